// Every number of gyros and star trackers, every drift model and every further state, on board and in the batch.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <chrono>
#include <cmath>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "added_drift.hpp"
#include "passes.hpp"
#include "trihedron/core/layout.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {
namespace {

struct Spacecraft {
  int gyros;
  DriftModelId drift_model;
  int star_trackers;
  FurtherStates further;  ///< wandering drift, readout bias, coefficient change, clock offset, error at orbital
                          ///< period, clock rate, drift at orbital period, polhode
};

/// Each choice of one is together with each choice of any other somewhere.
const std::vector<Spacecraft>& combinations() {
  static const std::vector<Spacecraft> all = {
      {2, kEsg7, 3, {false, true, false, false, true, false, true}},
      {3, kEsg7, 2, {true, false, true, true, false}},
      {4, kEsg7, 1, {false, true, true, false, false, false, false, true}},
      {2, kEsg20, 1, {true, false, true, true, true, false, true}},
      {3, kEsg20, 3, {true, true, false, false, false}},
      {4, kEsg20, 2, {false, false, false, true, true, false, true, true}},
      {2, vsh(1), 3, {false, false, true, false, false}},
      {3, vsh(1), 2, {false, true, false, true, true, false, false, true}},
      {4, vsh(1), 1, {true, false, false, false, true, false, true, true}},
      {2, vsh(2), 2, {false, false, true, false, true, false, true, true}},
      {3, vsh(2), 1, {true, true, false, true, false}},
      {4, vsh(2), 3, {false, true, false, true, false, false, true}},
      {2, vsh(3), 3, {false, true, true, false, true}},
      {3, vsh(3), 1, {true, false, false, true, false, false, true, true}},
      {4, vsh(3), 2, {true, false, false, true, true, false, true, true}},
      {2, vsh(4), 1, {true, false, true, true, true}},
      {3, vsh(4), 2, {false, true, false, false, false, false, true}},
      {4, vsh(4), 3, {false, false, false, true, true, false, false, true}},
      {2, vsh(5), 2, {true, true, true, false, true}},
      {3, vsh(5), 1, {false, false, false, true, false, false, true, true}},
      {4, vsh(5), 3, {true, true, false, false, false, false, true, true}},
      {2, vsh(6), 2, {true, true, true, false, false}},
      {3, vsh(6), 1, {false, false, false, true, true, false, false, true}},
      {4, vsh(6), 3, {true, false, false, true, true, false, true, true}},
  };
  return all;
}

/// The choices of a combination as numbers from 0, and how many there are of each.
constexpr std::array<int, 10> kChoices = {3, 3, 8, 2, 2, 2, 2, 2, 2, 2};
std::array<int, 10> choices_of(const Spacecraft& its) {
  const int model = its.drift_model == kEsg7 ? 0 : its.drift_model == kEsg20 ? 1 : 1 + its.drift_model.degree;
  const auto number = [](bool is_on) { return is_on ? 1 : 0; };
  return {its.gyros - 2,
          its.star_trackers - 1,
          model,
          number(its.further.wandering_drift),
          number(its.further.readout_bias),
          number(its.further.coefficient_change),
          number(its.further.clock_offset),
          number(its.further.orbital_error),
          number(its.further.orbital_drift),
          number(its.further.polhode)};
}

TEST(Combinations, HaveEachChoiceTogetherWithEachOther) {
  std::set<std::tuple<std::size_t, int, std::size_t, int>> seen;
  for (const Spacecraft& combination : combinations()) {
    const auto choices = choices_of(combination);
    for (std::size_t a = 0; a < choices.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        seen.emplace(a, choices.at(a), b, choices.at(b));
      }
    }
  }
  std::size_t expected = 0;
  for (std::size_t a = 0; a < kChoices.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      expected += static_cast<std::size_t>(kChoices.at(a) * kChoices.at(b));
    }
  }
  EXPECT_EQ(seen.size(), expected);
}

