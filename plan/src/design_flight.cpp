#include "design_flight.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/ground/observe/observe.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::plan {
namespace {

/// Fixes that one stands for.
constexpr int kGroup = 4;
/// Between samples.
constexpr Duration kLongestPeriod = std::chrono::seconds(1);
/// 1-sigma of the mean of a group over that of one.
constexpr double kNoiseOfGroup = 0.5;

/// 1-sigma of the direction that is fitted through the readings around a fix, as on board, over that of one reading.
double noise_of_fitted_reading(Duration gyro_period) {
  CalibrationSetup setup;
  setup.gyro_period = gyro_period;
  const auto reach = static_cast<int>(setup.reach() / gyro_period);
  constexpr int kCubic = 3;
  DirectionsFit fit(Time{}, Time{-reach * gyro_period}, Time{reach * gyro_period}, 2 * reach + 1, kCubic, 1);
  Directions h_b;
  h_b[0] = Eigen::Vector3d::UnitX();
  for (int i = -reach; i <= reach; ++i) {
    fit.add(Time{i * gyro_period}, h_b);
  }
  return fit.solve().noise_factor;
}

StarTrackerScenario without_errors(const StarTrackerScenario& head) {
  StarTrackerScenario exact;
  exact.mounting_rotation_vector_rad = head.mounting_rotation_vector_rad;
  exact.alignment_prior_sigma_rad = head.alignment_prior_sigma_rad;
  exact.noise_rad.setZero();
  exact.sun_exclusion_rad = head.sun_exclusion_rad;
  exact.earth_exclusion_rad = head.earth_exclusion_rad;
  exact.max_rate_rad_s = head.max_rate_rad_s;
  exact.outages = head.outages;
  return exact;
}

GyroScenario without_errors(const GyroScenario& gyro) {
  GyroScenario exact = gyro;
  exact.misalignment_rad = Eigen::Vector3d::Zero();
  exact.drift = {};
  exact.drift.kappa_rad_s.emplace().fill(0);
  exact.drift.outside_sigma_rad_s = 0;
  exact.drift.prior_sigma_rad_s = gyro.drift.prior_sigma_rad_s;
  exact.readout = {};
  exact.readout.noise_rad = 0;
  return exact;
}

}  // namespace

DesignFlight::DesignFlight(const Scenario& scenario, const CalibrationOptions& options)
    : scenario_(scenario), options_(options) {
  const double of_readings = kNoiseOfGroup * noise_of_fitted_reading(scenario.gyro_period);
  for (GyroScenario& gyro : scenario_.gyros) {
    readout_noise_rad_.push_back(of_readings * gyro.readout.noise_rad);
    gyro = without_errors(gyro);
  }
  fix_noise_rad_.emplace_back(kNoiseOfGroup * scenario.star_tracker.noise_rad);
  scenario_.star_tracker = without_errors(scenario.star_tracker);
  for (StarTrackerScenario& head : scenario_.further_star_trackers) {
    fix_noise_rad_.emplace_back(kNoiseOfGroup * head.noise_rad);
    head = without_errors(head);
  }
  if (options_.star_tracker_noise_rad) {
    *options_.star_tracker_noise_rad *= kNoiseOfGroup;
  }
  scenario_.star_tracker_period *= kGroup;
  // A reading at each fix: in a slew another would be off by more than any noise.
  Duration::rep samples = std::max<Duration::rep>(kLongestPeriod / scenario.gyro_period, 1);
  while (samples > 1 && scenario_.star_tracker_period % (samples * scenario.gyro_period) != Duration::zero()) {
    --samples;
  }
  scenario_.gyro_period *= samples;
}

Eigen::MatrixXd DesignFlight::covariance_after(const std::vector<Slew>& slews) const {
  Scenario scenario = scenario_;
  scenario.attitude.slews = slews;
  Pass exact = sim::simulate(scenario).pass;
  for (std::size_t k = 0; k < readout_noise_rad_.size(); ++k) {
    exact.settings.gyros[k].readout_noise_rad = readout_noise_rad_[k];
  }
  exact.settings.star_tracker_noise_rad = fix_noise_rad_[0];
  for (std::size_t i = 1; i < fix_noise_rad_.size(); ++i) {
    exact.settings.further_star_trackers[i - 1].noise_rad = fix_noise_rad_[i];
  }
  return ground::predicted_covariance(exact, options_);
}

}  // namespace trihedron::plan
