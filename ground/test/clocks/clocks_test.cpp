#include "trihedron/ground/clocks/clocks.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/judge/verdict.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

using testing::HasSubstr;

Scenario four_hours(std::uint64_t seed) { return scenario_in_eq1(seed, std::chrono::hours(4)); }

Clocks clocks_of(const Scenario& scenario) {
  const auto found = ground::clocks_of(sim::simulate(scenario).pass);
  return found.value();
}

void expect_within(const Measured& found, double truth, double sigmas) {
  EXPECT_LT(std::abs(found.value - truth), sigmas * found.sigma) << found.value << " ± " << found.sigma;
}

void expect_finding(const Verdict& verdict, FindingCode code, const char* cure) {
  const auto found = std::ranges::find(verdict.findings, code, &Finding::code);
  ASSERT_NE(found, verdict.findings.end()) << name_of(code);
  EXPECT_THAT(found->cure, HasSubstr(cure));
}

/// Five of its sigmas: once in two million times of independent noise; what the drift of the lag leaves is in it.
constexpr double kSigmas = 5;

TEST(Clocks, ThatAgreeAreLeftAlone) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
    Scenario scenario = four_hours(seed);
    scenario.gyros[0].drift.outside_sigma_rad_s = 1e-8;
    scenario.star_tracker.outlier_probability = 0.01;
    const Clocks clocks = clocks_of(scenario);
    expect_within(clocks.mid_offset_s, 0, kSigmas);
    expect_within(clocks.rate_s_s, 0, kSigmas);
    expect_within(clocks.late_s[1 - clocks.reference], 0, kSigmas);
    // Drift outside eq. (1) is in it: 1 ms over half of the pass.
    EXPECT_LT(std::abs(clocks.late_rate_s_s[1 - clocks.reference].value), 1.4e-7);
    EXPECT_LT(clocks.mid_offset_s.sigma, 5e-4);
    EXPECT_FALSE(clocks.step.has_value()) << seed;
    const ClockCorrection correction = correction_by(clocks, sim::simulate(scenario).pass.settings);
    EXPECT_FALSE(correction.of_star_tracker() || correction.of_gyros()) << seed;
  }
}

TEST(Clocks, OfAStarTrackerSecondsOrMinutesOffAreFound) {
  for (const double offset_s : {-3.0, 1.3, 0.4, -120.0, 500.0}) {
    Scenario scenario = four_hours(7);
    scenario.star_tracker.clock_offset_s = offset_s;
    const Clocks clocks = clocks_of(scenario);
    expect_within(clocks.mid_offset_s, offset_s, kSigmas);
    const ClockCorrection correction = correction_by(clocks, sim::simulate(scenario).pass.settings);
    EXPECT_NEAR(correction.offset_s, offset_s, 2e-3);
    EXPECT_EQ(correction.rate_s_s, 0);
  }
}

/// As of a telemetry map that takes one time scale for another.
TEST(Clocks, FarApartAreFoundWhereSlewsComeInARhythm) {
  for (const double offset_s : {33.0, -100.0}) {
    Scenario scenario = four_hours(7);
    std::vector<Slew> slews;
    for (int minutes = 5; minutes < 235; minutes += 15) {
      slews.push_back({60.0 * minutes, 0.5, 0.1, 0});
      slews.push_back({60.0 * (minutes + 4), 0, 0, 0});
    }
    scenario.attitude.slews = slews;
    scenario.star_tracker.clock_offset_s = offset_s;
    expect_within(clocks_of(scenario).mid_offset_s, offset_s, kSigmas);
  }
}

TEST(Clocks, OfAnotherRateAreFound) {
  for (const double rate : {1e-4, -1e-5, 1e-6}) {
    Scenario scenario = four_hours(8);
    scenario.star_tracker.clock_rate = rate;
    const Clocks clocks = clocks_of(scenario);
    expect_within(clocks.rate_s_s, rate, kSigmas);
    expect_within(clocks.offset_s, 0, kSigmas);
    // What the state can hold is left to it.
    const ClockCorrection correction = correction_by(clocks, sim::simulate(scenario).pass.settings);
    EXPECT_EQ(correction.of_star_tracker(), std::abs(rate) > 5e-6);
  }
}

