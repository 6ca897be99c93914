#pragma once

#include <Eigen/Core>

#include "trihedron/core/layout.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::consistency {

inline constexpr int kGyros = 2;
/// Where the parameters stand that a calibration of two gyros by eq. (1) lists.
struct Parameters {
  static constexpr Layout kLayout{.gyros = kGyros};
  static constexpr int kSize = kLayout.parameters();
  static constexpr int kPerGyro = kSize / kGyros;
  [[nodiscard]] static constexpr int drift(int gyro) { return kLayout.drift(gyro) - kLayout.drift(0); }
  [[nodiscard]] static constexpr int alignment(int gyro) { return kLayout.alignment(gyro) - kLayout.drift(0); }
};
using ParameterCovariance = Eigen::Matrix<double, Parameters::kSize, Parameters::kSize>;

/// Bayesian Cramér–Rao bound of the parameters of two gyros without process noise, rad/s and rad: the inverse of the
/// information of priors and fixes, linearised at the truth. Independent of the estimators: own integration of the
/// sensitivities along the true motion, normal equations. A fix has the star tracker's noise and, of the readings round
/// it that the invariant estimator fits, the noise of a cubic through them.
[[nodiscard]] ParameterCovariance parameter_bound(const PassSettings& settings, const Truth& truth);

}  // namespace trihedron::consistency
