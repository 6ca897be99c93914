#include "trihedron/ground/calibrate/calibrate.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "added_drift.hpp"
#include "named.hpp"
#include "passes.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/ground/evaluate/used_fixes.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/records/units.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

using testing::HasSubstr;

/// The first minutes of a pass.
Pass beginning(Pass pass, Duration duration) {
  const auto cut = [&](std::vector<Time>& t) {
    t.erase(std::upper_bound(t.begin(), t.end(), pass.settings.epoch + duration), t.end());
  };
  cut(pass.gyro.t);
  pass.gyro.h.resize(3 * static_cast<std::size_t>(pass.gyro.gyros) * pass.gyro.t.size());
  cut(pass.star_tracker.t);
  pass.star_tracker.q_in_c.resize(pass.star_tracker.t.size());
  return pass;
}

/// (error/σ)² of the attitude in the second half of the pass, mean over axes.
double square_of_attitude(const CalibrationRun& run, const Truth& truth) {
  const AttitudeErrors errors = attitude_errors(run.attitude, truth.t, truth.q_in_c);
  double sum = 0;
  const std::size_t late = errors.t.size() / 2;
  for (std::size_t i = late; i < errors.t.size(); ++i) {
    sum += errors.error_rad[i].cwiseQuotient(errors.sigma_rad[i]).squaredNorm();
  }
  return sum / (3 * static_cast<double>(errors.t.size() - late));
}

// Faster than the polynomials through the readings around a fix follow.
TEST(Calibrate, KnowsHowFarTheAttitudeOfABodyThatShakesIsOff) {
  Scenario scenario;
  scenario.duration = std::chrono::hours(1);
  scenario.attitude.jitter_rad = 2 * kArcsecond;
  scenario.attitude.jitter_bandwidth_hz = 2;
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  const CalibrationRun run = calibrate(simulated.pass, told());
  const double square = square_of_attitude(run, simulated.truth);
  EXPECT_GT(square, 0.7);
  EXPECT_LT(square, 1.6);
  EXPECT_GT(run.attitude.sigma_rad.back().minCoeff(), 1 * kArcsecond);
}

TEST(Calibrate, HasNoAttitudeByAFirstFixThatTheNextContradicts) {
  sim::SimulatedPass simulated = two_hours();
  std::vector<Eigen::Quaterniond>& q_in_c = simulated.pass.star_tracker.q_in_c;
  q_in_c[0] = q_in_c[0] * Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitX()));
  const CalibrationRun run = calibrate(simulated.pass, told());
  EXPECT_EQ(run.fixes[1].status, FixStatus::kRestarted);
  EXPECT_EQ(run.attitude.t.front(), simulated.pass.star_tracker.t[1]);
  const AttitudeErrors errors = attitude_errors(run.attitude, simulated.truth.t, simulated.truth.q_in_c);
  for (std::size_t i = 0; i < errors.t.size(); ++i) {
    EXPECT_LT(errors.error_rad[i].cwiseQuotient(errors.sigma_rad[i]).cwiseAbs().maxCoeff(), 6) << i;
  }
}

TEST(Calibrate, FindsTheTruthWithinItsSigmas) {
  std::vector<double> progress;
  const auto run =
      calibrate(two_hours().pass, {}, [&](std::string_view, double fraction) { progress.push_back(fraction); });
  const Calibration& result = run.calibration;
  for (std::size_t k = 0; k < 2; ++k) {
    const Truth::Gyro& truth = two_hours().truth.gyros[k];
    for (std::size_t i = 0; i < 7; ++i) {
      const Eigen::Index row = rows_of(result, {ParameterId::drift(k, truth.drift_rad_s[i].first)}).front();
      EXPECT_LT(std::abs(result.gyros[k].drift_rad_s[i] - truth.drift_rad_s[i].second),
                4 * std::sqrt(result.covariance(row, row)));
    }
    const Eigen::Vector3d error = alignment_error(result, two_hours().truth, k);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Index row = rows_of(result, {ParameterId::alignment(k, axis)}).front();
      EXPECT_LT(std::abs(error(axis)), 4 * std::sqrt(result.covariance(row, row)));
    }
  }
  EXPECT_EQ(result.on_board_drift.value().drift_model, kEsg7);
  EXPECT_EQ(result.estimator, Estimator::kInvariant);
  EXPECT_TRUE(result.further.empty());
  EXPECT_NEAR(result.statistics.nis_mean.value(), 4, 0.2);
  EXPECT_EQ(result.t, two_hours().pass.gyro.t.back());
  EXPECT_EQ(progress.back(), 1);
}

/// Drift of degrees that no smaller model has, 2 % of eq. (1) each.
Scenario with_drift_outside(std::uint64_t seed, Duration duration) {
  Scenario scenario = scenario_in_eq1(seed, duration);
  for (GyroScenario& gyro : scenario.gyros) {
    for (const int degree : {1, 3, 4, 6}) {
      for (const int order : {-1, 1, 3}) {
        if (order <= degree) {
          gyro.drift.harmonics.push_back({DriftHarmonic::Potential::kW, degree, order, 4e-8});
          gyro.drift.harmonics.push_back({DriftHarmonic::Potential::kD, degree, order, -3e-8});
        }
      }
    }
  }
  return scenario;
}

/// Nothing but the drift is open.
CalibrationOptions with_drift_open(Estimator estimator) {
  CalibrationOptions options;
  options.estimator = estimator;
  options.further_states = FurtherStateOptions::none();
  options.find_noise = false;
  return options;
}

TEST(Calibrate, ADriftFieldKeepsTheSigmasHonest) {
  const sim::SimulatedPass simulated = sim::simulate(with_drift_outside(5, std::chrono::hours(4)));
  CalibrationOptions options = with_drift_open(Estimator::kBatch);
  const Calibration by_field = calibrate(simulated.pass, options).calibration;
  // 20 degrees of freedom: above 45 once in a thousand.
  EXPECT_LT(nees_of(simulated.truth, by_field), 45);
  EXPECT_EQ(by_field.drift_field.size(), 32U);
  ASSERT_TRUE(set_drift_model("esg7", options));
  EXPECT_GT(nees_of(simulated.truth, calibrate(simulated.pass, options).calibration), 1000);
}

/// A body that stands still in space shows the drift at a few directions alone, which eq. (1) explains whatever it is:
/// its coefficients are off by what they make up for.
TEST(Calibrate, CoefficientsThatMakeUpForDriftWithoutEvidenceOfItHaveItInTheirSigmas) {
  Scenario scenario;  // drift outside eq. (1) of a hundredth
  scenario.seed = 5000;
  scenario.duration = std::chrono::hours(2);
  scenario.attitude.reference = AttitudeScenario::Reference::kInertial;
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  const CalibrationRun run = calibrate(simulated.pass, {});
  EXPECT_FALSE(run.evidence.back().accepted);
  EXPECT_EQ(run.calibration.on_board_drift.value().drift_model, kEsg7);
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);  // χ² of 20, once in 1000
}

