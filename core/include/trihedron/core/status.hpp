#pragma once
/// What was done with a sample, with a fix, and what is thought of a gyro.

#include <cstddef>
#include <cstdint>

namespace trihedron {

/// What was done with a gyro sample.
enum class SampleStatus : std::uint8_t {
  kNone,  ///< no sample in this step
  kUsed,
  kRejectedNotDirection,   ///< a reading is not finite or not unit
  kRejectedOutOfOrder,     ///< not later than the sample before it, or more than an hour ahead and not confirmed by the
                           ///< next sample
  kRejectedGeometry,       ///< momenta nearly parallel
  kRejectedTooFewGyros,    ///< fewer than two gyros can be used; the report names them
  kUsedAfterClockSetBack,  ///< first sample used after the telemetry clock was set back: no prediction is made across
                           ///< the jump
  kThinned,                ///< good, but less than Readings::min_spacing() after the sample before it: not used
};
inline constexpr std::size_t kSampleStatuses = 8;

/// Whether the sample took part in the estimation.
[[nodiscard]] constexpr bool is_used(SampleStatus status) {
  return status == SampleStatus::kUsed || status == SampleStatus::kUsedAfterClockSetBack;
}

/// What was done with a fix.
enum class FixStatus : std::uint8_t {
  kNone,                 ///< no fix was due
  kPending,              ///< held until the gyro samples round it are there
  kStarted,              ///< the first fix: sets the directions
  kUsed,                 ///< calibration updated
  kUsedAfterReopening,   ///< used after a run of rejections, with the directions reopened
  kRestarted,            ///< used after another run of rejections soon after, or where it contradicts the first
                         ///< fix alone: the filter restarted
  kRejectedNotRotation,  ///< quaternion not finite or not unit
  kRejectedOutOfOrder,   ///< repeated, or too late: the calibration has passed its time
  kRejectedNoGyro,       ///< no gyro samples close enough round it
  kRejectedUnknownHead,  ///< of a star tracker that the estimator does not have
  kRejectedBacklog,      ///< more fixes are waiting than there is room for
  kRejectedGeometry,     ///< momenta nearly parallel
  kRejectedTooFewGyros,  ///< fewer than two gyros can be used, or at the start not all; StepReport::gyros names them
  kRejectedByGate,       ///< NIS above the gate
  kEstimateLost,         ///< estimate or its covariance was no longer finite: the filter returns to the prior, and the
                         ///< next fix starts it; the navigator keeps what it has
  kRejectedFrozen,     ///< the quaternion of the fix before it once more, while the gyros show that the body has turned
  kUsedAfterWidening,  ///< used with wider sigmas: the innovations were correlated in time
};
inline constexpr std::size_t kFixStatuses = 17;

/// Whether the fix took part in the estimation.
[[nodiscard]] constexpr bool is_used(FixStatus status) {
  return status == FixStatus::kStarted || status == FixStatus::kUsed || status == FixStatus::kUsedAfterReopening ||
         status == FixStatus::kRestarted || status == FixStatus::kUsedAfterWidening;
}

/// Whether a gyro is used.
enum class GyroState : std::uint8_t {
  kUsed,
  kStuck,        ///< its readings, or one component, do not change, not even by noise; used again when they do
  kIsolated,     ///< left out for good: several times in a row it alone did not agree with the rest
  kNotSelected,  ///< left out by command
  kLeapt,        ///< its readings are where no body turns to between two samples; used again when they are back
};
inline constexpr std::size_t kGyroStates = 5;

}  // namespace trihedron
