#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "model/orbital_rate.hpp"
#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"

namespace trihedron::ground {
namespace {

constexpr double kMiddle_s = 1.5 * 3600;
const Eigen::Vector3d kAxis{0.6, -0.64, 0.48};

/// A pass with slews in which something moves.
CalibrationRun calibrated(std::uint64_t seed, const std::function<void(Scenario&)>& change,
                          Duration duration = std::chrono::hours(3)) {
  Scenario scenario = scenario_in_eq1(seed, duration);
  change(scenario);
  return calibrate(sim::simulate(scenario).pass, CalibrationOptions());
}

bool names(const CalibrationRun& run, FindingCode code) { return run.calibration.verdict.has(code); }

bool names_a_change(const CalibrationRun& run) {
  for (const FindingCode code :
       {FindingCode::kGyroMountingMoved, FindingCode::kStarTrackerMoved, FindingCode::kMomentumJumped,
        FindingCode::kInertialAxesTurned, FindingCode::kCoefficientsNotConstant, FindingCode::kAberrationNotCorrected,
        FindingCode::kReadoutScaleOff, FindingCode::kReadoutErrorByDirection, FindingCode::kStarTrackerWanders}) {
    if (names(run, code)) {
      return true;
    }
  }
  return false;
}

TEST(Moves, FindsNothingWhereNothingMoves) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    EXPECT_FALSE(names_a_change(calibrated(seed, [](Scenario&) {}))) << seed;
  }
  const auto steady = [](Scenario& scenario) { scenario.attitude.slews = std::vector<Slew>{}; };
  const CalibrationRun run = calibrated(4, steady);
  EXPECT_FALSE(names_a_change(run));
  EXPECT_EQ(run.calibration.on_board_drift.value().drift_model, kEsg7);
}

// A pass in which eq. (1) alone is 110 sigmas off in alignment, though it forecasts as well as more, and looks like
// uncorrected aberration.
TEST(Moves, TakesDriftOutsideEq1ForWhatItIs) {
  Scenario scenario;
  scenario.seed = 3180130578;
  scenario.duration = std::chrono::hours(9);
  scenario.attitude.reference = AttitudeScenario::Reference::kYawSteered;
  scenario.attitude.slews = std::vector<Slew>{};
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  const CalibrationRun run = calibrate(simulated.pass, CalibrationOptions());
  EXPECT_FALSE(names_a_change(run));
  EXPECT_NE(run.calibration.gyros[0].drift_model, kEsg7);
  const Eigen::VectorXd errors = estimate_minus_truth(run.calibration, simulated.truth);
  for (Eigen::Index i = 0; i < errors.size(); ++i) {
    if (run.calibration.states[static_cast<std::size_t>(i)].is_alignment()) {
      EXPECT_LT(std::abs(errors(i)), 4 * std::sqrt(run.calibration.covariance(i, i))) << i;
    }
  }
}

TEST(Moves, TellsDayAndNightFromOtherCoursesOfTheCoefficients) {
  const auto by_day = [](Scenario& scenario) {
    for (GyroScenario& gyro : scenario.gyros) {
      gyro.drift.thermal_fraction = 0.5;
    }
  };
  const CalibrationRun run = calibrated(1, by_day, std::chrono::hours(5));
  const Change& change = run.changes.front();
  EXPECT_EQ(change.moving, Moving::kCoefficients);
  EXPECT_EQ(change.motion, Motion::kOrbital);
  EXPECT_TRUE(change.is_found());
  EXPECT_TRUE(names(run, FindingCode::kCoefficientsNotConstant));
}

TEST(Moves, NamesTheCaseThatSlippedAndWhen) {
  const CalibrationRun run = calibrated(1, [](Scenario& scenario) {
    scenario.gyros[0].mounting_change = {.step_rad = 20 * kArcsecond * kAxis, .step_at_s = kMiddle_s};
  });
  EXPECT_TRUE(names(run, FindingCode::kGyroMountingMoved));
  EXPECT_FALSE(run.calibration.verdict.trustworthy);
  const Change& change = run.changes.front();
  EXPECT_EQ(change.gyro, 0);
  const Time at = run.calibration.epoch + from_seconds(kMiddle_s);
  EXPECT_LE(change.from, at);
  EXPECT_GE(change.until, at);
  // Five of its sigmas, and what half a stretch of the pass without the step makes of it.
  EXPECT_LT((change.size - 20 * kArcsecond * kAxis).norm(), 5 * change.sigma.norm() + 4 * kArcsecond);
}