/// The momenta are those that readings have through the alignments, also where the alignments of the filter stood for
/// drift that its model leaves out, here by half a minute of arc; and where the pair was lost before the end.
TEST(Calibrate, GivesTheMomentaThatAreReadThroughItsAlignments) {
  Scenario scenario;
  scenario.seed = 14;
  scenario.duration = std::chrono::hours(3);
  scenario.attitude.reference = AttitudeScenario::Reference::kYawSteered;
  scenario.attitude.slews = std::vector<Slew>{};
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.outside_sigma_rad_s = 2e-9;
  }
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  const Truth& truth = simulated.truth;
  const auto C_c_b = [](const Eigen::Vector3d& rotation_vector_rad) {
    return Rot<C, B<1>>::exp(Vec<C>::assume(rotation_vector_rad)).raw();
  };
  const auto off_rad = [&](const CalibrationRun& run, std::size_t gyro, std::size_t at) {
    const GyroCalibration& its = run.calibration.gyros.at(gyro);
    const Eigen::Matrix3d C_in_c = truth.q_in_c.at(at).toRotationMatrix();
    const Eigen::Vector3d h_in = Eigen::Map<const Eigen::Vector3d>(&truth.h_in.at(6 * at + 3 * gyro));
    const Eigen::Vector3d h_b = (C_in_c * C_c_b(truth.gyros.at(gyro).alignment_rotation_vector_rad)).transpose() * h_in;
    return angle_between<double>(its.momentum_in, C_in_c * C_c_b(its.alignment_rotation_vector_rad) * h_b);
  };
  const CalibrationRun run = calibrate(simulated.pass, {});
  ASSERT_EQ(run.calibration.on_board_drift.value().drift_model, kEsg7);
  EXPECT_EQ(run.calibration.t, truth.t.back());
  // χ² of 20, once in 1000. With the alignments taken as given it was 2475.
  EXPECT_LT(nees_of(truth, run.calibration), 45);
  // The filter knows the momenta to half an arcsecond, through its own alignments.
  EXPECT_GT(
      angle_between<double>(run.calibration.gyros[0].momentum_in, run.corrections.back().calibrated[0].momentum_in),
      10 * kArcsecond);
  const std::size_t last = truth.t.size() - 1;
  EXPECT_LT(off_rad(run, 0, last), 2 * kArcsecond);
  EXPECT_LT(off_rad(run, 1, last), 2 * kArcsecond);

  // Without a pair there is no attitude, without which the momenta stay where they were.
  constexpr std::size_t kLost = 960;  // samples, two minutes
  Pass lost = simulated.pass;
  const std::size_t end = lost.gyro.size();
  for (std::size_t sample = end - kLost; sample < end; ++sample) {
    std::fill_n(&lost.gyro.h[6 * sample + 3], 3, std::nan(""));
  }
  const Time until = lost.gyro.t[end - kLost - 1];
  const auto then = static_cast<std::size_t>(std::ranges::upper_bound(truth.t, until) - truth.t.begin()) - 1;
  const CalibrationRun without = calibrate(lost, {});
  EXPECT_LT(off_rad(without, 0, then), 4 * kArcsecond);
  EXPECT_LT(off_rad(without, 1, then), 4 * kArcsecond);
}

/// What steady flight does not tell of an alignment is in the momenta as well, since the fixes gave them through it;
/// also what the uncertainty of the spectrum adds.
TEST(Calibrate, InSteadyFlightPredictsTheAttitudeBetterThanItKnowsTheAlignments) {
  Scenario scenario;
  scenario.seed = 6;
  scenario.duration = std::chrono::hours(2);
  scenario.attitude.slews = std::vector<Slew>{};
  const Calibration calibration =
      calibrate(sim::simulate(scenario).pass, with_drift_open(Estimator::kBatch)).calibration;
  EXPECT_GT(sigma_of(calibration, ParameterId::alignment(0, 1)), kArcminute);
  ASSERT_TRUE(calibration.forecast);
  const PredictedError& now = calibration.forecast->errors.front();
  EXPECT_LT(std::sqrt(now.covariance_rad2.diagonal().maxCoeff()), 5 * kArcsecond);
}

TEST(Calibrate, OnBoardTheDriftFieldIsItsLargeMembersWhichMakeUpForTheOthers) {
  const sim::SimulatedPass simulated = sim::simulate(with_drift_outside(5, std::chrono::hours(4)));
  const CalibrationRun run = calibrate(simulated.pass, with_drift_open(Estimator::kInvariant));
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);
  // The calibration has all members; what those on board cannot make up for is less than the noise of a fix in an
  // orbit.
  EXPECT_EQ(run.calibration.gyros.at(0).drift_model, kLargestDriftModel);
  ASSERT_TRUE(run.calibration.on_board_drift);
  EXPECT_EQ(run.calibration.on_board_drift->drift_model, vsh(DriftModelId::kMaxDegreeOnBoard));
  EXPECT_FALSE(run.options.further_states.is_on(FurtherState::kWanderingDrift));
  EXPECT_LT(run.calibration.on_board_drift->random_walk_rad_sqrt_s * std::sqrt(5400), 2 * kArcsecond);
}

/// Its degrees 7 and 8 find no room on board, and its 326 parameters are states of the batch as modes.
TEST(Calibrate, ADriftFieldIsThePriorOfEitherEstimator) {
  const sim::SimulatedPass first = sim::simulate(with_drift_outside(5, std::chrono::hours(4)));
  const Calibration before = calibrate(first.pass, with_drift_open(Estimator::kBatch)).calibration;
  sim::SimulatedPass next =
      sim::simulate(with_gyros_of(first.truth, with_drift_outside(6, std::chrono::hours(2)), std::chrono::hours(24)));
  next.pass.settings.prior = before;
  for (const Estimator estimator : {Estimator::kBatch, Estimator::kInvariant}) {
    const Calibration after = calibrate(next.pass, with_drift_open(estimator)).calibration;
    EXPECT_LT(nees_of(next.truth, after), 45) << static_cast<int>(estimator);
    for (const ParameterId& state : drift_and_alignment(kEsg7, 2)) {
      EXPECT_LT(sigma_of(after, state), 1.05 * sigma_of(before, state)) << static_cast<int>(estimator);
    }
    if (estimator == Estimator::kBatch) {
      EXPECT_EQ(after.drift_field.size(), 32U);
    }
  }
  const NavigationRun held = navigate(next.pass, CalibrationOptions{});
  EXPECT_EQ(held.verdict.trustworthy, true);
}

TEST(Calibrate, ADriftFieldNeedsTheBatch) {
  CalibrationOptions options = told();
  ASSERT_TRUE(set_drift_model("field", options));
  EXPECT_THROW(static_cast<void>(calibrate(two_hours().pass, options)), SetupError);
  ASSERT_TRUE(set_drift_model("vsh:7", options));
  EXPECT_THROW(static_cast<void>(calibrate(two_hours().pass, options)), SetupError);
}

TEST(Calibrate, SmoothsTheAttitude) {
  const auto run = calibrate(two_hours().pass, told());
  const auto errors = attitude_errors(run.attitude, two_hours().truth.t, two_hours().truth.q_in_c);
  const auto last = statistics_by_stretch(errors, two_hours().pass.settings.epoch, std::chrono::minutes(30)).at(3);
  // Single readings give 2″.
  EXPECT_LT(last.rms_rad.maxCoeff(), 1.2 * kArcsecond);
  EXPECT_NEAR(*last.normalised_square, 1, 0.5);
}

TEST(Calibrate, RecordsEveryFixAndSample) {
  const auto run = calibrate(two_hours().pass, told());
  EXPECT_EQ(run.fixes.size(), two_hours().pass.star_tracker.size());
  EXPECT_EQ(run.samples[SampleStatus::kUsed], static_cast<long>(two_hours().pass.gyro.size()));
  EXPECT_EQ(run.fix_counts[FixStatus::kUsed], static_cast<long>(run.fixes.size()) - 1);
  EXPECT_EQ(run.parameters.t.size(), (run.fixes.size() + 9) / 10);  // each tenth is 30 s after the last
  EXPECT_EQ(run.attitude.size(), run.fixes.size());
  EXPECT_EQ(run.navigation.age_s.size(), run.fixes.size());
  EXPECT_GE(run.angle_t.size(), run.fixes.size() - 1);
  EXPECT_EQ(
      std::count_if(run.fixes.begin(), run.fixes.end(), [](const FixRecord& fix) { return fix.corrected_navigator; }),
      2);
  // After the correction at 90 min the open loop holds an arcminute.
  const auto errors = attitude_errors(run.navigation, two_hours().truth.t, two_hours().truth.q_in_c);
  EXPECT_LT(
      statistics_by_stretch(errors, two_hours().pass.settings.epoch, std::chrono::minutes(90)).at(1).max_total_rad,
      2.9e-4);
}

TEST(Calibrate, FliesOnceWhereWhatIsDecidedIsWhatThePassWasScreenedWith) {
  const Pass& pass = two_hours().pass;
  std::vector<double> parts;
  std::vector<std::string> stages;
  const auto progress = [&](std::string_view doing, double part) {
    if (part > 0) {
      parts.push_back(part);
    } else {
      stages.emplace_back(doing);
    }
  };
  const CalibrationRun decided = calibrate(pass, {}, progress);
  EXPECT_EQ(parts, std::vector<double>{1});
  EXPECT_EQ(stages, (std::vector<std::string>{"looks at the clocks", "screens the samples", "decides by eq. (1) alone",
                                              "decides what is there", "finds the noise"}));
  CalibrationOptions options = decided.options;
  options.find_noise = false;
  const CalibrationRun flown = calibrate(pass, options, progress);
  EXPECT_GT(parts.size(), 50U);
  EXPECT_EQ(decided.calibration.estimator, Estimator::kInvariant);
  ASSERT_FALSE(decided.corrections.empty());
  EXPECT_EQ(decided.corrections.back().calibrated[1].momentum_in, flown.corrections.back().calibrated[1].momentum_in);
  EXPECT_EQ(decided.errors.covariance, flown.errors.covariance);
  EXPECT_EQ(decided.attitude.sigma_rad, flown.attitude.sigma_rad);
  EXPECT_EQ(decided.navigation.t, flown.navigation.t);
  EXPECT_EQ(decided.navigation.sigma_rad, flown.navigation.sigma_rad);
}

