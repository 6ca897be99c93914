#pragma once
/// One gyro: the momentum that precesses in inertial space, and its readout in case axes.

#include <optional>
#include <span>
#include <vector>

#include "trihedron/core/drift.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/scenario.hpp"
#include "trihedron/sim/event.hpp"
#include "trihedron/sim/harmonics.hpp"
#include "trihedron/sim/random.hpp"
#include "trihedron/sim/unmodelled.hpp"

namespace trihedron::sim {

/// Case axes of the gyro that is being simulated; here its number does not matter.
using Case = B<0>;

/// Drift of one gyro: ω_b as a function of the direction of the momentum in case axes, with its changes in time. Random
/// parts are drawn at the start of each step and constant over it.
class Drift {
 public:
  /// Throws std::invalid_argument for a harmonic that does not exist.
  Drift(const DriftScenario& scenario, std::uint64_t seed, std::uint64_t gyro);

  /// Moves on to the step that begins at t_s and lasts step_s: draws its random parts. h: unit, at its beginning.
  void next_step(double t_s, double step_s, const Vec<Case>& h = {}, const DriftModulation::Flight& flight = {});

  /// ω_b(h), rad/s, during the step. h: unit.
  [[nodiscard]] Vec<Case> rate(const Vec<Case>& h) const {
    Vector3<double> rate = Esg7::rate<double>(h.raw(), kappa_now_rad_s_) + field_.rate<double>(h.raw()) + markov_rad_s_;
    if (bump_) {
      rate += bump_->rate(h.raw());
    }
    if (hysteresis_) {
      rate += hysteresis_->rate(h.raw());
    }
    return Vec<Case>::assume(rate);
  }
  /// Whether it is more than eq. (1) with kappa_rad_s().
  [[nodiscard]] bool has_outside_eq1() const {
    return !field_.members().empty() || scenario_.markov_sigma_rad_s > 0 || bump_ || hysteresis_;
  }
  /// The random rotation that the momentum takes during the step beside its drift, rad, if there is one.
  [[nodiscard]] const std::optional<Vec<Case>>& walk() const { return walk_rad_; }

  /// κ of eq. (1) as it is now, rad/s.
  [[nodiscard]] const Esg7::Coefficients<double>& kappa_rad_s() const { return kappa_now_rad_s_; }
  /// The part of the drift in the span of eq. (1), rad/s: by least squares over the sphere, of what is modulated over
  /// the time so far, too; of what walks, warms up or jumps as it is now.
  [[nodiscard]] Esg7::Coefficients<double> part_in_eq1_rad_s() const;
  [[nodiscard]] const HarmonicField& outside() const { return field_; }
  [[nodiscard]] const Vector3<double>& markov_rad_s() const { return markov_rad_s_; }
  [[nodiscard]] const std::optional<DriftBump>& bump() const { return bump_; }
  /// Whether the flight changes it, so that next_step() has to be told of it.
  [[nodiscard]] bool is_modulated() const { return modulation_.has_value(); }

 private:
  DriftScenario scenario_;
  Esg7::Coefficients<double> kappa_rad_s_;  ///< without warm-up and modulation
  Esg7::Coefficients<double> kappa_now_rad_s_;
  HarmonicField field_;
  std::optional<DriftBump> bump_;
  std::optional<DriftHysteresis> hysteresis_;
  std::optional<DriftModulation> modulation_;
  bool has_jumped_ = false;
  double warm_up_ = 0;  ///< fraction now
  Vector3<double> markov_rad_s_ = Vector3<double>::Zero();
  std::optional<Vec<Case>> walk_rad_;
  Stream coefficient_random_;
  Stream walk_random_;
  Stream markov_random_;
  Stream jump_random_;
};

/// The readout of one gyro: scale error, bias, noise, quantisation and faults between the true direction and telemetry.
class Readout {
 public:
  Readout(const ReadoutScenario& scenario, Duration sample_period, std::uint64_t seed, int gyro);

  /// Direction cosines as telemetered; NaN when dropped. Faults are appended to `events`.
  [[nodiscard]] Eigen::Vector3d read(Time t, const Vec<Case>& h, std::vector<Event>& events);

 private:
  ReadoutScenario scenario_;
  int gyro_;
  int stuck_samples_;
  int stuck_left_ = 0;
  Eigen::Vector3d last_{0, 0, 0};
  Stream noise_;
  Stream dropout_;
  Stream spike_;
  Stream stuck_;
};

/// One gyro in flight: its momentum turns by its drift as the body turns about it.
class Gyro {
 public:
  /// At the start of the pass, with the body at C_in_c. Throws std::invalid_argument for a start direction of no
  /// length.
  Gyro(const GyroScenario& scenario, const Rot<In, C>& C_in_c, std::uint64_t seed, int gyro);

  /// Integrates over one step that begins at t_s, from where the last one ended; C_in_c in its middle and at its end.
  /// sunlit: whether the Sun shines on the spacecraft.
  void advance(double t_s, double step_s, const Rot<In, C>& middle, const Rot<In, C>& end, bool sunlit = false);
  /// The same of all of a pass, two at a time, to the same bits.
  static void advance_all(std::span<Gyro> gyros, double t_s, double step_s, const Rot<In, C>& middle,
                          const Rot<In, C>& end, bool sunlit);

  [[nodiscard]] const Vec<In>& momentum() const { return h_in_; }
  [[nodiscard]] Vec<Case> momentum_in_case() const { return h_b_; }
  /// The same in the case of a body that stands at C_in_c.
  [[nodiscard]] Vec<Case> momentum_in_case(const Rot<In, C>& C_in_c) const {
    return (C_in_c * C_c_b_).inverse() * h_in_;
  }
  [[nodiscard]] const Rot<C, Case>& alignment() const { return C_c_b_; }
  [[nodiscard]] const Drift& drift() const { return drift_; }
  /// Coefficients by Drift::part_in_eq1_rad_s(), alignment as it is now.
  [[nodiscard]] Truth::Gyro truth() const;

 private:
  /// What changes at the beginning of a step.
  void begin_step(double t_s, double step_s, const Rot<In, C>& end, bool sunlit);
  /// The step of as many gyros as a scalar holds.
  template <class S>
  static void turn(std::span<Gyro> gyros, double step_s, const Rot<In, C>& middle, const Rot<In, C>& end);

  Drift drift_;
  MountingChange mounting_change_;
  Rot<C, Case> C_c_b_at_start_;
  Rot<C, Case> C_c_b_;
  Rot<In, Case> C_in_b_;  ///< where the last step ended
  Vec<In> h_in_;
  Vec<Case> h_b_;  ///< the same in case axes
};

}  // namespace trihedron::sim
