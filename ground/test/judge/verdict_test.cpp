#include "trihedron/ground/judge/verdict.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "judge/changes.hpp"
#include "named.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const Eigen::Vector3d kNoise_rad{1.45e-5, 1.45e-5, 9.7e-5};

/// Three hours of fixes in orbital flight, with rolls of `slew_rad`.
StarTrackerTelemetry flight(double slew_rad) {
  StarTrackerTelemetry tracker;
  for (int i = 0; i <= 3600; ++i) {
    const double t_s = 3.0 * i;
    const auto turn = [](double x, double y, double z) { return Rot<C, C>::exp(Vec<C>::assume(x, y, z)); };
    tracker.t.push_back(Time(from_seconds(t_s)));
    tracker.q_in_c.push_back((turn(0, 1.1e-3 * t_s, 0) * turn(slew_rad * std::sin(t_s / 97), 0, 0)).quaternion());
  }
  return tracker;
}

Pass good_pass() {
  Pass pass;
  pass.settings.star_tracker_noise_rad = kNoise_rad;
  pass.star_tracker = flight(0.5);
  pass.gyro.gyros = 2;
  pass.gyro.t = {pass.star_tracker.t.front(), pass.star_tracker.t.back()};
  pass.gyro.h.assign(18, 1 / std::sqrt(3.0));  // directions of up to three gyros
  return pass;
}

CalibrationRun good_run() {
  CalibrationRun run;
  run.calibration.gyros.resize(2);
  run.calibration.gyros[0].momentum_in = {1, 0, 0};
  run.calibration.gyros[1].momentum_in = {0, 1, 0};
  run.calibration.states = parameters({"gyro1.k0", "gyro1.align_x"});
  run.calibration.covariance = Eigen::Vector2d(1e-18, 1e-12).asDiagonal();
  for (GyroCalibration& gyro : run.calibration.gyros) {
    gyro.drift_rad_s.assign(Layout::kEq1, 0);
  }
  run.known_before.gyros = run.calibration.gyros;
  run.known_before.covariance = Eigen::Vector2d(2e-6, 8.7e-3).cwiseAbs2().asDiagonal();
  for (int i = 0; i <= 3600; ++i) {
    FixRecord& fix = run.fixes.emplace_back();
    fix.t = Time(std::chrono::seconds(3 * i));
    fix.status = FixStatus::kUsed;
  }
  Statistics& statistics = run.calibration.statistics;
  statistics.fixes = 3601;
  statistics.fixes_used = 3601;
  statistics.nis_count = 3600;
  statistics.nis_mean = 4.02;
  statistics.nis_degrees_of_freedom = 4;
  return run;
}

std::vector<std::string> codes(const Verdict& verdict) {
  std::vector<std::string> all;
  for (const Finding& finding : verdict.findings) {
    all.emplace_back(name_of(finding.code));
    EXPECT_FALSE(finding.text.empty() || finding.evidence.empty() || finding.cure.empty()) << name_of(finding.code);
  }
  return all;
}

TEST(Verdict, OfAGoodRunIsTrustworthyWithoutFindings) {
  const Verdict verdict = judge(good_pass(), good_run());
  EXPECT_TRUE(verdict.trustworthy);
  EXPECT_THAT(codes(verdict), IsEmpty());
}

/// A result that stayed at an earlier calibration, which was sure of itself, since the fixes that contradict it were
/// rejected.
TEST(Verdict, ComparesAnEarlierCalibrationWithThePassAlone) {
  Pass pass = good_pass();
  pass.settings.prior.emplace();
  CalibrationRun run = good_run();
  run.known_before.states = run.calibration.states;
  run.known_before.covariance = Eigen::Vector2d(1e-18, 1e-12).asDiagonal();
  EXPECT_THAT(codes(judge(pass, run)), testing::Not(testing::Contains("prior-contradicted")));
  run.by_pass_alone = run.calibration;
  EXPECT_THAT(codes(judge(pass, run)), testing::Not(testing::Contains("prior-contradicted")));
  run.by_pass_alone->gyros[0].alignment_rotation_vector_rad.x() = 1e-5;  // seven sigmas of the difference
  const Verdict verdict = judge(pass, run);
  EXPECT_THAT(codes(verdict), testing::Contains("prior-contradicted"));
  EXPECT_FALSE(verdict.trustworthy);
}

/// Some that are told to be a hundred times as accurate as the others, and are not. In a mean over all they do not
/// show.
TEST(Verdict, ForbidsFixesWhoseCovariancesAreFarTooSmall) {
  const auto judged = [](std::size_t many, double told_rad, double nis, std::size_t used) {
    CalibrationRun run = good_run();
    for (std::size_t i = 0; i < run.fixes.size(); ++i) {
      FixRecord& fix = run.fixes[i];
      fix.told_sigma_rad = 1.5e-5;
      fix.nis = 3.4;
      fix.degrees_of_freedom = 4;
      if (i >= 100 && i < 100 + many) {
        fix.told_sigma_rad = told_rad;
        fix.nis = nis;
        fix.status = i < 100 + used ? FixStatus::kUsed : FixStatus::kRejectedByGate;
      }
    }
    return judge(good_pass(), run);
  };
  const Verdict verdict = judged(30, 1.5e-7, 100, 3);
  EXPECT_THAT(codes(verdict), ElementsAre("fix-covariances-too-small"));
  EXPECT_FALSE(verdict.trustworthy);
  EXPECT_THAT(verdict.findings.front().evidence, testing::HasSubstr("of 30 fixes told 0.031″ and less"));
  EXPECT_THAT(verdict.findings.front().evidence, testing::HasSubstr("30 are off by more than one in a hundred is by "
                                                                    "chance; those used weigh as much as 30000 others; "
                                                                    "the first at t_s 300.000"));
  EXPECT_THAT(codes(judged(30, 1.5e-7, 100, 0)), IsEmpty());   // rejected, all of them
  EXPECT_THAT(codes(judged(30, 1.5e-7, 3.4, 30)), IsEmpty());  // and they are as accurate
  EXPECT_THAT(codes(judged(30, 1e-5, 100, 3)), IsEmpty());     // told about as accurate as the others
  EXPECT_THAT(codes(judged(30, 7e-6, 100, 3)), IsEmpty());     // and these have little weight
  EXPECT_THAT(codes(judged(7, 1.5e-7, 100, 3)), IsEmpty());    // too few to tell
}

TEST(Verdict, FindsABatchThatHasNotConverged) {
  auto run = good_run();
  run.calibration.statistics.batch_iterations = 12;
  run.calibration.statistics.batch_converged = true;
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
  run.calibration.statistics.batch_converged = false;
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("batch-not-converged"));
  EXPECT_FALSE(judge(good_pass(), run).trustworthy);
}

/// Innovations of one gyro with this in them beside unit white noise, in sigmas.
CalibrationRun with_innovations(double correlation, double line) {
  auto run = good_run();
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::array<double, 2> last{};
  for (FixRecord& fix : run.fixes) {
    fix.innovation_sigma = {1e-5, 1e-5};
    for (double& z : last) {
      z = correlation * z + std::sqrt(1 - correlation * correlation) * normal(random);
    }
    // The rate of the flight.
    const double wave = line * std::sin(1.1e-3 * to_seconds(fix.t.time_since_epoch()));
    fix.innovation = {1e-5 * (last[0] + wave), 1e-5 * last[1]};
  }
  return run;
}

TEST(Verdict, FindsInnovationsThatAreNotWhite) {
  EXPECT_THAT(codes(judge(good_pass(), with_innovations(0, 0))), IsEmpty());
  EXPECT_THAT(codes(judge(good_pass(), with_innovations(0.3, 0))), Contains("innovations-not-white"));
  EXPECT_THAT(codes(judge(good_pass(), with_innovations(-0.3, 0))), Contains("innovations-not-white"));
}

TEST(Verdict, ForbidsSigmasThatAreTooSmallBecauseFixesAreOffAlike) {
  // Means of such numbers are off by √((1 + r)/(1 − r)) times what they would be of white ones: 1.2 and 1.7 times.
  EXPECT_TRUE(judge(good_pass(), with_innovations(0.2, 0)).trustworthy);
  EXPECT_FALSE(judge(good_pass(), with_innovations(0.5, 0)).trustworthy);
  EXPECT_TRUE(judge(good_pass(), with_innovations(-0.5, 0)).trustworthy);
}