TEST(Calibrate, StartsFromAnEarlierCalibration) {
  const auto first = calibrate(two_hours().pass, told());
  Pass pass = two_hours().pass;
  pass.settings.prior = first.calibration;
  const auto second = calibrate(pass, told());
  // Known beforehand: the navigator is good from the first minute.
  const auto errors = attitude_errors(second.navigation, two_hours().truth.t, two_hours().truth.q_in_c);
  EXPECT_LT(statistics_by_stretch(errors, pass.settings.epoch, std::chrono::minutes(90)).at(0).max_total_rad, 2.9e-4);
  EXPECT_LT(second.calibration.covariance.trace(), first.calibration.covariance.trace());
}

TEST(Calibrate, KnowsTheReadoutBiasOfAnEarlierCalibration) {
  CalibrationOptions options = told();
  options.further_states[FurtherState::kReadoutBias] = FurtherStateOptions::Choice::kOn;
  const auto first = calibrate(two_hours().pass, options).calibration;
  Pass pass = beginning(two_hours().pass, std::chrono::minutes(10));
  pass.settings.prior = first;
  const auto second = calibrate(pass, options).calibration;
  double largest = 0;
  for (const FurtherEstimate& bias : first.further) {
    largest = std::max(largest, bias.sigma);
  }
  EXPECT_LT(largest, 0.5e-4);
  ASSERT_EQ(second.further.size(), 6U);
  for (const FurtherEstimate& bias : second.further) {
    EXPECT_LE(bias.sigma, 1.0001 * largest);
  }
}

TEST(Calibrate, GoesByTheNoiseOfAnEarlierCalibration) {
  Pass pass = beginning(two_hours().pass, std::chrono::minutes(20));
  Calibration earlier = calibrate(pass, told()).calibration;
  ASSERT_TRUE(earlier.noise.has_value());
  EXPECT_EQ(earlier.noise->direction_random_walk_rad_sqrt_s, told().direction_random_walk_rad_sqrt_s);
  EXPECT_FALSE(earlier.noise->star_tracker_noise_rad.has_value());
  EXPECT_EQ(earlier.noise->wandering_drift_rad_s, 0);
  earlier.noise = CalibrationNoise{1e-7, Eigen::Vector3d(1e-5, 2e-5, 1e-4), 3e-8, 1200};
  pass.settings.prior = earlier;
  const CalibrationRun run = calibrate(pass, {});
  EXPECT_EQ(run.options.direction_random_walk_rad_sqrt_s, 1e-7);
  EXPECT_EQ(run.options.star_tracker_noise_rad, earlier.noise->star_tracker_noise_rad);
  EXPECT_TRUE(run.options.further_states.is_on(FurtherState::kWanderingDrift));
  EXPECT_EQ(run.options.further_states.wandering_drift_rad_s, 3e-8);
  EXPECT_EQ(run.calibration.noise->wandering_time_s, 1200);
  // The walk that is told is the least.
  CalibrationOptions more;
  more.direction_random_walk_rad_sqrt_s = 2e-7;
  EXPECT_EQ(calibrate(pass, more).options.direction_random_walk_rad_sqrt_s, 2e-7);
  // Not where it is told.
  CalibrationOptions options;
  options.find_noise = false;
  EXPECT_EQ(calibrate(pass, options).options.direction_random_walk_rad_sqrt_s,
            options.direction_random_walk_rad_sqrt_s);
}

TEST(Calibrate, WithTwoStarTrackersFindsNoOtherNoiseThanTheirs) {
  Scenario scenario = scenario_in_eq1(12, std::chrono::minutes(55));
  scenario.further_star_trackers.resize(1, scenario.star_tracker);
  scenario.further_star_trackers[0].mounting_rotation_vector_rad = Eigen::Vector3d(1.2, 0, 0);
  const auto run = calibrate(sim::simulate(scenario).pass, {});
  EXPECT_TRUE(run.options.find_noise);
  EXPECT_FALSE(run.options.star_tracker_noise_rad.has_value());
  EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), 4, 0.3);
}

TEST(Calibrate, TellsThatAFurtherStarTrackerHasAClockOfItsOwn) {
  Scenario scenario = scenario_in_eq1(12, std::chrono::hours(2));
  scenario.further_star_trackers.resize(1, scenario.star_tracker);
  scenario.further_star_trackers[0].mounting_rotation_vector_rad = Eigen::Vector3d(1.2, 0, 0);
  const auto severities = [&](double offset_s) {
    scenario.further_star_trackers[0].clock_offset_s = offset_s;
    std::vector<Finding::Severity> found;
    for (const Finding& finding : calibrate(sim::simulate(scenario).pass, told()).calibration.verdict.findings) {
      if (finding.code == FindingCode::kClocksApart) {
        found.push_back(finding.severity);
      }
    }
    return found;
  };
  EXPECT_THAT(severities(0), testing::IsEmpty());
  EXPECT_THAT(severities(-0.02), ElementsAre(Finding::Severity::kDoNotUse));
}

TEST(Calibrate, TellsOneAttitudeWhereTwoStarTrackersHaveAFixAtOneTime) {
  Scenario scenario = scenario_in_eq1(12, std::chrono::minutes(10));
  scenario.further_star_trackers.resize(1, scenario.star_tracker);
  const auto run = calibrate(sim::simulate(scenario).pass, told());
  ASSERT_EQ(run.fixes[0].t, run.fixes[1].t);
  EXPECT_TRUE(std::ranges::is_sorted(run.attitude.t, std::less_equal<>()));
  EXPECT_EQ(run.attitude.t.back(), run.fixes.back().t);
  EXPECT_TRUE(std::ranges::is_sorted(run.navigation.t, std::less_equal<>()));
  EXPECT_EQ(run.navigation.age_s.size(), run.navigation.t.size());
}

TEST(Calibrate, TakesAStarTrackerThatSaysNothingForHalfOfThePass) {
  Pass pass = beginning(two_hours().pass, std::chrono::minutes(20));
  for (std::size_t i = pass.star_tracker.size() / 2; i < pass.star_tracker.size(); ++i) {
    pass.star_tracker.q_in_c[i].coeffs().setConstant(std::nan(""));
  }
  const auto run = calibrate(pass, told());
  EXPECT_EQ(used_fixes(pass, run.fixes).size(), pass.star_tracker.size() / 2);
}

TEST(UsedFixes, AreThoseOfTheFirstStarTrackerInOrderOfTime) {
  Pass pass;
  std::vector<FixRecord> fixes;
  const auto at = [](int s) { return Time(std::chrono::seconds(s)); };
  for (const int s : {10, 11, 12, 12}) {
    pass.star_tracker.t.push_back(at(s));
    pass.star_tracker.q_in_c.push_back(Eigen::Quaterniond::Identity());
  }
  pass.star_tracker.q_in_c[1].coeffs().setConstant(std::nan(""));
  const auto record = [&](int s, int head, FixStatus status) {
    FixRecord fix;
    fix.t = at(s);
    fix.head = head;
    fix.status = status;
    fixes.push_back(fix);
  };
  record(11, 0, FixStatus::kRejectedNotRotation);  // at once
  record(12, 0, FixStatus::kRejectedOutOfOrder);
  record(10, 0, FixStatus::kUsed);
  record(11, 1, FixStatus::kUsed);
  record(12, 0, FixStatus::kUsed);
  EXPECT_THAT(used_fixes(pass, fixes).t, testing::ElementsAre(at(10), at(12)));
}

TEST(Calibrate, UsesThePriorsOfThePass) {
  Pass pass = two_hours().pass;
  pass.settings.gyros[1].drift_rad_s[coefficient("nu12")] = two_hours().truth.gyros[1].drift_rad_s[4].second;
  pass.settings.gyros[1].drift_sigma_rad_s[coefficient("nu12")] = 1e-12;
  const auto run = calibrate(pass, told());
  EXPECT_LE(std::sqrt(run.calibration.covariance(14, 14)), 1.001e-12);
  EXPECT_EQ(run.calibration.states[14], parameter("gyro2.nu12"));
}

