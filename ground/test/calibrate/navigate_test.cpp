// navigate() is what flies: it knows nothing of what comes later in the pass.

#include <gtest/gtest.h>
#include <malloc.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <variant>
#include <vector>

#include "choose/decide.hpp"
#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/ground/onboard/recorder.hpp"
#include "trihedron/ground/onboard/replay.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;

/// What has come down until the gyro sample of this number, the last one: fixes until its time.
Pass until_sample(const Pass& pass, std::size_t samples) {
  Pass cut = pass;
  cut.gyro.t.resize(samples);
  cut.gyro.h.resize(3 * static_cast<std::size_t>(pass.gyro.gyros) * samples);
  const auto cut_fixes = [&](StarTrackerTelemetry& tracker) {
    std::size_t fixes = 0;
    for (const Time t : cut.gyro.t) {
      while (fixes < tracker.size() && tracker.t[fixes] <= t) {
        ++fixes;
      }
    }
    tracker.t.resize(fixes);
    tracker.q_in_c.resize(fixes);
  };
  cut_fixes(cut.star_tracker);
  for (StarTrackerTelemetry& tracker : cut.further_star_trackers) {
    cut_fixes(tracker);
  }
  return cut;
}

bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

template <class A, class B>
bool all_same_bits(const A& a, const B& b) {
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    if (!same_bits(a(i), b(i))) {
      return false;
    }
  }
  return true;
}

/// That the cut pass gives all rows that the whole one has until the last sample of the cut, the same to the bit.
void expect_beginning(const NavigationRun& whole, const NavigationRun& beginning, Time last) {
  const AttitudeHistory& all = whole.attitude;
  const AttitudeHistory& some = beginning.attitude;
  ASSERT_GT(some.size(), 0U);
  ASSERT_LE(some.size(), all.size());
  // The next row is of a sample that the cut does not have.
  EXPECT_EQ(some.t.back(), last);
  EXPECT_TRUE(some.size() == all.size() || all.t[some.size()] > last);
  for (std::size_t i = 0; i < some.size(); ++i) {
    ASSERT_EQ(some.t[i], all.t[i]) << i;
    ASSERT_TRUE(all_same_bits(some.q_in_c[i].coeffs(), all.q_in_c[i].coeffs())) << i;
    ASSERT_TRUE(all_same_bits(some.sigma_rad[i], all.sigma_rad[i])) << i;
    ASSERT_TRUE(same_bits(some.age_s[i], all.age_s[i])) << i;
  }
  // Fixes likewise, but for those that still waited for samples at the cut.
  constexpr std::size_t kWaiting = 8;
  ASSERT_LE(beginning.fixes.size(), whole.fixes.size());
  for (std::size_t i = 0; i + kWaiting < beginning.fixes.size(); ++i) {
    ASSERT_EQ(beginning.fixes[i].t, whole.fixes[i].t);
    ASSERT_EQ(beginning.fixes[i].status, whole.fixes[i].status);
    ASSERT_TRUE(same_bits(beginning.fixes[i].nis, whole.fixes[i].nis)) << i;
  }
}

void expect_causal(const Pass& pass, const CalibrationOptions& options, const std::vector<Duration>& cuts) {
  const NavigationRun whole = navigate(pass, options);
  for (const Duration cut : cuts) {
    SCOPED_TRACE(to_seconds(cut));
    const auto samples = static_cast<std::size_t>(std::ranges::upper_bound(pass.gyro.t, pass.settings.epoch + cut) -
                                                  pass.gyro.t.begin());
    const Pass beginning = until_sample(pass, samples);
    expect_beginning(whole, navigate(beginning, options), beginning.gyro.t.back());
  }
}

const std::vector<Duration>& cuts() {
  static const std::vector<Duration> all = {seconds(30), seconds(601), minutes(31), minutes(75),
                                            minutes(91) + std::chrono::milliseconds(1500)};
  return all;
}

