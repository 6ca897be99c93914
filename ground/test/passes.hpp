#pragma once
/// Simulated passes that several tests look at, and what they ask of a calibration.

#include <vector>

#include "trihedron/core/frames.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
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

/// Another flight with the gyros of this one, that much later.
inline Scenario with_gyros_of(const Truth& truth, Scenario scenario, Duration later) {
  scenario.epoch += later;
  for (std::size_t k = 0; k < scenario.gyros.size(); ++k) {
    auto& kappa = scenario.gyros[k].drift.kappa_rad_s.emplace();
    for (std::size_t i = 0; i < kappa.size(); ++i) {
      kappa[i] = truth.gyros[k].drift_rad_s[i].second;
    }
    scenario.gyros[k].misalignment_rad = truth.gyros[k].alignment_rotation_vector_rad;
  }
  return scenario;
}

inline const sim::SimulatedPass& two_hours() {
  static const sim::SimulatedPass simulated = sim::simulate(scenario_in_eq1(5, std::chrono::hours(2)));
  return simulated;
}

/// The gyros as the simulator made them, with their momenta at this row of the truth.
inline std::vector<GyroCalibration> true_gyros(const Truth& truth, std::size_t row) {
  std::vector<GyroCalibration> gyros;
  for (std::size_t k = 0; k < truth.gyros.size(); ++k) {
    const double* h = &truth.h_in[(row * truth.gyros.size() + k) * 3];
    GyroCalibration& gyro = gyros.emplace_back();
    for (const auto& [coefficient, value] : truth.gyros[k].drift_rad_s) {
      gyro.drift_rad_s.push_back(value);
    }
    gyro.alignment_rotation_vector_rad = truth.gyros[k].alignment_rotation_vector_rad;
    gyro.momentum_in = {h[0], h[1], h[2]};
  }
  return gyros;
}

/// Nothing left to decide, which takes runs of its own.
inline CalibrationOptions told() {
  CalibrationOptions options;
  options.drift_model = kEsg7;
  options.find_noise = false;
  options.further_states = FurtherStateOptions::none();
  return options;
}

/// That of one gyro in estimate_minus_truth(): δ, rad, c axes.
inline Eigen::Vector3d alignment_error(const Calibration& calibration, const Truth& truth, std::size_t gyro) {
  const Eigen::VectorXd errors = estimate_minus_truth(calibration, truth);
  return errors(rows_of(calibration, {ParameterId::alignment(gyro, 0), ParameterId::alignment(gyro, 1),
                                      ParameterId::alignment(gyro, 2)}));
}

/// eᵀP⁻¹e of eq. (1) and the alignments, whatever else the drift model holds; χ² of 20 for a pair.
inline double nees_of(const Truth& truth, const Calibration& calibration) {
  const auto rows = rows_of(calibration, drift_and_alignment(kEsg7, calibration.gyros.size()));
  const Eigen::VectorXd errors = estimate_minus_truth(calibration, truth)(rows);
  return normalised_square(errors, calibration.covariance(rows, rows));
}

}  // namespace trihedron::ground