/// With `fixes` of them, off by turns, in sigmas.
CalibrationRun with_turns(std::size_t fixes, double off) {
  auto run = with_innovations(0, 0);
  run.fixes.resize(std::min(fixes, run.fixes.size()));
  for (std::size_t i = 0; i < run.fixes.size(); ++i) {
    for (std::size_t k = 0; k < run.fixes[i].innovation.size(); ++k) {
      run.fixes[i].innovation[k] += (i % 2 == 0 ? off : -off) * run.fixes[i].innovation_sigma[k];
    }
  }
  return run;
}

TEST(Verdict, ForbidsFixesThatAreOffByTurns) {
  for (const double off : {0.1, 0.4}) {
    auto run = with_turns(10'000, off);
    // A fix that is missing changes no turns.
    run.fixes.erase(run.fixes.begin() + 1000);
    const Verdict verdict = judge(good_pass(), run);
    EXPECT_EQ(verdict.trustworthy, off < 0.2);
    if (off > 0.2) {
      ASSERT_THAT(codes(verdict), Contains("innovations-not-white"));
      EXPECT_THAT(verdict.findings[0].text, HasSubstr("by turns"));
      EXPECT_EQ(verdict.findings.size(), 1U);
    }
  }
  // Of 150 the mean is off by 0.08 sigma by chance.
  for (const Finding& finding : judge(good_pass(), with_turns(150, 0.25)).findings) {
    EXPECT_THAT(finding.text, Not(HasSubstr("by turns")));
  }
}

TEST(Verdict, ForbidsFixesThatAreOffByTurnsAlsoByRoundedStamps) {
  auto run = with_turns(10'000, 0.4);
  const Time first = run.fixes.front().t;
  for (std::size_t i = 0; i < run.fixes.size(); ++i) {
    run.fixes[i].t = first + std::chrono::milliseconds(std::lround(3000.4 * static_cast<double>(i)));
  }
  const Verdict verdict = judge(good_pass(), run);
  ASSERT_THAT(codes(verdict), Contains("innovations-not-white"));
  EXPECT_THAT(verdict.findings[0].text, HasSubstr("by turns"));
}

TEST(Verdict, ForbidsAnErrorAtOrbitalPeriodThatMayBeDrift) {
  auto run = good_run();
  run.calibration.further = {{parameter("orbital_sine_x_rad"), 1e-4, 1e-6}};
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("orbital-error-found"));
  EXPECT_TRUE(judge(good_pass(), run).trustworthy);  // it was asked for
  run.orbital_error_over_drift = 7;
  EXPECT_TRUE(judge(good_pass(), run).trustworthy);
  run.orbital_error_over_drift = 3;
  EXPECT_FALSE(judge(good_pass(), run).trustworthy);
}

TEST(Verdict, ForbidsDriftAtOrbitalPeriodThatMayBeAnErrorOfTheStarTracker) {
  auto run = good_run();
  run.options.further_states[FurtherState::kOrbitalDrift] = FurtherStateOptions::Choice::kOn;
  const ParameterId amplitude = ParameterId::further(FurtherState::kOrbitalDrift, 1, 4);
  run.calibration.further = {{amplitude, 1e-9, 1e-9}};
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
  auto unseen = run;  // decided for, with none of it seen for itself
  unseen.evidence = {{FurtherState::kOrbitalDrift, 23, true}};
  EXPECT_THAT(codes(judge(good_pass(), unseen)), ElementsAre("orbital-drift-found"));
  EXPECT_FALSE(judge(good_pass(), unseen).trustworthy);
  unseen.options.further_states[FurtherState::kOrbitalError] = FurtherStateOptions::Choice::kOn;
  EXPECT_THAT(codes(judge(good_pass(), unseen)), IsEmpty());  // beside an error, not in place of it
  run.orbital_error_over_drift = -3;                          // what may be the other is told however small it is
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("orbital-drift-found"));
  EXPECT_FALSE(judge(good_pass(), run).trustworthy);
  run.orbital_error_over_drift.reset();
  run.calibration.further = {{amplitude, -4e-8, 1e-9}};
  const Verdict found = judge(good_pass(), run);
  ASSERT_THAT(codes(found), ElementsAre("orbital-drift-found"));
  EXPECT_TRUE(found.trustworthy);
  EXPECT_THAT(found.findings[0].evidence,
              HasSubstr("largest amplitude -4.0e-08 rad/s, the cosine about axis y of gyro 2, 40 sigmas"));
  auto moved = run;
  const double sigma_rad = sigma_of(run.calibration, ParameterId::alignment(0, 0));
  moved.moved_by_orbital_drift_rad = {{-2.9 * sigma_rad, 0, 0}, {0, 0, 0}};
  EXPECT_TRUE(judge(good_pass(), moved).trustworthy);
  moved.moved_by_orbital_drift_rad = {{-3.5 * sigma_rad, 0, 0}, {0, 0, 0}};
  EXPECT_FALSE(judge(good_pass(), moved).trustworthy);
  EXPECT_THAT(judge(good_pass(), moved).findings[0].evidence, HasSubstr("it moved gyro1.align_x by -"));
  EXPECT_THAT(judge(good_pass(), moved).findings[0].evidence, HasSubstr("3.5 of its sigmas"));
  run.orbital_error_over_drift = -7;
  EXPECT_TRUE(judge(good_pass(), run).trustworthy);
  run.orbital_error_over_drift = -3;
  EXPECT_FALSE(judge(good_pass(), run).trustworthy);
}

TEST(Verdict, ForbidsDriftOutsideEq1ThatMayBeAnErrorOfTheStarTracker) {
  auto run = good_run();
  run.orbital_error_over_field = -7;
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
  run.orbital_error_over_field = -3;
  const Verdict found = judge(good_pass(), run);
  ASSERT_THAT(codes(found), ElementsAre("orbital-error-or-drift"));
  EXPECT_FALSE(found.trustworthy);
  EXPECT_THAT(found.findings[0].evidence, HasSubstr("-3.0"));
}

TEST(Verdict, ForbidsDriftOutsideEq1ThatWouldMoveTheAngleBetweenTheMomenta) {
  auto run = good_run();
  run.field_or_error = {.field = 300, .error = 250, .field_by_angle = 20};
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
  run.field_or_error->field_by_angle = -1;  // it does not say
  const Verdict open = judge(good_pass(), run);
  ASSERT_THAT(codes(open), ElementsAre("orbital-error-or-drift"));
  EXPECT_TRUE(open.trustworthy);
  run.field_or_error->field_by_angle = -7;
  const Verdict found = judge(good_pass(), run);
  ASSERT_THAT(codes(found), ElementsAre("orbital-error-or-drift"));
  EXPECT_FALSE(found.trustworthy);
  EXPECT_THAT(found.findings[0].evidence, HasSubstr("+300.0"));
  EXPECT_THAT(found.findings[0].evidence, HasSubstr("+250.0"));
  EXPECT_THAT(found.findings[0].evidence, HasSubstr("-7.0"));
}

TEST(Verdict, ForbidsDriftOutsideEq1WhereAnErrorOfTheStarTrackerIsLikelier) {
  auto run = good_run();
  run.field_or_error = {.field = 300, .error = 304, .field_by_angle = -1};
  EXPECT_TRUE(judge(good_pass(), run).trustworthy);
  run.field_or_error->error = 306;
  const Verdict found = judge(good_pass(), run);
  ASSERT_THAT(codes(found), ElementsAre("orbital-error-or-drift"));
  EXPECT_FALSE(found.trustworthy);
  run.field_or_error->field_by_angle = 6;  // the angle shows the drift
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
}

TEST(Verdict, TellsOfPolhodesAndOfPeriodsThatMayBeThoseOfTheOrbit) {
  auto run = good_run();
  run.options.orbital_rate_rad_s = 2 * std::numbers::pi / 6000;
  run.options.further_states.polhodes[0].period_s = 7200;
  run.options.further_states.polhodes[1].period_s = 5000;
  const ParameterId amplitude = ParameterId::further(FurtherState::kPolhode, 1, 9);
  run.calibration.further = {{amplitude, 4e-9, 1e-9}};
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
  run.calibration.further = {{amplitude, -4e-8, 1e-9}};
  const Verdict found = judge(good_pass(), run);
  ASSERT_THAT(codes(found), ElementsAre("polhode-found"));
  EXPECT_TRUE(found.trustworthy);
  EXPECT_THAT(found.findings[0].evidence, HasSubstr("120.0 and 83.3 min; largest amplitude -4.0e-08 rad/s"));
  EXPECT_THAT(found.findings[0].evidence, HasSubstr("gyro2_mu23_polhode_cosine_rad_s, 40 sigmas"));
  EXPECT_THAT(found.findings[0].text, Not(HasSubstr("day and night")));
  run.options.further_states.polhodes[0].period_s = 6100;
  EXPECT_THAT(judge(good_pass(), run).findings[0].text, HasSubstr("day and night"));
}

