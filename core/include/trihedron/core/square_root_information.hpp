#pragma once
/// Linear estimation with the square root of the information matrix (Bierman, "Factorization Methods for Discrete
/// Sequential Estimation", 1977). Process noise is that of Dyer and McReynolds, 1969, by a triangle of the moving
/// states alone in place of their larger array. Sizes are known at run time, storage is of fixed capacity; the work is
/// done by plain loops, compiled once.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "trihedron/core/rows_view.hpp"

namespace trihedron {

/// Rotates the rows of `extra` into the upper triangular rows of `root` (Householder), column by column; the first
/// `eliminated` columns of `extra` become zero, those of `root` a triangle. rootᵀ root + extraᵀ extra is unchanged.
/// Rows of `root` may be zero (no information yet). Both have the same number of columns.
void rotate_into(RowsView root, RowsView extra, int eliminated);

/// Reflections that make the first `columns` columns of `rows` upper triangular.
void triangularise(RowsView rows, int columns);

/// In place: each row becomes row · R⁻¹, R the upper triangle of `root`. A row that begins with zeros still does
/// afterwards.
void solve_rows(ConstRowsView root, RowsView rows);

/// x = R⁻¹ z, R the upper triangle of `root`, z the column right of it.
void solve_column(ConstRowsView root, double* x);

/// The first rows of the inverse of the upper triangle of `root`, as many as `inverse` has; zero below the diagonal.
void invert_triangle(ConstRowsView root, RowsView inverse);

/// product = a · b, all of them apart in memory.
void multiply(ConstRowsView a, ConstRowsView b, RowsView product);

/// product ← product + a · triangle, which has zeros below its diagonal, and may be wider than it is high; all of them
/// apart in memory.
void add_product_of_triangle(ConstRowsView a, ConstRowsView triangle, RowsView product);

/// rest ← rest − factors · b, apart from b in memory; the factors, one for each row of b, lie `stride` apart.
void take_off(const double* factors, std::ptrdiff_t stride, ConstRowsView b, double* rest);

/// An upper triangle that is only kept: half the room. There is room for Max rows.
template <int Max>
class PackedTriangle {
 public:
  /// Takes the upper triangle of R.
  void pack(ConstRowsView R) {
    size_ = R.rows;
    for (int i = 0; i < size_; ++i) {
      std::copy_n(R.row(i) + i, size_ - i, row(i));
    }
  }
  /// Into the upper triangle of R, of the same size.
  void unpack(RowsView R) const {
    for (int i = 0; i < size_; ++i) {
      std::copy_n(row(i), size_ - i, R.row(i) + i);
    }
  }
  /// j ≥ i.
  [[nodiscard]] double operator()(int i, int j) const { return row(i)[j - i]; }

  /// As invert_triangle(), of the rows and columns from `first` on, as many as `inverse` has, which is zero before.
  void invert(int first, RowsView inverse) const {
    for (int i = 0; i < inverse.rows; ++i) {
      double* x = inverse.row(i);
      x[i] = 1;
      for (int j = i; j < inverse.columns; ++j) {
        const double* R = row(first + j);
        x[j] /= R[0];
        for (int k = j + 1; k < inverse.columns; ++k) {
          x[k] -= x[j] * R[k - j];
        }
      }
    }
  }

 private:
  /// From the diagonal on.
  [[nodiscard]] double* row(int i) { return data_.data() + begin(i); }
  [[nodiscard]] const double* row(int i) const { return data_.data() + begin(i); }
  [[nodiscard]] std::ptrdiff_t begin(int i) const {
    return static_cast<std::ptrdiff_t>(i) * size_ - static_cast<std::ptrdiff_t>(i) * (i - 1) / 2;
  }

  int size_ = 0;
  std::array<double, static_cast<std::size_t>(Max) * (Max + 1) / 2> data_{};
};

/// Estimate errors x ~ (0, (RᵀR)⁻¹) of states, the first `dynamic` of which move; the others are constants. R is upper
/// triangular. A direction without information stays without: R times it remains zero to rounding, whatever the number
/// of steps. The estimate itself is kept by the owner, who adds each correction to it ("feedback"), so that the mean of
/// x is always zero. There is room for Max states, of which at most kMaxDynamic move.
template <int Max, int MaxDynamic>
class SquareRootInformation {
 public:
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, Max, 1>;
  using DynamicVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, MaxDynamic, 1>;
  using DynamicMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, MaxDynamic, MaxDynamic>;
  using DynamicByConstants = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, MaxDynamic, Max>;

  /// Forgets all information.
  void reset(int states, int dynamic) {
    states_ = states;
    dynamic_ = dynamic;
    data_.fill(0);
  }

  [[nodiscard]] int states() const { return states_; }
  [[nodiscard]] int dynamic() const { return dynamic_; }

