#pragma once
/// How long the attitude holds without the star tracker: open loops from the astro-corrections of a calibration to the
/// end of the pass, and the extension of the correction interval.

#include <optional>
#include <vector>

#include "trihedron/ground/calibrate.hpp"
#include "trihedron/ground/evaluate.hpp"

namespace trihedron::ground {

/// Attitude at those of `epochs` (increasing) from t on where there are gyro readings, by the momenta and parameters
/// that `gyros` hold at t. No astro-correction after it. Throws SetupError for gyros of an unknown drift model.
[[nodiscard]] AttitudeHistory fly_open_loop(const Pass& pass, Time t, const std::vector<GyroCalibration>& gyros,
                                            const std::vector<Time>& epochs);

/// The same astro-correction with the parameters known before the pass, and with those calibrated until then.
struct OpenLoops {
  AttitudeErrors known_before;
  AttitudeErrors calibrated;
  CorrectionInterval interval_known_before;
  CorrectionInterval interval_calibrated;

  /// Interval with calibrated over interval with known parameters; a lower bound where the calibrated one did not pass
  /// the limit before the end of the pass. Absent where the known one did not.
  [[nodiscard]] std::optional<double> extension() const;
};

struct Extension {
  double limit_rad = 0;
  std::vector<OpenLoops> loops;  ///< one per astro-correction
  /// Median over the loops from the second correction on: the first has nothing calibrated yet. Absent where there is
  /// none.
  std::optional<double> factor;
  bool is_lower_bound = false;  ///< some loop that bears on the median outlasted the pass
};

/// Flies both open loops from each of the run's corrections against a reference attitude. Mathematics: extension of the
/// correction interval (paper: 3–5).
[[nodiscard]] Extension measure_extension(const Pass& pass, const CalibrationRun& run,
                                          const std::vector<Time>& reference_t,
                                          const std::vector<Eigen::Quaterniond>& reference_q_in_c, double limit_rad);

}  // namespace trihedron::ground
