#pragma once
/// What a fix is compared with, its noise, and how both depend on the states: the same for the filter and for the batch
/// (docs/mathematics.md, section 7).

#include <Eigen/Core>

#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/layout.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/core/square_root_covariance.hpp"

namespace trihedron {

/// Error of a fix, c axes, by the shared states: as given = true · exp([e×]). 3 × layout.shared_size().
using FixBySharedStates = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxSharedStates>;
using SharedStates = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxSharedStates, 1>;

/// rate_c: of the body relative to `in`, rad/s.
[[nodiscard]] FixBySharedStates fix_by_shared_states(const CalibrationSetup& setup, const StarFix& fix,
                                                     const Eigen::Vector3d& rate_c);

/// Covariance of a fix's noise, c axes, rad²: its own, or where it comes without one that of its star tracker.
[[nodiscard]] Eigen::Matrix3d fix_noise(const CalibrationSetup& setup, const StarFix& fix);

/// The fix with what is known of its error taken off: a rotation vector, c axes, rad.
[[nodiscard]] Rot<In, C> corrected(const StarFix& fix, const Eigen::Vector3d& error_rad);

/// Of two momenta: what the cosine of the angle between them is by the estimates, less what it is by their readings, b
/// axes. z1 of eq. (3).
template <class Gyro>
[[nodiscard]] double cosine_off(const Gyro& one, const Gyro& other, const Eigen::Vector3d& one_b,
                                const Eigen::Vector3d& other_b) {
  return one.h_in.dot(other.h_in) - one.in_c(one_b).dot(other.in_c(other_b));
}

/// One gyro's part of a comparison: the two components of y = h × h_et across h, the first along h × (h of the next
/// gyro), and how they change with φ (in), with the fix's error and −δ (c), and with the errors of the readout.
struct GyroComparison {
  Eigen::Vector2d y;
  Eigen::Matrix<double, 2, 3> by_phi;
  Eigen::Matrix<double, 2, 3> by_fix;
  Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, GyroReadout::kMaxErrors> by_readout;
};

/// A fix compared with the momenta, gyro by gyro.
struct FixComparison {
  GyroMask used{};
  PerGyro<GyroComparison> gyros;
  FixBySharedStates by_shared;