TEST(Navigate, GivesAnAttitudeForEverySampleAndAHonestSigma) {
  CalibrationOptions options = told();
  options.corrections.interval = std::chrono::minutes(30);
  const auto run = navigate(two_hours().pass, options);
  // From when the samples round the first fix are there.
  EXPECT_GT(run.attitude.size(), two_hours().pass.gyro.size() - 20);
  EXPECT_TRUE(run.verdict.trustworthy);
  const auto errors = attitude_errors(run.attitude, two_hours().truth.t, two_hours().truth.q_in_c);
  // The last half hour: 600 epochs whose readout noise is independent; parameters are shared, hence the wide band.
  EXPECT_NEAR(
      *statistics_by_stretch(errors, two_hours().pass.settings.epoch, std::chrono::minutes(30)).at(3).normalised_square,
      1, 0.5);
}

TEST(Navigate, HoldsTheParametersItWasGiven) {
  Pass pass = two_hours().pass;
  pass.settings.prior = calibrate(pass, told()).calibration;
  CalibrationOptions options = told();
  options.corrections.when = CorrectionOptions::When::kOnlyFirst;
  options.corrections.take_parameters = false;
  const auto run = navigate(pass, options);
  EXPECT_NEAR(run.attitude.age_s.back(), 7200, 0.2);
  const auto errors = attitude_errors(run.attitude, two_hours().truth.t, two_hours().truth.q_in_c);
  EXPECT_LT(statistics(errors).max_total_rad, 5e-4);
}

TEST(Navigate, KnowsHowWrongTheParametersItHoldsMayBe) {
  // Nothing known beforehand, and nothing taken over: minutes of error, under sigmas of minutes.
  CalibrationOptions options = told();
  options.corrections.take_parameters = false;
  const auto run = navigate(two_hours().pass, options);
  const auto errors = attitude_errors(run.attitude, two_hours().truth.t, two_hours().truth.q_in_c);
  const auto whole = statistics(errors);
  EXPECT_GT(whole.max_total_rad, 1e-3);
  // One draw of the parameters for the whole pass: the mean square is about one, within a factor of several.
  EXPECT_LT(*whole.normalised_square, 4);
  ASSERT_TRUE(run.held_parameters_misfit.has_value());
  EXPECT_LT(*run.held_parameters_misfit, run.misfit_limit);  // the truth is a draw from the prior
}

/// The filter that runs along knows much at the end of the pass; what nothing takes over makes no attitude better.
TEST(Navigate, PredictsByTheParametersThatACorrectionTookOver) {
  CalibrationOptions options = told();
  options.need = Need{5 * kArcminute, std::chrono::hours(1)};
  const auto met = [&](CorrectionOptions::When when) {
    options.corrections.when = when;
    return navigate(two_hours().pass, options).forecast.value().need.value().met;
  };
  EXPECT_FALSE(met(CorrectionOptions::When::kOnlyFirst));
  EXPECT_TRUE(met(CorrectionOptions::When::kEvery));
  EXPECT_TRUE(met(CorrectionOptions::When::kEachFix));
}

TEST(Replay, TellsOfFixesAfterTheLastSample) {
  Pass pass = two_hours().pass;
  pass.gyro.t.resize(8 * 3600);
  pass.gyro.h.resize(6 * pass.gyro.t.size());
  const auto run = calibrate(pass, told());
  EXPECT_EQ(run.fixes.size(), pass.star_tracker.size());
  EXPECT_EQ(run.fix_counts[FixStatus::kRejectedNoGyro], 1201);  // from 3600 s on, 7200 s among them
}

std::string setup_error(const Pass& pass, const CalibrationOptions& options = {}) {
  try {
    static_cast<void>(calibrate(pass, options));
  } catch (const SetupError& error) {
    EXPECT_FALSE(error.cure().empty());
    return error.what();
  }
  return "no error";
}

TEST(SetupError, NamesWhatCannotWork) {
  const Pass good = beginning(two_hours().pass, std::chrono::minutes(2));
  CalibrationOptions options;
  options.drift_model = vsh(9);
  EXPECT_THAT(setup_error(good, options), HasSubstr("vsh:9"));
  options = {};
  options.gate_nis = 0;
  EXPECT_THAT(setup_error(good, options), HasSubstr("gate"));
  options = {};
  options.direction_random_walk_rad_sqrt_s = -1;
  EXPECT_THAT(setup_error(good, options), HasSubstr("noise"));
  options = {};
  options.estimator = Estimator::kPaper;
  options.further_states[FurtherState::kClockOffset] = FurtherStateOptions::Choice::kOn;
  EXPECT_THAT(setup_error(good, options), HasSubstr("no further states"));

  Pass pass = good;
  pass.settings.gyros[0].drift_sigma_rad_s[coefficient("W(5,0)")] = 1;
  EXPECT_THAT(setup_error(pass), HasSubstr("W(5,0)"));
  pass = good;
  pass.settings.gyros[1].drift_common_sigma_rad_s = 0;
  EXPECT_THAT(setup_error(pass), HasSubstr("positive definite"));
  pass = good;
  pass.settings.gyros[0].drift_rad_s[coefficient("k0")] = std::nan("");
  EXPECT_THAT(setup_error(pass), HasSubstr("mean"));
  pass = good;
  pass.settings.gyros.pop_back();
  EXPECT_THAT(setup_error(pass), HasSubstr("needs two to 4 gyros; the pass has 1"));
  pass = good;
  pass.star_tracker = {};
  EXPECT_THAT(setup_error(pass), HasSubstr("no fix could be used"));
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    std::copy_n(&pass.gyro.h[6 * i], 3, &pass.gyro.h[6 * i + 3]);
  }
  pass.star_tracker = good.star_tracker;
  EXPECT_THAT(setup_error(pass), HasSubstr("parallel"));
  try {
    static_cast<void>(navigate(pass, {}));
    FAIL() << "no attitude by momenta on one line";
  } catch (const SetupError& error) {
    EXPECT_THAT(error.cure(), HasSubstr("along other directions"));
  }
}

TEST(SetupError, NamesADriftModelThatEstimatorPaperDoesNotHave) {
  const Pass pass = beginning(two_hours().pass, std::chrono::minutes(2));
  CalibrationOptions options = told();
  options.estimator = Estimator::kPaper;
  for (const DriftModelId& model : {kEsg20, vsh(1)}) {
    options.drift_model = model;
    EXPECT_THAT(setup_error(pass, options), HasSubstr("eq. (1) alone"));
  }
}

TEST(Calibrate, TakesDriftModelsOfAnyDegreeOnBoard) {
  Pass pass = beginning(two_hours().pass, std::chrono::minutes(20));
  CalibrationOptions options = told();
  options.drift_model = vsh(1);
  const Calibration calibration = calibrate(pass, options).calibration;
  EXPECT_EQ(calibration.estimator, Estimator::kInvariant);
  EXPECT_EQ(calibration.states.size(), 2 * (13 + 3U));
  EXPECT_EQ(calibration.gyros[0].drift_rad_s.size(), 13U);
  // The next pass, or the navigator, goes on with it.
  pass.settings.prior = calibration;
  options.drift_model.reset();
  EXPECT_EQ(calibrate(pass, options).calibration.gyros[0].drift_model, vsh(1));
  const auto run = navigate(pass, {});
  const auto errors = attitude_errors(run.attitude, two_hours().truth.t, two_hours().truth.q_in_c);
  EXPECT_LT(statistics(errors).max_total_rad, 5e-4);
}