/// With the coefficient of its first gyro, and its alignment, off by so many sigmas because the coefficients change.
CalibrationRun with_coefficients_off(double coefficient_sigmas, double alignment_sigmas) {
  auto run = good_run();
  Change& change = run.changes.emplace_back();
  change.moving = Moving::kCoefficients;
  change.motion = Motion::kWalk;
  change.log_odds = 100;
  change.parameters_off = Eigen::VectorXd::Zero(20);
  change.parameters_off(0) = coefficient_sigmas * 1e-9;
  change.parameters_off(7) = alignment_sigmas * 1e-6;
  change.parameters_off_covariance = Eigen::MatrixXd::Zero(20, 20);
  change.parameters_off_covariance(0, 0) = 9e-18;
  return run;
}

TEST(Verdict, CountsCoefficientsThatChangeInTheirSigmas) {
  auto run = with_coefficients_off(10, 1);
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("coefficients-not-constant"));
  EXPECT_TRUE(judge(good_pass(), run).trustworthy);
  put_changes_into_covariance(run);
  // What was claimed, what was found to be off, and what is not known of that.
  EXPECT_NEAR(std::sqrt(run.calibration.covariance(0, 0)), std::hypot(1.0, 10.0, 3.0) * 1e-9, 1e-15);
  EXPECT_NEAR(std::sqrt(run.calibration.covariance(1, 1)), std::hypot(1.0, 1.0) * 1e-6, 1e-12);
  EXPECT_NEAR(run.calibration.covariance(0, 1), 10e-9 * 1e-6, 1e-21);
}

TEST(Verdict, ForbidsCoefficientsThatChangeWhereTheAlignmentIsOffByThem) {
  EXPECT_FALSE(judge(good_pass(), with_coefficients_off(10, 3)).trustworthy);
}

// A turn of the mounting that is there as likely as not.
TEST(Verdict, CountsWhatMayMoveInTheSigmasByItsProbability) {
  auto run = with_coefficients_off(0, 2);
  run.changes.front().moving = Moving::kStarTracker;
  run.changes.front().motion = Motion::kRamp;
  run.changes.front().log_odds = 0;
  put_changes_into_covariance(run);
  EXPECT_NEAR(std::sqrt(run.calibration.covariance(1, 1)), std::hypot(1.0, 2.0 / std::sqrt(2)) * 1e-6, 1e-12);
}

TEST(Verdict, LeavesTheCovarianceWhereNothingMovesOrGoesToAndFro) {
  auto run = with_coefficients_off(10, 1);
  run.changes.front().log_odds = -5;
  put_changes_into_covariance(run);
  EXPECT_EQ(run.calibration.covariance(0, 0), good_run().calibration.covariance(0, 0));
  run.changes.front().log_odds = 100;
  run.changes.front().motion = Motion::kOrbital;
  put_changes_into_covariance(run);
  EXPECT_EQ(run.calibration.covariance(0, 0), good_run().calibration.covariance(0, 0));
  run.changes.front().moving = Moving::kGyroCase;
  put_changes_into_covariance(run);
  EXPECT_EQ(run.calibration.covariance(0, 0), good_run().calibration.covariance(0, 0));
  EXPECT_FALSE(judge(good_pass(), run).trustworthy);
}

TEST(Verdict, FindsALineAtTheOrbitalRate) {
  EXPECT_THAT(codes(judge(good_pass(), with_innovations(0, 0.02))), IsEmpty());
  EXPECT_THAT(codes(judge(good_pass(), with_innovations(0, 0.2))), ElementsAre("orbital-line"));
}

TEST(Verdict, FindsHalvesThatDisagree) {
  auto run = good_run();
  run.calibration.statistics.halves_degrees_of_freedom = 18;
  run.calibration.statistics.halves_chi_square = 40;
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
  run.calibration.statistics.halves_chi_square = 60;  // chance of 2e-6
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("halves-disagree"));
  EXPECT_FALSE(judge(good_pass(), run).trustworthy);
}

// They disagree because the coefficients change, and what that makes of these is in their sigmas.
TEST(Verdict, LeavesHalvesThatDisagreeToCoefficientsThatChange) {
  for (const double alignment_sigmas : {1.0, 3.0}) {
    auto run = with_coefficients_off(10, alignment_sigmas);
    run.calibration.statistics.halves_degrees_of_freedom = 18;
    run.calibration.statistics.halves_chi_square = 60;
    const Verdict verdict = judge(good_pass(), run);
    EXPECT_THAT(codes(verdict), ElementsAre("coefficients-not-constant", "halves-disagree"));
    EXPECT_EQ(verdict.trustworthy, alignment_sigmas < 2);
  }
}

TEST(Verdict, LeavesHalvesThatDisagreeToACourseThatIsFollowed) {
  for (const auto course : {CourseOfChange::Kind::kEven, CourseOfChange::Kind::kWarmUp, CourseOfChange::Kind::kJump}) {
    auto run = good_run();
    run.options.further_states.change_course = course;
    run.calibration.further.push_back(
        {ParameterId::further(FurtherState::kCoefficientChange, 0, Esg7::kMu12), 1e-6, 1e-9});
    run.calibration.statistics.halves_degrees_of_freedom = 18;
    run.calibration.statistics.halves_chi_square = 60;
    const Verdict verdict = judge(good_pass(), run);
    EXPECT_THAT(codes(verdict), ElementsAre("coefficients-changed", "halves-disagree"));
    EXPECT_EQ(verdict.trustworthy, course != CourseOfChange::Kind::kEven);
  }
}

TEST(Verdict, FindsADriftModelThatIsTooSmallOrTooLarge) {
  auto run = good_run();
  run.drift_models = {{kEsg7, 0, 1e-4}, {vsh(1), 5, 2e-5}, {vsh(2), -8, 3e-5}};
  for (const DriftModelId& model : {kEsg7, vsh(1), kEsg20}) {
    run.calibration.gyros[0].drift_model = model;
    EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty()) << name_of(model);
  }
  run.calibration.gyros[0].drift_model = vsh(2);
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("drift-model-too-large"));
  EXPECT_TRUE(judge(good_pass(), run).trustworthy);
  run.drift_models[1].log_likelihood = 500;
  run.calibration.gyros[0].drift_model = kEsg7;
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("drift-model-too-small"));
  EXPECT_FALSE(judge(good_pass(), run).trustworthy);
  run.drift_models.push_back({kLargestDriftModel, 900, 1e-5});
  run.calibration.gyros[0].drift_model = kLargestDriftModel;
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("drift-model-at-its-limit"));
  EXPECT_THAT(judge(good_pass(), run).findings[0].evidence, HasSubstr("than vsh:2 by a factor of e^9"));
  run.drift_models.back().log_likelihood = run.drift_models[run.drift_models.size() - 2].log_likelihood + 1;
  EXPECT_THAT(codes(judge(good_pass(), run)), Not(Contains("drift-model-at-its-limit")));
}

TEST(Verdict, TellsOfErrorsOfTheStarTrackerThatWereFound) {
  auto run = good_run();
  run.calibration.further = {{parameter("clock_offset_s"), 1e-4, 1e-4}, {parameter("orbital_sine_x_rad"), 1e-5, 4e-6}};
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
  run.calibration.further = {{parameter("clock_offset_s"), -1e-2, 1e-4}, {parameter("orbital_sine_x_rad"), 1e-5, 1e-6}};
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("clock-offset-found", "orbital-error-found"));
  EXPECT_TRUE(judge(good_pass(), run).trustworthy);
}

