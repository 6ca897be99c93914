#pragma once
/// Which gyros are to be believed, and when.

#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/status.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// Readings that stand still, and verdicts at fixes that were rejected.
template <int N>
class GyroHealth {
 public:
  /// A live reading has noise: two alike may be chance or coarse telemetry, 2 s of them are not.
  static constexpr int kStuckSamples = 16;
  /// In a row, all naming the same gyro.
  static constexpr int kVerdicts = 5;
  /// Stuck times closer together than this are taken for one.
  static constexpr Duration kMemory = std::chrono::seconds(10);

  /// In the order of time.
  void look_at(const GyroSample<N>& sample) {
    for (int k = 0; k < N; ++k) {
      Readings& its = readings_[k];
      const Eigen::Vector3d& h_b = sample.h_b[k];
      if (its.alike > 0 && (h_b == its.last || (!h_b.allFinite() && !its.last.allFinite()))) {
        ++its.alike;
      } else {
        its.alike = 1;
        its.since = sample.t;
        its.last = h_b;
      }
      if (its.alike >= kStuckSamples) {
        if (!(its.stuck_from <= its.since && its.since - its.stuck_until <= kMemory)) {
          its.stuck_from = its.since;
        }
        its.stuck_until = sample.t;
      }
    }
  }

  /// A fix, or a look at the angles: `odd_gyro` alone does not agree with the rest, or it is kNoGyro.
  void judge(int odd_gyro) {
    verdicts_ = odd_gyro == suspect_ ? verdicts_ + 1 : 1;
    suspect_ = odd_gyro;
    if (suspect_ != kNoGyro && verdicts_ >= kVerdicts) {
      isolated_[suspect_] = true;
    }
  }

  /// Those whose readings can be used from `from` to `to`, both included.
  [[nodiscard]] GyroMask<N> usable(Time from, Time to) const {
    GyroMask<N> mask;
    for (int k = 0; k < N; ++k) {
      mask[k] = !isolated_[k] && !(readings_[k].stuck_from <= to && from <= readings_[k].stuck_until);
    }
    return mask;
  }

  [[nodiscard]] PerGyro<GyroState, N> states() const {
    PerGyro<GyroState, N> states;
    for (int k = 0; k < N; ++k) {
      states[k] = isolated_[k]                          ? GyroState::kIsolated
                  : readings_[k].alike >= kStuckSamples ? GyroState::kStuck
                                                        : GyroState::kUsed;
    }
    return states;
  }

  /// The clock has been set: `t` is now.
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
    Time since{};   ///< of the first of them
    Time stuck_from = Time::max();
    Time stuck_until = Time::min();
  };

  PerGyro<Readings, N> readings_;
  PerGyro<bool, N> isolated_{};
  int suspect_ = kNoGyro;
  int verdicts_ = 0;
};

}  // namespace trihedron
