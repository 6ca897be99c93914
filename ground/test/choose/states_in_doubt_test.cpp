#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <string>
#include <vector>

#include "choose/decide.hpp"
#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;

CalibrationOptions with(std::initializer_list<FurtherState> states) {
  CalibrationOptions options = told();
  options.estimator = Estimator::kBatch;
  for (const FurtherState state : states) {
    options.further_states[state] = Choice::kOn;
  }
  return options;
}

/// Keys of the further states that were taken in.
std::string states_of(const CalibrationRun& run) {
  std::string keys;
  for (const FurtherStateRow& row : kFurtherStates) {
    keys += run.options.further_states.is_on(row.state) ? std::string(row.key) + " " : "";
  }
  return keys;
}

/// A body that follows the orbit and turns about its vertical, by half a turn and back again.
Scenario turning(std::uint64_t seed, Duration duration, int turns = 1) {
  Scenario scenario = scenario_in_eq1(seed, duration);
  std::vector<Slew> slews;
  for (int turn = 1; turn <= turns; ++turn) {
    slews.push_back(
        {.begin_s = turn * to_seconds(duration) / (turns + 1), .yaw_rad = turn % 2 == 1 ? std::numbers::pi : 0});
  }
  scenario.attitude.slews = slews;
  return scenario;
}

TEST(LogEvidence, IsTheGainInTheLikelihoodOfThePass) {
  const Pass pass = sim::simulate(turning(5, std::chrono::hours(2))).pass;
  const Screened screened = screen(pass, with({}));
  const Trial without(pass, screened, with({}));
  const Trial one(pass, screened, with({FurtherState::kClockOffset}));
  const double gain = one.log_likelihood() - without.log_likelihood();
  // Of an offset of nothing that is known far better than its prior: s⁻¹ times the factor by the prior with s of its
  // sigma, and the mean of three.
  const LogEvidence evidence = one.log_evidence(FurtherState::kClockOffset);
  EXPECT_NEAR(evidence.by_prior_as_it_is, gain, 0.05);
  EXPECT_NEAR(evidence.value, gain + std::log((1 + 4 + 16) / 3.0), 0.05);
  // The same of a trial that has others, where these are zero.
  const Trial all(pass, screened,
                  with({FurtherState::kClockOffset, FurtherState::kClockRate, FurtherState::kOrbitalError,
                        FurtherState::kReadoutBias}));
  const LogEvidence given_others = all.log_evidence(
      FurtherState::kClockOffset, {FurtherState::kClockRate, FurtherState::kOrbitalError, FurtherState::kReadoutBias});
  EXPECT_NEAR(given_others.value, evidence.value, 0.05);
  EXPECT_GT(std::abs(given_others.value - all.log_evidence(FurtherState::kClockOffset).value), 0.1);
}

TEST(Trial, TellsTheSigmaOfAStateAsAFitWithItAloneDoes) {
  const Pass pass = sim::simulate(turning(5, std::chrono::hours(2))).pass;
  const CalibrationRun run = calibrate(pass, with({FurtherState::kClockOffset}));
  ASSERT_EQ(run.calibration.further.size(), 1U);
  const double sigma_s = run.calibration.further[0].sigma;
  const Screened screened = screen(pass, with({}));
  const std::vector<FurtherState> others{FurtherState::kClockRate, FurtherState::kOrbitalError,
                                         FurtherState::kReadoutBias};
  const Trial all(pass, screened,
                  with({FurtherState::kClockOffset, FurtherState::kClockRate, FurtherState::kOrbitalError,
                        FurtherState::kReadoutBias}));
  // A trial merges fixes that are near each other.
  EXPECT_NEAR(all.sigma(FurtherState::kClockOffset, others), sigma_s, 0.02 * sigma_s);
  EXPECT_GT(all.sigma(FurtherState::kClockOffset), 1.1 * sigma_s);
}

TEST(StatesInDoubt, AreToldWhereAFlightWithoutSlewsLeavesThemOpen) {
  Scenario scenario = scenario_in_eq1(6, std::chrono::hours(3));
  scenario.attitude.reference = AttitudeScenario::AttitudeScenario::Reference::kYawSteered;
  const CalibrationRun slewing = calibrate(sim::simulate(scenario).pass, CalibrationOptions());
  scenario.attitude.slews = std::vector<Slew>{};
  const Pass steady = sim::simulate(scenario).pass;
  const CalibrationRun run = calibrate(steady, CalibrationOptions());
  const auto open_sigma = [](const CalibrationRun& its, FurtherState state) {
    return std::ranges::find(its.evidence, state, &Evidence::state)->open_sigma.value();
  };
  // The priors are 20″ and 0.1 s.
  EXPECT_LT(open_sigma(slewing, FurtherState::kOrbitalError), 2 * kArcsecond);
  EXPECT_GT(open_sigma(run, FurtherState::kOrbitalError), 5 * kArcsecond);
  EXPECT_LT(open_sigma(slewing, FurtherState::kClockOffset), 1e-3);
  EXPECT_GT(open_sigma(run, FurtherState::kClockOffset), 5e-3);
  EXPECT_FALSE(slewing.calibration.verdict.has(FindingCode::kStarTrackerErrorsNotShown));
  EXPECT_TRUE(run.calibration.verdict.has(FindingCode::kStarTrackerErrorsNotShown));
  // Without a search for the noise as well.
  CalibrationOptions by_told_noise;
  by_told_noise.find_noise = false;
  EXPECT_GT(open_sigma(calibrate(steady, by_told_noise), FurtherState::kOrbitalError), 5 * kArcsecond);
  // What is said to be none is not open.
  CalibrationOptions none;
  none.further_states[FurtherState::kOrbitalError] = Choice::kOff;
  none.further_states[FurtherState::kClockOffset] = Choice::kOff;
  EXPECT_FALSE(calibrate(steady, none).calibration.verdict.has(FindingCode::kStarTrackerErrorsNotShown));
}

