#pragma once
/// Which gyros can be used, and over which times: detection of readings that stick or leap, and isolation of faulty
/// gyros.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>

#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/status.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// State of each gyro, with room for kGyros of them, from readings that repeat themselves or leap, and from the fault
/// suspicions of rejected fixes.
template <int kGyros = kMaxGyros>
class GyroHealth {
 public:
  /// Identical consecutive samples, and the time over which they came, that mean a stuck gyro: a live reading has
  /// noise, and so many equal values are no chance even in coarse telemetry.
  static constexpr int kStuckSamples = 16;
  static constexpr Duration kStuckTime = std::chrono::seconds(1);
  /// Sooner where a reading that moved stops between two samples: it is stuck when it should have gone on by so many
  /// times what noise and resolution have lately added to its steps.
  static constexpr double kStepsMissing = 4;
  /// A single component is stuck when it repeats itself so many times, while the others change and the reading moves by
  /// so many sigmas, though it has shown steps finer than this part of its noise: each repetition would be a chance of
  /// one in two hundred. Where its resolution is coarser or not known, a component of a live reading may stand still.
  static constexpr int kRepetitions = 4;
  static constexpr double kResolvedPart = 1.0 / 64;
  static constexpr double kSigmasMoved = 10;
  /// Below which a step is one of rounding in the arithmetic.
  static constexpr double kRounding = 1e-12;
  /// Over which the motion of a reading is averaged, and steps after which it is known.
  static constexpr double kMotionTime_s = 1;
  static constexpr int kStepsOfMotion = 8;
  /// No body turns by more than this from one sample to the next: two readings in a row that are farther from the one
  /// before them have leapt. A momentum does not leap; what reads it does.
  static constexpr double kLargestTurn_rad_s = 0.5;
  static constexpr double kLargestJolt_rad = 0.02;
  /// Steps in a row without a leap before one is believed: a first reading may be the one that is off.
  static constexpr int kStepsToLeap = 8;
  /// The longest step that tells a leap.
  static constexpr Duration kLongestStep = std::chrono::milliseconds(1500);
  /// After which readings that have leapt are used again, wherever they are: by then the fixes must judge.
  static constexpr Duration kLeapTime = std::chrono::hours(1);
  /// Consecutive suspicions of the same gyro after which it is isolated.
  static constexpr int kVerdicts = 5;
  /// Stuck stretches closer than this are merged.
  static constexpr Duration kMemory = std::chrono::seconds(10);

  GyroHealth() = default;
  /// `readout_noise_rad`: 1-sigma of each component; without it no single component is taken for stuck.
  explicit GyroHealth(int gyros, const PerGyro<double>& readout_noise_rad = {})
      : gyros_(gyros), selected_(all_gyros(gyros)) {
    std::copy_n(readout_noise_rad.begin(), kGyros, readout_noise_rad_.begin());
  }

  /// Takes the next sample; in time order.
  void look_at(const GyroSample& sample) {
    for (int k = 0; k < gyros_; ++k) {
      Readings& its = readings_[k];
      const Eigen::Vector3d& h_b = sample.h_b[k];
      its.look_for_leap(h_b, sample.t, last_t_);
      its.follow_components(h_b, sample.t, readout_noise_rad_[k]);
      if (its.alike > 0 && (h_b == its.last || (!h_b.allFinite() && !its.last.allFinite()))) {
        ++its.alike;
      } else {
        its.follow(h_b, sample.t, last_t_);
        its.alike = 1;
        its.since = sample.t;
        its.last = h_b;
      }
      its.decide_whether_stuck(sample.t);
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
      readings_[k].leap = {};
    }
    suspect_ = kNoGyro;
    verdicts_ = 0;
  }

  /// Those whose readings can be used from `from` to `to`, both included.
  [[nodiscard]] GyroMask usable(Time from, Time to) const {
    GyroMask mask;
    for (int k = 0; k < gyros_; ++k) {
      mask[k] = selected_[k] && !isolated_[k] && !readings_[k].is_dead_within(from, to);
    }
    return mask;
  }
  /// Those whose readings can be used at both of these times, whatever they were between.
  [[nodiscard]] GyroMask usable_at(Time a, Time b) const {
    GyroMask mask;
    for (int k = 0; k < gyros_; ++k) {
      mask[k] =
          selected_[k] && !isolated_[k] && !readings_[k].is_dead_within(a, a) && !readings_[k].is_dead_within(b, b);
    }
    return mask;
  }

