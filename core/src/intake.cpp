#include "trihedron/core/intake.hpp"

#include <algorithm>

namespace trihedron {
namespace {

bool in_range(Time t) { return -Intake::kMaxTime <= t.time_since_epoch() && t.time_since_epoch() <= Intake::kMaxTime; }

}  // namespace

Intake::Intake(const CalibrationSetup& setup)
    : gyros_(setup.layout.gyros),
      star_trackers_(setup.layout.star_trackers),
      max_interpolation_(setup.max_interpolation()),
      health_(setup.layout.gyros) {}

Intake::Clock Intake::look_at_clock(Time t, const std::optional<Time>& latest) {
  if (!in_range(t)) {
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
bool Intake::is_set_back(Time t) {
  const bool runs_on = behind_present_ > 0 && t > behind_present_t_ && t - behind_present_t_ <= max_interpolation_;
  behind_present_ = runs_on ? behind_present_ + 1 : 1;
  behind_present_t_ = t;
  return behind_present_ >= kSetBackSamples;
}

// Whether a time stamp lies so far ahead that a second one must confirm it: a single corrupt time stamp would otherwise
// put everything after it out of order.
bool Intake::is_wild(Time t, Time latest) {
  if (t - latest <= kMaxGap) {
    has_suspect_ = false;
    return false;
  }
  const bool confirmed = has_suspect_ && t > suspect_t_ && t - suspect_t_ <= max_interpolation_;
  has_suspect_ = !confirmed;
  suspect_t_ = t;
  return !confirmed;
}

SampleStatus Intake::screen(GyroSample& sample) {
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

FixStatus Intake::look_at(const StarFix& fix, const std::optional<Time>& latest, Time taken_until) const {
  if (!fix.q_in_c.coeffs().allFinite() || !nearly_unit(fix.q_in_c.norm())) {
    return FixStatus::kRejectedNotRotation;
  }
  if (fix.head < 0 || fix.head >= star_trackers_) {
    return FixStatus::kRejectedUnknownHead;
  }
  if (!in_range(fix.t)) {
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

void Intake::set_clock(Time t) {
  used_fix_t_ = {};
  has_suspect_ = false;
  health_.set_clock(t);
}

GyroMask Intake::used_over(Time from, Time to) const {
  const GyroMask at_both = health_.usable_at(from, to);
  return count(at_both) >= 2 ? at_both : health_.usable(to, to);
}

}  // namespace trihedron
