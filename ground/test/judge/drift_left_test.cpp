#include "judge/drift_left.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "passes.hpp"

namespace trihedron::ground {
namespace {

using testing::HasSubstr;

constexpr double kSigma_rad = 1e-5;

/// Nine hours of white innovations of two gyros; those of `gyro` have a line of this amplitude, in sigmas.
std::vector<FixRecord> innovations(std::uint64_t seed, double amplitude = 0, double period_s = 1800, int gyro = 1) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<FixRecord> fixes;
  for (int i = 0; i <= 10'800; ++i) {
    FixRecord& fix = fixes.emplace_back();
    fix.t = Time(std::chrono::seconds(3 * i));
    fix.status = FixStatus::kUsed;
    fix.innovation_sigma.assign(4, kSigma_rad);
    for (int component = 0; component < 4; ++component) {
      const double line = component == 2 * gyro ? amplitude * std::sin(2 * std::numbers::pi * 3 * i / period_s) : 0;
      fix.innovation.push_back(kSigma_rad * (normal(random) + line));
    }
  }
  return fixes;
}

CalibrationRun run_of(std::vector<FixRecord> fixes) {
  CalibrationRun run;
  run.fixes = std::move(fixes);
  run.options.find_noise = true;
  return run;
}

std::vector<Finding> found(const CalibrationRun& run, std::vector<Finding> findings = {}) {
  judge_drift_left({}, run, findings);
  return findings;
}

TEST(SlowLine, OfWhiteInnovationsIsRarelyLessLikelyThanItSays) {
  // By chance one in a hundred: more than 6 of 100 seeds are as unlikely as 1e-4 (Poisson).
  int below = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    below += strongest_slow_line(innovations(seed), 550).value().log_chance < std::log(0.01) ? 1 : 0;
  }
  EXPECT_LE(below, 6);
}

TEST(SlowLine, IsFoundInItsGyroAtItsPeriodWithItsAmplitude) {
  const SlowLine line = strongest_slow_line(innovations(1, 0.15), 550).value();
  EXPECT_EQ(line.gyro, 1);
  EXPECT_NEAR(line.period_s, 1800, 1e-9);
  // Of N innovations the noise puts √(2/N) into each quadrature.
  EXPECT_NEAR(line.amplitude, 0.15, 4 * std::sqrt(2.0 / 10'801));
  EXPECT_LT(line.log_chance, std::log(1e-5));
}

TEST(SlowLine, IsNotLookedForInFewOrUnusedInnovations) {
  std::vector<FixRecord> fixes = innovations(1);
  EXPECT_TRUE(strongest_slow_line(fixes, 550));
  for (FixRecord& fix : fixes) {
    fix.status = FixStatus::kRejectedByGate;
  }
  EXPECT_FALSE(strongest_slow_line(fixes, 550));
  EXPECT_FALSE(strongest_slow_line({}, 550));
  fixes = innovations(1);
  fixes.resize(190);
  EXPECT_FALSE(strongest_slow_line(fixes, 550));
}

TEST(DriftNotExplained, IsSaidOfALineThatNoNoiseMakes) {
  EXPECT_TRUE(found(run_of(innovations(1))).empty());
  const std::vector<Finding> findings = found(run_of(innovations(1, 0.15)));
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, FindingCode::kDriftNotExplained);
  EXPECT_EQ(findings[0].severity, FindingSeverity::kWarning);
  EXPECT_THAT(findings[0].evidence, HasSubstr("gyro 2 have a line of 30 min"));
}

TEST(DriftNotExplained, IsNotSaidOnceMoreOfALineThatIsToldAlready) {
  Finding told;
  told.code = FindingCode::kOrbitalLine;
  EXPECT_EQ(found(run_of(innovations(1, 0.15)), {told}).size(), 1U);
}

TEST(DriftNotExplained, IsSaidOfNoiseThatStandsForDrift) {
  CalibrationRun run = run_of({});
  run.options.direction_random_walk_rad_sqrt_s = 2e-8;
  EXPECT_TRUE(found(run).empty());
  run.options.direction_random_walk_rad_sqrt_s = 8e-8;
  ASSERT_EQ(found(run).size(), 1U);
  EXPECT_THAT(found(run)[0].evidence, HasSubstr("random walk of the momenta of 8.0e-08"));
  run.options.find_noise = false;  // it was given, not found
  EXPECT_TRUE(found(run).empty());

  run.options.find_noise = true;
  run.options.direction_random_walk_rad_sqrt_s = 3e-9;
  run.options.further_states.wandering_drift_rad_s = 2e-7;
  run.evidence = {{FurtherState::kWanderingDrift, 1, false}};
  EXPECT_TRUE(found(run).empty());
  run.evidence = {{FurtherState::kWanderingDrift, 50, true}};
  ASSERT_EQ(found(run).size(), 1U);
  EXPECT_THAT(found(run)[0].evidence, HasSubstr("drift of 2.0e-07 rad/s"));
}

TEST(DriftNotExplained, IsSaidOfTheStarTrackerWhereTheMomentaKeepTheirAngle) {
  const sim::SimulatedPass& quiet = two_hours();
  CalibrationRun run = run_of({});
  run.evidence = {{FurtherState::kWanderingDrift, 50, true}};
  run.calibration.gyros = ground::true_gyros(quiet.truth, 0);
  run.calibration.noise = CalibrationNoise{.wandering_drift_rad_s = 2e-7, .wandering_time_s = 600};
  std::vector<Finding> findings;
  judge_drift_left(quiet.pass, run, findings);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, FindingCode::kStarTrackerWanders);
  EXPECT_EQ(findings[0].severity, FindingSeverity::kDoNotUse);
  EXPECT_THAT(findings[0].evidence, HasSubstr("that wanders in"));
}

