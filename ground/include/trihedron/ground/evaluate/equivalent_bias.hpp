#pragma once
/// The drift of a pair of momenta or more as the bias that rate gyros would have.

#include <Eigen/Core>
#include <vector>

#include "trihedron/records/calibration.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// At each epoch of an attitude, rad/s, c axes: the angular velocity of the body that the momenta show where they are
/// taken to stand still, less the true one. Drift turns the momenta in inertial axes at ω_k × h_k; the turn of all of
/// them together is the Ω that agrees best, Σ |Ω × h_k − ω_k × h_k|² least, and the bias is −C_c_in Ω. Momenta are
/// those of the calibration at its time, turned by their drift along the attitude to each epoch; outside the attitude
/// they are taken to stand still. Throws SetupError for less than two gyros, or momenta that are nearly parallel.
[[nodiscard]] std::vector<Eigen::Vector3d> equivalent_gyro_bias_rad_s(const Calibration& calibration,
                                                                      const AttitudeHistory& attitude);

}  // namespace trihedron::ground