constexpr Duration kDuration = std::chrono::minutes(20);
constexpr double kClockOffset_s = 0.01;
constexpr double kWandering_rad_s = 1e-7;
constexpr Duration kWanderingTime = std::chrono::minutes(20);
/// κ(t) = κ (1 + fraction exp(−t / time)): nearly even over the pass.
constexpr double kChangeFraction = -0.5;
constexpr double kChangeTime_s = 10 * to_seconds(kDuration);
const Eigen::Vector3d kReadoutBias = Eigen::Vector3d(10, -15, 20) * kArcsecond;
const Eigen::Vector3d kOrbitalSine = Eigen::Vector3d(6, -5, 8) * kArcsecond;
const Eigen::Vector3d kOrbitalDriftSine = {6e-8, -4e-8, 9e-8};
const Eigen::Vector3d kOrbitalDriftCosine = {-5e-8, 8e-8, 3e-8};
/// A polhode of minutes.
PolhodeDrift polhode_of(int gyro) {
  PolhodeDrift drift;
  drift.polhode = {static_cast<float>(400 + 60 * gyro), 0.05F};
  drift.sine_rad_s << 2e-7, -1e-7, 3e-7, 1e-7, -2e-7, 2e-7, 1e-7;
  drift.cosine_rad_s << -1e-7, 2e-7, 1e-7, -2e-7, 3e-7, 1e-7, -1e-7;
  return drift;
}
const Eigen::Vector3d kHeadMisalignment = Eigen::Vector3d(2e-4, -1e-4, 1e-4);

/// Drift beside eq. (1) as large as the priors of its coefficients say.
void put_drift(const DriftModelId& model, DriftScenario& drift) {
  using enum DriftHarmonic::Potential;
  constexpr double kDegree2_rad_s = 1e-7;
  drift.outside_sigma_rad_s = model == kEsg20 ? kDegree2_rad_s : 0;
  for (int degree = 1; degree <= model.degree; ++degree) {
    const int n = std::max(degree, 2);
    const double size = kDegree2_rad_s * std::sqrt(6.0 / (n * (n + 1)));
    drift.harmonics.push_back({kW, degree, 1, size});
    drift.harmonics.push_back({kD, degree, -1, -size});
  }
}

/// What the states that are on are for is there, and nothing else.
Scenario scenario_of(const Spacecraft& its, std::uint64_t seed) {
  Scenario scenario = scenario_in_eq1(seed, kDuration);
  // Slews about all axes, so that this is long enough for the alignments.
  constexpr double kTurn = 30 * kDegree;
  scenario.attitude.slews = std::vector<Slew>{
      {100, kTurn, 0, 0}, {300, 0, kTurn, kTurn}, {550, 0, 0, 0}, {750, -kTurn, 0, kTurn}, {950, 0, 0, 0}};
  scenario.gyros.resize(static_cast<std::size_t>(its.gyros));
  const std::array<Eigen::Vector3d, 4> directions = {scenario.gyros[0].start_direction_c,
                                                     scenario.gyros[1].start_direction_c, Eigen::Vector3d(0.1, 0.2, 1),
                                                     Eigen::Vector3d(0.6, 0.5, -0.6)};
  for (std::size_t k = 0; k < scenario.gyros.size(); ++k) {
    GyroScenario& gyro = scenario.gyros[k];
    gyro.start_direction_c = directions.at(k);
    gyro.misalignment_magnitude_rad = gyro.alignment_prior_sigma_rad = 5 * kArcminute;
    put_drift(its.drift_model, gyro.drift);
    gyro.drift.markov_sigma_rad_s = its.further.wandering_drift ? kWandering_rad_s : 0;
    gyro.drift.markov_time_s = to_seconds(kWanderingTime);
    gyro.drift.warm_up_fraction = its.further.coefficient_change ? kChangeFraction : 0;
    gyro.drift.warm_up_time_s = kChangeTime_s;
    gyro.readout.bias_rad = its.further.readout_bias ? kReadoutBias : Eigen::Vector3d(0, 0, 0);
  }
  scenario.star_tracker.clock_offset_s = its.further.clock_offset ? kClockOffset_s : 0;
  const std::array<Eigen::Vector3d, 2> mountings = {Eigen::Vector3d(1.2, 0, 0), Eigen::Vector3d(0, -1.1, 0.3)};
  for (int head = 1; head < its.star_trackers; ++head) {
    StarTrackerScenario& tracker = scenario.further_star_trackers.emplace_back(scenario.star_tracker);
    tracker.mounting_rotation_vector_rad = mountings.at(static_cast<std::size_t>(head) - 1);
    tracker.misalignment_rad = kHeadMisalignment;
  }
  if (its.further.orbital_error) {
    scenario.star_tracker.orbital_sine_rad = kOrbitalSine;
  }
  return scenario;
}

