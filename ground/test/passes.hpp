#pragma once
/// Simulated passes that several tests look at, and what they ask of a calibration.

#include <Eigen/Cholesky>

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
  options.further_states = FurtherStateOptions::none();
  return options;
}

/// δ, rad, c axes.
inline Eigen::Vector3d alignment_error(const Truth::Gyro& truth, const GyroCalibration& estimate) {
  return (Rot<C, B<1>>::exp(Vec<C>::assume(truth.alignment_rotation_vector_rad)) *
          Rot<C, B<1>>::exp(Vec<C>::assume(estimate.alignment_rotation_vector_rad)).inverse())
      .log()
      .raw();
}

/// Parameters' errors, in the order of Calibration::states.
inline Eigen::VectorXd errors_of(const Truth& truth, const Calibration& calibration) {
  Eigen::VectorXd errors(calibration.covariance.rows());
  const auto per_gyro = errors.size() / static_cast<Eigen::Index>(calibration.gyros.size());
  for (std::size_t k = 0; k < calibration.gyros.size(); ++k) {
    auto own = errors.segment(static_cast<Eigen::Index>(k) * per_gyro, per_gyro);
    for (std::size_t i = 0; i < calibration.gyros[k].drift_rad_s.size(); ++i) {
      own(static_cast<Eigen::Index>(i)) =
          truth.gyros[k].drift_rad_s[i].second - calibration.gyros[k].drift_rad_s[i].second;
    }
    own.tail<3>() = alignment_error(truth.gyros[k], calibration.gyros[k]);
  }
  return errors;
}

inline double nees_of(const Truth& truth, const Calibration& calibration) {
  const Eigen::VectorXd errors = errors_of(truth, calibration);
  return errors.dot(calibration.covariance.llt().solve(errors));
}

}  // namespace trihedron::ground
