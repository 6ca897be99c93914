#pragma once

#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::plan {

/// A flight that ground::predicted_covariance() takes: no noise, no drift, no misalignment, and of all samples and
/// fixes every fourth, with the noise of four together.
class DesignFlight {
 public:
  DesignFlight(const Scenario& scenario, const CalibrationOptions& options);

  /// Covariance of the parameters after these slews. Throws ground::SetupError, std::invalid_argument.
  [[nodiscard]] Eigen::MatrixXd covariance_after(const std::vector<Slew>& slews) const;

 private:
  Scenario scenario_;
  CalibrationOptions options_;
  std::vector<double> readout_noise_rad_;
  std::vector<Eigen::Vector3d> fix_noise_rad_;
};

}  // namespace trihedron::plan
