#include "forecasts/flight.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "trihedron/core/frames.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/ground/evaluate/open_loop.hpp"
#include "trihedron/ground/evaluate/open_loop_forecast.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::forecasts {
namespace {

GyroMask pair() {
  GyroMask used{};
  used[0] = used[1] = true;
  return used;
}

/// The first part of a pass.
Pass first_part(const Pass& pass, Duration length) {
  Pass part = pass;
  const Time end = pass.settings.epoch + length;
  part.settings.duration = length;
  const auto samples = static_cast<std::size_t>(std::ranges::upper_bound(part.gyro.t, end) - part.gyro.t.begin());
  part.gyro.t.resize(samples);
  part.gyro.h.resize(samples * 3 * static_cast<std::size_t>(part.gyro.gyros));
  const auto fixes =
      static_cast<std::size_t>(std::ranges::upper_bound(part.star_tracker.t, end) - part.star_tracker.t.begin());
  part.star_tracker.t.resize(fixes);
  part.star_tracker.q_in_c.resize(fixes);
  return part;
}

}  // namespace

std::vector<World> worlds() {
  const auto of_each_gyro = [](const auto& change) {
    Scenario scenario;
    for (GyroScenario& gyro : scenario.gyros) {
      gyro.drift.outside_sigma_rad_s = 0;
      change(gyro.drift);
    }
    return scenario;
  };
  const auto high_degree = [](DriftScenario& drift) {
    using Potential = DriftHarmonic::Potential;
    drift.harmonics = {{Potential::kW, 1, 1, 3e-8},
                       {Potential::kD, 3, 2, 2e-8},
                       {Potential::kD, 4, 3, 2e-8},
                       {Potential::kW, 6, -2, 1e-8}};
  };
  Scenario steady = of_each_gyro([](DriftScenario&) {});
  steady.attitude.slews = std::vector<Slew>{};
  return {{"nominal", 1, of_each_gyro([](DriftScenario&) {})},
          {"steady", 2, steady},
          {"outside", 3, of_each_gyro([](DriftScenario& drift) { drift.outside_sigma_rad_s = 1e-8; })},
          {"walk", 4, of_each_gyro([](DriftScenario& drift) { drift.direction_walk_rad_sqrt_s = 5e-8; })},
          {"wandering", 5, of_each_gyro([](DriftScenario& drift) { drift.markov_sigma_rad_s = 3e-8; })},
          {"high-degree", 6, of_each_gyro(high_degree)}};
}

std::vector<Forecast> fly(const World& world, int run_number, const Flight& flight, const CalibrationOptions& options) {
  constexpr Duration kBeyond = std::chrono::minutes(1);  // for the mean about the last forecast
  Scenario scenario = world.scenario;
  scenario.seed = static_cast<std::uint64_t>(world.number) * 1'000'000 + static_cast<std::uint64_t>(run_number);
  scenario.duration = flight.calibrated + flight.after.back() + kBeyond;
  const sim::SimulatedPass flown = sim::simulate(scenario);
  const Pass calibrated = first_part(flown.pass, flight.calibrated);
  const CalibrationRun run = ground::calibrate(calibrated, options);
  const ground::AttitudeRule rule = ground::attitude_rule_of(options.estimator);
  const ground::BodyMotion as_flown(flown.truth.t, flown.truth.q_in_c);
  const ground::BodyMotion as_known(run.attitude.t, run.attitude.q_in_c);

  std::vector<Forecast> found;
  const auto add = [&](Time t, const std::vector<GyroCalibration>& gyros, OpenLoopStart errors) {
    const ground::AttitudeErrors open_loop = ground::attitude_errors(
        ground::fly_open_loop(flown.pass, t, gyros, flown.truth.t, rule), flown.truth.t, flown.truth.q_in_c);
    for (int k = 0; k < errors.layout.gyros; ++k) {
      errors.readout_noise_rad[k] /= std::sqrt(static_cast<double>(kAveraged));
    }
    const auto predicted = [&](const ground::BodyMotion& motion) {
      return ground::predicted_errors({errors, gyros, t, motion, rule, pair()}, flight.after);
    };
    const std::vector<PredictedError> of_flown = predicted(as_flown);
    const std::vector<PredictedError> of_known = predicted(as_known);
    for (std::size_t i = 0; i < flight.after.size(); ++i) {
      const auto middle = std::ranges::lower_bound(open_loop.t, t + flight.after[i]) - open_loop.t.begin();
      const auto first = static_cast<std::size_t>(middle - kAveraged / 2);
      if (first + kAveraged > open_loop.error_rad.size()) {
        continue;
      }
      Eigen::Vector3d error = Eigen::Vector3d::Zero();
      for (std::size_t epoch = first; epoch < first + kAveraged; ++epoch) {
        error += open_loop.error_rad[epoch] / kAveraged;
      }
      const Eigen::Matrix3d& covariance = of_flown[i].covariance_rad2;
      Forecast& forecast = found.emplace_back();
      forecast.corrected_min = to_seconds(t - run.calibration.epoch) / 60;
      forecast.after_min = to_seconds(flight.after[i]) / 60;
      forecast.square = error.dot(covariance.llt().solve(error));
      forecast.in_sigmas = error.cwiseQuotient(covariance.diagonal().cwiseSqrt());
      forecast.error_rad = error.norm();
      forecast.error_997_rad = of_flown[i].error_997_rad;
      forecast.error_997_continued_rad = of_known[i].error_997_rad;
    }
  };
  for (std::size_t i = 1; i < run.corrections.size() && options.estimator != Estimator::kBatch; ++i) {
    const Correction& correction = run.corrections[i];
    if (correction.t + std::chrono::minutes(60) < calibrated.gyro.t.back()) {
      add(correction.t, correction.calibrated, correction.errors);
    }
  }
  add(run.calibration.t, run.calibration.gyros, run.errors);
  return found;
}

}  // namespace trihedron::forecasts
