#pragma once
/// What a pass shows to be wrong with it before it is calibrated.

#include <optional>
#include <vector>

#include "calibrate/bursts.hpp"
#include "trihedron/ground/clocks/clocks.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {

/// Whether a pass is searched for its noise, and for errors of its readings and fixes.
[[nodiscard]] inline bool looks_for_noise(const CalibrationOptions& asked) {
  return asked.find_noise && asked.estimator != Estimator::kPaper;
}

/// A pass with stamps corrected, noise of the readings as they show it, and without readings that are wrong for a
/// moment and fixes that repeat the errors of others.
class CorrectedPass {
 public:
  /// Makes the request as soon as a correction is needed. Refers to the pass and to the request. Throws SetupError.
  CorrectedPass(const Pass& as_given, const CalibrationOptions& asked, StopRequest& stop_screening);

  [[nodiscard]] const Pass& pass() const { return own_ ? *own_ : as_given_; }
  /// Those asked for, with states for what the corrections leave of the clock of the star tracker.
  [[nodiscard]] const CalibrationOptions& options() const { return options_; }
  [[nodiscard]] bool has_correlated_fixes() const { return !correlated_.empty(); }
  /// What was found, and the clocks as those of the telemetry as it was given.
  void put_into(CalibrationRun& run) const;

 private:
  void replace_by(Pass corrected);
  void make_stamps_regular();
  void leave_out_wrong_readings();
  void take_readout_noise();
  void correct_clocks();
  void leave_out_correlated_fixes();

  const Pass& as_given_;
  CalibrationOptions options_;
  StopRequest& stop_screening_;
  std::optional<Pass> own_;
  double gyro_stamps_off_s_ = 0;
  double gyro_stamps_late_s_ = 0;
  std::optional<Bursts> bursts_;
  std::optional<ReadoutNoise> noise_;
  std::optional<Clocks> clocks_;
  std::optional<ClockStep> step_;
  ClockCorrection correction_;
  std::vector<CorrelatedFixes> correlated_;
};

}  // namespace trihedron::ground
