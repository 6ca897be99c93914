#include "design_flight.hpp"

#include <cmath>

#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/invariant_estimator.hpp"
#include "trihedron/ground/observe/observe.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::plan {
namespace {

constexpr int kTogether = 4;
/// 1-sigma of four together over that of one.
constexpr double kLessNoise = 0.5;
using OnBoard = InvariantEstimator<Esg7, 2>;

/// 1-sigma of the readings round a fix, taken together as on board, over that of one.
double noise_of_readings_together(Duration gyro_period) {
  SampleBuffer<1, 512> samples;
  for (Time t{-(OnBoard::kReach / gyro_period) * gyro_period}; t <= Time{OnBoard::kReach}; t += gyro_period) {
    GyroSample<1> sample;
    sample.t = t;
    sample.h_b[0] = Eigen::Vector3d::UnitX();
    samples.push(sample);
  }
  constexpr int kCubic = 3;
  return fit_directions<1>(samples, 0, samples.size(), Time{}, kCubic).noise_factor;
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
  const double of_readings = kLessNoise * noise_of_readings_together(scenario.gyro_period);
  for (GyroScenario& gyro : scenario_.gyros) {
    readout_noise_rad_.push_back(of_readings * gyro.readout.noise_rad);
    gyro = without_errors(gyro);
  }
  fix_noise_rad_.emplace_back(kLessNoise * scenario.star_tracker.noise_rad);
  scenario_.star_tracker = without_errors(scenario.star_tracker);
  for (StarTrackerScenario& head : scenario_.further_star_trackers) {
    fix_noise_rad_.emplace_back(kLessNoise * head.noise_rad);
    head = without_errors(head);
  }
  if (options_.star_tracker_noise_rad) {
    *options_.star_tracker_noise_rad *= kLessNoise;
  }
  scenario_.star_tracker_period *= kTogether;
  // What is further apart is a gap.
  if (kTogether * scenario.gyro_period <= std::chrono::milliseconds(500)) {
    scenario_.gyro_period *= kTogether;
  }
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