TEST(Clocks, OfAGyroThatIsLateAreFound) {
  for (const std::size_t late : {0U, 1U}) {
    Scenario scenario = four_hours(9);
    scenario.gyros[late].readout.latency_s = 0.02;
    const Clocks clocks = clocks_of(scenario);
    // The star tracker agrees with the other one.
    EXPECT_EQ(clocks.reference, late == 0 ? 1 : 0);
    expect_within(clocks.mid_offset_s, 0, kSigmas);
    expect_within(clocks.late_s[static_cast<int>(late)], 0.02, kSigmas);
  }
}

TEST(Clocks, OfGyrosThatDriftInSlewsAgree) {
  for (const Duration fix_period : {Duration(std::chrono::seconds(3)), Duration(std::chrono::minutes(1))}) {
    for (const std::uint64_t seed : {6U, 7U}) {
      Scenario scenario = four_hours(seed);
      scenario.star_tracker_period = fix_period;
      for (GyroScenario& gyro : scenario.gyros) {
        gyro.readout.noise_rad = 0.1 / 206265;
      }
      const Clocks clocks = clocks_of(scenario);
      const Measured& late = clocks.late_s[1 - clocks.reference];
      expect_within(late, 0, kSigmas);
      EXPECT_LT(late.sigma, 1e-4) << to_seconds(fix_period) << " s, seed " << seed;
    }
  }
}

TEST(Clocks, OfThreeGyrosTheOneThatDiffersIsLate) {
  Scenario scenario = four_hours(10);
  scenario.gyros.push_back(scenario.gyros[0]);
  scenario.gyros[2].start_direction_c = {0.1, -0.2, 0.97};
  scenario.gyros[1].readout.latency_s = -0.01;
  scenario.star_tracker.clock_offset_s = 2;
  const Clocks clocks = clocks_of(scenario);
  EXPECT_NE(clocks.reference, 1);
  expect_within(clocks.mid_offset_s, 2, kSigmas);
  expect_within(clocks.late_s[1], -0.01, kSigmas);
  expect_within(clocks.late_s[2 - clocks.reference], 0, kSigmas);
}

/// As its clock, which agrees with the others at one time, by default the middle of the pass, runs at another rate.
Pass with_gyro_clock_rate(Pass pass, std::size_t gyro, double rate_s_s, std::optional<Time> agrees_at = {}) {
  const GyroTelemetry good = pass.gyro;
  const Time at = agrees_at.value_or(good.t[good.size() / 2]);
  const auto gyros = static_cast<std::size_t>(good.gyros);
  for (std::size_t i = 1; i + 1 < good.size(); ++i) {
    const double late_samples = rate_s_s * to_seconds(good.t[i] - at) / to_seconds(pass.settings.gyro_period);
    const std::size_t other = late_samples > 0 ? i - 1 : i + 1;
    const double part = std::abs(late_samples);
    Eigen::Map<Eigen::Vector3d>(&pass.gyro.h[(gyros * i + gyro) * 3]) =
        (1 - part) * good.direction(i, static_cast<int>(gyro)) + part * good.direction(other, static_cast<int>(gyro));
  }
  return pass;
}