/// Known to a second of arc, and then one of them has moved by half a minute: fixes in slews are rejected, and what is
/// estimated stays where it was.
TEST(Calibrate, DoesNotTrustAnEarlierCalibrationOfACaseThatHasMoved) {
  const sim::SimulatedPass first = sim::simulate(scenario_in_eq1(11, std::chrono::hours(4)));
  const Calibration before = calibrate(first.pass, told()).calibration;
  Pass next =
      sim::simulate(with_gyros_of(first.truth, scenario_in_eq1(12, std::chrono::hours(2)), std::chrono::hours(24)))
          .pass;
  EXPECT_FALSE(calibrate(next, told()).by_pass_alone);
  next.settings.prior = before;
  const CalibrationRun same = calibrate(next, told());
  EXPECT_TRUE(same.by_pass_alone);
  EXPECT_FALSE(same.calibration.verdict.has(FindingCode::kPriorContradicted));
  const Eigen::Matrix3d moved = Rot<C, C>::exp(Vec<C>::assume(0, 30 * kArcsecond, 0)).raw();
  for (std::size_t i = 0; i < next.gyro.t.size(); ++i) {
    Eigen::Map<Eigen::Vector3d> reading(next.gyro.h.data() + 6 * i);
    reading = moved * reading.eval();
  }
  const Verdict verdict = calibrate(next, told()).calibration.verdict;
  const auto found = std::ranges::find(verdict.findings, FindingCode::kPriorContradicted, &Finding::code);
  ASSERT_NE(found, verdict.findings.end());
  EXPECT_THAT(found->evidence, HasSubstr("of 20 degrees of freedom"));  // by the pass alone
}

TEST(SetupError, NamesWhatIsWrongWithAnEarlierCalibration) {
  Pass pass = beginning(two_hours().pass, std::chrono::minutes(20));
  const Calibration good = calibrate(pass, told()).calibration;
  pass.settings.prior = good;
  pass.settings.prior->gyros.pop_back();
  EXPECT_THAT(setup_error(pass), HasSubstr("has 1 gyros; the pass has 2"));
  pass.settings.prior = good;
  pass.settings.prior->gyros[1].drift_model = vsh(3);
  EXPECT_THAT(setup_error(pass), HasSubstr("vsh:3"));
  pass.settings.prior = good;
  pass.settings.prior->states[3] = parameter("gyro1.W(5,0)");
  EXPECT_THAT(setup_error(pass), HasSubstr("gyro1.mu31"));
  pass.settings.prior = good;
  pass.settings.prior->covariance.setZero();
  EXPECT_THAT(setup_error(pass), HasSubstr("positive definite"));
  pass.settings.prior = good;
  pass.settings.prior->gyros[1].orbital_drift.emplace();
  CalibrationOptions paper;
  paper.estimator = Estimator::kPaper;
  EXPECT_THROW(static_cast<void>(navigate(pass, paper)), SetupError);
  pass.settings.prior->gyros[1].orbital_drift.reset();
  pass.settings.prior->gyros[1].polhode.emplace();
  EXPECT_THROW(static_cast<void>(navigate(pass, paper)), SetupError);
  pass.settings.prior->gyros[1].polhode.reset();
  EXPECT_NO_THROW(static_cast<void>(navigate(pass, paper)));
}

TEST(Calibrate, DecidesByItselfForClockOffsetAndErrorAtOrbitalPeriod) {
  Scenario scenario = scenario_in_eq1(6, std::chrono::hours(2));
  scenario.star_tracker.clock_offset_s = 0.01;
  scenario.star_tracker.orbital_sine_rad = Eigen::Vector3d(6, -5, 8) * kArcsecond;
  const auto simulated = sim::simulate(scenario);
  const auto run = calibrate(simulated.pass, {});
  ASSERT_EQ(run.calibration.further.size(), 7U);
  EXPECT_EQ(run.calibration.on_board_drift.value().drift_model, kEsg7);
  const Truth::StarTracker& truth = simulated.truth.star_trackers[0];
  for (const FurtherEstimate& estimate : run.calibration.further) {
    const double expected = estimate.parameter == parameter("clock_offset_s")       ? truth.clock_offset_s
                            : estimate.parameter == parameter("orbital_sine_x_rad") ? truth.orbital_sine_rad.x()
                            : estimate.parameter == parameter("orbital_sine_y_rad") ? truth.orbital_sine_rad.y()
                            : estimate.parameter == parameter("orbital_sine_z_rad") ? truth.orbital_sine_rad.z()
                                                                                    : 0;
    EXPECT_LT(std::abs(estimate.value - expected), 4 * estimate.sigma) << name_of(estimate.parameter);
  }
  EXPECT_LT(run.calibration.further[0].sigma, 5e-4);
  EXPECT_GT(run.orbital_error_over_drift.value(), 5);
}

// With a state for the first head alone the error of the second one goes into the attitude, which is then trusted.
TEST(Calibrate, FindsTheErrorAtOrbitalPeriodOfEachStarTracker) {
  Scenario scenario = scenario_in_eq1(6, std::chrono::hours(4));
  StarTrackerScenario& second = scenario.further_star_trackers.emplace_back(scenario.star_tracker);
  second.mounting_rotation_vector_rad = Eigen::Vector3d(0, 1, 0);
  second.orbital_sine_rad = Eigen::Vector3d(2, -3, 4) * kArcsecond;
  second.orbital_cosine_rad = Eigen::Vector3d(-2.5, 1.5, 3) * kArcsecond;
  const auto simulated = sim::simulate(scenario);
  const auto run = calibrate(simulated.pass, {});
  EXPECT_LT(square_of_attitude(run, simulated.truth), 1.5);
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);
  const auto of_second = [](const FurtherEstimate& estimate) {
    return name_of(estimate.parameter) == "star_tracker_2_orbital_sine_y_rad" &&
           std::abs(estimate.value) > 5 * estimate.sigma;
  };
  EXPECT_TRUE(std::ranges::any_of(run.calibration.further, of_second));
  const auto told =
      std::ranges::find(run.calibration.verdict.findings, FindingCode::kOrbitalErrorFound, &Finding::code);
  ASSERT_NE(told, run.calibration.verdict.findings.end());
  EXPECT_THAT(told->evidence, HasSubstr("of star tracker 2"));
}

/// Error of the alignment of a gyro, about the worst axis.
double worst_in_sigmas(const Calibration& calibration, const Truth& truth, std::size_t gyro) {
  const Eigen::Array3d error = alignment_error(calibration, truth, gyro).array();
  const Eigen::Index row = rows_of(calibration, {ParameterId::alignment(gyro, 0)})[0];
  return (error / calibration.covariance.diagonal().segment<3>(row).array().sqrt()).abs().maxCoeff();
}

TEST(Calibrate, DoesNotTakeDriftAtOrbitalPeriodForAnErrorOfTheStarTracker) {
  Scenario scenario;
  scenario.seed = 1;
  scenario.duration = std::chrono::hours(9);
  const auto simulated = sim::simulate(scenario);
  Pass pass = simulated.pass;
  add_orbital_drift(simulated.truth, {4e-8, -3e-8, 2e-8}, {-2e-8, 3e-8, 5e-8}, 0, pass.gyro);
  add_orbital_drift(simulated.truth, {-3e-8, 5e-8, 1e-8}, {4e-8, 2e-8, -3e-8}, 1, pass.gyro);
  const auto run = calibrate(pass, {});
  EXPECT_LT(run.orbital_error_over_drift.value(), -5);
  EXPECT_THAT(run.calibration.verdict.findings,
              ElementsAre(testing::Field(&Finding::code, FindingCode::kOrbitalDriftFound)));
  ASSERT_EQ(run.calibration.further.size(), 12U);
  EXPECT_LT(run.calibration.further[0].sigma, 1e-8);
  const auto errors = attitude_errors(run.attitude, simulated.truth.t, simulated.truth.q_in_c);
  double beyond = 0;
  for (std::size_t i = 0; i < errors.t.size(); ++i) {
    beyond += errors.error_rad[i].cwiseQuotient(errors.sigma_rad[i]).cwiseAbs().maxCoeff() > 4 ? 1 : 0;
  }
  EXPECT_LT(beyond, 0.01 * static_cast<double>(errors.t.size()));
  for (std::size_t gyro = 0; gyro < 2; ++gyro) {
    EXPECT_LT(worst_in_sigmas(run.calibration, simulated.truth, gyro), 4);
  }
}

// Each of the two alone is likelier than neither, and the drift is small enough for a field to take up most of it.
TEST(Calibrate, FindsDriftBesideAnErrorOfTheStarTrackerAtOrbitalPeriod) {
  Scenario scenario = scenario_in_eq1(4, std::chrono::hours(9));
  scenario.star_tracker.orbital_sine_rad = Eigen::Vector3d(6, -8, 5) * kArcsecond;
  const auto simulated = sim::simulate(scenario);
  Pass pass = simulated.pass;
  add_orbital_drift(simulated.truth, {1.5e-8, -1e-8, 2e-8}, {-1e-8, 2e-8, 1e-8}, 0, pass.gyro);
  add_orbital_drift(simulated.truth, {-2e-8, 1e-8, 1e-8}, {1e-8, 1.5e-8, -2e-8}, 1, pass.gyro);
  const auto run = calibrate(pass, {});
  EXPECT_THAT(run.calibration.verdict.findings,
              UnorderedElementsAre(testing::Field(&Finding::code, FindingCode::kOrbitalErrorFound),
                                   testing::Field(&Finding::code, FindingCode::kOrbitalDriftFound)));
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);
}

