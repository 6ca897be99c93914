#pragma once
/// How long the attitude holds without the star tracker: open loops from the astro-corrections of a calibration to the
/// end of the pass.

#include <cstdint>
#include <optional>
#include <vector>

#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/records/open_loop_forecast.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// How an attitude is made of the directions of the momenta.
enum class AttitudeRule : std::uint8_t {
  kTrihedron,  ///< on the first two, as the paper's filter does
  kAllAlike,   ///< by least squares, as the navigator does
};
[[nodiscard]] AttitudeRule attitude_rule_of(Estimator estimator);  ///< The rule that goes with an estimator.

/// Attitude at those of `epochs` (increasing) from t on where there are gyro readings, by the momenta and parameters
/// that `gyros` hold at t. No astro-correction after it. Throws SetupError for gyros of an unknown drift model.
[[nodiscard]] AttitudeHistory fly_open_loop(const Pass& pass, Time t, const std::vector<GyroCalibration>& gyros,
                                            const std::vector<Time>& epochs,
                                            AttitudeRule rule = AttitudeRule::kTrihedron);

/// Both open loops from one of the corrections of a calibration to the end of the pass.
struct OpenLoops {
  AttitudeErrors known_before;
  AttitudeErrors calibrated;
  IntervalPair intervals;
  std::vector<PredictedError> predicted;  ///< of `calibrated`, by the covariance at the correction
};

/// Which open loops are flown: all, with what is predicted of them, or those that the extension is told by, from the
/// second correction on, without predictions. The others are left empty.
enum class OpenLoopScope { kAll, kExtension };

/// From each of the run's corrections, against a reference attitude.
[[nodiscard]] std::vector<OpenLoops> fly_open_loops(const Pass& pass, const CalibrationRun& run,
                                                    const std::vector<Time>& reference_t,
                                                    const std::vector<Eigen::Quaterniond>& reference_q_in_c,
                                                    double limit_rad, OpenLoopScope scope = OpenLoopScope::kAll);

/// Over the corrections from the second on: at the first nothing is calibrated yet.
[[nodiscard]] std::optional<Extension> median_extension(const std::vector<OpenLoops>& loops);

}  // namespace trihedron::ground
