#pragma once

#include <Eigen/Core>

#include "trihedron/core/layout.hpp"
#include "trihedron/core/precession.hpp"

namespace trihedron::ground {

/// Estimates of one gyro: momentum, drift columns as in the layout, alignment, errors of the readout.
using Gyro = GyroModel<kMaxDriftColumns>;
using Gyros = PerGyro<Gyro>;

/// Prior of the gyros; their momenta have no meaning.
struct Prior {
  Gyros gyros;  ///< means
  /// Of κ and δ, gyro by gyro; by an earlier calibration also of the amplitudes of the drift at orbital period, behind
  /// them.
  Eigen::MatrixXd covariance;
};

}  // namespace trihedron::ground