TEST(DriftNotExplained, IsNotSaidOfTheStarTrackerWhereTheThirdGyroAloneDrifts) {
  Scenario scenario = scenario_in_eq1(3, std::chrono::hours(3));
  scenario.gyros.push_back(scenario.gyros.front());
  scenario.gyros.back().start_direction_c = {1, 1, 1};
  for (const double sigma_rad_s : {0.0, 1e-7}) {
    scenario.gyros.back().drift.markov_sigma_rad_s = sigma_rad_s;
    scenario.gyros.back().drift.markov_time_s = 600;
    const auto simulated = sim::simulate(scenario);
    CalibrationRun run = run_of({});
    run.evidence = {{FurtherState::kWanderingDrift, 50, true}};
    run.calibration.gyros = ground::true_gyros(simulated.truth, 0);
    run.calibration.noise = CalibrationNoise{.wandering_drift_rad_s = 1e-7, .wandering_time_s = 600};
    std::vector<Finding> findings;
    judge_drift_left(simulated.pass, run, findings);
    ASSERT_EQ(findings.size(), 1U);
    EXPECT_EQ(findings[0].code == FindingCode::kStarTrackerWanders, sigma_rad_s == 0) << sigma_rad_s;
  }
}

TEST(DriftNotExplained, ForbidsUseWhereTheAngleDoesNotTellItFromTheStarTracker) {
  // So slow that what is fitted to the angle takes up most of it.
  CalibrationRun run = run_of({});
  run.evidence = {{FurtherState::kWanderingDrift, 50, true}};
  run.calibration.gyros = ground::true_gyros(two_hours().truth, 0);
  run.calibration.noise = CalibrationNoise{.wandering_drift_rad_s = 6e-9, .wandering_time_s = 10'800};
  run.attitude.sigma_rad = {Eigen::Vector3d::Constant(5e-6)};
  std::vector<Finding> findings;
  judge_drift_left(two_hours().pass, run, findings);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, FindingCode::kDriftNotExplained);
  EXPECT_EQ(findings[0].severity, FindingSeverity::kDoNotUse);
  // 2 (x - 1 + e^-x) with x = 2/3: 1-sigma of 6e-9 rad/s over 10 800 s times 0.600, 38.9 µrad.
  EXPECT_THAT(findings[0].evidence, HasSubstr("moves a momentum by 8.02″"));

  // Where the attitude is not known as well as it moves, an error of the star tracker as large does no harm.
  run.attitude.sigma_rad = {Eigen::Vector3d::Constant(2e-5)};
  findings.clear();
  judge_drift_left(two_hours().pass, run, findings);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].severity, FindingSeverity::kWarning);
}

TEST(DriftNotExplained, IsSaidOfTheStarTrackerWhereALineIsInTheFixesAlone) {
  const sim::SimulatedPass& quiet = two_hours();
  CalibrationRun run = run_of(innovations(1, 1, 600));
  run.calibration.gyros = ground::true_gyros(quiet.truth, 0);
  run.calibration.noise = CalibrationNoise{.direction_random_walk_rad_sqrt_s = 3e-9};
  std::vector<Finding> findings;
  judge_drift_left(quiet.pass, run, findings);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, FindingCode::kStarTrackerWanders);
  EXPECT_THAT(findings[0].evidence, HasSubstr("line of 10 min"));

  // Drift of gyro 2 that moves the angle as far.
  Pass moved = quiet.pass;
  for (std::size_t i = 0; i < moved.gyro.size(); ++i) {
    const double turn_rad =
        kSigma_rad * std::sin(2 * std::numbers::pi * to_seconds(moved.gyro.t[i] - moved.gyro.t[0]) / 600);
    const Eigen::Vector3d normal = moved.gyro.direction(i, 0).cross(moved.gyro.direction(i, 1));
    Eigen::Map<Eigen::Vector3d>(&moved.gyro.h[6 * i + 3]) += turn_rad * normal.cross(moved.gyro.direction(i, 1));
  }
  findings.clear();
  judge_drift_left(moved, run, findings);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, FindingCode::kDriftNotExplained);
}

}  // namespace
}  // namespace trihedron::ground