  /// R, upper triangular, in place.
  [[nodiscard]] RowsView root() { return {data_.data(), states_, states_, states_ + 1}; }
  [[nodiscard]] ConstRowsView root() const { return {data_.data(), states_, states_, states_ + 1}; }

  /// Adds rows of information, unit white noise = rows · x. `rows` is overwritten.
  void add_information(RowsView rows) { rotate_into(root(), rows, states_); }

  /// Time update: x_d ← A x_d + B x_c + w, w of independent components with 1-sigma `noise`, which may be zero.
  void propagate(const DynamicMatrix& A_inverse, const DynamicByConstants& B, const DynamicVector& noise) {
    // With x_d(before) = A⁻¹ (x_d(after) − B x_c − w) the first rows are M x_d(after) + (R_c − M B) x_c, M = R_d A⁻¹.
    // Their noise has the covariance 1 + M Q Mᵀ = U Uᵀ, U upper triangular: times U⁻¹ they are of unit noise again. The
    // reflections that make U are of these few columns alone.
    const int d = dynamic_;
    const int c = states_ - d;
    DynamicMatrix M(d, d);
    // Uᵀ with rows and columns from the last to the first, as it comes by rotations into an upper triangle.
    DynamicMatrix reversed = DynamicMatrix::Identity(d, d);
    DynamicMatrix noises(d, d);
    for (int i = 0; i < d; ++i) {
      const double* R = root().row(i);
      for (int j = 0; j < d; ++j) {
        double sum = 0;
        for (int k = i; k < d; ++k) {
          sum += R[k] * A_inverse(k, j);
        }
        M(i, j) = sum;
        noises(j, d - 1 - i) = sum * noise(j);
      }
    }
    rotate_into(rows_of(reversed), rows_of(noises), d);
    for (int i = d - 1; i >= 0; --i) {
      double* row = root().row(i);
      const double* its = &M(i, 0);
      const auto first = static_cast<int>(std::find_if(its, its + i, [](double x) { return x != 0; }) - its);
      take_off(its + first, 1, {&B(first, 0), d - first, c, c}, row + d);
      std::copy_n(its, d, row);
      const double* U = &reversed(d - 1 - i, d - 1 - i);  // on the diagonal; those right of it lie d before one another
      if (i + 1 < d) {
        take_off(U - d, -d, {root().row(i + 1), d - 1 - i, states_, states_ + 1}, row);
      }
      const double by = 1 / *U;
      std::for_each(row, row + states_, [by](double& x) { x *= by; });
    }
    triangularise({data_.data(), d, states_, states_ + 1}, d);
  }

  /// In place: rows of H become H R⁻¹, seen through the present uncertainty: H P Hᵀ is the product of the result with
  /// its transpose. H has a column for each state, or for the last of them. Not finite unless regular().
  void see_through_uncertainty(RowsView H) const {
    const ConstRowsView R = root();
    const int columns = std::min(H.columns, states_);
    const int first = states_ - columns;
    solve_rows({R.row(first) + first, columns, columns, R.stride}, H);
  }

  /// Measurement update with rows (H, y), y = H x + unit white noise, which are used up; y is the last column. What it
  /// is to be corrected by is kept for correction(), before which nothing else may change R.
  void take(RowsView rows) { rotate_into(with_right_side(), rows, states_); }
  /// Of the update before it, to be fed back; not finite unless regular().
  [[nodiscard]] Vector correction() {
    const RowsView whole = with_right_side();
    Vector x(states_);
    solve_column({whole.data, whole.rows, whole.columns, whole.stride}, x.data());
    for (int i = 0; i < states_; ++i) {
      whole(i, states_) = 0;
    }
    return x;
  }

  /// take(), and its correction().
  [[nodiscard]] Vector update(RowsView rows) {
    take(rows);
    return correction();
  }

  /// R⁻¹, a square root of the covariance, P = R⁻¹ R⁻ᵀ, into `inverse`: its first rows, as many as it has. Not
  /// finite unless regular().
  void inverse_root(RowsView inverse) const { invert_triangle(root(), inverse); }

  /// Whether each state has information, finite, so that a covariance exists.
  [[nodiscard]] bool regular() const {
    for (int i = 0; i < states_; ++i) {
      const double its = std::abs(root()(i, i));
      if (!(its > 0 && its <= std::numeric_limits<double>::max())) {
        return false;
      }
    }
    return true;
  }

 private:
  [[nodiscard]] RowsView with_right_side() { return {data_.data(), states_, states_ + 1, states_ + 1}; }

  int states_ = 0;
  int dynamic_ = 0;
  // R, and right of it z of R x = z, which is zero except from take() to correction().
  std::array<double, static_cast<std::size_t>(Max) * (Max + 1)> data_{};
};

}  // namespace trihedron