TEST(Calibrate, FollowsCoefficientsThatChangeEvenly) {
  Scenario scenario = scenario_in_eq1(4, std::chrono::hours(9));
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.warm_up_fraction = 0.2;
    gyro.drift.warm_up_time_s = 1e5;  // of which a pass sees the begin
  }
  const auto simulated = sim::simulate(scenario);
  const auto run = calibrate(simulated.pass, {});
  EXPECT_THAT(run.calibration.verdict.findings,
              ElementsAre(testing::Field(&Finding::code, FindingCode::kCoefficientsChanged)));
  EXPECT_EQ(run.options.further_states.change_course, CourseOfChange::Kind::kEven);
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);
}

/// 360 fixes in three hours.
Scenario scenario_of_few_fixes(std::uint64_t seed) {
  Scenario scenario = scenario_in_eq1(seed, std::chrono::hours(3));
  scenario.star_tracker_period = std::chrono::seconds(30);
  return scenario;
}

TEST(Calibrate, FindsTheNoiseOfFewFixes) {
  Scenario scenario = scenario_of_few_fixes(2);
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.markov_sigma_rad_s = 2e-8;
  }
  const auto simulated = sim::simulate(scenario);
  const auto run = calibrate(simulated.pass, {});
  EXPECT_TRUE(run.options.find_noise);
  EXPECT_EQ(run.options.star_tracker_noise_rad, std::nullopt);  // what so few show of it may be chance
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);
  EXPECT_LT(square_of_attitude(run, simulated.truth), 1.5);
}

TEST(Calibrate, FindsNoNoiseByLessThanAHundredFixes) {
  Scenario scenario = scenario_of_few_fixes(2);
  scenario.star_tracker_period = std::chrono::seconds(110);
  const auto simulated = sim::simulate(scenario);
  EXPECT_FALSE(calibrate(simulated.pass, {}).options.find_noise);
}

// As in the magnetic field of the Earth, which turns both momenta nearly alike: no residual contradicts an error of the
// star tracker.
TEST(Calibrate, DoesNotTrustAnErrorAtOrbitalPeriodThatMayBeDriftOfAllGyros) {
  const auto simulated = sim::simulate(scenario_in_eq1(1, std::chrono::hours(9)));
  Pass pass = simulated.pass;
  add_magnetic_drift(simulated.truth, 1e-8, 0, pass.gyro);
  add_magnetic_drift(simulated.truth, 1.2e-8, 1, pass.gyro);
  const auto run = calibrate(pass, {});
  EXPECT_LT(run.orbital_error_over_drift.value(), 5);
  EXPECT_THAT(run.calibration.verdict.findings,
              Contains(AllOf(testing::Field(&Finding::code, FindingCode::kOrbitalErrorFound),
                             testing::Field(&Finding::severity, Finding::Severity::kDoNotUse))));
}

/// One fix, then the whole pass by the earlier calibration: the largest sigma at its end. The error there is within it.
double sigma_after_one_fix_rad(const sim::SimulatedPass& simulated, Estimator estimator) {
  CalibrationOptions open_loop;
  open_loop.estimator = estimator;
  open_loop.corrections.when = CorrectionOptions::When::kOnlyFirst;
  Pass one_fix = simulated.pass;
  one_fix.star_tracker.t.resize(1);
  one_fix.star_tracker.q_in_c.resize(1);
  const NavigationRun flown = navigate(one_fix, open_loop);
  const AttitudeErrors errors = attitude_errors(flown.attitude, simulated.truth.t, simulated.truth.q_in_c);
  const Eigen::Vector3d last_sigma_rad = errors.sigma_rad.back();
  EXPECT_LT(errors.error_rad.back().cwiseQuotient(last_sigma_rad).cwiseAbs().maxCoeff(), 4);
  return last_sigma_rad.maxCoeff();
}

/// Polhodes of two rotors.
std::array<PolhodeDrift, 2> two_polhodes(Time epoch) {
  std::array<PolhodeDrift, 2> polhodes;
  polhodes[0].polhode = {4200, 0.02F};
  polhodes[0].sine_rad_s << 2e-7, -1e-7, 3e-7, 1e-7, -2e-7, 2e-7, 1e-7;
  polhodes[0].cosine_rad_s << -1e-7, 2e-7, 1e-7, -2e-7, 3e-7, 1e-7, -1e-7;
  polhodes[1].polhode = {6100, -0.01F};
  polhodes[1].sine_rad_s << -1e-7, 3e-7, 2e-7, -2e-7, 1e-7, -1e-7, 2e-7;
  polhodes[1].cosine_rad_s << 2e-7, 1e-7, -1e-7, 3e-7, 2e-7, -2e-7, 1e-7;
  polhodes[0].zero_at = polhodes[1].zero_at = epoch;
  return polhodes;
}

/// Of the amplitudes with the polhodes, told from the epoch of the calibration on.
void expect_amplitudes(const Calibration& calibration, const std::array<PolhodeDrift, 2>& truth) {
  ASSERT_EQ(calibration.further.size(), 28U);
  for (const FurtherEstimate& its : calibration.further) {
    const PolhodeDrift told = truth[its.parameter.owner].from(calibration.epoch);
    const int component = its.parameter.component;
    const double expected = component < 7 ? told.sine_rad_s(component) : told.cosine_rad_s(component - 7);
    EXPECT_LT(std::abs(its.value - expected), 4.5 * its.sigma) << name_of(its.parameter);
  }
}

TEST(Calibrate, FindsThePolhodeOfEachRotor) {
  sim::SimulatedPass simulated = sim::simulate(scenario_in_eq1(8, std::chrono::hours(6)));
  const std::array<PolhodeDrift, 2> truth = two_polhodes(simulated.pass.settings.epoch);
  for (int k = 0; k < 2; ++k) {
    add_polhode(simulated.truth, truth[static_cast<std::size_t>(k)], k, simulated.pass.gyro);
  }
  const CalibrationRun run = calibrate(simulated.pass, {});
  EXPECT_THAT(run.calibration.verdict.findings,
              ElementsAre(testing::Field(&Finding::code, FindingCode::kPolhodeFound)));
  EXPECT_TRUE(run.calibration.verdict.trustworthy);
  for (std::size_t k = 0; k < 2; ++k) {
    const Polhode& found = run.calibration.gyros[k].polhode.value().polhode;
    for (const double hours : {2, 4, 6}) {
      EXPECT_NEAR(found.angle_rad(3600 * hours), truth[k].polhode.angle_rad(3600 * hours), 0.1) << k << " " << hours;
    }
    EXPECT_LT(worst_in_sigmas(run.calibration, simulated.truth, k), 4);
  }
}

TEST(Calibrate, CarriesThePolhodesOnToAnotherPass) {
  sim::SimulatedPass first = sim::simulate(scenario_in_eq1(6, std::chrono::hours(3)));
  const std::array<PolhodeDrift, 2> truth = two_polhodes(first.pass.settings.epoch);
  // Another flight, at other angles of the polhodes.
  sim::SimulatedPass next =
      sim::simulate(with_gyros_of(first.truth, scenario_in_eq1(7, std::chrono::hours(3)), std::chrono::minutes(437)));
  CalibrationOptions options = told();
  options.further_states[FurtherState::kPolhode] = FurtherStateOptions::Choice::kOn;
  for (int k = 0; k < 2; ++k) {
    const PolhodeDrift& its = truth[static_cast<std::size_t>(k)];
    options.further_states.polhodes[k] = its.polhode;
    add_polhode(first.truth, its, k, first.pass.gyro);
    add_polhode(next.truth, its.from(next.pass.settings.epoch), k, next.pass.gyro);
  }
  for (const Estimator estimator : {Estimator::kInvariant, Estimator::kBatch}) {
    options.estimator = estimator;
    const Calibration before = calibrate(first.pass, options).calibration;
    EXPECT_EQ(before.amplitude_covariance.rows(), 28);
    EXPECT_EQ(before.amplitude_covariance.cols(), 48);
    expect_amplitudes(before, truth);
    next.pass.settings.prior = before;
    CalibrationOptions again;
    again.estimator = estimator;
    const Calibration after = calibrate(next.pass, again).calibration;
    expect_amplitudes(after, truth);
    EXPECT_LT(after.further[0].sigma, before.further[0].sigma);
    EXPECT_LT(nees_of(next.truth, after), 45);
    EXPECT_LT(sigma_after_one_fix_rad(next, estimator), kArcminute);
  }
}