TEST(Clocks, OfAGyroThatRunsAtAnotherRateAreFoundAndForbidden) {
  for (const std::size_t gyro : {0U, 1U}) {
    const double rate = gyro == 0 ? 1e-6 : -1e-6;
    const Pass pass = with_gyro_clock_rate(sim::simulate(four_hours(14)).pass, gyro, rate);
    const Clocks clocks = ground::clocks_of(pass).value();
    EXPECT_EQ(clocks.reference, gyro == 0 ? 1 : 0);
    expect_within(clocks.late_rate_s_s[static_cast<int>(gyro)], rate, kSigmas);
    expect_within(clocks.rate_s_s, 0, kSigmas);
    const CalibrationRun run = calibrate(pass, {});
    expect_finding(judge(pass, run), FindingCode::kGyroClockRate, gyro == 0 ? "Subtract 1" : "Subtract -");
  }
  // Of three the one that differs.
  Scenario three = four_hours(15);
  three.gyros.push_back(three.gyros[0]);
  three.gyros[2].start_direction_c = {0.1, -0.2, 0.97};
  const Clocks clocks = ground::clocks_of(with_gyro_clock_rate(sim::simulate(three).pass, 2, 1e-6)).value();
  EXPECT_NE(clocks.reference, 2);
  expect_within(clocks.late_rate_s_s[2], 1e-6, kSigmas);
}

/// Though all agree at the end of the pass.
TEST(Clocks, OfThreeGyrosTheOneThatRunsAtAnotherRateIsNotTheReference) {
  Scenario three = four_hours(15);
  three.gyros.push_back(three.gyros[0]);
  three.gyros[2].start_direction_c = {0.1, -0.2, 0.97};
  const Pass pass = sim::simulate(three).pass;
  for (const int gyro : {0, 1, 2}) {
    const Clocks clocks =
        ground::clocks_of(with_gyro_clock_rate(pass, static_cast<std::size_t>(gyro), 2e-6, pass.gyro.t.back())).value();
    EXPECT_NE(clocks.reference, gyro);
    expect_within(clocks.late_rate_s_s[gyro], 2e-6, kSigmas);
    EXPECT_LT(std::abs(clocks.late_rate_s_s[3 - gyro - clocks.reference].value), 1.4e-7);
  }
}

/// The state of the star tracker's clock follows half of what the gyro is late: its cure would be another.
TEST(Clocks, OfAGyroThatRunsAtAnotherRateAreNotBlamedOnTheStarTracker) {
  const Pass good = sim::simulate(four_hours(14)).pass;
  const Pass pass = with_gyro_clock_rate(good, 1, 2e-6, good.gyro.t.back());
  const CalibrationRun run = calibrate(pass, {});
  const Verdict verdict = judge(pass, run);
  const auto rate = std::ranges::find(verdict.findings, FindingCode::kGyroClockRate, &Finding::code);
  ASSERT_NE(rate, verdict.findings.end());
  // It adds up with the latency of the middle of the pass.
  EXPECT_THAT(rate->cure, HasSubstr("(t - 2009-05-20T02:00:00)"));
  expect_finding(verdict, FindingCode::kGyroLate, "latency_s = -0.014");
  for (const FindingCode code : {FindingCode::kClockOffsetFound, FindingCode::kClockRateFound}) {
    EXPECT_EQ(std::ranges::find(verdict.findings, code, &Finding::code), verdict.findings.end()) << name_of(code);
  }
}

TEST(Clocks, AreNotInventedWhereTheBodyTurnsEvenly) {
  for (const double offset_s : {0.0, -3.0}) {
    Scenario scenario = four_hours(11);
    scenario.attitude.slews = std::vector<Slew>{};
    scenario.star_tracker.clock_offset_s = offset_s;
    EXPECT_FALSE(ground::clocks_of(sim::simulate(scenario).pass).has_value());
  }
}

/// Where the attitude is exp([a t×]) C exp([b t×]), with a fixed in space and b in the body, an offset is the same as
/// other alignments and momenta.
TEST(Clocks, AreNotInventedWhereTheBodyTumbles) {
  const auto turned = [](const Eigen::Vector3d& axis, double angle_rad) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis.normalized()));
  };
  Scenario scenario = four_hours(12);
  scenario.attitude.reference = AttitudeScenario::Reference::kRecorded;
  scenario.attitude.slews = std::vector<Slew>{};
  scenario.attitude.jitter_rad = 0;
  for (double t_s = -60; t_s <= to_seconds(scenario.duration) + 60; t_s += 2) {
    scenario.attitude.recorded.push_back(
        {t_s, turned({1, 2, 3}, 0.6 * kDegree * t_s) * turned({-2, 1, 2}, 1.1 * kDegree * t_s)});
  }
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  EXPECT_FALSE(ground::clocks_of(simulated.pass).has_value());
  const CalibrationRun run = calibrate(simulated.pass, told());
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);  // χ² of 20, once in 1000
}