TEST(Verdict, TellsOfAClockRateThatWasFound) {
  auto run = good_run();
  run.calibration.further = {{parameter("clock_offset_s"), 1e-4, 1e-4}, {parameter("clock_rate_s_s"), 1e-8, 1e-8}};
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
  run.calibration.further[1].value = 1e-6;
  const Verdict verdict = judge(good_pass(), run);
  EXPECT_THAT(codes(verdict), ElementsAre("clock-rate-found"));
  EXPECT_THAT(verdict.findings[0].text, HasSubstr("which of them is wrong"));
  EXPECT_TRUE(verdict.trustworthy);
}

TEST(Verdict, FindsTooFewFixes) {
  auto run = good_run();
  run.calibration.statistics.fixes_used = 99;
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("too-few-fixes"));
  EXPECT_FALSE(judge(good_pass(), run).trustworthy);
}

TEST(Verdict, FindsAPassShorterThanAnOrbit) {
  auto pass = good_pass();
  pass.gyro.t.back() = pass.gyro.t.front() + std::chrono::minutes(89);
  EXPECT_THAT(codes(judge(pass, good_run())), ElementsAre("short-pass"));
  EXPECT_TRUE(judge(pass, good_run()).trustworthy);
}

TEST(Verdict, FindsManyRejections) {
  auto run = good_run();
  run.calibration.statistics.fixes_rejected_as_outliers = 170;
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());  // under one in twenty
  run.calibration.statistics.fixes_rejected_as_outliers = 200;
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("many-rejected"));
  EXPECT_TRUE(judge(good_pass(), run).trustworthy);
  run.calibration.statistics.fixes_rejected_as_outliers = 2000;
  EXPECT_FALSE(judge(good_pass(), run).trustworthy);
}

TEST(Verdict, FindsThatTheFilterWasReopened) {
  auto run = good_run();
  run.calibration.statistics.reopened = 1;
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("reopened"));
  EXPECT_TRUE(judge(good_pass(), run).trustworthy);
  run.calibration.statistics.fixes_used = 499;
  const Verdict of_few = judge(good_pass(), run);
  EXPECT_FALSE(of_few.trustworthy);
  EXPECT_THAT(of_few.findings.at(0).evidence, HasSubstr("499 fixes used"));
}

TEST(Verdict, FindsNisOutOfBoundsOnBothSides) {
  auto run = good_run();
  for (const auto& [nis, trustworthy] :
       {std::pair(4.4, true), std::pair(5.1, false), std::pair(3.5, true), std::pair(2.0, true)}) {
    run.calibration.statistics.nis_mean = nis;
    const Verdict verdict = judge(good_pass(), run);
    EXPECT_THAT(codes(verdict), ElementsAre("nis-out-of-bounds")) << nis;
    EXPECT_EQ(verdict.trustworthy, trustworthy) << nis;
  }
  // Few fixes scatter more: the same mean is then no finding.
  run.calibration.statistics.nis_mean = 4.4;
  run.calibration.statistics.nis_count = 120;
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
  run.calibration.statistics.nis_count = 0;
  EXPECT_THAT(codes(judge(good_pass(), run)), Not(Contains("nis-out-of-bounds")));
}

TEST(Verdict, NamesTheParametersThatTheDataDoNotDetermine) {
  auto run = good_run();
  run.calibration.covariance(1, 1) = 5e-3 * 5e-3;
  const Verdict verdict = judge(good_pass(), run);
  EXPECT_THAT(codes(verdict), ElementsAre("not-determined"));
  EXPECT_NE(verdict.findings[0].text.find("gyro1.align_x"), std::string::npos);
  EXPECT_EQ(verdict.findings[0].text.find("gyro1.k0"), std::string::npos);
}

TEST(Verdict, FindsAPriorThatIsContradicted) {
  auto run = good_run();
  run.calibration.gyros[0].drift_rad_s.assign(Layout::kEq1, 1e-6);
  run.known_before.gyros = run.calibration.gyros;
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
  run.known_before.gyros[0].drift_rad_s[0] -= 5.1 * 2e-6;
  const Verdict verdict = judge(good_pass(), run);
  EXPECT_THAT(codes(verdict), ElementsAre("prior-contradicted"));
  EXPECT_NE(verdict.findings[0].evidence.find("gyro1.k0 by 5"), std::string::npos);
  EXPECT_FALSE(verdict.trustworthy);
  auto unknown = run;
  unknown.calibration.covariance(0, 0) = 7e-6 * 7e-6;
  EXPECT_THAT(codes(judge(good_pass(), unknown)), Not(Contains("prior-contradicted")));
  run.known_before.gyros[0].drift_rad_s[0] += 0.2 * 2e-6;
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
}

// Half as uncertain as before: a prior that is off moves the estimate by half of its sigmas.
TEST(Verdict, FindsAPriorThatIsContradictedAsAWhole) {
  const auto found_off_by = [](double prior_sigmas, double left) {
    auto run = good_run();
    run.calibration.covariance = left * run.known_before.covariance;
    run.calibration.gyros[0].drift_rad_s.assign(Layout::kEq1, 0);
    run.known_before.gyros = run.calibration.gyros;
    run.known_before.gyros[0].drift_rad_s[0] = -prior_sigmas * 2e-6;
    run.known_before.gyros[0].alignment_rotation_vector_rad.x() = prior_sigmas * 8.7e-3;
    return run;
  };
  auto pass = good_pass();
  EXPECT_THAT(codes(judge(pass, found_off_by(3, 0.24))), IsEmpty());
  EXPECT_THAT(codes(judge(pass, found_off_by(4, 0.01))), IsEmpty());  // the data alone tell it
  const Verdict verdict = judge(pass, found_off_by(4, 0.24));
  EXPECT_THAT(codes(verdict), ElementsAre("prior-contradicted"));
  EXPECT_THAT(verdict.findings[0].evidence, HasSubstr("of 2 degrees of freedom"));
  EXPECT_THAT(verdict.findings[0].cure, HasSubstr("larger prior sigmas"));
  EXPECT_FALSE(verdict.trustworthy);
  pass.settings.prior = found_off_by(4, 0.24).known_before;
  EXPECT_THAT(judge(pass, found_off_by(4, 0.24)).findings[0].text, HasSubstr("the earlier calibration"));
}

TEST(Verdict, FindsAPriorSoTightThatDriftOutsideEq1StandsForTheCoefficients) {
  auto run = good_run();
  run.calibration.drift_field = {{.gyro = 0, .degree = 2, .rms_rad_s = 4e-6},
                                 {.gyro = 0, .degree = 4, .rms_rad_s = 4e-6}};
  EXPECT_THAT(codes(judge(good_pass(), run)), IsEmpty());
  run.calibration.drift_field.back().rms_rad_s = 5e-6;
  const Verdict verdict = judge(good_pass(), run);
  EXPECT_THAT(codes(verdict), ElementsAre("prior-contradicted"));
  EXPECT_THAT(verdict.findings[0].evidence, HasSubstr("drift of gyro 1 outside eq. (1)"));
  EXPECT_FALSE(verdict.trustworthy);
}

TEST(Verdict, FindsSteadyFlightAndNamesItsAxis) {
  auto pass = good_pass();
  pass.star_tracker = flight(0);
  const Verdict verdict = judge(pass, good_run());
  EXPECT_THAT(codes(verdict), ElementsAre("weak-alignment-axis"));
  EXPECT_NE(verdict.findings[0].text.find("+1.000"), std::string::npos);
  EXPECT_FALSE(verdict.trustworthy);
}

TEST(Verdict, NamesNoAxisWhereNoneMoves) {
  auto pass = good_pass();
  std::ranges::fill(pass.star_tracker.q_in_c, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5));
  const Verdict verdict = judge(pass, good_run());
  EXPECT_THAT(codes(verdict), ElementsAre("weak-alignment-axis"));
  EXPECT_THAT(verdict.findings[0].text, HasSubstr("about any axis"));
  EXPECT_THAT(verdict.findings[0].cure, HasSubstr("about two axes"));
}

TEST(Verdict, OfSteadyFlightIsTrustworthyForAStatedNeedThatIsMet) {
  auto pass = good_pass();
  pass.star_tracker = flight(0);
  auto run = good_run();
  NeedForecast& need = run.calibration.forecast.emplace().need.emplace();
  need.met = true;
  EXPECT_THAT(codes(judge(pass, run)), ElementsAre("weak-alignment-axis"));
  EXPECT_TRUE(judge(pass, run).trustworthy);
  run.options.estimator = Estimator::kPaper;  // its sigmas about this axis are too small, and so is the forecast
  EXPECT_FALSE(judge(pass, run).trustworthy);
  run.options.estimator = Estimator::kInvariant;
  need.met = false;
  EXPECT_FALSE(judge(pass, run).trustworthy);
}

