#pragma once
/// Drift that no model of an estimator contains: a feature too sharp for harmonics of low degree, dependence on the
/// history of the motion, and coefficients that follow something else than the direction.

#include <functional>

#include "trihedron/core/drift.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::sim {

/// A sharp feature on the sphere of directions in case axes, as from a blemish of one electrode that acts while the
/// spin axis points near to it: ω = −∇ₛW + h × ∇ₛW (conservative and dissipative in equal parts) of a bump
/// W ∝ (1 − u)³, u = (1 − c·h)/(1 − cos radius), inside the radius round its centre c and nothing outside it. Two times
/// differentiable at its edge, and across h everywhere.
class DriftBump {
 public:
  /// amplitude_rad_s: the largest |ω|. centre: of any length but 0. 0 < radius_rad ≤ π/2. Throws std::invalid_argument.
  DriftBump(double amplitude_rad_s, const Vector3<double>& centre, double radius_rad);

  /// ω_b(h), rad/s. h: unit.
  [[nodiscard]] Vector3<double> rate(const Vector3<double>& h) const {
    const double inside = 1 - (1 - centre_.dot(h)) / depth_;
    if (inside <= 0) {
      return Vector3<double>::Zero();
    }
    const Vector3<double> along = scale_rad_s_ * inside * inside * (centre_ - h * h.dot(centre_));
    return h.cross(along) - along;
  }
  [[nodiscard]] const Vector3<double>& centre() const { return centre_; }

 private:
  Vector3<double> centre_;
  double depth_;  ///< 1 − cos radius
  double scale_rad_s_;
};

/// Drift that depends on the side from which a direction was reached, as polarised insulators and worn-in electrodes
/// give it: a second direction g follows h at a distance of at most the width, like a load on a slack rope (the play
/// operator of hysteresis, which does not depend on the speed), and ω = −amplitude P_h g / sin width points from g to
/// h. It is odd in the motion, so its part in the span of eq. (1), over the sphere and all sides, is zero.
class DriftHysteresis {
 public:
  /// 0 < width_rad ≤ π/2, or std::invalid_argument.
  DriftHysteresis(double amplitude_rad_s, double width_rad);

  /// The momentum has come to h in case axes; the first call says where it starts. h: unit.
  void move_to(const Vector3<double>& h);

  /// ω_b(h), rad/s, across h; not larger than the amplitude when the follower has been moved to h. h: unit.
  [[nodiscard]] Vector3<double> rate(const Vector3<double>& h) const {
    return scale_rad_s_ * (h * h.dot(follower_) - follower_);
  }

 private:
  double width_rad_;
  double scale_rad_s_;
  Vector3<double> follower_{0, 0, 0};
};

/// Relative change of all coefficients of eq. (1) in time, by what a scenario switches on:
/// after slews (heat of the suspension's currents), with the rotor's polhode (its patches face the electrodes in turn),
/// with day and night of the orbit (temperature).
class DriftModulation {
 public:
  /// phase_rad: of the polhode at the start.
  DriftModulation(const DriftScenario& scenario, double phase_rad) : scenario_(scenario), phase_rad_(phase_rad) {}

  /// What a step of the flight tells.
  struct Flight {
    double body_rate_rad_s = 0;
    bool sunlit = false;
  };
  /// Moves on to the step that begins at t_s, as flown in the one before.
  void next_step(double t_s, double step_s, const Flight& flight);

  /// Fraction that is added to the coefficients now.
  [[nodiscard]] double now() const { return now_; }
  /// Its mean over the steps so far, but for the polhode, which comes back about 0 as often as the flight lasts; 0
  /// before the first.
  [[nodiscard]] double mean() const { return time_s_ > 0 ? sum_s_ / time_s_ : 0; }

  /// A body that turns faster slews: twice the rate of a low orbit.
  static constexpr double kSlewRate_rad_s = 2.2e-3;

 private:
  DriftScenario scenario_;
  double phase_rad_;
  double since_slew_ = 0;  ///< 1 in a slew, from there decaying to 0
  double warmth_ = 0.5;    ///< 0 … 1: in the shadow, in the light for ever
  double now_ = 0;
  double sum_s_ = 0;
  double time_s_ = 0;
};

/// Coefficients of the part of a drift field, rad/s, in the span of eq. (1): least squares over the sphere of the
/// components across h, by a product rule that is exact for fields of degree up to 40.
[[nodiscard]] Esg7::Coefficients<double> part_in_eq1(
    const std::function<Vector3<double>(const Vector3<double>&)>& rate_rad_s);

}  // namespace trihedron::sim