/// Everything that a pass may suffer from.
Scenario dirty(Duration duration) {
  Scenario scenario;
  scenario.seed = 3;
  scenario.duration = duration;
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.outside_sigma_rad_s = 5e-8;
    gyro.drift.direction_walk_rad_sqrt_s = 2e-8;
    gyro.drift.markov_sigma_rad_s = 2e-8;
    gyro.readout.quantum_rad = 0.5 * kArcsecond;
    gyro.readout.dropout_probability = 1e-3;
    gyro.readout.spike_probability = 1e-4;
    gyro.readout.stuck_probability = 1e-4;
  }
  scenario.gyro_gaps = {{2400, 2520}};
  scenario.star_tracker.noise_rad *= 1.5;
  scenario.star_tracker.clock_offset_s = 0.01;
  scenario.star_tracker.orbital_sine_rad = Eigen::Vector3d(5, -4, 8) * kArcsecond;
  scenario.star_tracker.outages = {{3600, 4400}};
  scenario.star_tracker.dropout_probability = 0.02;
  scenario.star_tracker.outlier_probability = 0.05;
  return scenario;
}

TEST(Navigate, IsCausal) { expect_causal(two_hours().pass, {}, cuts()); }

/// The noise of the readings, which it finds by the whole pass where the settings tell another, is told here.
TEST(Navigate, IsCausalWithAWrongNoiseThatIsTold) {
  Pass pass = two_hours().pass;
  for (GyroPrior& gyro : pass.settings.gyros) {
    gyro.readout_noise_rad *= 2;
  }
  CalibrationOptions options;
  options.find_noise = false;
  expect_causal(pass, options, {minutes(50)});
}

TEST(Navigate, IsCausalOnADirtyPass) {
  Pass pass = sim::simulate(dirty(std::chrono::hours(2))).pass;
  pass.settings.star_tracker_noise_rad /= 1.5;  // what was promised
  expect_causal(pass, {}, cuts());
  CalibrationOptions options;
  options.corrections.when = CorrectionOptions::When::kEachFix;
  options.student_t_freedom = 8;
  expect_causal(pass, options, cuts());
}

TEST(Navigate, IsCausalAcrossALossOfTheStarTrackerAndOfAGyro) {
  Scenario scenario = dirty(std::chrono::hours(2));
  scenario.gyros.resize(3, scenario.gyros[0]);
  scenario.gyros[2].start_direction_c = {0.1, 0.2, 1};
  scenario.further_star_trackers.resize(1, scenario.star_tracker);
  scenario.further_star_trackers[0].mounting_rotation_vector_rad = Eigen::Vector3d(1.2, 0, 0);
  Pass pass = sim::simulate(scenario).pass;
  for (std::size_t i = pass.gyro.size() / 3; i < pass.gyro.size(); ++i) {  // a degree at once
    Eigen::Map<Eigen::Vector3d> h_b(&pass.gyro.h[3 * (3 * i + 1)]);
    h_b = (h_b + 0.017 * h_b.unitOrthogonal()).normalized().eval();
  }
  expect_causal(pass, {}, cuts());
}

TEST(Navigate, IsCausalAfterAnEarlierCalibration) {
  CalibrationOptions options = told();
  options.drift_model = vsh(1);
  options.further_states[FurtherState::kReadoutBias] = FurtherStateOptions::Choice::kOn;
  Pass pass = two_hours().pass;
  pass.settings.prior = calibrate(pass, options).calibration;
  pass.settings.prior->noise = CalibrationNoise{1e-8, Eigen::Vector3d(2e-5, 2e-5, 1e-4), 3e-8, 1200};
  expect_causal(pass, {}, {seconds(45), minutes(50)});
}

/// The whole pass asks for more than the navigator takes: what it does is not decided by it.
TEST(Navigate, DoesNotTakeWhatOnlyTheWholePassShows) {
  Scenario scenario = scenario_in_eq1(6, std::chrono::minutes(40));
  scenario.star_tracker.clock_offset_s = 0.05;
  const Pass pass = sim::simulate(scenario).pass;
  CalibrationOptions options;
  EXPECT_TRUE(calibrate(pass, options).options.further_states.is_on(FurtherState::kClockOffset));
  const NavigationRun by_default = navigate(pass, options);
  const NavigationRun without = navigate(pass, told());
  ASSERT_EQ(by_default.attitude.size(), without.attitude.size());
  EXPECT_TRUE(all_same_bits(by_default.attitude.q_in_c.back().coeffs(), without.attitude.q_in_c.back().coeffs()));
}