TEST(Verdict, FindsSteadyFlightBehindRejectedOutliers) {
  auto pass = good_pass();
  pass.star_tracker = flight(0);
  auto run = good_run();
  for (std::size_t i = 50; i < run.fixes.size(); i += 100) {
    pass.star_tracker.q_in_c[i] =
        pass.star_tracker.q_in_c[i] * Rot<C, C>::exp(Vec<C>::assume(0.03, 0, 0.01)).quaternion();
    run.fixes[i].status = FixStatus::kRejectedByGate;
  }
  EXPECT_THAT(codes(judge(pass, run)), ElementsAre("weak-alignment-axis"));
}

TEST(Verdict, TellsOfGyrosThatAreNotUsed) {
  auto pass = good_pass();
  pass.gyro.gyros = 3;
  const Verdict verdict = judge(pass, good_run());
  EXPECT_THAT(codes(verdict), ElementsAre("gyros-not-used"));
  EXPECT_TRUE(verdict.trustworthy);
}

TEST(Verdict, TellsOfStarTrackersThatAreNotUsed) {
  auto pass = good_pass();
  pass.further_star_trackers.push_back(pass.star_tracker);
  const Verdict verdict = judge(pass, good_run());
  EXPECT_THAT(codes(verdict), ElementsAre("star-trackers-not-used"));
  EXPECT_TRUE(verdict.trustworthy);
  auto run = good_run();
  run.calibration.further = {{parameter("star_tracker_2_align_x_rad"), 0, 1e-6}};
  EXPECT_THAT(codes(judge(pass, run)), IsEmpty());
}

TEST(Verdict, FindsAGyroThatWasLeftOut) {
  auto run = good_run();
  run.gyro_events = {{Time(std::chrono::minutes(90)), 1, GyroState::kIsolated}};
  const Verdict of_pair = judge(good_pass(), run);
  EXPECT_THAT(codes(of_pair), ElementsAre("gyro-isolated"));
  EXPECT_EQ(of_pair.findings[0].evidence, "gyro 2 left out for good at 90.0 min");
  EXPECT_FALSE(of_pair.trustworthy);
  run.calibration.gyros.push_back(run.calibration.gyros[0]);
  auto pass = good_pass();
  pass.gyro.gyros = 3;
  EXPECT_THAT(codes(judge(pass, run)), ElementsAre("gyro-isolated"));
  EXPECT_TRUE(judge(pass, run).trustworthy);
}

TEST(Verdict, FindsAGyroThatStoodStill) {
  auto run = good_run();
  run.gyro_events = {{Time(std::chrono::minutes(3)), 0, GyroState::kStuck},
                     {Time(std::chrono::minutes(4)), 0, GyroState::kUsed},
                     {Time(std::chrono::minutes(5)), 0, GyroState::kStuck},
                     {Time(std::chrono::minutes(6)), 0, GyroState::kUsed}};
  const Verdict verdict = judge(good_pass(), run);
  EXPECT_THAT(codes(verdict), ElementsAre("gyro-stuck"));
  EXPECT_EQ(verdict.findings[0].evidence, "gyro 1 stuck 2 times, first at 3.0 min");
  EXPECT_THAT(verdict.findings[0].text, HasSubstr("stood still"));
  EXPECT_TRUE(verdict.trustworthy);
}

TEST(Verdict, TellsAGyroThatGivesNoReadingsFromOneThatStandsStillByTheReadingThere) {
  using std::chrono::hours;
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  auto run = good_run();
  auto pass = good_pass();
  const Time begin = pass.gyro.t.front();
  pass.gyro.t = {begin, begin + hours(1), begin + hours(2), begin + hours(3)};
  pass.gyro.h.assign(24, 1 / std::sqrt(3.0));
  const auto put = [&](std::size_t sample, double value) {  // of gyro 2
    std::fill_n(pass.gyro.h.begin() + static_cast<std::ptrdiff_t>(6 * sample + 3), 3, value);
  };
  const auto text = [&] { return judge(pass, run).findings.at(0).text; };
  run.gyro_events = {{pass.gyro.t[2], 1, GyroState::kStuck}};
  EXPECT_THAT(text(), HasSubstr("stood still"));
  put(3, kNaN);  // what comes after it is another matter
  EXPECT_THAT(text(), HasSubstr("stood still"));
  for (const double value : {0.0, 0.3, kNaN}) {
    put(2, value);
    EXPECT_THAT(text(), HasSubstr("gives no readings any more"));
  }
  put(3, 1 / std::sqrt(3.0));  // that it did not move does not make a reading of none
  EXPECT_THAT(text(), HasSubstr("gives no readings any more"));
  run.gyro_events.push_back({pass.gyro.t[3], 1, GyroState::kUsed});
  EXPECT_THAT(text(), HasSubstr("For a while a gyro gave no readings"));
  run.gyro_events.push_back({pass.gyro.t[3] + hours(1), 1, GyroState::kStuck});  // and again, to the end
  for (const int later : {1, 2}) {
    pass.gyro.t.push_back(pass.gyro.t[3] + hours(later));
    pass.gyro.h.insert(pass.gyro.h.end(), 6, kNaN);
  }
  EXPECT_THAT(text(), HasSubstr("gives no readings any more"));
  run.gyro_events.pop_back();
  run.gyro_events.insert(run.gyro_events.begin(),
                         {{pass.gyro.t[0], 0, GyroState::kStuck}, {pass.gyro.t[1], 0, GyroState::kUsed}});
  EXPECT_THAT(text(), HasSubstr("At some times readings of a gyro"));
}

TEST(Verdict, FindsReadingsThatScatterOtherwiseThanTold) {
  auto run = good_run();
  run.readout_noise.emplace().gyros = 2;
  for (int k = 0; k < 2; ++k) {
    run.readout_noise->found_rad[k] = run.readout_noise->most_rad[k] = 2e-5;
    run.readout_noise->told_rad[k] = 1e-5;
  }
  const Verdict steady = judge(good_pass(), run);
  EXPECT_THAT(codes(steady), ElementsAre("readout-noise"));
  EXPECT_EQ(steady.findings[0].evidence, "4.1″ 4.1″ found, up to 4.1″ 4.1″ for an hour, 2.1″ 2.1″ in pass.toml");
  EXPECT_TRUE(steady.trustworthy);
  run.readout_noise->in_slews = 4;
  const Verdict in_slews = judge(good_pass(), run);
  EXPECT_THAT(in_slews.findings[0].evidence, HasSubstr("for an hour, 4.0 times as much in slews, 2.1"));
  EXPECT_FALSE(in_slews.trustworthy);
  run.readout_noise->in_slews = 1;
  run.readout_noise->most_rad[1] = 4e-5;
  EXPECT_FALSE(judge(good_pass(), run).trustworthy);
}

TEST(Verdict, FindsThatThereIsNoPairAtTheEnd) {
  auto run = good_run();
  auto pass = good_pass();
  const Time end = pass.gyro.t.back();
  for (const GyroState state : {GyroState::kStuck, GyroState::kLeapt}) {
    run.gyro_events = {{end - std::chrono::minutes(6), 0, state}};
    EXPECT_FALSE(has_pair_at_end(run.gyro_events, 2, end));
    EXPECT_FALSE(judge(pass, run).trustworthy);
    EXPECT_THAT(judge(pass, run).findings.at(0).text, HasSubstr("no pair at the end"));
    run.gyro_events[0].t = end - std::chrono::minutes(4);  // it may come back
    EXPECT_TRUE(has_pair_at_end(run.gyro_events, 2, end));
    EXPECT_TRUE(judge(pass, run).trustworthy);
  }
  run.gyro_events = {{end - std::chrono::hours(1), 1, GyroState::kStuck}};
  run.calibration.gyros.push_back(run.calibration.gyros[0]);
  pass.gyro.gyros = 3;
  EXPECT_TRUE(judge(pass, run).trustworthy);
}

