#pragma once

#include <Eigen/Core>
#include <cstddef>

namespace trihedron {

/// Rows of numbers that lie one after the other in memory; nothing is owned.
template <class T>
struct BasicRowsView {
  T* data = nullptr;
  int rows = 0;
  int columns = 0;
  int stride = 0;  ///< from row to row

  [[nodiscard]] T* row(int i) const { return data + static_cast<std::ptrdiff_t>(i) * stride; }
  [[nodiscard]] T& operator()(int i, int j) const { return row(i)[j]; }
};
using RowsView = BasicRowsView<double>;
using ConstRowsView = BasicRowsView<const double>;

/// View of a row-major matrix.
template <class Derived>
[[nodiscard]] RowsView rows_of(Eigen::PlainObjectBase<Derived>& m) {
  static_assert(Derived::IsRowMajor || Derived::ColsAtCompileTime == 1);
  return {m.data(), static_cast<int>(m.rows()), static_cast<int>(m.cols()), static_cast<int>(m.cols())};
}

/// The same of one that is only read.
template <class Derived>
[[nodiscard]] ConstRowsView view_of(const Eigen::PlainObjectBase<Derived>& m) {
  static_assert(Derived::IsRowMajor);
  return {m.data(), static_cast<int>(m.rows()), static_cast<int>(m.cols()), static_cast<int>(m.cols())};
}

}  // namespace trihedron
