#include "trihedron/sim/simulate.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "trihedron/records/stop.hpp"
#include "trihedron/sim/attitude.hpp"
#include "trihedron/sim/gyro.hpp"
#include "trihedron/sim/interval.hpp"
#include "trihedron/sim/orbit.hpp"
#include "trihedron/sim/sky.hpp"
#include "trihedron/sim/star_tracker.hpp"

namespace trihedron::sim {
namespace {

void require(bool condition, const std::string& message) {
  if (!condition) {
    throw std::invalid_argument("scenario: " + message);
  }
}

bool is_probability(double p) { return p >= 0 && p <= 1; }

void check(const GyroScenario& gyro, const std::string& name, double duration_s) {
  const DriftScenario& drift = gyro.drift;
  const ReadoutScenario& readout = gyro.readout;
  require(gyro.misalignment_magnitude_rad >= 0, name + ".misalignment_magnitude_rad must not be negative");
  require(gyro.alignment_prior_sigma_rad > 0, name + ".alignment_prior_sigma_rad must be positive");
  require(drift.prior_sigma_rad_s > 0, name + ".drift.prior_sigma_rad_s must be positive");
  require(drift.outside_sigma_rad_s >= 0, name + ".drift.outside_sigma_rad_s must not be negative");
  require(drift.coefficient_walk_rad_s_sqrt_s >= 0, name + ".drift.coefficient_walk_rad_s_sqrt_s must not be negative");
  require(drift.direction_walk_rad_sqrt_s >= 0, name + ".drift.direction_walk_rad_sqrt_s must not be negative");
  require(drift.markov_sigma_rad_s >= 0, name + ".drift.markov_sigma_rad_s must not be negative");
  require(drift.warm_up_time_s > 0, name + ".drift.warm_up_time_s must be positive");
  require(drift.markov_time_s > 0, name + ".drift.markov_time_s must be positive");
  require(drift.jump_sigma_rad_s >= 0, name + ".drift.jump_sigma_rad_s must not be negative");
  require(drift.slew_time_s > 0, name + ".drift.slew_time_s must be positive");
  require(drift.polhode_period_s > 0, name + ".drift.polhode_period_s must be positive");
  require(drift.polhode_period_s + drift.polhode_period_rate * duration_s > 0,
          "polhode_period_rate of [gyro.drift] makes the polhode_period of " + name + " negative within the pass");
  require(drift.thermal_time_s > 0, name + ".drift.thermal_time_s must be positive");
  require(readout.noise_rad >= 0, name + ".readout.noise_rad must not be negative");
  require(std::isfinite(readout.latency_s), name + ".readout.latency_s must be finite");
  require(readout.quantum_rad >= 0, name + ".readout.quantum_rad must not be negative");
  require(readout.stuck_s >= 0, name + ".readout.stuck_s must not be negative");
  require(is_probability(readout.dropout_probability), name + ".readout.dropout_probability must be 0 … 1");
  require(is_probability(readout.spike_probability), name + ".readout.spike_probability must be 0 … 1");
  require(is_probability(readout.stuck_probability), name + ".readout.stuck_probability must be 0 … 1");
}

void check(const StarTrackerScenario& head, const std::string& name) {
  require((head.noise_rad.array() >= 0).all(), name + ".noise_rad must not be negative");
  require((head.field_error_rad.array() >= 0).all(), name + ".field_error_rad must not be negative");
  require(head.field_correlation_rad > 0, name + ".field_correlation_rad must be positive");
  require(std::isfinite(head.clock_offset_s), name + ".clock_offset_s must be finite");
  require(std::isfinite(head.clock_rate), name + ".clock_rate must be finite");
  require(std::isfinite(head.latency_s), name + ".latency_s must be finite");
  require(is_probability(head.dropout_probability), name + ".dropout_probability must be 0 … 1");
  require(is_probability(head.outlier_probability), name + ".outlier_probability must be 0 … 1");
  require(is_probability(head.wrong_sign_probability), name + ".wrong_sign_probability must be 0 … 1");
  require(head.alignment_prior_sigma_rad > 0, name + ".alignment_prior_sigma_rad must be positive");
}

void check(const Scenario& scenario) {
  require(scenario.duration > Duration{0}, "duration must be positive");
  require(scenario.gyro_period > Duration{0}, "gyro_period must be positive");
  require(
      scenario.star_tracker_period > Duration{0} && scenario.star_tracker_period % scenario.gyro_period == Duration{0},
      "the period of [star_tracker] must be a multiple of the period of [gyro]");
  require(scenario.gyros.size() >= 2 && scenario.gyros.size() <= 4, "there must be 2 to 4 gyros");
  for (std::size_t i = 0; i < scenario.gyros.size(); ++i) {
    check(scenario.gyros[i], "gyros[" + std::to_string(i) + "]", to_seconds(scenario.duration));
  }
  require(scenario.attitude.jitter_rad >= 0, "attitude.jitter_rad must not be negative");
  check(scenario.star_tracker, "star_tracker");
  require(
      scenario.star_tracker.mounting_rotation_vector_rad.isZero(0) && scenario.star_tracker.misalignment_rad.isZero(0),
      "the axes of the first star tracker are c: it has no mounting and no misalignment");
  for (std::size_t i = 0; i < scenario.further_star_trackers.size(); ++i) {
    check(scenario.further_star_trackers[i], "further_star_trackers[" + std::to_string(i) + "]");
  }
}

void append(std::vector<double>& values, const Eigen::Vector3d& v) { values.insert(values.end(), v.begin(), v.end()); }

void record_truth(Time t, const Rot<In, C>& C_in_c, const std::vector<Gyro>& gyros, Truth& truth) {
  Eigen::Quaterniond q = C_in_c.quaternion();
  if (!truth.q_in_c.empty() && q.dot(truth.q_in_c.back()) < 0) {
    q.coeffs() = -q.coeffs();
  }
  truth.t.push_back(t);
  truth.q_in_c.push_back(q);
  for (const Gyro& gyro : gyros) {
    append(truth.h_in, gyro.momentum().raw());
  }
}

/// Whether the Earth does not hide the Sun. The shadow is a cylinder: over the penumbra of ten seconds nothing warms.
bool is_sunlit(const Vec<In>& position_m, const Vec<In>& sun_m) {
  const Eigen::Vector3d& r = position_m.raw();
  const Eigen::Vector3d to_sun = sun_m.raw().normalized();
  return r.dot(to_sun) > 0 || r.cross(to_sun).norm() > kEarthRadius_m;
}

Truth::StarTracker truth_of(const StarTrackerScenario& head) {
  return {head.clock_offset_s - head.latency_s, head.clock_rate, head.orbital_sine_rad, head.orbital_cosine_rad,
          head.misalignment_rad};
}

}  // namespace

PassSettings settings_of(const Scenario& scenario) {
  PassSettings settings;
  settings.spacecraft = scenario.spacecraft;
  settings.epoch = scenario.epoch;
  settings.duration = scenario.duration;
  settings.gyro_period = scenario.gyro_period;
  settings.star_tracker_period = scenario.star_tracker_period;
  settings.star_tracker_noise_rad = scenario.star_tracker.noise_rad;
  for (const StarTrackerScenario& head : scenario.further_star_trackers) {
    settings.further_star_trackers.push_back(
        {head.noise_rad, head.mounting_rotation_vector_rad, head.alignment_prior_sigma_rad});
  }
  for (const GyroScenario& gyro : scenario.gyros) {
    GyroPrior prior;
    prior.readout_noise_rad = gyro.readout.noise_rad;
    prior.drift_common_sigma_rad_s = gyro.drift.prior_sigma_rad_s;
    prior.alignment_rotation_vector_rad = gyro.mounting_rotation_vector_rad;
    prior.alignment_sigma_rad.setConstant(gyro.alignment_prior_sigma_rad);
    settings.gyros.push_back(prior);
  }
  return settings;
}

double margin_s(const Scenario& scenario) {
  const double duration_s = to_seconds(scenario.duration);
  double margin_s = 0;
  const auto include = [&](const StarTrackerScenario& head) {
    margin_s = std::max(margin_s, std::abs(head.clock_offset_s) + std::abs(head.clock_rate) * duration_s +
                                      std::abs(head.latency_s) + 0.1);
  };
  include(scenario.star_tracker);
  std::ranges::for_each(scenario.further_star_trackers, include);
  for (const GyroScenario& gyro : scenario.gyros) {
    margin_s = std::max(margin_s, std::abs(gyro.readout.latency_s));
  }
  return margin_s;
}

void expect_possible(const Scenario& scenario) { check(scenario); }

SimulatedPass simulate(const Scenario& scenario) {
  check(scenario);
  const double duration_s = to_seconds(scenario.duration);
  const double step_s = to_seconds(scenario.gyro_period);
  std::vector<StarTrackerScenario> heads{scenario.star_tracker};
  heads.insert(heads.end(), scenario.further_star_trackers.begin(), scenario.further_star_trackers.end());
  const double margin_s = sim::margin_s(scenario);
  const std::unique_ptr<Ephemeris> ephemeris = ephemeris_of(scenario.orbit, -margin_s, duration_s + margin_s);
  const Ephemeris& orbit = *ephemeris;
  const AttitudeProgramme attitude(scenario.attitude, orbit, scenario.seed, -margin_s, duration_s + margin_s);

  const Sky sky(scenario.epoch, -margin_s, duration_s + margin_s);
  const bool is_warmed =
      std::ranges::any_of(scenario.gyros, [](const GyroScenario& gyro) { return gyro.drift.thermal_fraction != 0; });

  Rot<In, C> C_in_c = attitude.at(0);
  std::vector<Gyro> gyros;
  std::vector<Readout> readouts;
  for (std::size_t i = 0; i < scenario.gyros.size(); ++i) {
    const auto number = static_cast<int>(i);
    gyros.emplace_back(scenario.gyros[i], C_in_c, scenario.seed, number);
    readouts.emplace_back(scenario.gyros[i].readout, scenario.gyro_period, scenario.seed, number);
  }

  SimulatedPass result;
  result.pass.settings = settings_of(scenario);
  GyroTelemetry& telemetry = result.pass.gyro;
  telemetry.gyros = static_cast<int>(gyros.size());
  const auto samples = static_cast<std::size_t>(scenario.duration / scenario.gyro_period) + 1;
  telemetry.t.reserve(samples);
  telemetry.h.reserve(samples * gyros.size() * 3);

  // Over a latency the momentum itself does not move by anything that can be read.
  const auto seen_by = [&](std::size_t i, double t_s) {
    const double latency_s = scenario.gyros[i].readout.latency_s;
    return latency_s == 0 ? gyros[i].momentum_in_case() : gyros[i].momentum_in_case(attitude.at(t_s - latency_s));
  };
  for (Duration since{0};; since += scenario.gyro_period) {
    check_stop();
    const Time t = scenario.epoch + since;
    const double t_s = to_seconds(since);
    if (since % scenario.star_tracker_period == Duration{0}) {
      record_truth(t, C_in_c, gyros, result.truth);
    }
    if (within(scenario.gyro_gaps, since)) {
      result.events.push_back({t, Fault::kGyroGap});
    } else {
      telemetry.t.push_back(t);
      for (std::size_t i = 0; i < gyros.size(); ++i) {
        append(telemetry.h, readouts[i].read(t, seen_by(i, t_s), result.events));
      }
    }
    if (since + scenario.gyro_period > scenario.duration) {
      break;
    }
    const Rot<In, C> middle = attitude.at(t_s + step_s / 2);
    const Rot<In, C> end = attitude.at(t_s + step_s);
    const bool sunlit = is_warmed && is_sunlit(orbit.at(t_s).position_m, sky.at(t_s).sun_m);
    Gyro::advance_all(gyros, t_s, step_s, middle, end, sunlit);
    C_in_c = end;
  }
  for (const Gyro& gyro : gyros) {
    result.truth.gyros.push_back(gyro.truth());
  }

  for (std::size_t i = 0; i < heads.size(); ++i) {
    StarTrackerTelemetry& fixes = i == 0 ? result.pass.star_tracker : result.pass.further_star_trackers.emplace_back();
    fixes = simulate_fixes(heads[i], {attitude, orbit, sky}, scenario.epoch, scenario.duration,
                           scenario.star_tracker_period, scenario.seed, result.events, static_cast<int>(i));
    result.truth.star_trackers.push_back(truth_of(heads[i]));
  }
  result.truth.orbital_rate_rad_s = orbit.mean_rate_rad_s();
  return result;
}

}  // namespace trihedron::sim