TEST(Clocks, OfAShortOrEmptyPassAreNotTold) {
  Pass pass = sim::simulate(scenario_in_eq1(1, std::chrono::minutes(2))).pass;
  EXPECT_FALSE(ground::clocks_of(pass).has_value());
  pass.star_tracker = {};
  EXPECT_FALSE(ground::clocks_of(pass).has_value());
  pass.gyro.t.clear();
  pass.gyro.h.clear();
  EXPECT_FALSE(ground::clocks_of(pass).has_value());
}

TEST(Clocks, CorrectionGivesThePassOfStampsThatAgree) {
  Scenario scenario = scenario_in_eq1(12, std::chrono::minutes(20));
  scenario.attitude.jitter_rad = 0;
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.readout.noise_rad = 0;
  }
  const Pass good = sim::simulate(scenario).pass;
  Pass late = good;
  late.gyro.h[3 * 2 * 1000] = std::nan("");  // of gyro 1
  for (std::size_t i = late.gyro.size(); --i > 0;) {
    const Eigen::Vector3d now = good.gyro.direction(i, 1);
    const Eigen::Vector3d then = good.gyro.direction(i - 1, 1);
    Eigen::Map<Eigen::Vector3d>(&late.gyro.h[(2 * i + 1) * 3]) = 0.8 * now + 0.2 * then;  // 25 ms late
  }
  ClockCorrection correction{2, 1e-3, {}};
  correction.late_s[1] = 0.025;
  correct(late, correction);
  for (std::size_t i = 10; i + 10 < good.gyro.size(); ++i) {
    // A parabola between samples: 72″/s² × (0.125 s)².
    ASSERT_LT((late.gyro.direction(i, 1) - good.gyro.direction(i, 1)).norm(), 6e-6) << i;
    ASSERT_EQ(late.gyro.direction(i, 0).hasNaN(), i == 1000);
  }
  EXPECT_TRUE(late.gyro.direction(good.gyro.size() - 1, 1).hasNaN());  // nothing follows
  for (std::size_t i = 0; i < good.star_tracker.size(); ++i) {
    const double before_s = to_seconds(good.star_tracker.t[i] - good.settings.epoch);
    EXPECT_NEAR(to_seconds(late.star_tracker.t[i] - good.settings.epoch), before_s * (1 + 1e-3) + 2, 2e-9);
  }
}

Time minutes_in(const Pass& pass, int minutes) { return pass.settings.epoch + std::chrono::minutes(minutes); }

/// With fixes stamped late over a part of the pass.
Pass with_late_fixes(Pass pass, int from_min, int until_min, double late_s) {
  for (Time& t : pass.star_tracker.t) {
    if (t >= minutes_in(pass, from_min) && t < minutes_in(pass, until_min)) {
      t += from_seconds(late_s);
    }
  }
  return pass;
}

/// Over a part of the pass the readings of one gyro as they are where all of them are stamped late.
Pass with_late_readings(const Scenario& scenario, std::size_t gyro, int from_min, int until_min, double late_s) {
  Pass pass = sim::simulate(scenario).pass;
  Scenario late = scenario;
  late.gyros[gyro].readout.latency_s = late_s;
  const Pass of_late = sim::simulate(late).pass;
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    if (pass.gyro.t[i] >= minutes_in(pass, from_min) && pass.gyro.t[i] < minutes_in(pass, until_min)) {
      const std::size_t place = (2 * i + gyro) * 3;
      std::copy_n(&of_late.gyro.h[place], 3, &pass.gyro.h[place]);
    }
  }
  return pass;
}

