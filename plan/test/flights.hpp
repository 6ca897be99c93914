#pragma once

#include "trihedron/records/options.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::plan {

/// Eighty minutes without a slew, all drift in eq. (1), both momenta near the orbit plane.
inline Scenario steady_flight() {
  Scenario scenario;
  scenario.seed = 2;
  scenario.duration = std::chrono::minutes(80);
  scenario.attitude.slews = std::vector<Slew>{};
  scenario.gyros[0].start_direction_c = {0.995, 0.085, 0.043};
  scenario.gyros[1].start_direction_c = {0.050, 0.124, 0.991};
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.outside_sigma_rad_s = 0;
  }
  return scenario;
}

/// Nothing left to decide, which takes runs of its own.
inline CalibrationOptions told() {
  CalibrationOptions options;
  options.drift_model = kEsg7;
  options.find_noise = false;
  options.further_states = FurtherStateOptions::none();
  return options;
}

}  // namespace trihedron::plan
