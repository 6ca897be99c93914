#include "lane.hpp"

#include <algorithm>
#include <tuple>

#include "state.hpp"
#include "trihedron/ground/choose/settled.hpp"
#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::lanes {
namespace {

std::unique_ptr<Lane::Estimator> estimator_of(const FilterFlight& flight) {
  const PassSettings settings = sim::settings_of(flight.scenario);
  return ground::pair_estimator(settings, ground::settled_as_told(flight.options));
}
}  // namespace

Lane::Lane(const FilterFlight& flight, const Lane* before)
    : scenario(&flight.scenario),
      begin_s(-sim::margin_s(flight.scenario)),
      end_s(to_seconds(flight.scenario.duration) + sim::margin_s(flight.scenario)),
      ephemeris(sim::ephemeris_of(flight.scenario.orbit, begin_s, end_s)),
      attitude(
          before != nullptr
              ? sim::AttitudeProgramme(scenario->attitude, before->attitude.reference(), scenario->seed, begin_s, end_s)
              : sim::AttitudeProgramme(scenario->attitude, *ephemeris, scenario->seed, begin_s, end_s)),
      estimator(estimator_of(flight)) {
  const Scenario& its = flight.scenario;
  for (int k = 0; k < kGyros; ++k) {
    gyros.emplace_back(its.gyros[static_cast<std::size_t>(k)], attitude.at(0), its.seed, k);
    readout_noise.emplace_back(its.seed, sim::Source::kReadoutNoise, static_cast<std::uint64_t>(k));
  }
  const sim::Sky sky(its.epoch, begin_s, end_s);
  std::vector<sim::Event> events;
  fixes = sim::simulate_fixes(its.star_tracker, {attitude, *ephemeris, sky}, its.epoch, its.duration,
                              its.star_tracker_period, its.seed, events);
}

bool Lane::has_reference_of(const Scenario& other) const {
  using Reference = AttitudeScenario::Reference;
  const Reference reference = scenario->attitude.reference;
  const auto orbit = [](const Scenario& its) {
    const OrbitScenario& of = its.orbit;
    return std::tuple(of.perigee_altitude_m, of.apogee_altitude_m, of.inclination_rad, of.ascending_node_rad,
                      of.argument_of_perigee_rad, of.mean_anomaly_rad, its.duration, sim::margin_s(its));
  };
  return (reference == Reference::kOrbital || reference == Reference::kYawSteered) &&
         reference == other.attitude.reference && scenario->orbit.ephemeris.empty() && other.orbit.ephemeris.empty() &&
         orbit(*scenario) == orbit(other);
}

bool Lane::turns_by_little() const {
  return std::ranges::all_of(gyros, [&](const sim::Gyro& gyro) {
    const double most_rad_s = gyro.drift().kappa_rad_s().cwiseAbs().sum();
    return most_rad_s * to_seconds(scenario->gyro_period) < kLittle_rad;
  });
}

bool Lane::is_like(const Lane& other) const {
  const auto times = [](const Lane& its) {
    const std::optional<sim::SmoothNoise>& jitter = its.attitude.jitter();
    return std::tuple(its.scenario->epoch, its.scenario->duration, its.scenario->gyro_period,
                      its.scenario->star_tracker_period, jitter.has_value(), jitter ? jitter->knots_per_s() : 0);
  };
  return times(*this) == times(other);
}
}  // namespace trihedron::lanes
