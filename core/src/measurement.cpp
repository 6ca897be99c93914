#include "trihedron/core/measurement.hpp"

#include "trihedron/core/cholesky.hpp"
#include "trihedron/core/elementary.hpp"

namespace trihedron {

FixBySharedStates fix_by_shared_states(const CalibrationSetup& setup, const StarFix& fix,
                                       const Eigen::Vector3d& rate_c) {
  const Layout& layout = setup.layout;
  FixBySharedStates by = FixBySharedStates::Zero(3, layout.shared_size());
  if (layout.further.clock_offset) {
    by.col(layout.clock_offset() - layout.shared()) = rate_c;
  }
  if (layout.further.clock_rate) {
    by.col(layout.clock_rate() - layout.shared()) = to_seconds(fix.t - setup.orbital_phase_zero) * rate_c;
  }
  if (layout.further.orbital_error) {
    const double phase = setup.orbital_rate_rad_s * to_seconds(fix.t - setup.orbital_phase_zero);
    const int first = layout.orbital_error(fix.head) - layout.shared();
    by.middleCols<3>(first) = elementary::sin(phase) * Eigen::Matrix3d::Identity();
    by.middleCols<3>(first + 3) = elementary::cos(phase) * Eigen::Matrix3d::Identity();
  }
  if (fix.head > 0) {
    by.middleCols<3>(layout.star_tracker(fix.head) - layout.shared()).setIdentity();
  }
  return by;
}

Eigen::Matrix3d fix_noise(const CalibrationSetup& setup, const StarFix& fix) {
  const StarTrackerSetup& its = setup.star_trackers[static_cast<std::size_t>(fix.head)];
  if (fix.covariance.is_told()) {
    const Eigen::Matrix3d told = fix.covariance.matrix();
    const auto factor = setup.over_told_covariance.asDiagonal();
    return fix.head == 0 ? Eigen::Matrix3d(factor * told * factor) : told;
  }
  const Eigen::Matrix3d root = its.C_c_s * its.noise_rad.asDiagonal();
  return root * root.transpose();
}

Rot<In, C> corrected(const StarFix& fix, const Eigen::Vector3d& error_rad) {
  return Rot<In, C>::assume(fix.q_in_c.normalized()) * Rot<C, C>::exp(-Vec<C>::assume(error_rad));
}

ComponentCovariance noise_of(const FixComparison& comparison, const Eigen::Matrix3d& R_c,
                             const PerGyro<double>& readout_noise_rad) {
  const int components = comparison.components();
  ComponentCovariance R(components, components);
  Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxComponents, 3> by_fix(components, 3);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxComponents, 1> white(components);
  int row = 0;
  for (int k = 0; k < kMaxGyros; ++k) {
    if (comparison.used[k]) {
      by_fix.middleRows<2>(row) = comparison.gyros[k].by_fix;
      white.segment<2>(row).setConstant(readout_noise_rad[k] * readout_noise_rad[k]);
      row += 2;
    }
  }
  R = by_fix.lazyProduct(R_c).eval().lazyProduct(by_fix.transpose());
  R.diagonal() += white;
  return R;
}

void whiten(ComponentCovariance& R, RowsView rows) {
  static_cast<void>(factorize(R));
  solve_lower(matrix_of(R), rows);
}

ComponentCovariance before_whitening(const ComponentCovariance& L, const ComponentCovariance& covariance) {
  const Eigen::Index n = L.rows();
  ComponentCovariance left(n, n);
  ComponentCovariance all(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      double sum = 0;
      for (Eigen::Index k = 0; k <= i; ++k) {
        sum += L(i, k) * covariance(k, j);
      }
      left(i, j) = sum;
    }
    for (Eigen::Index j = 0; j <= i; ++j) {
      double sum = 0;
      for (Eigen::Index k = 0; k <= j; ++k) {
        sum += left(i, k) * L(j, k);
      }
      all(i, j) = all(j, i) = sum;
    }
  }
  return all;
}

AttitudeSolution with_covariance(const AttitudeByDirections& attitude, const Eigen::Matrix3d& spread_square,
                                 const PerGyro<double>& readout_noise_rad, int gyros, double walk_variance_rad2) {
  AttitudeSolution solution;
  solution.C_in_c = attitude.C_in_c;
  for (int k = 0; k < gyros; ++k) {
    const double white = readout_noise_rad[k] * readout_noise_rad[k] + walk_variance_rad2;
    const double* by_phi = attitude.by_direction(k).data();  // column by column
    for (int i = 0; i < 3; ++i) {
      const double x = white * by_phi[i];
      const double y = white * by_phi[i + 3];
      const double z = white * by_phi[i + 6];
      for (int j = 0; j < 3; ++j) {
        solution.covariance_rad2(i, j) += x * by_phi[j] + (y * by_phi[j + 3] + z * by_phi[j + 6]);
      }
    }
  }
  solution.covariance_rad2 += spread_square;
  return solution;
}

}  // namespace trihedron
