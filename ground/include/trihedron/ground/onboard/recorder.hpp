#pragma once
/// Collects the reports of a pipeline.

#include <optional>
#include <vector>

#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// The record of one fix; `gyros`: their number.
[[nodiscard]] FixRecord record_of(const StepReport& report, int gyros);
/// Of fixes; what is not about fixes is left as it is.
void add_statistics(const std::vector<FixRecord>& fixes, Statistics& statistics);

/// Puts everything that a pipeline reports into a run.
class Recorder {
 public:
  /// The next report; `pipeline` is as it was left by it.
  void add(const StepReport& report, const Pipeline& pipeline);

  /// What was recorded, without calibration and verdict.
  [[nodiscard]] const CalibrationRun& run() const { return run_; }
  [[nodiscard]] CalibrationRun take() && { return std::move(run_); }

 private:
  void add_sample(const StepReport& report, const Pipeline& pipeline);
  void add_fix(const StepReport& report, const Pipeline& pipeline);
  void add_angle(Time t, double residual);

  CalibrationRun run_;
  Time corrected_{};
  PerGyro<GyroState> gyros_before_{};
};

/// Puts the attitude of a pipeline's navigator at each sample, and its fixes, into a run.
class NavigationRecorder {
 public:
  void add(const StepReport& report, const Pipeline& pipeline);
  [[nodiscard]] NavigationRun take() && { return std::move(run_); }

 private:
  NavigationRun run_;
  Time corrected_{};
};

}  // namespace trihedron::ground