/// The step is told of the part that does not hold the end of the pass. Between slews the body turns with the orbit,
/// 3.9″ in 20 ms, a little more than the noise of a fix; a momentum along the normal of the orbit does not show it, and
/// slews are ten minutes apart.
void expect_step(const std::optional<ClockStep>& step, const Pass& pass, int gyro, int from_min, int until_min,
                 double change_s) {
  ASSERT_TRUE(step.has_value());
  EXPECT_EQ(step->gyro, gyro);
  expect_within(step->change_s, change_s, kSigmas);
  const double edge_s = gyro < 0 ? 60 : 1200;
  EXPECT_NEAR(to_seconds(step->from - minutes_in(pass, from_min)), 0, edge_s);
  EXPECT_NEAR(to_seconds(step->until - minutes_in(pass, until_min)), 0, edge_s);
}

struct LateFixes {
  int from_min;
  int until_min;
  double late_s;
};

TEST(Clocks, OfAStarTrackerThatStepsAreFound) {
  for (const LateFixes& late : {LateFixes{60, 150, 0.02}, {60, 150, -0.2}, {0, 120, 1.0}, {0, 60, -5.0}}) {
    const Pass pass = with_late_fixes(sim::simulate(four_hours(13)).pass, late.from_min, late.until_min, late.late_s);
    const auto clocks = ground::clocks_of(pass);
    expect_step(clocks.value().step, pass, -1, late.from_min, late.until_min, -late.late_s);
    expect_within(clocks->mid_offset_s, 0, kSigmas);
  }
}

TEST(Clocks, ThatStepForGoodHaveSteppedBefore) {
  const Pass pass = with_late_fixes(sim::simulate(four_hours(14)).pass, 180, 240, 0.05);
  const auto clocks = ground::clocks_of(pass);
  expect_step(clocks.value().step, pass, -1, 0, 180, 0.05);
  expect_within(clocks->mid_offset_s, -0.05, kSigmas);
}

TEST(Clocks, ThatStepByASecondHaveNotRunAtAnotherRate) {
  Scenario nine_hours = four_hours(14);
  nine_hours.duration = std::chrono::hours(9);
  const Pass good = sim::simulate(nine_hours).pass;
  for (const double late_s : {-1.0, 1.2}) {
    const auto clocks = ground::clocks_of(with_late_fixes(good, 250, 541, late_s));
    expect_step(clocks.value().step, good, -1, 0, 250, late_s);
    expect_within(clocks->rate_s_s, 0, kSigmas);
  }
}

TEST(Clocks, OfAGyroThatStepsAreFound) {
  for (const std::size_t gyro : {0U, 1U}) {
    const Pass pass = with_late_readings(four_hours(16), gyro, 60, 150, 0.03);
    const auto clocks = ground::clocks_of(pass);
    expect_step(clocks.value().step, pass, static_cast<int>(gyro), 60, 150, 0.03);
  }
}

TEST(Clocks, StepIsTakenOffTheStampsOfItsPart) {
  const Pass good = sim::simulate(scenario_in_eq1(12, std::chrono::minutes(20))).pass;
  ClockStep step{-1, minutes_in(good, 5), minutes_in(good, 10), {-2, 0.01}};
  Pass late = with_late_fixes(good, 5, 10, 2);
  late.star_tracker.covariances.resize(late.star_tracker.size());
  correct(late, step);
  EXPECT_EQ(late.star_tracker.t, good.star_tracker.t);
  EXPECT_EQ(late.star_tracker.covariances.size(), good.star_tracker.size());
  step.change_s.value = 20;
  correct(late, step);
  EXPECT_EQ(late.star_tracker.size(), good.star_tracker.size() - 6);  // after the part, of 20 s of fixes, each 3 s
  EXPECT_EQ(std::ranges::adjacent_find(late.star_tracker.t, std::ranges::greater_equal{}), late.star_tracker.t.end());
}