/// (error/σ)² of the attitude in this hour, counted from 0.
double normalised_square_at_end(const sim::SimulatedPass& simulated, const NavigationRun& run, std::size_t hour = 3) {
  const auto errors = attitude_errors(run.attitude, simulated.truth.t, simulated.truth.q_in_c);
  return *statistics_by_stretch(errors, simulated.pass.settings.epoch, minutes(60)).at(hour).normalised_square;
}

Scenario with_orbital_error(Scenario scenario, double altitude_m) {
  scenario.orbit.perigee_altitude_m = scenario.orbit.apogee_altitude_m = altitude_m;
  scenario.star_tracker.orbital_sine_rad = {2e-4, -1e-4, 2e-4};
  scenario.star_tracker.orbital_cosine_rad = {-1e-4, 2e-4, 1e-4};
  return scenario;
}

TEST(Navigate, FollowsAnErrorOfTheStarTrackerAtThePeriodOfAnyOrbit) {
  const Scenario scenario = with_orbital_error(scenario_in_eq1(8, std::chrono::hours(4)), 1000e3);
  sim::SimulatedPass simulated = sim::simulate(scenario);
  const double by_default = normalised_square_at_end(simulated, navigate(simulated.pass, {}));
  EXPECT_LT(by_default, 2);
  CalibrationOptions of_another_orbit;
  of_another_orbit.orbital_rate_rad_s = 1.1e-3;
  EXPECT_GT(normalised_square_at_end(simulated, navigate(simulated.pass, of_another_orbit)), 1.5 * by_default);
  // An earlier calibration tells it from the beginning on.
  const Calibration calibration = calibrate(simulated.pass, {}).calibration;
  ASSERT_TRUE(calibration.orbital_rate_rad_s);
  EXPECT_NEAR(*calibration.orbital_rate_rad_s, simulated.truth.orbital_rate_rad_s, 1e-6);
  simulated.pass.settings.prior = calibration;
  EXPECT_LT(normalised_square_at_end(simulated, navigate(simulated.pass, {})), 2);
  // That of another orbit does not: the pass itself does.
  sim::SimulatedPass lower = sim::simulate(with_gyros_of(
      simulated.truth, with_orbital_error(scenario_in_eq1(9, std::chrono::hours(4)), 400e3), std::chrono::hours(24)));
  lower.pass.settings.prior = calibration;
  EXPECT_LT(normalised_square_at_end(lower, navigate(lower.pass, {})), 2);
  const CalibrationRun again = calibrate(lower.pass, {});
  EXPECT_NEAR(again.calibration.orbital_rate_rad_s.value_or(0), lower.truth.orbital_rate_rad_s, 1e-6);
}

TEST(Navigate, KeepsTheRateOfTheOrbitFromAnEarlierCalibrationWhereTheAttitudeIsFixedInSpace) {
  const Pass& pass = two_hours().pass;
  CalibrationOptions options = told();
  options.further_states[FurtherState::kOrbitalError] = FurtherStateOptions::Choice::kOn;
  Calibration prior = calibrate(pass, options).calibration;
  prior.orbital_rate_rad_s = 9.97e-4;
  Scenario fixed = scenario_in_eq1(10, minutes(30));
  fixed.attitude.reference = AttitudeScenario::Reference::kInertial;
  fixed.attitude.slews = std::vector<Slew>{};
  Pass later = sim::simulate(with_gyros_of(two_hours().truth, fixed, std::chrono::hours(24))).pass;
  later.settings.prior = prior;
  EXPECT_EQ(calibrate(later, options).options.orbital_rate_rad_s, 9.97e-4);
}

