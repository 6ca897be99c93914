#pragma once
/// Detection of a star tracker that repeats its last quaternion with new time stamps.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/measurement.hpp"
#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/setup.hpp"

namespace trihedron {

/// Whether a momentum that was read as `before_c` and is read as `now_c`, c axes, shows that the body has turned by
/// more than two fixes of the same quaternion can differ. `R_c`: covariance of the noise of one fix, c axes, rad²;
/// `reading_rad`: 1-sigma of the difference of the two readings, with the drift between them; `gate`: limit of the
/// squared difference in sigmas, of two degrees of freedom.
[[nodiscard]] bool shows_turn(const Eigen::Vector3d& before_c, const Eigen::Vector3d& now_c, const Eigen::Matrix3d& R_c,
                              double reading_rad, double gate);

/// For each star tracker its last quaternion, and what the gyros read when it was new. A quaternion that is repeated
/// exactly, up to its sign, while the readings show that the body has turned, is frozen, and so are its repetitions up
/// to the next one that differs. On a body at rest coarsely rounded quaternions repeat and are not frozen.
template <int kStarTrackers, int kGyros>
class FrozenFixes {
 public:
  FrozenFixes() = default;
  /// `drift_rad_s`: how fast a momentum may drift in inertial space, 1-sigma.
  explicit FrozenFixes(double drift_rad_s) : drift_rad_s_(drift_rad_s) {}

  /// Takes the next fix, in the order of their times, with the readings at its time; whether it is frozen. `gyros`:
  /// their estimates, for the directions of their cases.
  template <class Gyros>
  [[nodiscard]] bool look_at(const StarFix& fix, const FixReadings& readings, const CalibrationSetup& setup,
                             const Gyros& gyros) {
    Last& last = last_[static_cast<std::size_t>(fix.head)];
    const auto is_same = [&](double sign) {
      const auto* const q = fix.q_in_c.coeffs().data();
      return std::equal(last.q_in_c.begin(), last.q_in_c.end(), q, [&](double a, double b) { return a == sign * b; });
    };
    if (last.state == State::kNone || !(is_same(1) || is_same(-1))) {
      last.state = State::kFresh;
      last.t = fix.t;
      last.used = readings.used;
      std::copy_n(fix.q_in_c.coeffs().data(), last.q_in_c.size(), last.q_in_c.begin());
      std::copy_n(readings.h_b.begin(), kGyros, last.h_b.begin());
    } else if (last.state == State::kFresh && has_turned(last, fix, readings, setup, gyros)) {
      last.state = State::kFrozen;
    }
    return last.state == State::kFrozen;
  }

  void forget() { last_ = {}; }

  /// The clock has been set back by −shift.
  void set_clock(Duration shift) {
    for (Last& last : last_) {
      last.t = shifted(last.t, shift);
    }
  }

 private:
  enum class State : std::uint8_t { kNone, kFresh, kFrozen };
  struct Last {
    std::array<double, 4> q_in_c{};
    PerGyro<Eigen::Vector3d, kGyros> h_b;  ///< when the quaternion was new
    Time t{};                              ///< the same
    GyroMask used{};                       ///< of h_b
    State state = State::kNone;
  };

  template <class Gyros>
  [[nodiscard]] bool has_turned(const Last& last, const StarFix& fix, const FixReadings& readings,
                                const CalibrationSetup& setup, const Gyros& gyros) const {
    const Eigen::Matrix3d R_c = fix_noise(setup, fix);
    const double drift_rad = drift_rad_s_ * to_seconds(fix.t - last.t);
    const GyroMask used = both(last.used, readings.used);
    for (int k = 0; k < setup.layout.gyros; ++k) {
      const double readout_rad = setup.readout_noise_rad[k];
      const double reading_rad = std::sqrt(2 * readout_rad * readout_rad + drift_rad * drift_rad);
      if (used[k] &&
          shows_turn(gyros[k].in_c(last.h_b[k]), gyros[k].in_c(readings.h_b[k]), R_c, reading_rad, setup.gate_nis)) {
        return true;
      }
    }
    return false;
  }

  double drift_rad_s_ = 0;
  std::array<Last, static_cast<std::size_t>(kStarTrackers)> last_{};
};

}  // namespace trihedron
