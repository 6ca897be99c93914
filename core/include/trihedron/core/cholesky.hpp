#pragma once
/// Cholesky factors of small matrices: compiled once for all sizes, since each takes the compiler seconds. Nothing is
/// allocated.

#include <Eigen/Core>

#include "trihedron/core/rows_view.hpp"

namespace trihedron {

/// A matrix that is only read. Unlike Eigen::Ref<const Eigen::MatrixXd> it holds no copy: nothing refers to the heap.
using MatrixView = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
/// That of a matrix stored by columns.
template <class Derived>
[[nodiscard]] MatrixView matrix_of(const Eigen::PlainObjectBase<Derived>& matrix) {
  static_assert(!Derived::IsRowMajor);
  return {matrix.data(), matrix.rows(), matrix.cols(), Eigen::OuterStride<>(matrix.outerStride())};
}

/// In place: a = L Lᵀ becomes L, zero above the diagonal. False, and `a` of no use, unless it is positive definite.
[[nodiscard]] bool factorize(Eigen::Ref<Eigen::MatrixXd> a);

/// In place: b becomes L⁻¹ b.
void solve_lower(const MatrixView& L, Eigen::Ref<Eigen::MatrixXd> b);

/// In place: b becomes (L Lᵀ)⁻¹ b.
void solve_factorized(const MatrixView& L, Eigen::Ref<Eigen::MatrixXd> b);

/// In place: rows b become L⁻¹ b.
void solve_lower(const MatrixView& L, RowsView b);

/// The upper triangular root of `covariance`, of which the lower triangle is used: root · rootᵀ = covariance. `root` is
/// square and of the same size; below the diagonal it is left as it is. False, and `root` of no use, unless the
/// covariance is positive definite and finite.
[[nodiscard]] bool covariance_root(const Eigen::Ref<const Eigen::MatrixXd>& covariance, RowsView root);

/// L of a = L Lᵀ; of no use unless `a` is positive definite.
template <int M>
[[nodiscard]] Eigen::Matrix<double, M, M> cholesky_root(Eigen::Matrix<double, M, M> a) {
  static_cast<void>(factorize(a));
  return a;
}

}  // namespace trihedron