  [[nodiscard]] int components() const { return 2 * count(used); }
};

/// by_reading, whose columns are components of a reading in c, as columns about the errors of the readout.
template <class Derived>
[[nodiscard]] auto by_readout_errors(const Layout& layout, const Eigen::MatrixBase<Derived>& by_reading,
                                     const GyroReadout& gyro, const Eigen::Vector3d& h_b) {
  using ByCase = Eigen::Matrix<double, Derived::RowsAtCompileTime, 3>;
  constexpr int kRows = Derived::RowsAtCompileTime;
  using ByErrors = Eigen::Matrix<double, kRows, Eigen::Dynamic, kRows == 1 ? Eigen::RowMajor : Eigen::ColMajor, kRows,
                                 GyroReadout::kMaxErrors>;
  const ByCase by_case = by_reading * gyro.C_c_b;
  return ByErrors(by_case.lazyProduct(GyroReadout::by_errors(layout, h_b)));
}

/// y_k = h_k × h_et,k = (φ_k − C_in_c δ_k + h_k × C_in_b Δb_k)⊥ + noise of each gyro used. C_in_c: the fix, for y;
/// C_linear: the attitude to linearise at, with less noise. Of `gyros`, as many as the layout has, the members of
/// GyroModel are needed.
template <class Gyros>
[[nodiscard]] FixComparison compare(const Layout& layout, const Gyros& gyros, const Eigen::Matrix3d& C_in_c,
                                    const Eigen::Matrix3d& C_linear, const Directions& h_b, const GyroMask& used,
                                    const FixBySharedStates& by_shared) {
  FixComparison comparison;
  comparison.used = used;
  comparison.by_shared = by_shared;
  for (int k = 0; k < layout.gyros; ++k) {
    if (!used[k]) {
      continue;
    }
    const Eigen::Vector3d& h = gyros[k].h_in;
    const Eigen::Vector3d normal = h.cross(gyros[(k + 1) % layout.gyros].h_in);
    GyroComparison& its = comparison.gyros[k];
    // Any axis across h does; that of momenta on one line would be made of rounding.
    constexpr double kOnOneLine = 1e-20;
    its.by_phi.row(0) = (normal.squaredNorm() > kOnOneLine ? normal.normalized() : h.unitOrthogonal()).transpose();
    its.by_phi.row(1) = h.cross(its.by_phi.row(0).transpose()).transpose();
    its.by_fix = its.by_phi * C_linear;
    its.y = its.by_phi * h.cross(C_in_c * gyros[k].in_c(h_b[k]));
    its.by_readout = by_readout_errors(layout, its.by_phi * skew<double>(h) * C_linear, gyros[k], h_b[k]);
  }
  return comparison;
}

/// Covariance of the components of a comparison.
using ComponentCovariance = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxComponents, kMaxComponents>;
/// Of the noise of a comparison: the fix's error is common to all components, each readout's to its own two. R_c:
/// covariance of the fix, c axes, rad²; readout_noise_rad: of the readings that it is compared with.
[[nodiscard]] ComponentCovariance noise_of(const FixComparison& comparison, const Eigen::Matrix3d& R_c,
                                           const PerGyro<double>& readout_noise_rad);

/// Rows about the states, and right of them what they are compared with; room for Max states and as many components.
template <int Max, int Components = kMaxComponents>
using ComparedRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, Components, Max + 1>;
/// Three rows about the states.
template <int Max>
using StateRows3 = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, Max>;

/// In place: R becomes its Cholesky factor L, and the rows L⁻¹ times themselves, of unit white noise.
void whiten(ComponentCovariance& R, RowsView rows);

/// The columns of rows that are about states.
template <class Derived>
[[nodiscard]] RowsView states_of(Eigen::PlainObjectBase<Derived>& rows) {
  const RowsView all = rows_of(rows);
  return {all.data, all.rows, all.columns - 1, all.stride};
}

/// L · covariance · Lᵀ: of components that were divided by L, before that.
[[nodiscard]] ComponentCovariance before_whitening(const ComponentCovariance& L, const ComponentCovariance& covariance);

/// Puts m times the columns of a gyro's drift where the layout has them.
template <class M, class Rows>
void put_drift_columns(const Layout& layout, int gyro, const M& m, Rows&& rows) {
  rows.middleCols(layout.drift(gyro), layout.drift_size()) = m.leftCols(layout.drift_size());
  if (layout.further.wandering_drift) {
    rows.middleCols(layout.wandering(gyro), 3) = m.middleCols(layout.wandering_column(), 3);
  }
  for (const Layout::Block& its : layout.beside_kappa(gyro)) {
    rows.middleCols(its.state, its.size) = m.middleCols(its.column, its.size);
  }
}

/// The comparison as rows (H, y) about the states at its time.
template <int Max, int Components = kMaxComponents>
[[nodiscard]] ComparedRows<Max, Components> rows_about_states_now(const Layout& layout,
                                                                  const FixComparison& comparison) {
  ComparedRows<Max, Components> rows(comparison.components(), layout.size() + 1);
  rows.setZero();
  int row = 0;
  for (int k = 0; k < layout.gyros; ++k) {
    if (!comparison.used[k]) {
      continue;
    }
    const GyroComparison& its = comparison.gyros[k];
    auto H = rows.template middleRows<2>(row);
    H.template middleCols<3>(layout.direction(k)) = its.by_phi;
    H.template middleCols<3>(layout.alignment(k)) = -its.by_fix;
    H.middleCols(layout.readout(k), layout.readout_size()) = its.by_readout;
    H.middleCols(layout.shared(), layout.shared_size()) = its.by_fix.lazyProduct(comparison.by_shared);
    H.col(layout.size()) = its.y;
    row += 2;
  }
  return rows;
}

/// Error of the attitude by these readings, c axes, by the states now, all three components of each direction; zero for
/// the shared ones.
template <int Max, class Gyros>
[[nodiscard]] StateRows3<Max> attitude_by_states_now(const Layout& layout, const AttitudeByDirections& attitude,
                                                     const Gyros& gyros, const Directions& h_b) {
  StateRows3<Max> rows(3, layout.size());
  rows.setZero();
  const Eigen::Matrix3d C_c_in = attitude.C_in_c.raw().transpose();
  for (int k = 0; k < layout.gyros; ++k) {
    const Eigen::Matrix3d by_phi = attitude.by_direction(k);
    rows.template middleCols<3>(layout.direction(k)) = by_phi * C_c_in;
    rows.template middleCols<3>(layout.alignment(k)) = -by_phi;
    rows.middleCols(layout.readout(k), layout.readout_size()) =
        by_readout_errors(layout, by_phi * skew<double>(gyros[k].in_c(h_b[k])), gyros[k], h_b[k]);
  }
  return rows;
}

/// In place: rows about the states now become rows about those at the beginning of a stretch, for which `since` has the
/// sensitivities.
template <class Rows, class Sensitivities>
void carry_back(const Layout& layout, const Sensitivities& since, Rows& rows) {
  for (int k = 0; k < layout.gyros; ++k) {
    const Eigen::Matrix<double, Rows::RowsAtCompileTime, 3, 0, Rows::MaxRowsAtCompileTime, 3> by_phi =
        rows.template middleCols<3>(layout.direction(k));
    put_drift_columns(layout, k, by_phi.lazyProduct(since[k].by_drift.first(layout.drift_columns())).eval(), rows);
    rows.template middleCols<3>(layout.alignment(k)) += by_phi * since[k].by_alignment;
    rows.template middleCols<3>(layout.direction(k)) = by_phi * since[k].by_start;
  }
}

/// Adds a gyro's part of errors x, rows as in the layout, to the estimates of its parameters; the momentum and the
/// drift that wanders are left to the caller.
template <class Vector, class Gyro>
void add_parameter_errors(const Layout& layout, int gyro, const Vector& x, Gyro& its) {
  its.drift_rad_s.head(layout.drift_size()) += x.segment(layout.drift(gyro), layout.drift_size());
  for (const Layout::Block& block : layout.beside_kappa(gyro)) {
    its.drift_rad_s.segment(block.column, block.size) += x.segment(block.state, block.size);
  }
  its.add_errors(layout, x.segment(layout.readout(gyro), layout.readout_size()));
  its.C_c_b = turned(its.C_c_b, Eigen::Vector3d(x.segment(layout.alignment(gyro), 3)));
}

/// Covariance of an attitude by `spread`, spread · spreadᵀ of the errors of what is estimated, plus the readout noise
/// and a random walk of the directions of `walk_variance_rad2` per axis.
[[nodiscard]] AttitudeSolution with_covariance(const AttitudeByDirections& attitude,
                                               const Eigen::Matrix3d& spread_square,
                                               const PerGyro<double>& readout_noise_rad, int gyros,
                                               double walk_variance_rad2);

/// rows · rowsᵀ.
template <int Max>
[[nodiscard]] Eigen::Matrix3d gram(const StateRows3<Max>& rows) {
  const double* x = rows.data();
  const double* y = x + rows.cols();
  const double* z = y + rows.cols();
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
  for (Eigen::Index i = 0; i < rows.cols(); ++i) {
    xx += x[i] * x[i];
    yy += y[i] * y[i];
    zz += z[i] * z[i];
    xy += x[i] * y[i];
    xz += x[i] * z[i];
    yz += y[i] * z[i];
  }
  Eigen::Matrix3d square;
  square << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return square;
}

}  // namespace trihedron