TEST(Moves, NamesTheStarTrackerThatSlipped) {
  const CalibrationRun run = calibrated(2, [](Scenario& scenario) {
    scenario.star_tracker.mounting_change = {.step_rad = 20 * kArcsecond * kAxis, .step_at_s = kMiddle_s};
  });
  EXPECT_TRUE(names(run, FindingCode::kStarTrackerMoved));
  EXPECT_FALSE(run.calibration.verdict.trustworthy);
}

// Drift outside eq. (1), or that wanders, would be taken for so small a step, were it not between two fixes.
TEST(Moves, NamesMountingsThatSlipByArcsecondsAndTheSecondOfIt) {
  constexpr double kAt_s = 3096;
  const auto slips = [](Scenario& scenario, MountingChange& mounting, const Eigen::Vector3d& step_rad) {
    mounting = {.step_rad = step_rad, .step_at_s = kAt_s};
    const CalibrationRun run = calibrate(sim::simulate(scenario).pass, CalibrationOptions());
    const Change& change = run.changes.front();
    EXPECT_TRUE(change.is_found());
    EXPECT_EQ(change.motion, Motion::kStep);
    const Time at = run.calibration.epoch + from_seconds(kAt_s);
    EXPECT_EQ(change.until, at);
    EXPECT_EQ(change.from, at - scenario.star_tracker_period);
    EXPECT_LT(((change.size - step_rad).array() / change.sigma.array()).abs().maxCoeff(), 4);
    // Attitudes before and after are apart by many of their sigmas, whatever the parameters are.
    const bool forbids_use = std::ranges::any_of(run.calibration.verdict.findings, [](const Finding& finding) {
      return finding.code == FindingCode::kStarTrackerMoved && finding.severity == FindingSeverity::kDoNotUse;
    });
    EXPECT_EQ(forbids_use, change.moving == Moving::kStarTracker);
    return change;
  };
  Scenario scenario;
  scenario.seed = 1;
  scenario.duration = std::chrono::hours(2);
  scenario.gyro_period = std::chrono::milliseconds(250);
  Scenario other = scenario;
  EXPECT_EQ(slips(scenario, scenario.star_tracker.mounting_change, {0, 12 * kArcsecond, 0}).moving,
            Moving::kStarTracker);
  const Change of_case = slips(other, other.gyros[1].mounting_change, {12 * kArcsecond, 0, 0});
  EXPECT_EQ(of_case.moving, Moving::kGyroCase);
  EXPECT_EQ(of_case.gyro, 1);
}

TEST(Moves, NamesTheStarTrackerThatTurnsSlowly) {
  const CalibrationRun run = calibrated(3, [](Scenario& scenario) {
    scenario.star_tracker.mounting_change.rate_rad_s = 60 * kArcsecond / (2 * kMiddle_s) * kAxis;
  });
  EXPECT_TRUE(names(run, FindingCode::kStarTrackerMoved));
  EXPECT_FALSE(run.calibration.verdict.trustworthy);
}

/// By an angle that depends on the time since the first fix.
void turn_fixes(StarTrackerTelemetry& fixes, const Eigen::Vector3d& axis,
                const std::function<double(double)>& angle_rad) {
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const double t_s = to_seconds(fixes.t[i] - fixes.t.front());
    fixes.q_in_c[i] = fixes.q_in_c[i] * Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad(t_s), axis));
  }
}

TEST(Moves, NamesTheStarTrackerThatCreepsOrSettlesByArcseconds) {
  constexpr double kDuration_s = 9 * 3600;
  const auto creeps = [](double t_s) { return 6 * kArcsecond * t_s / kDuration_s; };
  const auto settles = [](double t_s) { return 8 * kArcsecond * (1 - std::exp(-t_s / (0.15 * kDuration_s))); };
  const std::vector<std::pair<Motion, std::function<double(double)>>> courses = {{Motion::kRamp, creeps},
                                                                                 {Motion::kDecay, settles}};
  for (const auto& [motion, angle_rad] : courses) {
    Pass pass = sim::simulate(scenario_in_eq1(14, from_seconds(kDuration_s))).pass;
    turn_fixes(pass.star_tracker, Eigen::Vector3d::UnitZ(), angle_rad);
    const CalibrationRun run = calibrate(pass, CalibrationOptions());
    EXPECT_TRUE(names(run, FindingCode::kStarTrackerMoved));
    EXPECT_FALSE(run.calibration.verdict.trustworthy);
    EXPECT_EQ(run.changes.front().motion, motion);
    EXPECT_NEAR(run.changes.front().size.z(), angle_rad(kDuration_s), 4 * run.changes.front().sigma.z());
  }
}

