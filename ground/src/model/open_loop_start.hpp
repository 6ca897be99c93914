#pragma once
/// What is known of the errors of an open loop at the astro-correction that it begins with.

#include <Eigen/Core>

#include "model/gyro.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/records/open_loop_forecast.hpp"

namespace trihedron::ground {

/// From the covariance of an estimator at the correction: rows and columns as OpenLoopStart says, with the coefficients
/// of that time. `gyros`: the estimates, of which the change of the coefficients is needed; an open loop does not go on
/// with it, so that it counts as an error of its size.
[[nodiscard]] OpenLoopStart open_loop_start(const CalibrationSetup& setup, const Layout& layout, const Gyros& gyros,
                                            Eigen::MatrixXd covariance);

/// Of parameters that are held: the momenta are read through them at an attitude. `gyros`: with these momenta;
/// `parameters`: covariance of κ and δ; `attitude_rad2`: of the attitude, c axes.
[[nodiscard]] OpenLoopStart start_with_held_parameters(const CalibrationSetup& setup, const Gyros& gyros,
                                                       const Eigen::MatrixXd& parameters, const Eigen::Matrix3d& C_in_c,
                                                       const Eigen::Matrix3d& attitude_rad2);

}  // namespace trihedron::ground
