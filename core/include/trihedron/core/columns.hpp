#pragma once
/// Vectors side by side, as many as a gyro's drift has columns: three rows in storage of fixed capacity.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>

namespace trihedron {

/// 3 × columns; row i begins at data + i · stride. The rows are padded with zeros to a multiple of kPad, so that loops
/// over them have no remainder.
struct ColumnsView {
  static constexpr int kPad = 4;
  double* data = nullptr;
  int stride = 0;
  int columns = 0;

  [[nodiscard]] double* row(int i) const { return data + static_cast<std::ptrdiff_t>(i) * stride; }
  void set_column(int column, const Eigen::Vector3d& v) const {
    row(0)[column] = v.x();
    row(1)[column] = v.y();
    row(2)[column] = v.z();
  }
  [[nodiscard]] static constexpr int padded(int columns) { return (columns + kPad - 1) / kPad * kPad; }
  void set_zero() const {
    for (int i = 0; i < 3; ++i) {
      std::fill(row(i), row(i) + padded(columns), 0.0);
    }
  }
  void pad() const {
    for (int i = 0; i < 3; ++i) {
      std::fill(row(i) + columns, row(i) + padded(columns), 0.0);
    }
  }
  /// The sum of the columns, each times its coefficient; of every kPad-th by itself first, since each sum is a chain of
  /// operations that wait for one another.
  [[nodiscard]] Eigen::Vector3d times(const double* factors) const {
    double sums[3][kPad] = {};
    const int whole = columns - columns % kPad;
    for (int j = 0; j < whole; j += kPad) {
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < kPad; ++k) {
          sums[i][k] += row(i)[j + k] * factors[j + k];
        }
      }
    }
    for (int j = whole; j < columns; ++j) {
      for (int i = 0; i < 3; ++i) {
        sums[i][j - whole] += row(i)[j] * factors[j];
      }
    }
    const auto sum = [&](int i) { return (sums[i][0] + sums[i][1]) + (sums[i][2] + sums[i][3]); };
    return {sum(0), sum(1), sum(2)};
  }
};

/// Left as they are in memory unless made by zero().
template <int Max>
class Columns {
 public:
  static constexpr int kStride = ColumnsView::padded(Max);
  using Matrix = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, Max>;

  [[nodiscard]] static Columns zero() {
    Columns columns;
    columns.data_.fill(0);
    return columns;
  }
  [[nodiscard]] ColumnsView view(int columns) { return {data_.data(), kStride, columns}; }
  /// The first `columns` of them.
  [[nodiscard]] auto first(int columns) const {
    return Eigen::Map<const Matrix, 0, Eigen::OuterStride<>>(data_.data(), 3, columns, Eigen::OuterStride<>(kStride));
  }
  [[nodiscard]] auto first(int columns) {
    return Eigen::Map<Matrix, 0, Eigen::OuterStride<>>(data_.data(), 3, columns, Eigen::OuterStride<>(kStride));
  }

 private:
  std::array<double, static_cast<std::size_t>(3 * kStride)> data_;
};

}  // namespace trihedron
