#pragma once
/// Which gyros can be used, and over which times: detection of stuck readings and isolation of faulty gyros.

#include <Eigen/Core>
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
        its.alike = 1;
        its.since = sample.t;
        its.last = h_b;
      }
      its.stuck = its.alike >= kStuckSamples && sample.t - its.since >= kStuckTime;
      if (its.stuck) {
        if (!(its.stuck_from <= its.since && its.since - its.stuck_until <= kMemory)) {
          its.stuck_from = its.since;
        }
        its.stuck_until = sample.t;
      }
    }
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
      mask[k] = selected_[k] && !isolated_[k] && !(readings_[k].stuck_from <= to && from <= readings_[k].stuck_until);
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
      its.since = t;
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
  };

  int gyros_ = 0;
  PerGyro<Readings> readings_;
  GyroMask selected_{};
  GyroMask isolated_{};
  int suspect_ = kNoGyro;
  int verdicts_ = 0;
};

}  // namespace trihedron
