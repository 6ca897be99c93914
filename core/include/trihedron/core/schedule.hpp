#pragma once
/// What the calibration does next. It follows the samples some seconds behind, so that the readings to both sides of a
/// fix are there, and updates by the angles between the momenta where no fix could be used for long.

#include <algorithm>
#include <chrono>
#include <cstdint>

#include "trihedron/core/time.hpp"

namespace trihedron {

/// Times of what is due.
class Schedule {
 public:
  /// Interval of angle updates in an outage of fixes; successive updates share no samples.
  static constexpr Duration kAngleInterval = std::chrono::seconds(3);

  Schedule() = default;
  /// `reach`: how far to both sides of a fix readings are fitted. `angles_after`: time without a usable fix after which
  /// the angles are used; Duration::max(): never.
  Schedule(Duration reach, Duration angles_after) : reach_(reach), angles_after_(angles_after) {}

  enum class Next : std::uint8_t { kNothing, kSample, kFix, kAngles };
  /// The earliest thing to do until `limit`: follow the next sample, deal with the next fix, at these times
  /// (Time::max() where there is none), or update by the angles.
  [[nodiscard]] Next next(Time limit, Time sample_t, Time fix_t) const {
    // A fix whose readings overlap those of an angle update has priority; the update waits until no such fix can
    // arrive.
    if (sample_t != Time::max() && angles_t_ < sample_t && angles_t_ <= fix_t - 2 * reach_) {
      return angles_t_ > limit - 2 * reach_ ? Next::kNothing : Next::kAngles;
    }
    if (fix_t < sample_t && fix_t <= limit) {
      return Next::kFix;
    }
    return sample_t <= limit ? Next::kSample : Next::kNothing;
  }

  [[nodiscard]] Time angles_t() const { return angles_t_; }
  /// Fixes earlier than this come too late: the calibration has passed them, or their readings have been used.
  [[nodiscard]] Time taken_until() const { return taken_until_; }

  void followed_to(Time t) { taken_until_ = std::max(taken_until_, t); }
  void fix_used(Time t) {
    if (angles_after_ != Duration::max()) {
      angles_t_ = t + angles_after_;
    }
  }
  void angles_used(Time t) {
    taken_until_ = t + 2 * reach_;
    angles_t_ = t + std::max(kAngleInterval, 2 * reach_);
  }
  /// Not before `t`: there are no readings.
  void put_angles_off(Time t) { angles_t_ = t; }
  /// Until the next fix is used.
  void no_angles() { angles_t_ = Time::max(); }
  /// The clock has been set back by −shift.
  void set_clock(Duration shift) {
    angles_t_ = angles_t_ == Time::max() ? angles_t_ : shifted(angles_t_, shift);
    taken_until_ = Time::min();
  }

 private:
  Duration reach_{};
  Duration angles_after_ = Duration::max();
  Time angles_t_ = Time::max();
  Time taken_until_ = Time::min();
};

}  // namespace trihedron