TEST(Verdict, FindsAGyroThatLeapt) {
  auto run = good_run();
  run.gyro_events = {{Time(std::chrono::minutes(3)), 1, GyroState::kLeapt},
                     {Time(std::chrono::minutes(8)), 1, GyroState::kUsed}};
  const Verdict verdict = judge(good_pass(), run);
  EXPECT_THAT(codes(verdict), ElementsAre("gyro-leapt"));
  EXPECT_EQ(verdict.findings[0].evidence, "gyro 2 leapt at 3.0 min");
  EXPECT_TRUE(verdict.trustworthy);
}

TEST(Verdict, FindsStampsOfGyrosThatScatter) {
  auto run = good_run();
  run.gyro_stamps_off_s = 0.017;
  const Verdict verdict = judge(good_pass(), run);
  EXPECT_THAT(codes(verdict), ElementsAre("gyro-stamps-scatter"));
  EXPECT_EQ(verdict.findings[0].evidence, "17.0 ms (root mean square)");
  EXPECT_TRUE(verdict.trustworthy);
  run.gyro_stamps_late_s = 0.03;
  EXPECT_EQ(judge(good_pass(), run).findings[0].evidence,
            "17.0 ms (root mean square); beside this all were taken to be +30.0 ms late, as the star tracker says");
}

TEST(Verdict, ForbidsAPairOfWhichNoClockAgreesWithAnother) {
  auto pass = good_pass();
  pass.settings.gyros.resize(2);
  const auto with_clocks = [&](double late_s, double offset_s) {
    auto run = good_run();
    run.clocks.emplace().late_s[1] = {late_s, 1e-4};
    run.clocks->mid_offset_s = {offset_s, 1e-4};
    run.clock_correction.late_s[1] = late_s;
    run.calibration.further = {{parameter("clock_offset_s"), offset_s, 1e-4}};
    return run;
  };
  const auto late_of = [&](const Verdict& verdict) {
    const auto found = std::ranges::find(verdict.findings, FindingCode::kGyroLate, &Finding::code);
    return found == verdict.findings.end() ? Finding{} : *found;
  };
  for (const double sign : {1.0, -1.0}) {
    const Finding finding = late_of(judge(pass, with_clocks(sign * 0.006, -0.006)));
    EXPECT_EQ(finding.severity, FindingSeverity::kDoNotUse);
    EXPECT_THAT(finding.text, HasSubstr("agrees with neither"));
    EXPECT_THAT(finding.evidence, HasSubstr("-6.00 ms after their stamp"));
    EXPECT_THAT(finding.cure, HasSubstr("latency_s = "));
  }
  // One of the two agrees with the star tracker, or nearly.
  EXPECT_EQ(late_of(judge(pass, with_clocks(0.006, 0.004))).severity, FindingSeverity::kWarning);
  EXPECT_EQ(late_of(judge(pass, with_clocks(0.004, 0.006))).severity, FindingSeverity::kWarning);
  EXPECT_EQ(late_of(judge(pass, with_clocks(0.02, 0))).severity, FindingSeverity::kWarning);
  // The gyro that is not late was chosen by the middle of the pass; the state is of its begin.
  auto with_rate = with_clocks(0.02, 0);
  with_rate.clocks->mid_offset_s = {1e-3, 1e-4};
  with_rate.calibration.further = {{parameter("clock_offset_s"), -8e-3, 1e-4}};
  EXPECT_EQ(late_of(judge(pass, with_rate)).severity, FindingSeverity::kWarning);
  // Without a state of the offset that of the clocks tells it.
  auto run = with_clocks(0.006, 0.006);
  run.calibration.further.clear();
  EXPECT_EQ(late_of(judge(pass, run)).severity, FindingSeverity::kDoNotUse);
  // A third gyro tells which of the others is late.
  pass.settings.gyros.resize(3);
  EXPECT_EQ(late_of(judge(pass, run)).severity, FindingSeverity::kWarning);
}

TEST(Verdict, NamesTheOneGyroThatTheLastFixesContradict) {
  // So many of the last fixes, and by how many sigmas they contradict each of three gyros.
  const auto with_end = [](std::size_t count, std::array<double, 3> sigmas) {
    auto run = good_run();
    for (std::size_t i = run.fixes.size() - count; i < run.fixes.size(); ++i) {
      run.fixes[i].status = FixStatus::kRejectedByGate;
      run.fixes[i].innovation_sigma.assign(6, 1e-5);
      for (const double off : sigmas) {
        run.fixes[i].innovation.insert(run.fixes[i].innovation.end(), {0, off * 1e-5});
      }
    }
    return judge(good_pass(), run);
  };
  const Verdict verdict = with_end(20, {0, 5, 1});
  EXPECT_THAT(codes(verdict), ElementsAre("gyro-mounting-moved"));
  EXPECT_EQ(verdict.findings[0].evidence, "gyro 2, 20 fixes from 179.1 min on");
  EXPECT_FALSE(verdict.trustworthy);
  EXPECT_THAT(codes(with_end(19, {0, 5, 1})), IsEmpty());  // too few
  EXPECT_THAT(codes(with_end(20, {5, 5, 5})), IsEmpty());  // the star tracker
  EXPECT_THAT(codes(with_end(20, {0, 4, 1})), IsEmpty());  // no more than chance and the gate allow
}

TEST(Verdict, FindsAStarTrackerThatWasOff) {
  auto run = good_run();
  run.calibration.statistics.fixes_off_in_a_row = 100;
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("star-tracker-off"));
}

TEST(Verdict, FindsAStarTrackerThatWasFrozen) {
  auto run = good_run();
  run.calibration.statistics.fixes_frozen = 100;
  const Verdict verdict = judge(good_pass(), run);
  EXPECT_THAT(codes(verdict), ElementsAre("star-tracker-frozen"));
  EXPECT_EQ(verdict.findings[0].evidence, "100 of 3601 fixes");
  EXPECT_TRUE(verdict.trustworthy);
}

TEST(Verdict, FindsABadlyPlacedPair) {
  auto run = good_run();
  run.calibration.gyros[1].momentum_in = {std::cos(0.5), std::sin(0.5), 0};
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("pair-badly-placed"));
  run.calibration.gyros[1].momentum_in = {-std::cos(0.5), std::sin(0.5), 0};
  EXPECT_THAT(codes(judge(good_pass(), run)), ElementsAre("pair-badly-placed"));
}

NavigationRun good_navigation() {
  NavigationRun run;
  run.statistics = good_run().calibration.statistics;
  run.samples[SampleStatus::kUsed] = 86400;
  run.attitude.t.resize(86400);
  run.gyros = 2;
  run.corrections = 7;
  run.open_loops.assign(7, {.t = {}, .error_rad = 1e-4, .square = 3});
  return run;
}

TEST(Verdict, OfANavigationForbidsUseWithoutAPairAtTheEndAsThatOfACalibrationDoes) {
  NavigationRun run = good_navigation();
  const Pass pass = good_pass();
  const Time end = pass.gyro.t.back();
  for (const auto& [state, code] : {std::pair(GyroState::kStuck, "gyro-stuck"),
                                    {GyroState::kLeapt, "gyro-leapt"},
                                    {GyroState::kIsolated, "gyro-isolated"}}) {
    run.gyro_events = {{end - std::chrono::hours(1), 1, state}};
    const Verdict lost = judge_navigation(pass, run);
    EXPECT_THAT(codes(lost), ElementsAre(code));
    EXPECT_FALSE(lost.trustworthy) << code;
    EXPECT_THAT(lost.findings.at(0).text, HasSubstr("no pair at the end of the pass, and no attitude."));
    run.gyro_events.push_back({end - std::chrono::minutes(30), 1, GyroState::kUsed});
    const Verdict back = judge_navigation(pass, run);
    EXPECT_THAT(codes(back), ElementsAre(code));
    EXPECT_TRUE(back.trustworthy) << code;
  }
  run.gyro_events = {{end - std::chrono::hours(1), 1, GyroState::kStuck}};
  run.gyros = 3;
  EXPECT_TRUE(judge_navigation(pass, run).trustworthy);
}

TEST(Verdict, OfANavigationForbidsStampsThatScatterMuch) {
  NavigationRun run = good_navigation();
  run.gyro_stamps_off_s = 0.003;
  EXPECT_THAT(codes(judge_navigation(good_pass(), run)), ElementsAre("gyro-stamps-scatter"));
  EXPECT_TRUE(judge_navigation(good_pass(), run).trustworthy);
  run.gyro_stamps_off_s = 0.017;
  EXPECT_FALSE(judge_navigation(good_pass(), run).trustworthy);
}