TEST(Calibrate, TakesAccountOfAClockThatSteps) {
  const auto simulated = sim::simulate(four_hours(3));
  CalibrationOptions options = told();
  options.further_states[FurtherState::kClockOffset] = FurtherStateOptions::Choice::kAuto;
  const auto run = calibrate(with_late_fixes(simulated.pass, 0, 120, 0.1), options);
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);
  EXPECT_TRUE(run.calibration.verdict.trustworthy);
  expect_finding(run.calibration.verdict, FindingCode::kClockStepped, "Add -0.");
  const Pass of_gyro = with_late_readings(four_hours(3), 1, 60, 150, 0.05);
  const auto of_gyro_run = calibrate(of_gyro, options);
  EXPECT_LT(nees_of(simulated.truth, of_gyro_run.calibration), 45);
  EXPECT_TRUE(of_gyro_run.calibration.verdict.trustworthy);
  expect_finding(of_gyro_run.calibration.verdict, FindingCode::kClockStepped, "of gyro 2 there");
}

TEST(Calibrate, LeavesAStepThatItMayNotTakeOffAndSaysSo) {
  Pass pass = with_late_fixes(sim::simulate(four_hours(3)).pass, 0, 120, 0.1);
  CalibrationOptions options = told();
  options.further_states[FurtherState::kClockOffset] = FurtherStateOptions::Choice::kOff;
  const Verdict of_calibration = calibrate(pass, options).calibration.verdict;
  EXPECT_FALSE(of_calibration.trustworthy);
  expect_finding(of_calibration, FindingCode::kClockStepped, "Add -0.");
  CalibrationOptions in_eq1;
  in_eq1.drift_model = kEsg7;
  const Verdict of_navigation = navigate(pass, in_eq1).verdict;
  EXPECT_FALSE(of_navigation.trustworthy);
  expect_finding(of_navigation, FindingCode::kClockStepped, "Add -0.");
}

/// A fault of the clocks, what names it, and the line that mends it.
struct Fault {
  const char* name;
  void (*put)(Scenario&);
  FindingCode code;
  const char* cure;
};

const Fault kFaults[] = {
    {"late", [](Scenario& s) { s.star_tracker.latency_s = 3; }, FindingCode::kClockOffsetFound, "clock_offset_s = -"},
    {"early", [](Scenario& s) { s.star_tracker.clock_offset_s = 60; }, FindingCode::kClockOffsetFound,
     "clock_offset_s = "},
    {"ppm100", [](Scenario& s) { s.star_tracker.clock_rate = 1e-4; }, FindingCode::kClockRateFound,
     "clock_rate_s_s = "},
    {"ppm1", [](Scenario& s) { s.star_tracker.clock_rate = 1e-6; }, FindingCode::kClockRateFound, "clock_rate_s_s = "},
    {"gyro", [](Scenario& s) { s.gyros[1].readout.latency_s = 0.02; }, FindingCode::kGyroLate, "latency_s = 0.0"}};

class ClockFaults : public testing::TestWithParam<Estimator> {};

/// χ² of 20 passes 45 once in a thousand times.
constexpr double kNeesBound = 45;