TEST(Calibrate, CarriesDriftAtOrbitalPeriodOnToAnotherPass) {
  sim::SimulatedPass first = sim::simulate(scenario_in_eq1(6, std::chrono::hours(3)));
  const Time epoch = first.pass.settings.epoch;
  const std::array<OrbitalDrift, 2> truth = {
      OrbitalDrift{{4e-8, -3e-8, 2e-8}, {-2e-8, 3e-8, 5e-8}, kOrbitalRate_rad_s, epoch},
      OrbitalDrift{{-3e-8, 5e-8, 1e-8}, {4e-8, 2e-8, -3e-8}, kOrbitalRate_rad_s, epoch}};
  const auto add = [&truth](sim::SimulatedPass& to) {
    for (int k = 0; k < 2; ++k) {
      const OrbitalDrift its = truth[static_cast<std::size_t>(k)].from(to.pass.settings.epoch);
      add_orbital_drift(to.truth, its.sine_rad_s, its.cosine_rad_s, k, to.pass.gyro);
    }
  };
  add(first);
  // Another flight, at another phase of the orbit.
  sim::SimulatedPass next =
      sim::simulate(with_gyros_of(first.truth, scenario_in_eq1(7, std::chrono::hours(3)), std::chrono::minutes(437)));
  add(next);
  CalibrationOptions options = told();
  options.orbital_rate_rad_s = kOrbitalRate_rad_s;
  options.further_states[FurtherState::kOrbitalDrift] = FurtherStateOptions::Choice::kOn;
  for (const Estimator estimator : {Estimator::kInvariant, Estimator::kBatch}) {
    options.estimator = estimator;
    const Calibration before = calibrate(first.pass, options).calibration;
    EXPECT_EQ(before.amplitude_covariance.rows(), 12);
    EXPECT_EQ(before.amplitude_covariance.cols(), 32);
    next.pass.settings.prior = before;
    CalibrationOptions again;
    again.estimator = estimator;
    const Calibration after = calibrate(next.pass, again).calibration;
    ASSERT_EQ(after.further.size(), 12U);
    for (std::size_t i = 0; i < 12; ++i) {
      const FurtherEstimate& its = after.further[i];
      const OrbitalDrift told = truth[its.parameter.owner].from(next.pass.settings.epoch);
      const int component = its.parameter.component;
      const double expected = component < 3 ? told.sine_rad_s(component) : told.cosine_rad_s(component - 3);
      EXPECT_LT(std::abs(its.value - expected), 4.5 * its.sigma) << name_of(its.parameter);
      EXPECT_LT(its.sigma, before.further[i].sigma) << name_of(its.parameter);
    }
    EXPECT_LT(nees_of(next.truth, after), 45);
    const double sigma_rad = sigma_after_one_fix_rad(next, estimator);
    EXPECT_LT(sigma_rad, kArcminute);
    // Without what the estimates have in common it would know less, here by an eighth.
    next.pass.settings.prior->amplitude_covariance.resize(0, 0);
    EXPECT_GT(sigma_after_one_fix_rad(next, estimator), 1.08 * sigma_rad);
  }
}

TEST(Calibrate, DoesNotTakeARandomWalkForDriftThatWanders) {
  Scenario scenario = scenario_in_eq1(11, std::chrono::minutes(55));
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.direction_walk_rad_sqrt_s = 1e-7;
  }
  const auto run = calibrate(sim::simulate(scenario).pass, {});
  const auto wandering =
      std::ranges::find(run.evidence, std::optional(FurtherState::kWanderingDrift), &Evidence::state);
  ASSERT_NE(wandering, run.evidence.end());
  EXPECT_FALSE(wandering->accepted);
  EXPECT_NEAR(run.options.direction_random_walk_rad_sqrt_s, 1e-7, 0.3e-7);
  EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), 4, 0.3);
}

TEST(Calibrate, FindsTheBiasOfTheReadoutsAndDriftThatWanders) {
  Scenario scenario = scenario_in_eq1(7, std::chrono::hours(4));
  const Eigen::Vector3d bias = Eigen::Vector3d(10, -15, 20) * kArcsecond;
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.markov_sigma_rad_s = 1e-7;
    gyro.drift.markov_time_s = 1200;
    gyro.readout.bias_rad = bias;
  }
  const auto simulated = sim::simulate(scenario);
  const auto run = calibrate(simulated.pass, {});
  const auto accepted = [&](std::optional<FurtherState> state) {
    return std::any_of(run.evidence.begin(), run.evidence.end(),
                       [&](const Evidence& evidence) { return evidence.state == state && evidence.accepted; });
  };
  EXPECT_TRUE(accepted(FurtherState::kWanderingDrift));
  EXPECT_TRUE(accepted(FurtherState::kReadoutBias));
  EXPECT_FALSE(accepted(FurtherState::kClockOffset));
  EXPECT_FALSE(accepted(FurtherState::kOrbitalError));
  EXPECT_FALSE(accepted({}));
  const FurtherStateOptions& states = run.options.further_states;
  EXPECT_TRUE(states.is_on(FurtherState::kWanderingDrift));
  EXPECT_LT(std::abs(std::log(states.wandering_drift_rad_s / 1e-7)), std::log(3.0));
  EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), 4, 0.15);
  ASSERT_EQ(run.calibration.further.size(), 6U);
  EXPECT_EQ(run.calibration.further[4].parameter, parameter("gyro2_readout_bias_y_rad"));
  for (std::size_t i = 0; i < 6; ++i) {
    const FurtherEstimate& estimate = run.calibration.further[i];
    EXPECT_LT(std::abs(estimate.value - bias(static_cast<Eigen::Index>(i % 3))), 4 * estimate.sigma)
        << name_of(estimate.parameter);
    EXPECT_EQ(run.calibration.gyros[i / 3].readout_bias(static_cast<Eigen::Index>(i % 3)), estimate.value);
  }
  for (std::size_t k = 0; k < 2; ++k) {
    const Eigen::Vector3d error = alignment_error(run.calibration, simulated.truth, k);
    const Eigen::Index row = rows_of(run.calibration, {ParameterId::alignment(k, 0)}).front();
    const Eigen::Matrix3d covariance = run.calibration.covariance.block<3, 3>(row, row);
    EXPECT_LT(error.dot(covariance.llt().solve(error)), 22);  // χ² of 3, once in 15 000
  }
}

TEST(Calibrate, FindsLevelAndTimeOfDriftThatWanders) {
  // Within minutes such drift is alike where both are larger or both smaller; forecasts of hours are not.
  for (const double time_s : {1200.0, 10800.0}) {
    Scenario scenario = scenario_in_eq1(3, std::chrono::hours(9));
    scenario.gyro_period = std::chrono::milliseconds(500);
    for (GyroScenario& gyro : scenario.gyros) {
      gyro.drift.markov_sigma_rad_s = 5e-8;
      gyro.drift.markov_time_s = time_s;
    }
    const auto run = calibrate(sim::simulate(scenario).pass, {});
    const FurtherStateOptions& found = run.options.further_states;
    EXPECT_EQ(to_seconds(found.wandering_time), time_s);  // of 400 s, 20 min, 1 h and 3 h
    EXPECT_LT(std::abs(std::log(found.wandering_drift_rad_s / 5e-8)), std::log(1.5)) << time_s;
  }
}

TEST(Calibrate, KnowsTheRateOfTheOrbitFromTheAttitude) {
  // An attitude that stands still in space does not show it; the filter must not fall over that.
  Scenario scenario;
  scenario.duration = std::chrono::minutes(30);
  scenario.attitude.reference = AttitudeScenario::Reference::kInertial;
  CalibrationOptions options;
  options.further_states[FurtherState::kClockOffset] = options.further_states[FurtherState::kOrbitalError] =
      FurtherStateOptions::Choice::kOn;
  const auto run = calibrate(sim::simulate(scenario).pass, options);
  EXPECT_EQ(run.calibration.further.size(), 7U);
  EXPECT_TRUE(run.calibration.covariance.allFinite());
}

