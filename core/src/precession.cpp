#include "trihedron/core/precession.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "trihedron/core/elementary.hpp"

namespace trihedron {

void advance_by_drift(ColumnsView by_drift, ColumnsView basis, const Eigen::Matrix3d& dt_C_in_b,
                      const Eigen::Vector3d& turn) {
  // One plain loop over all columns, which the compiler makes vector instructions of.
  double* __restrict x = by_drift.row(0);
  double* __restrict y = by_drift.row(1);
  double* __restrict z = by_drift.row(2);
  const double* __restrict bx = basis.row(0);
  const double* __restrict by = basis.row(1);
  const double* __restrict bz = basis.row(2);
  const double tx = turn.x();
  const double ty = turn.y();
  const double tz = turn.z();
  const Eigen::Matrix3d& m = dt_C_in_b;
  const double m00 = m(0, 0), m01 = m(0, 1), m02 = m(0, 2);
  const double m10 = m(1, 0), m11 = m(1, 1), m12 = m(1, 2);
  const double m20 = m(2, 0), m21 = m(2, 1), m22 = m(2, 2);
  const int columns = ColumnsView::padded(by_drift.columns);
#ifndef __clang__
#pragma GCC ivdep  // the rows do not overlap
#endif
  for (int i = 0; i < columns; ++i) {
    const double px = x[i];
    const double py = y[i];
    const double pz = z[i];
    x[i] = px + (ty * pz - tz * py) + (m00 * bx[i] + m01 * by[i] + m02 * bz[i]);
    y[i] = py + (tz * px - tx * pz) + (m10 * bx[i] + m11 * by[i] + m12 * bz[i]);
    z[i] = pz + (tx * py - ty * px) + (m20 * bx[i] + m21 * by[i] + m22 * bz[i]);
  }
}

Eigen::Matrix3d turned(const Eigen::Matrix3d& C_c_b, const Eigen::Vector3d& delta) {
  return Eigen::Quaterniond(Rot<C, C>::exp(Vec<C>::assume(delta)).raw() * C_c_b).normalized().toRotationMatrix();
}

double GaussMarkov::kept(double dt_s) const { return std::max(elementary::exp(-dt_s / time_s), 1e-6); }

double GaussMarkov::noise(double kept) const { return sigma * std::sqrt(1 - kept * kept); }

double missed_by_long_step_rad(double drift_rad, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double dt_s) {
  const double turn_rad = dt_s < kQuarterOrbit_s ? angle_between<double>(from, to) : std::numbers::pi;
  return drift_rad * turn_rad;
}

}  // namespace trihedron
