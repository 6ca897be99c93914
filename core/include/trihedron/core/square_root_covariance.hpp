#pragma once
/// Linear estimation with the square root of the covariance matrix: measurements one after the other (Carlson, "Fast
/// triangular formulation of the square root filter", 1973), several in one pass through the root. Sizes are known at
/// run time, storage is of fixed capacity; the work is done by plain loops, compiled once.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "trihedron/core/cholesky.hpp"
#include "trihedron/core/rows_view.hpp"

namespace trihedron {

/// Rotates the rows of `extra` into the upper triangular rows of `root` (Householder), column by column; the first
/// `eliminated` columns of `extra` become zero, those of `root` a triangle. rootᵀ root + extraᵀ extra is unchanged.
/// Rows of `root` may be zero. Both have the same number of columns.
void rotate_into(RowsView root, RowsView extra, int eliminated);

/// Reflections that make the first `columns` columns of `rows` upper triangular.
void triangularise(RowsView rows, int columns);

/// In place: each row becomes row · root, the root upper triangular, with zeros below its diagonal.
void see_through(ConstRowsView root, RowsView rows);

/// Measurements that are taken in one pass through the root.
inline constexpr int kMeasurementsAtOnce = 4;
/// The numbers that a pass leaves for each column of the root.
inline constexpr int kNumbersOfColumn = 2 * kMeasurementsAtOnce + 1;

/// Measurement update of P = root · rootᵀ, upper triangular, by y = H x + unit white noise. `rows`: H · root, and y as
/// the last column; used up. `correction`: of x, which was zero. `numbers`: room for kNumbersOfColumn for each column.
void take_measurements(RowsView root, RowsView rows, double* numbers, double* correction);

/// square ← square + rows · rowsᵀ, which is symmetric and stays so.
void add_square(ConstRowsView rows, double* square, std::ptrdiff_t stride);

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
  /// Takes the upper triangle of `root`.
  void pack(RowsView root) {
    size_ = root.rows;
    for (int i = 0; i < size_; ++i) {
      std::copy_n(root.row(i) + i, size_ - i, row(i));
    }
  }
  /// Its first rows and columns into the upper triangle of `root`, as many as that has.
  void unpack(RowsView root) const {
    for (int i = 0; i < root.rows; ++i) {
      std::copy_n(row(i), root.columns - i, root.row(i) + i);
    }
  }