/// Three gyros, the third across the others; all drift in eq. (1).
Scenario scenario_of_three(std::uint64_t seed, Duration duration) {
  Scenario scenario = scenario_in_eq1(seed, duration);
  scenario.gyros.resize(3, scenario.gyros[0]);
  scenario.gyros[2].start_direction_c = scenario.gyros[0].start_direction_c.cross(scenario.gyros[1].start_direction_c);
  return scenario;
}

sim::SimulatedPass three_gyros() { return sim::simulate(scenario_of_three(8, std::chrono::hours(2))); }

TEST(Calibrate, TakesThreeGyros) {
  const auto simulated = three_gyros();
  const auto run = calibrate(simulated.pass, {});
  // What is open is decided as of a pair, and there is nothing to be found.
  EXPECT_FALSE(run.evidence.empty());
  EXPECT_THAT(run.evidence, testing::Each(testing::Field(&Evidence::accepted, false)));
  EXPECT_EQ(run.fixes.back().innovation.size(), 6U);
  EXPECT_EQ(run.calibration.statistics.nis_degrees_of_freedom, 6);
  EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), 6, 0.3);
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d error = alignment_error(run.calibration, simulated.truth, k);
    const Eigen::Index row = rows_of(run.calibration, {ParameterId::alignment(k, 0)}).front();
    const Eigen::Matrix3d covariance = run.calibration.covariance.block<3, 3>(row, row);
    EXPECT_LT(error.dot(covariance.llt().solve(error)), 22);  // χ² of 3, once in 15 000
  }
  EXPECT_TRUE(run.gyro_events.empty());
}

TEST(Calibrate, DecidesOfThreeGyrosForDriftModelAndFurtherStates) {
  Scenario scenario = scenario_of_three(13, std::chrono::hours(2));
  scenario.star_tracker.clock_offset_s = 0.01;
  scenario.gyros[2].drift.outside_sigma_rad_s = 1e-7;
  const auto simulated = sim::simulate(scenario);
  const auto run = calibrate(simulated.pass, {});
  EXPECT_GE(run.calibration.gyros[2].drift_model.degree, 2);  // all members of degrees 1 and 2 are there
  ASSERT_FALSE(run.calibration.further.empty());
  const FurtherEstimate& offset = run.calibration.further[0];
  EXPECT_EQ(offset.parameter, parameter("clock_offset_s"));
  EXPECT_LT(std::abs(offset.value - 0.01), 4 * offset.sigma);
  EXPECT_LT(offset.sigma, 5e-4);
  EXPECT_TRUE(run.gyro_events.empty());
}

TEST(Calibrate, TakesNoiseOfTheStarTrackerThatIsMoreForAPartOfThePassForItsMean) {
  Pass pass = two_hours().pass;
  const Eigen::Vector3d told_rad = pass.settings.star_tracker_noise_rad;
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  for (std::size_t i = pass.star_tracker.size() / 2; i < pass.star_tracker.size(); ++i) {
    const Eigen::Vector3d more_rad =
        std::sqrt(3.0) * told_rad.cwiseProduct(Eigen::Vector3d::NullaryExpr([&] { return normal(random); }));
    pass.star_tracker.q_in_c[i] *= Rot<C, C>::exp(Vec<C>::assume(more_rad)).quaternion();
  }
  const CalibrationRun run = calibrate(pass, {});
  ASSERT_TRUE(run.options.star_tracker_noise_rad.has_value());
  const Eigen::Array3d ratio = run.options.star_tracker_noise_rad->cwiseQuotient(told_rad).array();
  EXPECT_LT((ratio - std::sqrt(2.5)).abs().maxCoeff(), 0.1) << ratio.transpose();
  EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), 4, 0.3);
  EXPECT_TRUE(run.calibration.verdict.trustworthy);
  EXPECT_LT(nees_of(two_hours().truth, run.calibration), 40);
}

TEST(Calibrate, FindsTheNoiseOfAStarTrackerThatIsToldFarBelowThatOfTheReadings) {
  const Eigen::Vector3d noise_rad = two_hours().pass.settings.star_tracker_noise_rad;
  Pass pass = two_hours().pass;
  pass.settings.star_tracker_noise_rad /= 5;
  for (const Estimator estimator : {Estimator::kInvariant, Estimator::kBatch}) {
    CalibrationOptions options;
    options.estimator = estimator;
    const CalibrationRun run = calibrate(pass, options);
    ASSERT_TRUE(run.options.star_tracker_noise_rad.has_value());
    const Eigen::Array3d ratio = run.options.star_tracker_noise_rad->cwiseQuotient(noise_rad).array();
    EXPECT_LT((ratio - 1).abs().maxCoeff(), 0.07) << ratio.transpose();
    EXPECT_TRUE(run.calibration.verdict.trustworthy);
  }
}

TEST(Calibrate, FindsTheNoiseOfThreeGyros) {
  Scenario scenario = scenario_of_three(9, std::chrono::hours(3));
  scenario.star_tracker.noise_rad *= 1.5;
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.direction_walk_rad_sqrt_s = 3e-8;
  }
  Pass pass = sim::simulate(scenario).pass;
  pass.settings.star_tracker_noise_rad /= 1.5;  // what was promised
  const auto run = calibrate(pass, {});
  EXPECT_TRUE(run.options.find_noise);
  EXPECT_NEAR(run.options.direction_random_walk_rad_sqrt_s, 3e-8, 1e-8);
  ASSERT_TRUE(run.options.star_tracker_noise_rad.has_value());
  EXPECT_NEAR(run.options.star_tracker_noise_rad->x(), scenario.star_tracker.noise_rad.x(), 1e-6);
  EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), 6, 0.3);
}

TEST(Calibrate, DoesNotPutDownAPoorDriftModelToAGyro) {
  Scenario scenario = scenario_of_three(10, std::chrono::hours(3));
  scenario.gyros[1].drift.outside_sigma_rad_s = 1e-7;
  const auto run = calibrate(sim::simulate(scenario).pass, told());
  EXPECT_GT(run.calibration.statistics.fixes_rejected_as_outliers, 20);
  EXPECT_GT(run.calibration.statistics.nis_mean.value(), 7);
  EXPECT_TRUE(run.gyro_events.empty());
}

TEST(Calibrate, GoesOnWithoutAGyroThatWandersOff) {
  auto simulated = three_gyros();
  GyroTelemetry& gyro = simulated.pass.gyro;
  const std::size_t from = gyro.size() / 2;
  for (std::size_t i = from; i < gyro.size(); ++i) {  // a degree at once
    Eigen::Map<Eigen::Vector3d> h_b(&gyro.h[3 * (3 * i + 1)]);
    h_b = (h_b + 0.017 * h_b.unitOrthogonal()).normalized().eval();
  }
  const auto run = calibrate(simulated.pass, {});
  ASSERT_EQ(run.gyro_events.size(), 1U);
  EXPECT_EQ(run.gyro_events[0].gyro, 1);
  EXPECT_EQ(run.gyro_events[0].state, GyroState::kIsolated);
  EXPECT_LT(run.gyro_events[0].t - gyro.t[from], std::chrono::minutes(1));
  EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), run.calibration.statistics.nis_degrees_of_freedom, 0.3);
  EXPECT_EQ(run.fixes.back().status, FixStatus::kUsed);
  EXPECT_EQ(run.fixes.back().degrees_of_freedom, 4);
  EXPECT_TRUE(run.calibration.verdict.trustworthy);
}

TEST(Navigate, CorrectedAtEachFixByTheInvariantErrorIsBetterThanASingleReading) {
  CalibrationOptions options = told();
  options.corrections.when = CorrectionOptions::When::kEachFix;
  const auto run = navigate(two_hours().pass, options);
  // From when the samples round the first fix are there.
  EXPECT_GT(run.attitude.size(), two_hours().pass.gyro.size() - 20);
  const auto errors = attitude_errors(run.attitude, two_hours().truth.t, two_hours().truth.q_in_c);
  const auto last = statistics_by_stretch(errors, two_hours().pass.settings.epoch, std::chrono::minutes(30)).at(3);
  EXPECT_LT(last.rms_rad.maxCoeff(), 1.7 * kArcsecond);
}

}  // namespace
}  // namespace trihedron::ground