TEST_P(ClockFaults, AreTakenAccountOfAndNamed) {
  CalibrationOptions options;
  options.estimator = GetParam();
  for (const Fault& fault : kFaults) {
    Scenario scenario = four_hours(3);
    fault.put(scenario);
    const auto simulated = sim::simulate(scenario);
    const auto run = calibrate(simulated.pass, options);
    EXPECT_LT(nees_of(simulated.truth, run.calibration), kNeesBound) << fault.name;
    EXPECT_TRUE(run.calibration.verdict.trustworthy) << fault.name;
    expect_finding(run.calibration.verdict, fault.code, fault.cure);
    for (const FurtherEstimate& estimate : run.calibration.further) {
      const Truth::StarTracker& truth = simulated.truth.star_trackers[0];
      if (estimate.parameter.is_further(FurtherState::kClockOffset)) {
        EXPECT_LT(std::abs(estimate.value - truth.clock_offset_s), kSigmas * estimate.sigma) << fault.name;
      } else if (estimate.parameter.is_further(FurtherState::kClockRate)) {
        EXPECT_LT(std::abs(estimate.value - truth.clock_rate_s_s), kSigmas * estimate.sigma) << fault.name;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ClockFaults, testing::Values(Estimator::kInvariant, Estimator::kBatch));

TEST(Calibrate, LeavesClocksThatAreSwitchedOffAndSaysSo) {
  Scenario scenario = scenario_in_eq1(3, std::chrono::hours(2));
  scenario.star_tracker.clock_offset_s = -3;
  const auto run = calibrate(sim::simulate(scenario).pass, told());
  EXPECT_FALSE(run.clock_correction.of_star_tracker());
  EXPECT_FALSE(run.calibration.verdict.trustworthy);
  expect_finding(run.calibration.verdict, FindingCode::kClocksApart, "clock_offset_s = -");
}

/// A calibration that found no offset of the clock has no state for one that comes later: it is in the attitude.
TEST(Navigate, ForbidsAClockThatIsOffWhereNoStateHoldsIt) {
  Scenario scenario = scenario_in_eq1(3, std::chrono::hours(2));
  const Calibration before = calibrate(sim::simulate(scenario).pass, told()).calibration;
  const auto verdict_with = [&](double offset_s) {
    scenario.star_tracker.clock_offset_s = offset_s;
    Pass pass = sim::simulate(scenario).pass;
    pass.settings.prior = before;
    CalibrationOptions options = told();
    options.corrections.take_parameters = false;
    return navigate(pass, options).verdict;
  };
  EXPECT_FALSE(verdict_with(0).has(FindingCode::kClocksApart));
  EXPECT_FALSE(verdict_with(0.0002).has(FindingCode::kClocksApart));
  const Verdict off = verdict_with(0.2);
  expect_finding(off, FindingCode::kClocksApart, "clock_offset_s = 0.");
  EXPECT_FALSE(off.trustworthy);
}

TEST(Navigate, TellsOfClocksThatAreApart) {
  const auto verdict_with = [](double offset_s, double rate, double late_s) {
    Scenario scenario = scenario_in_eq1(3, std::chrono::hours(2));
    scenario.star_tracker.clock_offset_s = offset_s;
    scenario.star_tracker.clock_rate = rate;
    scenario.gyros[1].readout.latency_s = late_s;
    CalibrationOptions options;
    options.drift_model = kEsg7;
    return navigate(sim::simulate(scenario).pass, options).verdict;
  };
  const Verdict good = verdict_with(0.01, 0, 0);
  EXPECT_FALSE(good.has(FindingCode::kClocksApart) || good.has(FindingCode::kGyroLate));
  expect_finding(verdict_with(-3, 0, 0), FindingCode::kClocksApart, "clock_offset_s = -");
  const Verdict fast = verdict_with(0, 1e-4, 0);
  expect_finding(fast, FindingCode::kClocksApart, "clock_rate_s_s = ");
  EXPECT_FALSE(fast.trustworthy);
  const Verdict late = verdict_with(0, 0, 0.02);
  expect_finding(late, FindingCode::kGyroLate, "latency_s = 0.0");
  EXPECT_FALSE(late.trustworthy);
  const auto severity_of_late = [](const Verdict& verdict) {
    const auto found = std::ranges::find(verdict.findings, FindingCode::kGyroLate, &Finding::code);
    return found == verdict.findings.end() ? FindingSeverity::kNote : found->severity;
  };
  EXPECT_EQ(severity_of_late(verdict_with(0, 0, 0.008)), FindingSeverity::kWarning);
  const Verdict apart = verdict_with(0.03, 0, 0.008);  // from either gyro by 20 ms and more
  expect_finding(apart, FindingCode::kGyroLate, "which of the three clocks");
  EXPECT_EQ(severity_of_late(apart), FindingSeverity::kDoNotUse);
}

/// An open loop over the next hour with what a calibration of the hours before found; `latency_s` of the star tracker
/// and of gyro 2, in the calibration and in the hour after it.
struct Later {
  NavigationRun run;
  double worst_sigmas = 0;  ///< of the error of the attitude about one axis
};

Later navigated(double tracker_s, double gyro_s, double later_tracker_s, double stated_s = 0) {
  const auto flown = [&](double latency_s) {
    Scenario scenario = scenario_in_eq1(3, std::chrono::hours(3));
    scenario.star_tracker.latency_s = latency_s;
    scenario.gyros[1].readout.latency_s = gyro_s;
    return sim::simulate(scenario);
  };
  const Time cut = Time{} + std::chrono::hours(2);
  const auto split = [&](const Pass& whole, bool first) {
    Pass part = whole;
    const Time at = whole.settings.epoch + (cut - Time{});
    const auto begin = std::ranges::lower_bound(whole.gyro.t, at) - whole.gyro.t.begin();
    const auto fix = std::ranges::lower_bound(whole.star_tracker.t, at) - whole.star_tracker.t.begin();
    const auto keep = [first](auto& values, std::ptrdiff_t place) {
      first ? values.erase(values.begin() + place, values.end()) : values.erase(values.begin(), values.begin() + place);
    };
    keep(part.gyro.t, begin);
    keep(part.gyro.h, begin * 3 * whole.gyro.gyros);
    keep(part.star_tracker.t, fix);
    keep(part.star_tracker.q_in_c, fix);
    return part;
  };
  CalibrationOptions options = told();
  options.further_states[FurtherState::kClockOffset] = FurtherStateOptions::Choice::kAuto;
  Pass later = split(flown(later_tracker_s).pass, false);
  later.settings.prior = calibrate(split(flown(tracker_s).pass, true), options).calibration;
  if (stated_s != 0) {
    later.settings.star_tracker_clock_offset_s = stated_s;
    correct(later, {stated_s, 0, {}});
  }
  CalibrationOptions open_loop;
  open_loop.corrections.take_parameters = false;
  open_loop.corrections.when = CorrectionOptions::When::kOnlyFirst;
  Later result{navigate(later, open_loop), 0};
  const Truth truth = flown(0).truth;
  const AttitudeErrors errors = attitude_errors(result.run.attitude, truth.t, truth.q_in_c);
  for (std::size_t i = 0; i < errors.error_rad.size(); ++i) {
    result.worst_sigmas =
        std::max(result.worst_sigmas, (errors.error_rad[i].array() / errors.sigma_rad[i].array()).abs().maxCoeff());
  }
  return result;
}

TEST(Navigate, CorrectsStampsAsTheCalibrationInUseFoundThem) {
  for (const auto& [tracker_s, gyro_s, code] : {std::tuple(3.0, 0.0, FindingCode::kClockOffsetFound),
                                                {0.02, 0.0, FindingCode::kClockOffsetFound},
                                                {0.0, 0.125, FindingCode::kGyroLate}}) {
    const Later later = navigated(tracker_s, gyro_s, tracker_s);
    EXPECT_LT(later.worst_sigmas, kSigmas) << tracker_s << ' ' << gyro_s;
    EXPECT_TRUE(later.run.verdict.trustworthy);
    EXPECT_TRUE(later.run.verdict.has(code));
    EXPECT_FALSE(later.run.verdict.has(FindingCode::kClocksApart));
  }
}

TEST(Navigate, DoesNotCorrectTwiceWhatPassTomlStates) {
  const Later later = navigated(3, 0, 3, -3);
  EXPECT_NEAR(later.run.clock_correction.offset_s, 0, 5e-3);
  EXPECT_LT(later.worst_sigmas, kSigmas);
}

TEST(Navigate, SaysThatTheClocksAreNoLongerAsTheCalibrationFoundThem) {
  const Later later = navigated(3, 0, 0);
  EXPECT_FALSE(later.run.verdict.trustworthy);
  expect_finding(later.run.verdict, FindingCode::kClocksApart, "no longer as the calibration found them");
}

}  // namespace
}  // namespace trihedron::ground
