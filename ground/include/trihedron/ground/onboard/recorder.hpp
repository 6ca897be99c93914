#pragma once
/// Collects the reports of a pipeline.

#include <array>
#include <optional>
#include <vector>

#include "trihedron/core/layout.hpp"
#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// The record of one fix; `gyros`: their number.
[[nodiscard]] FixRecord record_of(const StepReport& report, int gyros);
/// Adds the solution at `t`, with its sigmas. Of several at one time, as of fixes of several star trackers, the last is
/// kept.
void append(AttitudeHistory& history, Time t, const AttitudeSolution& solution);

/// What Statistics says of fixes, summed up one by one; plain data.
class FixSums {
 public:
  void add(const FixRecord& fix);
  /// What is not about fixes is left as it is.
  void put_into(Statistics& statistics) const;

 private:
  long fixes_ = 0;
  long used_ = 0;
  long outliers_ = 0;
  long frozen_ = 0;
  long reopened_ = 0;
  long off_in_a_row_ = 0;  ///< of runs that were long enough
  long jumped_in_a_row_ = 0;
  long judged_ = 0;  ///< that the mean NIS is over
  double nis_ = 0;
  double freedom_ = 0;
  std::array<double, kMaxComponents> squares_{};
  std::size_t components_ = 0;
};

/// Of fixes; what is not about fixes is left as it is.
void add_statistics(const std::vector<FixRecord>& fixes, Statistics& statistics);

/// Changes of the states of gyros, from sample to sample.
class GyroEvents {
 public:
  void add(const StepReport& report, int gyros, std::vector<GyroEvent>& events);

 private:
  PerGyro<GyroState> before_{};
};

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
  void forget_unconfirmed_start();
  void add_fix(const StepReport& report, const Pipeline& pipeline);
  void add_angle(Time t, double residual);

  CalibrationRun run_;
  Time corrected_{};
  GyroEvents gyros_;
};

/// Counts astro-corrections, and the intervals over which fixes were there but none could correct.
class CorrectionSums {
 public:
  void add(const FixRecord& fix, Duration interval);
  [[nodiscard]] long made() const { return made_; }
  [[nodiscard]] long missed() const { return missed_; }

 private:
  std::optional<Time> corrected_;      ///< the last one
  std::optional<Time> waiting_since_;  ///< the first fix that could have corrected
  long made_ = 0;
  long missed_ = 0;
};

/// Puts the attitude of a pipeline's navigator at each sample, and its fixes, into a run.
class NavigationRecorder {
 public:
  void add(const StepReport& report, const Pipeline& pipeline);
  [[nodiscard]] NavigationRun take() &&;

 private:
  /// Fixes that an open loop is compared with at its end.
  static constexpr std::size_t kLastFixes = 5;

  void add_fix(const StepReport& report, const Pipeline& pipeline);
  void end_open_loop();

  NavigationRun run_;
  Time corrected_{};
  GyroEvents gyros_;
  CorrectionSums corrections_;
  bool start_unconfirmed_ = false;          ///< the last fix that was used started the filter
  std::vector<OpenLoopEnd> last_compared_;  ///< of each of the last fixes since the last correction
};

}  // namespace trihedron::ground