TEST(StatesInDoubt, AreTakenInWhereOthersHidThem) {
  Scenario scenario = turning(1, std::chrono::hours(6));
  scenario.star_tracker.clock_offset_s = 0.01;
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  const CalibrationRun run = calibrate(simulated.pass, CalibrationOptions());
  EXPECT_EQ(states_of(run), "clock_offset ");
  ASSERT_EQ(run.calibration.further.size(), 1U);
  EXPECT_NEAR(run.calibration.further[0].value, 0.01, 4 * run.calibration.further[0].sigma);
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);  // χ² of 20: once in 900
}

TEST(StatesInDoubt, ErrorsAtOrbitalPeriodAreFoundBesideDriftOutsideEquation1) {
  Scenario scenario;
  scenario.seed = 2;
  scenario.duration = std::chrono::hours(6);
  scenario.star_tracker.orbital_sine_rad = Eigen::Vector3d(3, -2, 0) * kArcsecond;
  scenario.star_tracker.orbital_cosine_rad = Eigen::Vector3d(-1, 2, 2) * kArcsecond;
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  const CalibrationRun run = calibrate(simulated.pass, CalibrationOptions());
  EXPECT_EQ(states_of(run), "orbital_error ");
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);
}

TEST(StatesInDoubt, StayOutWhereThereIsNothingButDrift) {
  for (const double markov_rad_s : {0.0, 3e-8}) {
    Scenario scenario = turning(3, std::chrono::hours(4));
    for (GyroScenario& gyro : scenario.gyros) {
      gyro.drift.markov_sigma_rad_s = markov_rad_s;
    }
    const CalibrationRun run = calibrate(sim::simulate(scenario).pass, CalibrationOptions());
    EXPECT_EQ(states_of(run), markov_rad_s > 0 ? "wandering_drift " : "");
    for (const Evidence& evidence : run.evidence) {
      const bool is_left_out = evidence.state && evidence.state != FurtherState::kWanderingDrift;
      EXPECT_EQ(evidence.open_sigma.has_value(), is_left_out) << evidence.key();
      EXPECT_GT(evidence.open_sigma.value_or(1), 0) << evidence.key();
    }
  }
}

TEST(StatesInDoubt, ARateOfTheClockIsNoStateWithoutAnOffset) {
  Scenario scenario = turning(4, std::chrono::hours(6), 6);
  scenario.star_tracker.clock_rate = 2e-6;  // and right at the epoch
  const CalibrationRun run = calibrate(sim::simulate(scenario).pass, CalibrationOptions());
  EXPECT_EQ(states_of(run), "clock_offset clock_rate ");
  for (const Evidence& evidence : run.evidence) {
    if (evidence.state) {
      EXPECT_EQ(evidence.accepted, run.options.further_states.is_on(*evidence.state)) << evidence.key();
    }
  }
}

// In a flight without slews a bias of the readings, or drift at orbital period, makes up for drift outside eq. (1),
// with coefficients far off.
TEST(DriftModelTold, IsNotToBeUsedWhereThePassHasDriftThatItDoesNotContain) {
  for (const Estimator estimator : {Estimator::kInvariant, Estimator::kBatch}) {
    for (const bool outside : {false, true}) {
      Scenario scenario = turning(6, std::chrono::hours(4), 0);
      for (GyroScenario& gyro : scenario.gyros) {
        gyro.drift.outside_sigma_rad_s = outside ? 1e-8 : 0;
      }
      CalibrationOptions options;
      options.estimator = estimator;
      options.drift_model = kEsg7;
      const CalibrationRun run = calibrate(sim::simulate(scenario).pass, options);
      EXPECT_EQ(run.calibration.verdict.has(FindingCode::kDriftModelTooSmall), outside);
    }
  }
}

// ---- A drift field or an error of the star tracker

/// Steered in yaw without slews, so that the same directions come back with each orbit.
Scenario steered_in_yaw() {
  Scenario scenario = scenario_in_eq1(3, std::chrono::hours(5));
  scenario.attitude.reference = AttitudeScenario::Reference::kYawSteered;
  scenario.attitude.slews = std::vector<Slew>{};
  return scenario;
}