CalibrationOptions with_constant_coefficients() {
  CalibrationOptions options;
  options.further_states[FurtherState::kCoefficientChange] = FurtherStateOptions::Choice::kOff;
  return options;
}

TEST(Moves, NamesErrorsOfTheStarTrackerFasterThanTheOrbit) {
  for (const int times : {2, 3}) {
    Pass pass = sim::simulate(scenario_in_eq1(12, std::chrono::hours(4))).pass;
    const double rate_rad_s = times * orbital_rate_rad_s(pass.star_tracker);
    turn_fixes(pass.star_tracker, Eigen::Vector3d::UnitX(),
               [&](double t_s) { return 4 * kArcsecond * std::sin(rate_rad_s * t_s); });
    const CalibrationRun run = calibrate(pass, CalibrationOptions());
    EXPECT_TRUE(names(run, FindingCode::kStarTrackerWanders)) << times;
    EXPECT_FALSE(run.calibration.verdict.trustworthy) << times;
    const Change& change = run.changes.front();
    EXPECT_EQ(change.motion, Motion::kFaster) << times;
    EXPECT_NEAR(std::hypot(change.size(0), change.size(3)), 4 * kArcsecond, kArcsecond) << times;
  }
}

// In this flight the motion moves parameters by many of their sigmas; where it is less than two, it is named as well,
// and the result may be used.
TEST(Moves, NamesTheCaseThatGoesToAndFroAtTheOrbitalRate) {
  Pass pass = sim::simulate(scenario_in_eq1(14, std::chrono::hours(6))).pass;
  const double rate_rad_s = orbital_rate_rad_s(pass.star_tracker);
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    const double angle_rad = 4 * kArcsecond * std::sin(rate_rad_s * to_seconds(pass.gyro.t[i] - pass.gyro.t[0]));
    Eigen::Map<Eigen::Vector3d> h(&pass.gyro.h[3 * static_cast<std::size_t>(pass.gyro.gyros) * i]);
    h = (Eigen::AngleAxisd(angle_rad, kAxis) * h).eval();
  }
  const CalibrationRun run = calibrate(pass, CalibrationOptions());
  EXPECT_TRUE(names(run, FindingCode::kGyroMountingMoved));
  EXPECT_FALSE(run.calibration.verdict.trustworthy);
  EXPECT_EQ(run.changes.front().motion, Motion::kOrbital);
}

TEST(Moves, NamesCoefficientsThatChange) {
  Scenario scenario = scenario_in_eq1(4, std::chrono::hours(3));
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.warm_up_fraction = 0.3;
  }
  const CalibrationRun run = calibrate(sim::simulate(scenario).pass, with_constant_coefficients());
  EXPECT_TRUE(names(run, FindingCode::kCoefficientsNotConstant));
}

/// Whether each coefficient of eq. (1) and each alignment is within four sigmas.
void expect_within_sigmas(const Calibration& found, const Truth& truth) {
  const Eigen::VectorXd errors = estimate_minus_truth(found, truth);
  for (Eigen::Index i = 0; i < errors.size(); ++i) {
    const ParameterId& state = found.states[static_cast<std::size_t>(i)];
    if (!state.is_drift() || state.coefficient.is_in_eq1()) {
      EXPECT_LT(std::abs(errors(i)), 4 * std::sqrt(found.covariance(i, i))) << i;
    }
  }
}

// A jump by a twentieth of what coefficients are is many of the sigmas that are claimed where they are taken for
// constant. The alignment does not suffer.
TEST(Moves, PutsCoefficientsThatChangeIntoTheirSigmas) {
  Scenario scenario = scenario_in_eq1(7, std::chrono::hours(6));
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.jump_sigma_rad_s = 1e-7;
    gyro.drift.jump_at_s = kMiddle_s;
  }
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  CalibrationOptions options = with_constant_coefficients();
  options.drift_model = kEsg7;
  const CalibrationRun run = calibrate(simulated.pass, options);
  EXPECT_TRUE(names(run, FindingCode::kCoefficientsNotConstant));
  const Calibration& found = run.calibration;
  expect_within_sigmas(found, simulated.truth);
  for (Eigen::Index i = 0; i < found.covariance.rows(); ++i) {
    // What is predicted of open loops begins with the same.
    const Eigen::Index begins_with = run.errors.layout.drift(0) + i;
    EXPECT_NEAR(run.errors.covariance(begins_with, begins_with), found.covariance(i, i), 1e-6 * found.covariance(i, i));
  }
}

