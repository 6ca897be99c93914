#pragma once

#include <Eigen/Core>

#include "trihedron/core/layout.hpp"
#include "trihedron/core/precession.hpp"

namespace trihedron::ground {

/// What is believed of one gyro: momentum, drift columns as in the layout, alignment, readout bias.
using Gyro = GyroModel<kMaxDriftColumns>;
using Gyros = PerGyro<Gyro>;

/// What is known of the gyros before a pass; the momenta mean nothing.
struct Prior {
  Gyros gyros;                 ///< means
  Eigen::MatrixXd covariance;  ///< of κ and δ, gyro by gyro
};

}  // namespace trihedron::ground
