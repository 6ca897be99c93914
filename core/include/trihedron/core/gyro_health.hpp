#pragma once
/// Which gyros can be used, and over which times: detection of stuck readings and isolation of faulty gyros.

#include <Eigen/Core>
#include <algorithm>
#include <chrono>

#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/status.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// State of each gyro from repeated readings and from the fault suspicions of rejected fixes.
class GyroHealth {
 public:
  /// Identical consecutive samples, and the time over which they came, that mean a stuck gyro: a live reading has
  /// noise, and so many equal values are no chance even in coarse telemetry.
  static constexpr int kStuckSamples = 16;
  static constexpr Duration kStuckTime = std::chrono::seconds(1);
  /// Sooner where a reading that moved stops between two samples: it is stuck when it should have gone on by so many
  /// times what noise and resolution have lately added to its steps.
  static constexpr double kStepsMissing = 4;
  /// Over which the motion of a reading is averaged, and steps after which it is known.
  static constexpr double kMotionTime_s = 1;
  static constexpr int kStepsOfMotion = 8;
  /// Consecutive suspicions of the same gyro after which it is isolated.
  static constexpr int kVerdicts = 5;
  /// Stuck stretches closer than this are merged.
  static constexpr Duration kMemory = std::chrono::seconds(10);

  GyroHealth() = default;
  explicit GyroHealth(int gyros) : gyros_(gyros), selected_(all_gyros(gyros)) {}

  /// Takes the next sample; in time order.
  void look_at(const GyroSample& sample) {
    for (int k = 0; k < gyros_; ++k) {
      Readings& its = readings_[k];
      const Eigen::Vector3d& h_b = sample.h_b[k];
      if (its.alike > 0 && (h_b == its.last || (!h_b.allFinite() && !its.last.allFinite()))) {
        ++its.alike;
      } else {
        its.follow(h_b, sample.t, last_t_);
        its.alike = 1;
        its.since = sample.t;
        its.last = h_b;
      }
      its.stuck = its.alike > 1 &&
                  ((its.alike >= kStuckSamples && sample.t - its.since >= kStuckTime) || its.has_stopped(sample.t));
      if (its.stuck) {
        if (!(its.stuck_from <= its.since && its.since - its.stuck_until <= kMemory)) {
          its.stuck_from = its.since;
        }
        its.stuck_until = sample.t;
      }
    }
    last_t_ = sample.t;
  }

  /// Takes the result of a fix, or of an update by the angles: the gyro that alone does not agree with the rest, or
  /// kNoGyro.
  void judge(int odd_gyro) {
    verdicts_ = odd_gyro == suspect_ ? verdicts_ + 1 : 1;
    suspect_ = odd_gyro;
    if (suspect_ != kNoGyro && verdicts_ >= kVerdicts) {
      isolated_[suspect_] = true;
    }
  }

  /// Leaves out all gyros but these, and takes these back where they were isolated.
  void select(const GyroMask& selected) {
    for (int k = 0; k < gyros_; ++k) {
      selected_[k] = selected[k];
      isolated_[k] = false;
    }
    suspect_ = kNoGyro;
    verdicts_ = 0;
  }

  /// Those whose readings can be used from `from` to `to`, both included.
  [[nodiscard]] GyroMask usable(Time from, Time to) const {
    GyroMask mask;
    for (int k = 0; k < gyros_; ++k) {
      mask[k] = selected_[k] && !isolated_[k] && !readings_[k].is_stuck_within(from, to);
    }
    return mask;
  }
  /// Those whose readings can be used at both of these times, whatever they were between.
  [[nodiscard]] GyroMask usable_at(Time a, Time b) const {
    GyroMask mask;
    for (int k = 0; k < gyros_; ++k) {
      mask[k] =
          selected_[k] && !isolated_[k] && !readings_[k].is_stuck_within(a, a) && !readings_[k].is_stuck_within(b, b);
    }
    return mask;
  }

  [[nodiscard]] PerGyro<GyroState> states() const {
    PerGyro<GyroState> states;
    for (int k = 0; k < gyros_; ++k) {
      states[k] = !selected_[k]        ? GyroState::kNotSelected
                  : isolated_[k]       ? GyroState::kIsolated
                  : readings_[k].stuck ? GyroState::kStuck
                                       : GyroState::kUsed;
    }
    return states;
  }

  /// The clock has been set back; `t` is the time now.
  void set_clock(Time t) {
    for (Readings& its : readings_) {
      its.since = last_t_ = t;
      its.stuck_from = Time::max();
      its.stuck_until = Time::min();
    }
  }

 private:
  struct Readings {
    Eigen::Vector3d last = Eigen::Vector3d::Zero();
    int alike = 0;  ///< in a row
    bool stuck = false;
    Time since{};  ///< of the first of them
    Time stuck_from = Time::max();
    Time stuck_until = Time::min();
    Eigen::Vector3d motion = Eigen::Vector3d::Zero();  ///< per second, average
    double jitter = 0;                                 ///< of late the largest part of a step that is not motion
    int steps = 0;                                     ///< that the motion is known by

    /// A reading other than the last ones, which came until `until`. The step after a stretch in which it was stuck is
    /// not one of motion.
    void follow(const Eigen::Vector3d& h_b, Time t, Time until) {
      const double dt_s = to_seconds(t - since);
      const Eigen::Vector3d step = h_b - last;
      if (alike == 0 || stuck || !(dt_s > 0) || !step.allFinite()) {
        return;
      }
      const double part = dt_s < kMotionTime_s ? dt_s / kMotionTime_s : 1;
      // A live reading that stood still: by its resolution.
      const double missing = motion.norm() * to_seconds(until - since);
      const double off = (step - motion * dt_s).norm();
      jitter = std::max({missing, off, (1 - part) * jitter});
      motion += part * (step / dt_s - motion);
      steps += steps < kStepsOfMotion ? 1 : 0;
    }
    [[nodiscard]] bool is_stuck_within(Time from, Time to) const { return stuck_from <= to && from <= stuck_until; }
    [[nodiscard]] bool has_stopped(Time t) const {
      return steps == kStepsOfMotion && last.allFinite() &&
             motion.norm() * to_seconds(t - since) > kStepsMissing * jitter;
    }
  };

  int gyros_ = 0;
  Time last_t_{};
  PerGyro<Readings> readings_;
  GyroMask selected_{};
  GyroMask isolated_{};
  int suspect_ = kNoGyro;
  int verdicts_ = 0;
};

}  // namespace trihedron
