#pragma once
/// What enters the on-board step: checks of the clock, of the readings and of the fixes.

#include <array>
#include <chrono>
#include <optional>

#include "trihedron/core/gyro_health.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/core/status.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// Decides what of the telemetry is used.
class Intake {
 public:
  /// A time step larger than this is accepted only when the next sample confirms it.
  static constexpr Duration kMaxGap = std::chrono::hours(1);
  /// Consecutive samples behind the present time after which the clock is taken to have been set back.
  static constexpr int kSetBackSamples = 16;
  /// Times farther from the origin, 146 years, are out of order, so that the difference of any two can be told.
  static constexpr Duration kMaxTime = Duration::max() / 2;

  Intake() = default;
  explicit Intake(const CalibrationSetup& setup);

  enum class Clock : std::uint8_t { kRunsOn, kOutOfOrder, kSetBack };
  /// Checks the clock by the time `t` of a sample; `latest`: time of the last sample accepted.
  [[nodiscard]] Clock look_at_clock(Time t, const std::optional<Time>& latest);

  /// Whether the last samples were behind the present time and ran on there; a time that stands still does not.
  [[nodiscard]] bool may_be_set_back() const { return behind_present_ > 1; }
  /// Where it may: samples before the one at which the clock is taken to have been set back, if they all go on so.
  [[nodiscard]] int samples_to_set_back() const { return kSetBackSamples - 1 - behind_present_; }

  /// Checks the readings of a sample whose time has been accepted, and normalises them.
  [[nodiscard]] SampleStatus screen(GyroSample& sample);

  /// Checks a fix; kPending: it can be used. `taken_until`: fixes before it are too late.
  [[nodiscard]] FixStatus look_at(const StarFix& fix, const std::optional<Time>& latest, Time taken_until) const;
  /// The estimator has used a fix.
  void mark_used(const StarFix& fix) { used_fix_t_[static_cast<std::size_t>(fix.head)] = fix.t; }

  /// The clock has been set back to `t`.
  void set_clock(Time t);

  [[nodiscard]] GyroHealth& health() { return health_; }
  [[nodiscard]] const GyroHealth& health() const { return health_; }
  /// Gyros that can be used at both ends of a step; where those are too few, at its end.
  [[nodiscard]] GyroMask used_over(Time from, Time to) const;

 private:
  [[nodiscard]] bool is_set_back(Time t);
  [[nodiscard]] bool is_wild(Time t, Time latest);

  int gyros_ = 0;
  int star_trackers_ = 0;
  Duration max_interpolation_{};
  GyroHealth health_;
  std::array<std::optional<Time>, kMaxStarTrackers> used_fix_t_;
  int behind_present_ = 0;  ///< samples in a row
  Time behind_present_t_{};
  Time suspect_t_{};
  bool has_suspect_ = false;
};

}  // namespace trihedron