TEST(Verdict, OfANavigationSaysWhetherTheParametersFit) {
  NavigationRun run = good_navigation();
  const auto verdict = [&] { return judge_navigation(good_pass(), run); };
  EXPECT_THAT(codes(verdict()), IsEmpty());
  run.misfit_limit = 45;
  run.held_parameters_misfit = 30;
  EXPECT_TRUE(verdict().trustworthy);
  for (const double misfit : {60.0, std::nan("")}) {
    run.held_parameters_misfit = misfit;
    EXPECT_THAT(codes(verdict()), ElementsAre("calibration-does-not-fit"));
    EXPECT_FALSE(verdict().trustworthy);
  }
  run.held_parameters_misfit.reset();
  run.statistics.nis_mean = 40;
  EXPECT_THAT(codes(verdict()), ElementsAre("nis-out-of-bounds"));
  EXPECT_FALSE(verdict().trustworthy);
  run = good_navigation();
  run.statistics.fixes_frozen = 20;
  EXPECT_THAT(codes(verdict()), ElementsAre("star-tracker-frozen"));
}

/// Fixes of a star tracker that was remounted are rejected in slews, all to one side; outliers, and noise that is
/// larger in slews, are so to all sides.
TEST(Verdict, OfANavigationForbidsFixesThatContradictItAlike) {
  NavigationRun run = good_navigation();
  run.held_parameters_misfit = 0;
  const auto reject = [&](std::size_t many, double common_rad, double noise_rad) {
    run.fixes.assign(
        7200, {.status = FixStatus::kUsed, .innovation = {0, 0, 0, 0}, .innovation_sigma = {1e-4, 1e-4, 1e-4, 1e-4}});
    std::mt19937_64 stream(1);
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < many; ++i) {
      FixRecord& fix = run.fixes[1000 + i + i / 40 * 60];  // forty in a row, then used for three minutes
      fix.status = FixStatus::kRejectedByGate;
      for (double& component : fix.innovation) {
        component = common_rad + noise_rad * normal(stream);
      }
    }
    return judge_navigation(good_pass(), run);
  };
  const Verdict remounted = reject(1000, 1e-3, 2e-4);
  EXPECT_THAT(codes(remounted), ElementsAre("calibration-does-not-fit"));
  EXPECT_FALSE(remounted.trustworthy);
  EXPECT_EQ(remounted.findings.at(0).evidence, "1000 of 7200 fixes, 8 and more in a row");
  EXPECT_TRUE(reject(200, 1e-3, 2e-4).trustworthy);
  EXPECT_THAT(codes(reject(200, 1e-3, 2e-4)), ElementsAre("calibration-does-not-fit"));
  EXPECT_THAT(codes(reject(40, 1e-3, 2e-4)), IsEmpty());
  EXPECT_THAT(codes(reject(1000, 0, 1e-3)), IsEmpty());
  // Nothing is held, and no calibration is in use.
  static_cast<void>(reject(1000, 1e-3, 2e-4));
  run.held_parameters_misfit.reset();
  EXPECT_THAT(codes(judge_navigation(good_pass(), run)), IsEmpty());
  run.held_parameters_misfit = 0;
  // Contradict one that started the filter, which was an outlier.
  std::vector<FixRecord>& fixes = run.fixes;
  for (std::size_t i = 1; i + 1 < fixes.size(); ++i) {
    if (fixes[i].status == FixStatus::kRejectedByGate && fixes[i - 1].status == FixStatus::kUsed) {
      fixes[i - 1].status = FixStatus::kStarted;
    } else if (fixes[i].status == FixStatus::kUsed && fixes[i - 1].status == FixStatus::kRejectedByGate) {
      fixes[i].status = FixStatus::kUsedAfterReopening;
    }
  }
  EXPECT_THAT(codes(judge_navigation(good_pass(), run)), IsEmpty());
  static_cast<void>(reject(1000, 1e-3, 2e-4));
  for (FixRecord& fix : run.fixes) {
    fix.jumped = true;  // the star tracker's fault, which is told otherwise
  }
  EXPECT_THAT(codes(judge_navigation(good_pass(), run)), IsEmpty());
}

TEST(Verdict, OfANavigationFindsSamplesWithoutAttitude) {
  NavigationRun run = good_navigation();
  const auto verdict = [&] { return judge_navigation(good_pass(), run); };
  run.samples[SampleStatus::kRejectedNotDirection] = 80000;  // the telemetry's, and counted there
  run.samples[SampleStatus::kThinned] = 800000;
  run.samples[SampleStatus::kRejectedTooFewGyros] = 4000;
  EXPECT_THAT(codes(verdict()), IsEmpty());
  run.samples[SampleStatus::kRejectedTooFewGyros] = 10000;
  EXPECT_THAT(codes(verdict()), ElementsAre("attitude-incomplete"));
  EXPECT_TRUE(verdict().trustworthy);
  EXPECT_EQ(verdict().findings[0].evidence,
            "10000 of 96400 samples: no attitude by the readings at 0, too few gyros at 10000");
  run.samples[SampleStatus::kRejectedTooFewGyros] = 100000;
  EXPECT_FALSE(verdict().trustworthy);
  run = good_navigation();
  run.attitude.t.resize(83000);
  EXPECT_THAT(codes(verdict()), IsEmpty());
  run.attitude.t.resize(272);
  EXPECT_THAT(codes(verdict()), ElementsAre("attitude-incomplete"));
  EXPECT_FALSE(verdict().trustworthy);
  run = good_navigation();
  run.samples[SampleStatus::kRejectedGeometry] = 10000;
  EXPECT_THAT(codes(verdict()), ElementsAre("attitude-incomplete"));
  EXPECT_FALSE(verdict().trustworthy);
}

TEST(Verdict, OfANavigationFindsCorrectionsThatWereNotMade) {
  NavigationRun run = good_navigation();
  const auto verdict = [&] { return judge_navigation(good_pass(), run); };
  run.corrections = 1000;
  run.corrections_missed = 40;  // of each fix: a few outliers
  EXPECT_THAT(codes(verdict()), IsEmpty());
  run.corrections = 6;
  run.corrections_missed = 1;
  EXPECT_THAT(codes(verdict()), ElementsAre("corrections-missed"));
  EXPECT_TRUE(verdict().trustworthy);
  run.corrections = 2;
  run.corrections_missed = 5;
  EXPECT_FALSE(verdict().trustworthy);
}

TEST(Verdict, OfANavigationFindsAnAttitudeThatIsOffTheFixes) {
  NavigationRun run = good_navigation();
  const auto verdict = [&] { return judge_navigation(good_pass(), run); };
  run.open_loops.assign(7, {.t = {}, .error_rad = 1e-4, .square = 16});  // 99.9 % lie below 16.3
  EXPECT_THAT(codes(verdict()), IsEmpty());
  run.open_loops.assign(7, {.t = {}, .error_rad = 1e-4, .square = 20});
  EXPECT_THAT(codes(verdict()), ElementsAre("attitude-off-fixes"));
  EXPECT_TRUE(verdict().trustworthy);
  run.open_loops.assign(7, {.t = {}, .error_rad = 1e-4, .square = 28});
  EXPECT_FALSE(verdict().trustworthy);
  run.open_loops[3].square = std::nan("");  // as of an overflow
  EXPECT_FALSE(verdict().trustworthy);
  run.open_loops.clear();
  EXPECT_THAT(codes(verdict()), IsEmpty());
}

TEST(Verdict, OfANavigationTakesOverThatOfTheCalibrationInUse) {
  NavigationRun run = good_navigation();
  Pass pass = good_pass();
  pass.settings.prior.emplace().verdict.trustworthy = true;
  run.held_parameters_misfit = 0;
  EXPECT_THAT(codes(judge_navigation(pass, run)), IsEmpty());
  pass.settings.prior->verdict.trustworthy = false;
  EXPECT_EQ(judge_navigation(pass, run).findings.at(0).evidence, "it gives no reason");
  pass.settings.prior->verdict.findings = {{FindingCode::kTooFewFixes, "", "", ""},
                                           {FindingCode::kShortPass, "", "", ""}};
  const Verdict held = judge_navigation(pass, run);
  EXPECT_THAT(codes(held), ElementsAre("calibration-not-trustworthy"));
  EXPECT_EQ(held.findings[0].evidence, "too-few-fixes");
  EXPECT_FALSE(held.trustworthy);
  run.held_parameters_misfit.reset();  // calibrated along: a start only
  EXPECT_THAT(codes(judge_navigation(pass, run)), ElementsAre("calibration-not-trustworthy"));
  EXPECT_TRUE(judge_navigation(pass, run).trustworthy);
  // What does not meet a need is not wrong; with another fault it is.
  run.held_parameters_misfit = 0;
  pass.settings.prior->verdict.findings = {{FindingCode::kNeedNotMet, "", "", ""}};
  EXPECT_THAT(codes(judge_navigation(pass, run)), IsEmpty());
  pass.settings.prior->verdict.findings.push_back({FindingCode::kTooFewFixes, "", "", ""});
  EXPECT_THAT(codes(judge_navigation(pass, run)), ElementsAre("calibration-not-trustworthy"));
}

