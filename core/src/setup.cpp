#include "trihedron/core/setup.hpp"

#include <algorithm>
#include <cmath>

#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/elementary.hpp"
#include "trihedron/core/fix_report.hpp"

namespace trihedron {

namespace {

bool positive(double value) { return value > 0 && std::isfinite(value); }

bool is_rotation(const Eigen::Matrix3d& C) { return (C * C.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-6; }

bool is_usable(const StarTrackerSetup& its) {
  return (its.noise_rad.array() > 0).all() && its.noise_rad.allFinite() && is_rotation(its.C_c_s);
}

bool is_usable(const CourseOfChange& change) {
  return positive(change.duration_s) && (change.kind == CourseOfChange::Kind::kEven || positive(change.time_s));
}

bool is_usable(const Polhode& polhode) {
  return positive(static_cast<double>(polhode.period_s)) && std::isfinite(polhode.period_rate);
}

bool noise_is_usable(const CalibrationSetup& setup) {
  for (int k = 0; k < setup.layout.gyros; ++k) {
    if (!(setup.readout_noise_rad[k] > 0 && setup.readout_noise_rad[k] < 1)) {
      return false;
    }
  }
  for (int head = 0; head < setup.layout.star_trackers; ++head) {
    if (!is_usable(setup.star_trackers[static_cast<std::size_t>(head)])) {
      return false;
    }
  }
  const double walk = setup.direction_random_walk_rad_sqrt_s;
  return walk >= 0 && std::isfinite(walk) && setup.gyro_period > Duration::zero() &&
         setup.gyro_period <= CalibrationSetup::kLongestGyroPeriod;
}

bool further_states_are_usable(const CalibrationSetup& setup) {
  const FurtherStates& further = setup.layout.further;
  const GaussMarkov& wandering = setup.wandering_drift;
  if ((further.wandering_drift && !(positive(wandering.sigma) && positive(wandering.time_s))) ||
      (further.coefficient_change && !is_usable(setup.change)) ||
      ((further.orbital_error || further.orbital_drift) && !std::isfinite(setup.orbital_rate_rad_s))) {
    return false;
  }
  for (int k = 0; further.polhode && k < setup.layout.gyros; ++k) {
    if (!is_usable(setup.polhodes[k])) {
      return false;
    }
  }
  for (int state = setup.layout.behind_parameters(); state < setup.layout.size(); ++state) {
    if (!positive(prior_sigma_of_further_state(setup, state))) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::optional<SetupFault> CalibrationSetup::fault() const {
  if (!noise_is_usable(*this)) {
    return SetupFault::kNoiseNotPositive;
  }
  if (!(gate_nis > 0) || !(student_t_freedom >= 0 && std::isfinite(student_t_freedom)) ||
      !(reopen_after_rejections > 0) || !(reopen_after_jump_rejections > 0)) {
    return SetupFault::kGateNotPositive;
  }
  if (!further_states_are_usable(*this)) {
    return SetupFault::kPriorNotPositiveDefinite;
  }
  return std::nullopt;
}

Duration max_interpolation(Duration gyro_period) {
  constexpr Duration kLeast = std::chrono::milliseconds(500);
  return std::max(kLeast, gyro_period * 5 / 2);
}

DriftTimes CalibrationSetup::drift_times(Time t) const {
  DriftTime common;
  if (layout.further.coefficient_change) {
    common.part_of_change = part_of_change(t);
  }
  if (layout.further.orbital_drift) {
    const double phase = orbital_rate_rad_s * to_seconds(t - orbital_phase_zero);
    common.orbital_sine = elementary::sin(phase);
    common.orbital_cosine = elementary::cos(phase);
  }
  DriftTimes times;
  for (int k = 0; k < layout.gyros; ++k) {
    times[k] = common;
    if (layout.further.polhode) {
      const double angle = polhodes[k].angle_rad(to_seconds(t - orbital_phase_zero));
      times[k].polhode_sine = elementary::sin(angle);
      times[k].polhode_cosine = elementary::cos(angle);
    }
  }
  return times;
}

Duration CalibrationSetup::reach() const {
  constexpr Duration kLeast = std::chrono::milliseconds(1400);
  constexpr int kCubic = 3;
  return std::max(kLeast, gyro_period * (DirectionsFit::least_samples(kCubic) / 2));
}

Duration CalibrationSetup::recent() const {
  constexpr Duration kLeast = std::chrono::milliseconds(2500);
  constexpr int kQuadratic = 2;
  return std::max(kLeast, gyro_period * DirectionsFit::least_samples(kQuadratic));
}

double CalibrationSetup::fixes_sharing_a_sample(Duration since_the_last_fix) const {
  // In the middle of its samples a cubic has 9/4 of the variance of their mean, for being so little sensitive to those
  // far from it.
  constexpr double kOfMean = 9.0 / 4;
  return std::max(layout.star_trackers * 2 * to_seconds(reach()) / (kOfMean * to_seconds(since_the_last_fix)), 1.0);
}

double prior_sigma_of_further_state(const CalibrationSetup& setup, int state) {
  const Layout& layout = setup.layout;
  for (const FurtherStateKind& kind : kFurtherStateKinds) {
    const Layout::Owners owners = layout.owners(kind.state);
    for (int owner = owners.begin; layout.has(kind.state) && owner < owners.end; ++owner) {
      const int first = layout.first(kind.state, owner);
      if (first <= state && state < first + kind.size) {
        return kind.state == FurtherState::kStarTrackerAlignment
                   ? setup.star_trackers[static_cast<std::size_t>(owner)].alignment_sigma_rad
                   : setup.further_sigma[kind.state];
      }
    }
  }
  return 0;
}

double student_t_weight(double freedom, double nis, int components) {
  return freedom > 0 ? std::min((freedom + components) / (freedom + nis), 1.0) : 1.0;
}

}  // namespace trihedron
