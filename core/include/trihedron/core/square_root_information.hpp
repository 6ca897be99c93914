#pragma once
/// Linear estimation with the square root of the information matrix (Bierman, "Factorization Methods for Discrete
/// Sequential Estimation", 1977; process noise after Dyer and McReynolds, 1969).

#include <Eigen/Core>
#include <cmath>

#include "trihedron/core/assert.hpp"

namespace trihedron {

/// Rotates the rows of `extra` into the upper triangular rows of `root` (Householder), column by column; the first
/// `columns` columns of `extra` become zero. rootᵀ root + extraᵀ extra is unchanged. Rows of `root` may be zero (no
/// information yet).
template <class Root, class Extra>
void rotate_into(Eigen::MatrixBase<Root>& root, Eigen::MatrixBase<Extra>& extra, int columns) {
  using S = typename Root::Scalar;
  using std::sqrt;
  for (int j = 0; j < columns; ++j) {
    const S below = extra.col(j).squaredNorm();
    if (!(below > S(0))) {
      continue;
    }
    const S diagonal = root(j, j);
    const S norm = sqrt(diagonal * diagonal + below);
    const S alpha = diagonal > S(0) ? -norm : norm;
    const S v0 = diagonal - alpha;
    const S beta = S(-1) / (alpha * v0);
    const Eigen::Matrix<S, Extra::RowsAtCompileTime, 1> v = extra.col(j);
    for (int k = j + 1; k < root.cols(); ++k) {
      const S s = beta * (v0 * root(j, k) + v.dot(extra.col(k)));
      root(j, k) -= v0 * s;
      extra.col(k) -= s * v;
    }
    root(j, j) = alpha;
    extra.col(j).setZero();
  }
}

/// rows · rowsᵀ: with rows seen through an uncertainty, their covariance. For so few of them the library's blocked
/// product spends its time on packing, and the compiler's on instantiating it.
template <class S, int M, int N, int Order>
[[nodiscard]] Eigen::Matrix<S, M, M> gram(const Eigen::Matrix<S, M, N, Order>& rows) {
  return rows.lazyProduct(rows.transpose());
}

/// Estimate errors x ~ (0, (RᵀR)⁻¹) of N states, the first D of which move; the other N − D are constants. R is upper
/// triangular. A direction without information costs nothing and gains nothing: R times it stays zero to rounding,
/// whatever the number of steps. The estimate itself is kept by the owner, who adds each correction to it ("feedback"),
/// so that the mean of x is always zero.
template <int N, int D, class S = double>
class SquareRootInformation {
 public:
  static constexpr int kStates = N;
  static constexpr int kDynamic = D;
  using Vector = Eigen::Matrix<S, N, 1>;
  using Matrix = Eigen::Matrix<S, N, N>;
  using DynamicVector = Eigen::Matrix<S, D, 1>;
  using DynamicMatrix = Eigen::Matrix<S, D, D>;
  using DynamicByConstants = Eigen::Matrix<S, D, N - D>;
  template <int M>
  using Rows = Eigen::Matrix<S, M, N, M == 1 ? Eigen::RowMajor : Eigen::ColMajor>;

  /// Adds the prior of the constants: `root` with rootᵀ root their information matrix, of any shape.
  void add_prior_of_constants(const Eigen::Matrix<S, N - D, N - D>& root) {
    Eigen::Matrix<S, N - D, N + 1> extra;
    extra.setZero();
    extra.template block<N - D, N - D>(0, D) = root;
    rotate_into(root_, extra, N);
  }

  /// Adds information rows about any states: unit white noise = rows · x.
  template <int M>
  void add_information(const Rows<M>& rows) {
    Eigen::Matrix<S, M, N + 1> extra = Eigen::Matrix<S, M, N + 1>::Zero();
    extra.template leftCols<N>() = rows;
    rotate_into(root_, extra, N);
  }

  /// Time update: x_d ← A x_d + B x_c + w, w of independent components with 1-sigma `noise`, which may be zero.
  void propagate(const DynamicMatrix& A_inverse, const DynamicByConstants& B, const DynamicVector& noise) {
    // Rows of R with x_d(before) = A⁻¹ (x_d(after) − B x_c − w) put in: columns are w / noise, x_d(after), x_c. Then
    // w is eliminated.
    Eigen::Matrix<S, D, D + N> moved;
    const DynamicMatrix R_d = root_.template topLeftCorner<D, D>().lazyProduct(A_inverse);
    moved.template leftCols<D>() = -R_d * noise.asDiagonal();
    moved.template middleCols<D>(D) = R_d;
    moved.template rightCols<N - D>() = root_.template block<D, N - D>(0, D) - R_d.lazyProduct(B);
    Eigen::Matrix<S, D, D + N, Eigen::RowMajor> white;
    white.setZero();
    white.template leftCols<D>().setIdentity();
    rotate_into(white, moved, D);
    auto top = root_.template topLeftCorner<D, N>();
    auto kept = moved.template rightCols<N>();
    top.setZero();
    rotate_into(top, kept, D);
  }

  /// H R⁻¹: rows of H seen through the present uncertainty; H P Hᵀ is its gram(). Needs regular().
  template <int M>
  [[nodiscard]] Rows<M> through_uncertainty(const Rows<M>& H) const {
    TRIHEDRON_ASSERT(regular());
    // Row by row: for so few of them the library's blocked solver spends its time on packing. A row that begins with
    // zeros still does afterwards.
    Rows<M> through = Rows<M>::Zero();
    for (int i = 0; i < M; ++i) {
      int first = 0;
      while (first < N && H(i, first) == S(0)) {
        ++first;
      }
      const int rest = N - first;
      const auto lower = root_.block(first, first, rest, rest).transpose().template triangularView<Eigen::Lower>();
      through.row(i).tail(rest) = lower.solve(H.row(i).tail(rest).transpose()).transpose();
    }
    return through;
  }

  /// Measurement update with `H` and `y`, y = H x + unit white noise. Returns the correction, to be fed back; not
  /// finite unless regular() after it.
  template <int M>
  [[nodiscard]] Vector update(const Rows<M>& H, const Eigen::Matrix<S, M, 1>& y) {
    Eigen::Matrix<S, M, N + 1> extra;
    extra.template leftCols<N>() = H;
    extra.col(N) = y;
    rotate_into(root_, extra, N);
    const Vector x = root_.template leftCols<N>().template triangularView<Eigen::Upper>().solve(root_.col(N));
    root_.col(N).setZero();
    return x;
  }

  /// R⁻¹, a square root of the covariance: P = R⁻¹ R⁻ᵀ. Needs regular().
  [[nodiscard]] Matrix inverse_root() const {
    TRIHEDRON_ASSERT(regular());
    return root_.template leftCols<N>().template triangularView<Eigen::Upper>().solve(Matrix::Identity());
  }

  /// R, upper triangular.
  [[nodiscard]] Matrix root() const { return root_.template leftCols<N>(); }

  /// Whether each state has information, so that a covariance exists.
  [[nodiscard]] bool regular() const { return (root_.diagonal().array() != S(0)).all(); }

 private:
  // R, and right of it z of R x = z, which is zero except within update().
  Eigen::Matrix<S, N, N + 1, Eigen::RowMajor> root_ = Eigen::Matrix<S, N, N + 1, Eigen::RowMajor>::Zero();
};

}  // namespace trihedron