TEST(Verdict, SaysWhatLimitsANeedThatIsNotMet) {
  NavigationRun run = good_navigation();
  const Pass pass = good_pass();
  NeedForecast& need = run.forecast.emplace().need.emplace();
  need.need = {1e-3, std::chrono::minutes(270)};
  need.met = true;
  EXPECT_THAT(codes(judge_navigation(pass, run)), IsEmpty());
  need.met = false;
  need.error_997_rad = 2e-3;
  need.accuracy = {1e-3, std::chrono::minutes(40), false};
  need.causes = {{"gyro1.k0", true, 0.8}, {"gyro2.k0", true, 0.15}, {"readout noise", false, 0.01}};
  const Verdict by_parameter = judge_navigation(pass, run);
  EXPECT_THAT(codes(by_parameter), ElementsAre("need-not-met"));
  EXPECT_FALSE(by_parameter.trustworthy);
  EXPECT_THAT(by_parameter.findings[0].evidence, HasSubstr("gyro1.k0 (80 %), gyro2.k0 (15 %)"));
  EXPECT_THAT(by_parameter.findings[0].evidence, Not(HasSubstr("readout")));
  EXPECT_THAT(by_parameter.findings[0].cure, HasSubstr("correct every 40 min"));
  need.causes = {{"drift that wanders", false, 0.9}};
  need.accuracy.within = Duration::zero();
  const Verdict by_noise = judge_navigation(pass, run);
  EXPECT_THAT(by_noise.findings[0].cure, HasSubstr("noise of the gyros"));
  EXPECT_THAT(by_noise.findings[0].cure, Not(HasSubstr("every")));
  // The largest single cause is noise, but parameters make more of the error together.
  need.causes = {{"random walk of the momenta", false, 0.3}, {"gyro1.k0", true, 0.25}, {"gyro2.k0", true, 0.2}};
  EXPECT_THAT(judge_navigation(pass, run).findings[0].cure, HasSubstr("longer pass, with slews"));
  need.error_997_rad = std::numeric_limits<double>::infinity();
  EXPECT_THAT(judge_navigation(pass, run).findings[0].evidence, HasSubstr("one line"));
}

TEST(Verdict, OfANavigationFindsACalibrationOfAnotherStartUp) {
  const NavigationRun run = good_navigation();
  Pass pass = good_pass();
  pass.settings.prior.emplace().verdict.trustworthy = true;
  const auto found = [&](std::chrono::days later, const char* of_calibration, const char* of_pass) {
    pass.settings.epoch = pass.settings.prior->epoch + later;
    pass.settings.prior->start_up = of_calibration;
    pass.settings.start_up = of_pass;
    const Verdict verdict = judge_navigation(pass, run);
    EXPECT_TRUE(verdict.trustworthy);
    return verdict.findings.empty()
               ? ""
               : std::string(name_of(verdict.findings[0].code)) + ": " + verdict.findings[0].evidence;
  };
  using std::chrono::days;
  EXPECT_EQ(found(days(0), "", ""), "");
  EXPECT_EQ(found(days(29), "", ""), "");
  EXPECT_EQ(found(days(-29), "", "May"), "");
  EXPECT_EQ(found(days(400), "May", "May"), "");
  EXPECT_EQ(found(days(400), "", ""), "calibration-of-another-time: made 400 days before this pass");
  EXPECT_EQ(found(days(-400), "May", ""), "calibration-of-another-time: made 400 days after this pass");
  EXPECT_EQ(found(days(1), "May", "June"), "calibration-of-another-time: start-up May in place of June");
}

TEST(AlignmentObservability, IsNilWhereTheAxisNeverMoves) {
  const auto steady = alignment_observability(flight(0), {0, 0, 0}, 1.45e-5);
  EXPECT_NEAR(std::abs(steady.weakest_axis_c.y()), 1, 1e-6);
  EXPECT_GT(steady.sigma_rad, 1e-3);  // infinite but for rounding
  EXPECT_LT(steady.best_sigma_rad, 2e-6);
}

TEST(AlignmentObservability, DoesNotTakeTheNoiseOfTheTrackerForMotion) {
  auto tracker = flight(0);
  // A deterministic error of the size of the noise, alternating.
  for (std::size_t i = 0; i < tracker.size(); ++i) {
    const Eigen::Vector3d error = (i % 2 == 0 ? 1 : -1) * kNoise_rad;
    tracker.q_in_c[i] = tracker.q_in_c[i] * Rot<C, C>::exp(Vec<C>::assume(error)).quaternion();
  }
  EXPECT_LT(alignment_observability(tracker, {0, 0, 0}, 1.45e-5).sigma_rad, 5e-3);
  EXPECT_GT(alignment_observability(tracker, kNoise_rad, 1.45e-5).sigma_rad, 5e-3);
}

TEST(AlignmentObservability, PassesOverWhatIsNoRotation) {
  auto tracker = flight(0.5);
  const double clean = alignment_observability(tracker, kNoise_rad, 1.45e-5).sigma_rad;
  EXPECT_LT(clean, 2e-6);  // 0.4″: slews of 30°
  tracker.q_in_c[100].coeffs().setZero();
  tracker.q_in_c[101].coeffs().setConstant(std::nan(""));
  EXPECT_NEAR(alignment_observability(tracker, kNoise_rad, 1.45e-5).sigma_rad, clean, 1e-2 * clean);
}

TEST(Verdict, TellsOfGyroSamplesThatWereLeftOutBecauseTheyCameTooFast) {
  auto run = good_run();
  auto pass = good_pass();
  pass.settings.gyro_period = std::chrono::milliseconds(20);
  run.samples[SampleStatus::kUsed] = 2;
  EXPECT_THAT(codes(judge(pass, run)), IsEmpty());
  run.samples[SampleStatus::kThinned] = 1;
  const Verdict verdict = judge(pass, run);
  EXPECT_THAT(codes(verdict), ElementsAre("gyro-samples-thinned"));
  EXPECT_TRUE(verdict.trustworthy);
  EXPECT_EQ(verdict.findings[0].severity, FindingSeverity::kNote);
  EXPECT_THAT(verdict.findings[0].text, HasSubstr("up to 13 samples per second are used"));
  EXPECT_EQ(verdict.findings[0].evidence, "1 of 2 samples left out; sampled every 0.02 s");
}

TEST(Verdict, FindsGyroSamplesThatAreFarApart) {
  auto pass = good_pass();
  pass.settings.gyro_period = std::chrono::milliseconds(350);
  EXPECT_THAT(codes(judge(pass, good_run())), IsEmpty());
  pass.settings.gyro_period = std::chrono::milliseconds(351);
  EXPECT_THAT(codes(judge(pass, good_run())), ElementsAre("gyro-samples-far-apart"));
  pass.settings.gyro_period = std::chrono::seconds(1);
  const Verdict verdict = judge(pass, good_run());
  EXPECT_TRUE(verdict.trustworthy);
  EXPECT_EQ(verdict.findings[0].severity, FindingSeverity::kWarning);
  EXPECT_EQ(verdict.findings[0].evidence, "sampled every 1 s, so that a cubic is fitted over ±4 s instead of ±1.4 s");
  EXPECT_EQ(verdict.findings[0].cure, "Sample the gyros every 0.35 s or more often.");
  auto by_paper = good_run();
  by_paper.options.estimator = Estimator::kPaper;
  EXPECT_EQ(judge(pass, by_paper).findings[0].evidence, "interpolated between samples 1 s apart");
}

}  // namespace
}  // namespace trihedron::ground