CalibrationOptions options_of(const Spacecraft& its, Estimator estimator) {
  CalibrationOptions options = told();
  options.estimator = estimator;
  options.drift_model = its.drift_model;
  const auto turn_on = [&](FurtherState state, bool is_on) {
    if (is_on) {
      options.further_states[state] = FurtherStateOptions::Choice::kOn;
    }
  };
  turn_on(FurtherState::kWanderingDrift, its.further.wandering_drift);
  turn_on(FurtherState::kReadoutBias, its.further.readout_bias);
  turn_on(FurtherState::kCoefficientChange, its.further.coefficient_change);
  turn_on(FurtherState::kClockOffset, its.further.clock_offset);
  turn_on(FurtherState::kOrbitalError, its.further.orbital_error);
  turn_on(FurtherState::kOrbitalDrift, its.further.orbital_drift);
  turn_on(FurtherState::kPolhode, its.further.polhode);
  for (int k = 0; k < its.gyros; ++k) {
    options.further_states.polhodes[k] = polhode_of(k).polhode;
  }
  options.further_states.wandering_drift_rad_s = kWandering_rad_s;
  options.further_states.wandering_time = kWanderingTime;
  return options;
}

double truth_of(const ParameterId& parameter, const Truth& truth) {
  switch (parameter.further_state) {
    case FurtherState::kClockOffset:
      return kClockOffset_s;
    case FurtherState::kOrbitalError:
      return parameter.owner == 0 && parameter.component < 3 ? kOrbitalSine(parameter.component) : 0;
    case FurtherState::kStarTrackerAlignment:
      return kHeadMisalignment(parameter.component);
    case FurtherState::kReadoutBias:
      return kReadoutBias(parameter.component);
    case FurtherState::kCoefficientChange: {
      const double end = 1 + kChangeFraction * std::exp(-to_seconds(kDuration) / kChangeTime_s);
      const double at_end = *truth.gyros[parameter.owner].drift(DriftCoefficient::of_eq1(parameter.component));
      return at_end * (end - 1 - kChangeFraction) / end;
    }
    case FurtherState::kOrbitalDrift:
      return parameter.component < 3 ? kOrbitalDriftSine(parameter.component)
                                     : kOrbitalDriftCosine(parameter.component - 3);
    case FurtherState::kPolhode: {
      const PolhodeDrift drift = polhode_of(parameter.owner);
      return parameter.component < 7 ? drift.sine_rad_s(parameter.component)
                                     : drift.cosine_rad_s(parameter.component - 7);
    }
    case FurtherState::kClockRate:
    case FurtherState::kWanderingDrift:
      break;
  }
  return std::nan("");
}

std::size_t further_components(const Spacecraft& its) {
  return (its.further.clock_offset ? 1U : 0U) +
         (its.further.orbital_error ? 6U * static_cast<std::size_t>(its.star_trackers) : 0U) +
         3U * static_cast<std::size_t>(its.star_trackers - 1) +
         static_cast<std::size_t>(its.gyros) *
             ((its.further.readout_bias ? 3U : 0U) + (its.further.coefficient_change ? 7U : 0U) +
              (its.further.orbital_drift ? 6U : 0U) + (its.further.polhode ? 14U : 0U));
}