TEST(FieldOrError, IsNotTrustedWhereDriftWouldMoveTheAngleBetweenTheMomenta) {
  Pass pass = sim::simulate(steered_in_yaw()).pass;
  const double rate_rad_s = 2 * std::numbers::pi / 5600;
  for (std::size_t i = 0; i < pass.star_tracker.size(); ++i) {
    const double angle = 2 * rate_rad_s * to_seconds(pass.star_tracker.t[i] - pass.settings.epoch);
    const Eigen::Vector3d error = 15 * kArcsecond * Eigen::Vector3d(std::sin(angle), std::cos(angle), std::sin(angle));
    pass.star_tracker.q_in_c[i] = pass.star_tracker.q_in_c[i] * Rot<C, C>::exp(Vec<C>::assume(error)).quaternion();
  }
  const CalibrationRun run = calibrate(pass, CalibrationOptions());
  ASSERT_TRUE(run.field_or_error);
  EXPECT_GT(run.field_or_error->error, 0.7 * run.field_or_error->field);  // it is what there is
  EXPECT_LT(run.field_or_error->field_by_angle, -5);                      // at which the verdict forbids use
  EXPECT_TRUE(run.calibration.verdict.has(FindingCode::kOrbitalErrorOrDrift));
  EXPECT_FALSE(run.calibration.verdict.trustworthy);
  // Somebody may know that the star tracker has none.
  CalibrationOptions known;
  known.further_states[FurtherState::kOrbitalError] = Choice::kOff;
  EXPECT_FALSE(calibrate(pass, known).field_or_error);
}

TEST(FieldOrError, IsDriftWhereTheAngleShowsIt) {
  Scenario scenario = steered_in_yaw();
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.outside_sigma_rad_s = 5e-8;
  }
  const CalibrationRun run = calibrate(sim::simulate(scenario).pass, CalibrationOptions());
  ASSERT_TRUE(run.field_or_error);
  EXPECT_GT(run.field_or_error->field_by_angle, 5);  // from which the verdict says nothing
  EXPECT_FALSE(run.calibration.verdict.has(FindingCode::kOrbitalErrorOrDrift));
}

TEST(OrbitalError, IsNotTakenForDriftWhoseSpectrumWasFoundBesideIt) {
  Scenario scenario;           // with drift outside eq. (1)
  scenario.seed = 1616976969;  // of which the error, free while the spectrum is found, has ln B 7.7
  scenario.attitude.slews = std::vector<Slew>{};
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  const CalibrationRun run = calibrate(simulated.pass, CalibrationOptions());
  EXPECT_FALSE(run.options.further_states.is_on(FurtherState::kOrbitalError)) << states_of(run);
  const auto evidence = std::ranges::find(run.evidence, FurtherState::kOrbitalError, &Evidence::state);
  ASSERT_NE(evidence, run.evidence.end());
  EXPECT_LT(evidence->log_bayes_factor, 3);
  EXPECT_TRUE(evidence->open_sigma.has_value());
  const ErrorStatistics off = statistics(attitude_errors(run.attitude, simulated.truth.t, simulated.truth.q_in_c));
  EXPECT_LT(off.normalised_square.value(), 1.5);  // 10 with the error
}

/// Turns about its vertical so that its panels follow the Sun, 25° out of the plane of the orbit.
std::vector<AttitudeSample> turned_to_the_sun(double until_s) {
  constexpr double kSun_rad = 25 * kDegree;
  std::vector<AttitudeSample> samples;
  for (double t_s = -60; samples.empty() || samples.back().t_s < until_s + 60; t_s += 10) {
    const double u = 2 * std::numbers::pi / 5600 * t_s;
    Eigen::Matrix3d C_in_orbit;
    C_in_orbit << -std::sin(u), 0, std::cos(u), std::cos(u), 0, std::sin(u), 0, 1, 0;
    const Eigen::AngleAxisd yaw(std::atan2(std::tan(kSun_rad), std::sin(u)), Eigen::Vector3d::UnitZ());
    samples.push_back({t_s, Eigen::Quaterniond(C_in_orbit * yaw)});
  }
  return samples;
}

TEST(FieldOrError, IsAberrationWhereThatMakesThePassAsLikely) {
  Scenario scenario = scenario_in_eq1(3, std::chrono::hours(9));
  scenario.attitude.reference = AttitudeScenario::Reference::kRecorded;
  scenario.attitude.recorded = turned_to_the_sun(to_seconds(scenario.duration));
  scenario.attitude.slews = std::vector<Slew>{};
  scenario.star_tracker.aberration = StarTrackerScenario::Aberration::kUncorrected;
  const CalibrationRun run = calibrate(sim::simulate(scenario).pass, CalibrationOptions());
  ASSERT_TRUE(run.orbital_error_over_field);
  EXPECT_GT(*run.orbital_error_over_field, -5);
  EXPECT_FALSE(run.calibration.verdict.trustworthy);
}

}  // namespace
}  // namespace trihedron::ground