/// Of a body that slews most of the time the orbit is told late.
TEST(Navigate, IsNotMisledBySlewsAboutThePeriodOfTheOrbit) {
  struct Case {
    double rest_s, dwell_s, altitude_m;
  };
  for (const auto& [rest_s, dwell_s, altitude_m] :
       {Case{5, 5, 500e3}, Case{60, 20, 500e3}, Case{120, 60, 500e3}, Case{5, 5, 1000e3}}) {
    Scenario scenario = with_orbital_error(scenario_in_eq1(8, minutes(160)), altitude_m);
    auto& imaging = std::get<ImagingProgramme>(scenario.attitude.slews);
    imaging.mean_rest_s = rest_s;
    imaging.dwell_s = dwell_s;
    const sim::SimulatedPass simulated = sim::simulate(scenario);
    CalibrationOptions options;
    options.corrections.interval = minutes(20);
    const NavigationRun run = navigate(simulated.pass, options);
    EXPECT_LT(normalised_square_at_end(simulated, run, 1), altitude_m < 800e3 ? 3 : 10) << rest_s;
    EXPECT_LT(normalised_square_at_end(simulated, run, 2), 3) << rest_s << " " << altitude_m;
  }
}

/// A stamp that is off by hours is rejected, and says nothing of how long the fixes have come.
TEST(Navigate, LearnsTheRateOfTheOrbitThoughSomeStampsAreFarAhead) {
  const Scenario scenario = with_orbital_error(scenario_in_eq1(8, minutes(50)), 1000e3);
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  const Pass& pass = simulated.pass;
  Pipeline pipeline(pass.settings, settled_before(pass.settings, {}));
  std::size_t fix = 0;
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    GyroSample sample = sample_of(pass.gyro, i);
    sample.t += i % 1000 == 100 ? std::chrono::hours(30) : std::chrono::hours(0);
    static_cast<void>(pipeline.feed(sample));
    for (; fix < pass.star_tracker.size() && pass.star_tracker.t[fix] < pass.gyro.t[i]; ++fix) {
      static_cast<void>(pipeline.feed(pass.star_tracker.fix(fix, 0)));
    }
  }
  EXPECT_NEAR(pipeline.options().orbital_rate_rad_s.value_or(0), simulated.truth.orbital_rate_rad_s, 2e-5);
}