using CombinationAndEstimator = std::tuple<int, Estimator>;

class AnyCombination : public testing::TestWithParam<CombinationAndEstimator> {};

std::string name_of_combination(const testing::TestParamInfo<CombinationAndEstimator>& info) {
  const Spacecraft& its = combinations().at(static_cast<std::size_t>(std::get<0>(info.param)));
  std::string model = name_of(its.drift_model);
  std::erase(model, ':');
  return std::string(name_of(std::get<1>(info.param))) + "_" + model + "_gyros" + std::to_string(its.gyros) +
         "_trackers" + std::to_string(its.star_trackers);
}

INSTANTIATE_TEST_SUITE_P(All, AnyCombination,
                         testing::Combine(testing::Range(0, 24),
                                          testing::Values(Estimator::kInvariant, Estimator::kBatch)),
                         name_of_combination);

TEST_P(AnyCombination, IsCalibratedWithinItsSigmas) {
  const auto [number, estimator] = GetParam();
  const Spacecraft& its = combinations().at(static_cast<std::size_t>(number));
  auto simulated = sim::simulate(scenario_of(its, 300 + static_cast<std::uint64_t>(number)));
  for (int k = 0; its.further.orbital_drift && k < its.gyros; ++k) {
    add_orbital_drift(simulated.truth, kOrbitalDriftSine, kOrbitalDriftCosine, k, simulated.pass.gyro);
  }
  for (int k = 0; its.further.polhode && k < its.gyros; ++k) {
    add_polhode(simulated.truth, polhode_of(k), k, simulated.pass.gyro);
  }
  const CalibrationRun run = calibrate(simulated.pass, options_of(its, estimator));
  const Calibration& found = run.calibration;

  EXPECT_EQ(found.estimator, estimator);
  ASSERT_EQ(found.states, drift_and_alignment(its.drift_model, static_cast<std::size_t>(its.gyros)));
  const Eigen::VectorXd errors = estimate_minus_truth(found, simulated.truth, UnnamedDrift::kIsZero);
  const double nees = errors.dot(found.covariance.llt().solve(errors));
  const boost::math::chi_squared freedom(static_cast<double>(errors.size()));
  // The star trackers fix at the same times, where they share the gyro readings: what is learned of the angles between
  // the momenta is counted once for each of them.
  EXPECT_LT(nees / its.star_trackers, boost::math::quantile(freedom, 0.9999)) << "of " << errors.size();
  // Known to 5′ before. An error at orbital period is hardly told from an alignment in that time.
  const double well_known_rad = (its.further.orbital_error ? 25 : 15) * kArcsecond;
  for (std::size_t k = 0; k < found.gyros.size(); ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LT(sigma_of(found, ParameterId::alignment(k, axis)), well_known_rad) << "gyro " << k + 1 << " " << axis;
    }
  }

  EXPECT_EQ(found.further.size(), further_components(its));
  for (const FurtherEstimate& estimate : found.further) {
    EXPECT_LT(std::abs(estimate.value - truth_of(estimate.parameter, simulated.truth)), 4.5 * estimate.sigma)
        << name_of(estimate.parameter);
  }

  const auto attitude = statistics(attitude_errors(run.attitude, simulated.truth.t, simulated.truth.q_in_c));
  EXPECT_GT(attitude.count, 390U);
  EXPECT_LT(*attitude.normalised_square, 3);  // one draw of the errors that the whole pass shares
  if (estimator == Estimator::kInvariant) {
    const double expected = found.statistics.nis_degrees_of_freedom;
    EXPECT_EQ(expected, 2 * its.gyros);
    const double sigma = std::sqrt(2 * expected / static_cast<double>(found.statistics.nis_count));
    EXPECT_NEAR(found.statistics.nis_mean.value(), expected, 5 * sigma);
  } else {
    EXPECT_TRUE(found.statistics.batch_converged.value());
  }
  EXPECT_TRUE(run.gyro_events.empty());
}

}  // namespace
}  // namespace trihedron::ground
