#pragma once

#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::plan {

/// The simplified flight by which candidate slews are compared (ground::predicted_covariance()): telemetry without
/// noise, drift or misalignment; of samples and fixes only every fourth, each with the noise of the mean of four.
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
