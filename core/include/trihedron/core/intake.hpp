#pragma once
/// What enters the on-board step: checks of the clock, of the readings and of the fixes.

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>

#include "trihedron/core/gyro_health.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/core/status.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// Decides what of the telemetry is used; with room for kGyros gyros.
template <int kGyros = kMaxGyros>
class Intake {
 public:
  /// A time step larger than this is accepted only when the next sample confirms it.
  static constexpr Duration kMaxGap = std::chrono::hours(1);
  /// Consecutive samples behind the present time after which the clock is taken to have been set back.
  static constexpr int kSetBackSamples = 16;

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

  [[nodiscard]] GyroHealth<kGyros>& health() { return health_; }
  [[nodiscard]] const GyroHealth<kGyros>& health() const { return health_; }
  /// Gyros that can be used at both ends of a step; where those are too few, at its end.
  [[nodiscard]] GyroMask used_over(Time from, Time to) const;

 private:
  [[nodiscard]] static bool is_in_range(Time t) {
    return -kMaxTime <= t.time_since_epoch() && t.time_since_epoch() <= kMaxTime;
  }
  [[nodiscard]] bool is_set_back(Time t);
  [[nodiscard]] bool is_wild(Time t, Time latest);

  int gyros_ = 0;
  int star_trackers_ = 0;
  Duration max_interpolation_{};
  GyroHealth<kGyros> health_;
  std::array<std::optional<Time>, kMaxStarTrackers> used_fix_t_;
  int behind_present_ = 0;  ///< samples in a row
  Time behind_present_t_{};
  Time suspect_t_{};
  bool has_suspect_ = false;
};

template <int kGyros>
Intake<kGyros>::Intake(const CalibrationSetup& setup)
    : gyros_(setup.layout.gyros),
      star_trackers_(setup.layout.star_trackers),
      max_interpolation_(setup.max_interpolation()),
      health_(setup.layout.gyros, setup.readout_noise_rad) {}

template <int kGyros>
auto Intake<kGyros>::look_at_clock(Time t, const std::optional<Time>& latest) -> Clock {
  if (!is_in_range(t)) {
    return Clock::kOutOfOrder;
  }
  if (latest && !(t > *latest)) {
    if (!is_set_back(t)) {
      return Clock::kOutOfOrder;
    }
    behind_present_ = 0;
    return Clock::kSetBack;
  }
  behind_present_ = 0;
  return latest && is_wild(t, *latest) ? Clock::kOutOfOrder : Clock::kRunsOn;
}

// Whether enough consecutive samples behind the present time increase regularly, so that their time is taken as the
// time now: without it all would be out of order until the old time is reached again.
template <int kGyros>
bool Intake<kGyros>::is_set_back(Time t) {
  const bool runs_on = behind_present_ > 0 && t > behind_present_t_ && t - behind_present_t_ <= max_interpolation_;
  behind_present_ = runs_on ? behind_present_ + 1 : 1;
  behind_present_t_ = t;
  return behind_present_ >= kSetBackSamples;
}

// Whether a time stamp lies so far ahead that a second one must confirm it: a single corrupt time stamp would otherwise
// put everything after it out of order.
template <int kGyros>
bool Intake<kGyros>::is_wild(Time t, Time latest) {
  if (t - latest <= kMaxGap) {
    has_suspect_ = false;
    return false;
  }
  const bool confirmed = has_suspect_ && t > suspect_t_ && t - suspect_t_ <= max_interpolation_;
  has_suspect_ = !confirmed;
  suspect_t_ = t;
  return !confirmed;
}

template <int kGyros>
SampleStatus Intake<kGyros>::screen(GyroSample& sample) {
  health_.look_at(sample);
  const GyroMask used = health_.usable(sample.t, sample.t);
  if (count(used) < 2) {
    return SampleStatus::kRejectedTooFewGyros;
  }
  for (int k = 0; k < gyros_; ++k) {
    Eigen::Vector3d& h = sample.h_b[k];
    const double norm = h.norm();
    if (nearly_unit(norm)) {
      h /= norm;
    } else if (used[k]) {
      return SampleStatus::kRejectedNotDirection;
    } else {
      h = Eigen::Vector3d::UnitX();  // not used, but finite
    }
  }
  return SampleStatus::kUsed;
}

template <int kGyros>
FixStatus Intake<kGyros>::look_at(const StarFix& fix, const std::optional<Time>& latest, Time taken_until) const {
  if (!fix.q_in_c.coeffs().allFinite() || !nearly_unit(fix.q_in_c.norm())) {
    return FixStatus::kRejectedNotRotation;
  }
  if (fix.head < 0 || fix.head >= star_trackers_) {
    return FixStatus::kRejectedUnknownHead;
  }
  if (!is_in_range(fix.t)) {
    return FixStatus::kRejectedOutOfOrder;
  }
  const PerGyro<GyroState> states = health_.states();
  const auto used_now = std::count(states.begin(), states.begin() + gyros_, GyroState::kUsed);
  if (count(health_.usable(fix.t, fix.t)) < 2 || used_now < 2) {
    return FixStatus::kRejectedTooFewGyros;
  }
  if (!latest || fix.t - *latest > max_interpolation_) {
    return FixStatus::kRejectedNoGyro;
  }
  const std::optional<Time>& used_t = used_fix_t_[static_cast<std::size_t>(fix.head)];
  const bool too_late = (used_t && fix.t <= *used_t) || fix.t < taken_until;
  return too_late ? FixStatus::kRejectedOutOfOrder : FixStatus::kPending;
}

template <int kGyros>
void Intake<kGyros>::set_clock(Time t) {
  used_fix_t_ = {};
  has_suspect_ = false;
  health_.set_clock(t);
}

template <int kGyros>
GyroMask Intake<kGyros>::used_over(Time from, Time to) const {
  const GyroMask at_both = health_.usable_at(from, to);
  return count(at_both) >= 2 ? at_both : health_.usable(to, to);
}

}  // namespace trihedron
