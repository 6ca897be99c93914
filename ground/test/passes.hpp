#pragma once
/// Simulated passes that several tests look at, and what they ask of a calibration.

#include "trihedron/core/frames.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {

/// The paper's experiment, all drift in eq. (1).
inline Scenario scenario_in_eq1(std::uint64_t seed, Duration duration) {
  Scenario scenario;
  scenario.seed = seed;
  scenario.duration = duration;
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.outside_sigma_rad_s = 0;
  }
  return scenario;
}

inline const sim::SimulatedPass& two_hours() {
  static const sim::SimulatedPass simulated = sim::simulate(scenario_in_eq1(5, std::chrono::hours(2)));
  return simulated;
}

/// Nothing left to decide, which takes runs of its own.
inline CalibrationOptions told() {
  CalibrationOptions options;
  options.drift_model = "esg7";
  options.find_noise = false;
  FurtherStateOptions& states = options.further_states;
  states.clock_offset = states.orbital_error = states.wandering_drift = states.readout_bias =
      FurtherStateOptions::Choice::kOff;
  return options;
}

/// δ, rad, c axes.
inline Eigen::Vector3d alignment_error(const Truth::Gyro& truth, const GyroCalibration& estimate) {
  return (Rot<C, B<1>>::exp(Vec<C>::assume(truth.alignment_rotation_vector_rad)) *
          Rot<C, B<1>>::exp(Vec<C>::assume(estimate.alignment_rotation_vector_rad)).inverse())
      .log()
      .raw();
}

}  // namespace trihedron::ground