  [[nodiscard]] PerGyro<GyroState> states() const {
    PerGyro<GyroState> states;
    for (int k = 0; k < gyros_; ++k) {
      states[k] = !selected_[k]              ? GyroState::kNotSelected
                  : isolated_[k]             ? GyroState::kIsolated
                  : readings_[k].stuck       ? GyroState::kStuck
                  : readings_[k].leap.proven ? GyroState::kLeapt
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
      its.leap = {};
      its.components = {};
    }
  }

 private:
  /// One component of the readings.
  struct Component {
    int repetitions = 0;  ///< of its value in a row, while others changed
    bool stuck = false;
    Time since{};  ///< of the first with that value
    double finest_step = std::numeric_limits<double>::max();
  };

  /// Readings that are where they cannot have come to.
  struct Leap {
    bool suspected = false;  ///< one reading has leapt
    bool proven = false;     ///< and the next one as well
    int steps_without = 0;
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    Time from = Time::max();
    Time until = Time::min();
  };

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
    std::array<Component, 3> components{};
    Leap leap;

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
    /// A component may stand still where the body turns about its axis; then its noise moves it. Where the whole
    /// reading repeats itself, that says nothing of one component.
    void follow_components(const Eigen::Vector3d& h_b, Time t, double noise_rad) {
      for (int axis = 0; axis < 3 && alike > 0; ++axis) {
        Component& its = components[static_cast<std::size_t>(axis)];
        const double step = std::abs(h_b(axis) - last(axis));
        if (step == 0) {
          its.repetitions += h_b == last ? 0 : 1;
          const double across_rad = noise_rad * std::sqrt(std::max(1 - h_b(axis) * h_b(axis), 0.0));
          its.stuck = its.stuck || (its.repetitions >= kRepetitions && its.finest_step < kResolvedPart * across_rad &&
                                    motion.norm() * to_seconds(t - its.since) > kSigmasMoved * noise_rad);
          continue;
        }
        if (step > kRounding) {
          its.finest_step = std::min(its.finest_step, step);
        }
        its.repetitions = 0;
        its.stuck = false;
        its.since = t;
      }
    }
    /// A single reading that is off is left to those who compare it with its neighbours. Readings that have leapt are
    /// used again once they leap back.
    void look_for_leap(const Eigen::Vector3d& h_b, Time t, Time last_t) {
      if (!nearly_unit(h_b.norm()) || !nearly_unit(last.norm())) {
        return;
      }
      const bool leaps = !stuck && t - last_t <= kLongestStep && is_beyond_reach(last, h_b, t - last_t);
      if (leap.proven) {
        leap.proven = !leaps && t - leap.from < kLeapTime;
      } else if (leap.suspected) {
        leap.proven = is_beyond_reach(leap.before, h_b, 2 * std::min(t - leap.from, kLongestStep));
        leap.suspected = false;
      } else if (leaps && leap.steps_without >= kStepsToLeap) {
        leap = {.suspected = true, .before = last, .from = t};
      }
      leap.steps_without = leaps ? 0 : std::min(leap.steps_without + 1, kStepsToLeap);
      leap.until = leap.proven ? t : leap.until;
    }
    [[nodiscard]] static bool is_beyond_reach(const Eigen::Vector3d& from, const Eigen::Vector3d& to, Duration time) {
      return (to - from).norm() > kLargestJolt_rad + kLargestTurn_rad_s * to_seconds(time);
    }
    void decide_whether_stuck(Time t) {
      stuck = alike > 1 && ((alike >= kStuckSamples && t - since >= kStuckTime) || has_stopped(t));
      Time begin = stuck ? since : t;
      for (const Component& component : components) {
        stuck = stuck || component.stuck;
        begin = component.stuck ? std::min(begin, component.since) : begin;
      }
      if (stuck) {
        if (!(stuck_from <= begin && begin - stuck_until <= kMemory)) {
          stuck_from = begin;
        }
        stuck_until = t;
      }
    }
    [[nodiscard]] bool is_dead_within(Time from, Time to) const {
      return (stuck_from <= to && from <= stuck_until) || (leap.from <= to && from <= leap.until);
    }
    [[nodiscard]] bool has_stopped(Time t) const {
      return steps == kStepsOfMotion && last.allFinite() &&
             motion.norm() * to_seconds(t - since) > kStepsMissing * jitter;
    }
  };

  int gyros_ = 0;
  PerGyro<double, kGyros> readout_noise_rad_{};
  Time last_t_{};
  PerGyro<Readings, kGyros> readings_;
  GyroMask selected_{};
  GyroMask isolated_{};
  int suspect_ = kNoGyro;
  int verdicts_ = 0;
};

}  // namespace trihedron