/// What is kept to learn the rate of the orbit does not grow for ever, nor by samples that are too close to be used.
TEST(Navigate, KeepsNoTelemetryForEver) {
  const PassSettings& settings = two_hours().pass.settings;
  const GyroSample first = sample_of(two_hours().pass.gyro, 0);
  const auto grown_by = [&](Duration spacing, int samples) {
    Pipeline pipeline(settings, settled_before(settings, {}));
    const auto used = [] { return mallinfo2().uordblks + mallinfo2().hblkhd; };
    const std::size_t before = used();
    GyroSample sample = first;
    for (int i = 0; i < samples; ++i) {
      static_cast<void>(pipeline.feed(sample));
      sample.t += spacing;
      for (int k = 0; k < 2; ++k) {  // otherwise they are stuck
        const Eigen::Vector3d off(std::sin(i + k), std::sin(2 * i + k), std::sin(3 * i + k));
        sample.h_b[k] = (first.h_b[k] + 1e-5 * off).normalized();
      }
    }
    return used() - before;
  };
  constexpr std::size_t kLittle = 1'000'000;
  EXPECT_LT(grown_by(std::chrono::milliseconds(500), 60'000), kLittle);
  EXPECT_LT(grown_by(std::chrono::microseconds(100), 60'000), kLittle);
}

TEST(Navigate, IsCausalWhereTheRateOfTheOrbitIsLearnt) {
  Scenario scenario = scenario_in_eq1(8, minutes(50));
  scenario.orbit.perigee_altitude_m = scenario.orbit.apogee_altitude_m = 1000e3;
  expect_causal(sim::simulate(scenario).pass, {}, {minutes(19), minutes(21), minutes(41)});
}

/// Coefficients that jump by a twentieth of what they are, which no fix is rejected for.
TEST(Navigate, StaysHonestWhereCoefficientsJump) {
  Scenario scenario = scenario_in_eq1(9, std::chrono::hours(4));
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.jump_sigma_rad_s = 1e-7;
    gyro.drift.jump_at_s = 2.5 * 3600;
  }
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  CalibrationOptions options;
  options.corrections.when = CorrectionOptions::When::kEachFix;
  const NavigationRun run = navigate(simulated.pass, options);
  EXPECT_LT(normalised_square_at_end(simulated, run), 3);
  EXPECT_TRUE(run.verdict.has(FindingCode::kSigmasWidened));
  EXPECT_TRUE(run.verdict.trustworthy);
  // What calibrates the whole pass finds the jump, and has nothing to widen.
  EXPECT_EQ(calibrate(simulated.pass, {}).fix_counts[FixStatus::kUsedAfterWidening], 0);
  // Nor is there anything where parameters are held.
  options.corrections.take_parameters = false;
  EXPECT_FALSE(navigate(simulated.pass, options).verdict.has(FindingCode::kSigmasWidened));
}

/// A pass navigated with the values of its own calibration, after they have been spoilt.
template <class Spoil>
NavigationRun navigate_with(const Spoil& spoil) {
  Pass pass = two_hours().pass;
  CalibrationOptions options = told();
  pass.settings.prior = calibrate(pass, options).calibration;
  spoil(*pass.settings.prior);
  options.corrections = {CorrectionOptions::When::kEvery, minutes(30), false};
  return navigate(pass, options);
}

TEST(Navigate, WithAGoodCalibrationHasNoFindings) {
  const NavigationRun run = navigate_with([](Calibration&) {});
  EXPECT_TRUE(run.verdict.trustworthy);
  for (const Finding& finding : run.verdict.findings) {
    ADD_FAILURE() << finding.text << " " << finding.evidence;
  }
  EXPECT_EQ(run.corrections, 5);  // at 0, 30 … 120 min
  EXPECT_EQ(run.corrections_missed, 0);
  EXPECT_EQ(run.open_loops.size(), 4U);
  EXPECT_EQ(run.samples[SampleStatus::kUsed], static_cast<long>(run.attitude.size()));
}

/// One minute of attitude is wrong, which is said; the calibration in use is not to blame for it.
TEST(Navigate, IsNotForbiddenForAFirstFixThatIsAnOutlier) {
  Pass pass = two_hours().pass;
  CalibrationOptions options = told();
  pass.settings.prior = calibrate(pass, options).calibration;
  options.corrections = {CorrectionOptions::When::kEvery, minutes(30), false};
  pass.star_tracker.q_in_c[0] *= Eigen::Quaterniond(Eigen::AngleAxisd(kDegree, Eigen::Vector3d::UnitX()));
  const NavigationRun run = navigate(pass, options);
  EXPECT_TRUE(run.verdict.trustworthy);
  EXPECT_TRUE(run.verdict.has(FindingCode::kReopened));
  EXPECT_FALSE(run.verdict.has(FindingCode::kAttitudeOffFixes));
}

/// As after work on the star tracker: a degree about the orbit normal, which only slews show.
TEST(Navigate, IsForbiddenWhereTheStarTrackerWasRemounted) {
  Pass pass = two_hours().pass;
  CalibrationOptions options = told();
  pass.settings.prior = calibrate(pass, options).calibration;
  options.corrections = {CorrectionOptions::When::kEvery, minutes(30), false};
  for (Eigen::Quaterniond& q_in_c : pass.star_tracker.q_in_c) {
    q_in_c *= Eigen::Quaterniond(Eigen::AngleAxisd(kDegree, Eigen::Vector3d::UnitY()));
  }
  const NavigationRun run = navigate(pass, options);
  EXPECT_TRUE(run.verdict.has(FindingCode::kCalibrationDoesNotFit));
  EXPECT_FALSE(run.verdict.trustworthy);
}

/// Before the pass alignments and coefficients are independent, so that the distance of all is the sum of both.
TEST(Navigate, LooksAtAlignmentsAndCoefficientsForThemselves) {
  const Pass& pass = two_hours().pass;
  Pipeline pipeline(pass.settings, told());
  replay(pass, pipeline, [](const StepReport&) {});
  const auto [all, alignments, of_eq1] = pipeline.distances_from_prior();
  EXPECT_EQ(all.degrees_of_freedom, 20);
  EXPECT_EQ(alignments.degrees_of_freedom, 6);
  EXPECT_EQ(of_eq1.degrees_of_freedom, 14);
  EXPECT_GT(alignments.square, 0.1);
  EXPECT_GT(of_eq1.square, 0.1);
  EXPECT_NEAR(all.square, alignments.square + of_eq1.square, 1e-9 * all.square);
  const NavigationRun moved = navigate_with([](Calibration& calibration) {
    calibration.gyros[0].alignment_rotation_vector_rad.x() += 8 * sigma_of(calibration, ParameterId::alignment(0, 0));
  });
  EXPECT_TRUE(moved.verdict.has(FindingCode::kCalibrationDoesNotFit));
  EXPECT_GT(*moved.held_parameters_misfit, moved.misfit_limit);
}

TEST(Navigate, WithCoefficientsTenThousandTimesTooLargeIsNotToBeUsed) {
  const NavigationRun run = navigate_with([](Calibration& calibration) {
    for (GyroCalibration& gyro : calibration.gyros) {
      for (double& coefficient : gyro.drift_rad_s) {
        coefficient *= 1e4;
      }
    }
  });
  EXPECT_FALSE(run.verdict.trustworthy);
  EXPECT_TRUE(run.verdict.has(FindingCode::kAttitudeIncomplete));
}

TEST(Navigate, WithAnAlignmentFarOffIsNotToBeUsed) {
  const NavigationRun run =
      navigate_with([](Calibration& calibration) { calibration.gyros[0].alignment_rotation_vector_rad.x() += 1; });
  EXPECT_FALSE(run.verdict.trustworthy);
}

TEST(Navigate, OfAPairThatHasLostAGyroPredictsNothing) {
  Pass pass = two_hours().pass;
  const CalibrationOptions options = told();
  EXPECT_TRUE(navigate(pass, options).forecast.has_value());
  const std::size_t lost = pass.gyro.size() - pass.gyro.size() / 8;  // for a quarter of an hour
  for (std::size_t i = lost; i < pass.gyro.size(); ++i) {
    std::copy_n(pass.gyro.h.begin() + static_cast<std::ptrdiff_t>(6 * lost + 3), 3,
                pass.gyro.h.begin() + static_cast<std::ptrdiff_t>(6 * i + 3));
  }
  const NavigationRun run = navigate(pass, options);
  EXPECT_EQ(run.gyros, 2);
  EXPECT_FALSE(run.forecast.has_value());
  EXPECT_FALSE(run.verdict.trustworthy);
  EXPECT_TRUE(run.verdict.has(FindingCode::kGyroStuck));
}

TEST(CorrectionSums, CountsIntervalsOverWhichNoFixCouldCorrect) {
  CorrectionSums sums;
  const auto fix = [&](int t_min, bool corrected, Duration interval = minutes(30)) {
    FixRecord record;
    record.t = Time(minutes(t_min));
    record.corrected_navigator = corrected;
    sums.add(record, interval);
    return sums.missed();
  };
  EXPECT_EQ(fix(0, false), 0);
  EXPECT_EQ(fix(1, true), 0);
  EXPECT_EQ(fix(2, false), 0);
  EXPECT_EQ(fix(32, false), 0);  // due, and refused
  EXPECT_EQ(fix(33, true), 0);
  EXPECT_EQ(fix(500, false), 0);  // after a gap
  EXPECT_EQ(fix(529, false), 0);
  EXPECT_EQ(fix(530, false), 1);
  EXPECT_EQ(fix(559, false), 1);
  EXPECT_EQ(fix(560, true), 1);
  EXPECT_EQ(sums.made(), 3);
  EXPECT_EQ(fix(561, false, Duration::zero()), 2);  // each fix
  EXPECT_EQ(fix(561, false, Duration::max()), 2);   // only the first
}

}  // namespace
}  // namespace trihedron::ground
