#pragma once
/// What the on-board step reports of each event, and when it corrects the navigator.

#include <chrono>
#include <cstdint>
#include <optional>

#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/fix_report.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/core/status.hpp"

namespace trihedron {

/// Astro-corrections of the navigator.
struct CorrectionPolicy {
  static constexpr Duration kEveryFix = Duration::zero();
  static constexpr Duration kOnlyFirst = Duration::max();
  Duration interval = std::chrono::minutes(90);
  /// With more the buffer of samples could fill up before the work is done.
  static constexpr int kMostSpread = 20;
  bool take_parameters = true;  ///< false: the parameters of the set-up are held
  bool navigate = true;         ///< false: the calibration alone, without a navigator
  /// Whether the calibration may predict over several samples in one step, where they are close and the body hardly
  /// turns meanwhile. The estimates stay the same to a hundredth of their sigmas.
  bool steps_over_samples = false;
  /// The work of a fix is spread over as many samples, at most kMostSpread, or over those up to the next fix if these
  /// are fewer, so that no call takes much longer than another; 0: it is done at once. What comes out is the same bit
  /// for bit; but where a fix comes while the one before it is still dealt with, the attitude that the navigator had at
  /// it is found from a later sample, which differs by rounding.
  int spread_over = 0;
};

/// The parameters that the navigator uses from its next astro-correction on.
enum class ParametersInUse : std::uint8_t {
  kOfCalibration,  ///< taken over from the estimator at each correction
  kOfSetUp,        ///< those known before
  kHeld,           ///< those that it has; at the start those of the set-up
};

/// What was done with a fix, or with the angles between the momenta.
struct FixOutcome {
  FixReport fix;           ///< its time is its own
  bool corrected = false;  ///< the navigator was corrected at that fix
  /// That fix and the readings it was compared with, where it was compared.
  std::optional<ComparedFix> compared;
  /// Attitude at that fix, used or rejected as an outlier: of the calibration itself, and of the open-loop navigator.
  std::optional<AttitudeSolution> calibrated;
  std::optional<AttitudeSolution> navigated;
  /// Of an update by the angles between the momenta, made because no fix could be used for long: it checks the gyros
  /// without a star tracker, and keeps the calibration going. Its time is its own.
  AngleReport angles;
};

/// Report on one event; every member is valid, whatever was wrong with the event. The outcome is of the fix that was
/// dealt with in this step, if any; where its work is spread over several steps, with the last of them.
struct StepReport : FixOutcome {
  Time t{};
  SampleStatus sample = SampleStatus::kNone;
  PerGyro<GyroState> gyros{};  ///< after this step
  bool more_due = false;       ///< another fix can be dealt with now: carry_on() does
  int fixes_dropped = 0;  ///< fixes discarded because the clock was set back while they waited: their time is unknown
  /// z1 of eq. (3), cosθ predicted minus cosθ measured: the integrity of the pair, without a star tracker. Zero before
  /// the start, and where one of the two cannot be used.
  double angle_residual = 0;
};

}  // namespace trihedron