/// Six hours with slews, in which the coefficients change; nothing is off, and no noise stands for it.
CalibrationRun flown_with_course(Estimator estimator, const std::function<void(DriftScenario&)>& change) {
  Scenario scenario = scenario_in_eq1(7, std::chrono::hours(6));
  for (GyroScenario& gyro : scenario.gyros) {
    change(gyro.drift);
  }
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  CalibrationOptions options;
  options.estimator = estimator;
  CalibrationRun run = calibrate(simulated.pass, options);
  expect_within_sigmas(run.calibration, simulated.truth);
  EXPECT_TRUE(run.calibration.verdict.trustworthy);
  EXPECT_TRUE(names(run, FindingCode::kCoefficientsChanged));
  EXPECT_FALSE(names(run, FindingCode::kDriftNotExplained));
  return run;
}

TEST(Moves, FindsTheTimeOfAWarmUp) {
  constexpr double kTime_s = 2400;
  const CalibrationRun run = flown_with_course(Estimator::kBatch, [](DriftScenario& drift) {
    drift.warm_up_fraction = 0.3;
    drift.warm_up_time_s = kTime_s;
  });
  EXPECT_EQ(run.options.further_states.change_course, CourseOfChange::Kind::kWarmUp);
  EXPECT_NEAR(to_seconds(run.options.further_states.change_time), kTime_s, 0.05 * kTime_s);
}

TEST(Moves, FindsTheTimeOfAJump) {
  constexpr double kAt_s = 2.3 * 3600;
  const CalibrationRun run = flown_with_course(Estimator::kInvariant, [](DriftScenario& drift) {
    drift.jump_sigma_rad_s = 1e-6;
    drift.jump_at_s = kAt_s;
  });
  EXPECT_EQ(run.options.further_states.change_course, CourseOfChange::Kind::kJump);
  EXPECT_NEAR(to_seconds(run.options.further_states.change_time), kAt_s, 10);
}

TEST(Moves, NamesAxesOfAReadoutThatAreNotAtRightAngles) {
  const Pass given = sim::simulate(scenario_in_eq1(8, std::chrono::hours(3))).pass;
  for (const double by : {1e-4, 3e-5}) {
    Pass pass = given;
    Eigen::Matrix3d skewed = Eigen::Matrix3d::Identity();
    skewed(0, 1) = skewed(1, 0) = by;
    for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
      Eigen::Map<Eigen::Vector3d> h(&pass.gyro.h[3 * static_cast<std::size_t>(pass.gyro.gyros) * i]);
      h = (skewed * h).normalized().eval();
    }
    EXPECT_TRUE(names(calibrate(pass, CalibrationOptions()), FindingCode::kReadoutScaleOff)) << by;
  }
}

TEST(Moves, NamesReadingsThatAreNotLinear) {
  Pass pass = sim::simulate(scenario_in_eq1(8, std::chrono::hours(3))).pass;
  for (std::size_t i = 0; i < pass.gyro.h.size(); i += 3) {
    Eigen::Map<Eigen::Vector3d> h(&pass.gyro.h[i]);
    h = (h + 10 * kArcsecond * Eigen::Vector3d(h.array().cube())).normalized().eval();
  }
  const CalibrationRun run = calibrate(pass, CalibrationOptions());
  EXPECT_TRUE(names(run, FindingCode::kReadoutErrorByDirection));
  EXPECT_FALSE(run.calibration.verdict.trustworthy);
}

TEST(Moves, NamesAberration) {
  const CalibrationRun run = calibrated(
      5, [](Scenario& scenario) { scenario.star_tracker.aberration = StarTrackerScenario::Aberration::kUncorrected; });
  EXPECT_TRUE(names(run, FindingCode::kAberrationNotCorrected));
  EXPECT_FALSE(run.calibration.verdict.trustworthy);
}

TEST(Moves, NamesInertialAxesThatJump) {
  const CalibrationRun run = calibrated(6, [](Scenario& scenario) {
    // Far from both momenta: about one of them, it could not be told from a jump of the other.
    scenario.star_tracker.inertial_step_rad = 23 * kArcsecond * Eigen::Vector3d::Ones();
    scenario.star_tracker.inertial_step_at_s = kMiddle_s;
  });
  EXPECT_TRUE(names(run, FindingCode::kInertialAxesTurned));
}

}  // namespace
}  // namespace trihedron::ground