  /// In place: x, a number for each row, becomes that of root · x(after) = x(before).
  void solve(double* x) const {
    for (int i = size_ - 1; i >= 0; --i) {
      const double* its = row(i);
      for (int j = i + 1; j < size_; ++j) {
        x[i] -= its[j - i] * x[j];
      }
      x[i] /= its[0];
    }
  }
  /// The row i of the inverse, from the diagonal on.
  void put_inverse(int i, double* x) const {
    std::fill_n(x, size_ - i, 0.0);
    x[0] = 1;
    for (int j = i; j < size_; ++j) {
      const double* its = row(j);
      x[j - i] /= its[0];
      for (int k = j + 1; k < size_; ++k) {
        x[k - i] -= x[j - i] * its[k - j];
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

/// Estimate errors x ~ (0, S Sᵀ) of states, of which the first ones move; the others are constants. S is upper
/// triangular. The estimate itself is kept by the owner, who adds each correction to it ("feedback"), so that the mean
/// of x is always zero. There is room for Max states, of which at most MaxDynamic move.
template <int Max, int MaxDynamic>
class SquareRootCovariance {
 public:
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, Max, 1>;
  using DynamicVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, MaxDynamic, 1>;
  using DynamicByStates = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, MaxDynamic, Max>;

  /// Without any errors.
  void reset(int states) {
    states_ = states;
    data_.fill(0);
  }

  [[nodiscard]] int states() const { return states_; }

  /// S, in place.
  [[nodiscard]] RowsView root() { return {data_.data(), states_, states_, states_}; }
  [[nodiscard]] ConstRowsView root() const { return {data_.data(), states_, states_, states_}; }

  /// Time update: x_d ← F x + w, w of independent components with 1-sigma `noise`, which may be zero. F has a row for
  /// each state that moves and a column for each state, and is used up.
  void propagate(RowsView F, const DynamicVector& noise) {
    DynamicMatrix reversed = DynamicMatrix::Zero(F.rows, F.rows);
    reversed.diagonal() = noise.reverse();
    move(F, reversed);
  }
  /// The first states, as many as F has rows, are made anew of the others: x ← F x + w, F zero in their own columns.
  /// `covariance`: of w, positive definite.
  template <class Covariance>
  void begin(RowsView F, const Covariance& covariance) {
    DynamicMatrix reversed = covariance.reverse();
    static_cast<void>(factorize(reversed));
    move(F, reversed);
  }

  /// In place: rows of H become H S, seen through the present uncertainty: H P Hᵀ is the product of the result with its
  /// transpose. H has a column for each state, or for the last of them.
  void see_through_uncertainty(RowsView H) const {
    const ConstRowsView S = root();
    const int columns = std::min(H.columns, states_);
    const int first = states_ - columns;
    see_through({S.row(first) + first, columns, columns, S.stride}, H);
  }

  /// S, or its first rows, as many as `into` has.
  void put_root(RowsView into) const {
    for (int i = 0; i < into.rows; ++i) {
      std::copy_n(root().row(i), states_, into.row(i));
    }
  }

  /// Measurement update by y = H x + unit white noise. `rows`: H seen through the uncertainty, and y as the last
  /// column; used up.
  void take(RowsView rows) {
    std::array<double, static_cast<std::size_t>(Max) * kNumbersOfColumn> numbers;
    take_measurements(root(), rows, numbers.data(), correction_.data());
  }
  /// Of the update before it, to be fed back.
  [[nodiscard]] Vector correction() const { return Eigen::Map<const Vector>(correction_.data(), states_); }

  /// Makes all sigmas so many times as large.
  void scale(double factor) {
    for (int i = 0; i < states_; ++i) {
      std::for_each(root().row(i) + i, root().row(i) + states_, [factor](double& its) { its *= factor; });
    }
  }
  /// P⁻¹ ← P⁻¹ + part² RᵀR, R the rows from the state `first` up to `end` of the inverse of the root of a prior, which
  /// is without the first states, so many as `before`: what it tells of these states, given those behind them. All rows
  /// after scale(factor), with part² = 1 − 1/factor², make all sigmas so many times as large, but no larger than those
  /// of the prior.
  template <int MaxOfPrior>
  void take_prior(const PackedTriangle<MaxOfPrior>& prior, int before, int first, int end, double part) {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMeasurementsAtOnce, Max + 1> rows;
    for (int i = first; i < end; i += kMeasurementsAtOnce) {
      rows.setZero(std::min(kMeasurementsAtOnce, end - i), states_ + 1);
      for (int k = 0; k < static_cast<int>(rows.rows()); ++k) {
        prior.put_inverse(i + k - before, &rows(k, i + k));
      }
      rows *= part;
      see_through_uncertainty({rows.data(), static_cast<int>(rows.rows()), states_, states_ + 1});
      take(rows_of(rows));
    }
  }

  /// Whether each state has an uncertainty, finite.
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
  using DynamicMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, MaxDynamic, MaxDynamic>;

  /// x ← F x + w of the first states, as many as F has rows. `noise`: a lower root of the covariance of w, with rows
  /// and columns from the last to the first; used up.
  void move(RowsView F, DynamicMatrix& noise) {
    const int d = F.rows;
    const int of_one_momentum = d % 3 == 0 ? 3 : 2;  // rows with zeros in the same columns; two in the paper's filter
    const ConstRowsView S = std::as_const(*this).root();
    for (int i = 0; i < d; i += of_one_momentum) {
      see_through(S, {F.row(i), std::min(of_one_momentum, d - i), F.columns, F.stride});
    }
    // The first columns of F S and the noise beside them become one triangle by rotations from the right. They are
    // rotations of rows of the transpose, from the last to the first.
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, MaxDynamic, MaxDynamic> moved(d, d);
    for (int i = 0; i < d; ++i) {
      for (int j = 0; j < d; ++j) {
        moved(j, d - 1 - i) = F(i, j);
      }
    }
    rotate_into({noise.data(), d, d, d}, rows_of(moved), d);
    for (int i = 0; i < d; ++i) {
      double* row = root().row(i);
      std::copy_n(F.row(i) + d, F.columns - d, row + d);
      for (int j = i; j < d; ++j) {
        row[j] = noise(d - 1 - i, d - 1 - j);  // by columns, so that it is the transpose
      }
    }
  }

  int states_ = 0;
  std::array<double, static_cast<std::size_t>(Max) * Max> data_{};
  std::array<double, static_cast<std::size_t>(Max)> correction_{};
};

}  // namespace trihedron
