#include "calibrate/correlated_fixes.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <random>

#include "model/orbital_rate.hpp"
#include "passes.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

const Eigen::Vector3d kErrors_rad = Eigen::Vector3d(3, 3, 20) * kArcsecond;
constexpr Duration kPass = std::chrono::hours(6);

/// Errors that are alike over `time_s`, first-order Gauss–Markov, of this 1-sigma.
void add_errors(StarTrackerTelemetry& fixes, double time_s, const Eigen::Vector3d& sigma_rad, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto drawn = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  Eigen::Vector3d error = drawn();
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (i > 0) {
      const double kept = std::exp(-to_seconds(fixes.t[i] - fixes.t[i - 1]) / time_s);
      error = kept * error + std::sqrt(1 - kept * kept) * drawn();
    }
    const Eigen::Vector3d off_rad = error.cwiseProduct(sigma_rad);
    fixes.q_in_c[i] = fixes.q_in_c[i] * Rot<C, C>::exp(Vec<C>::assume(off_rad)).quaternion();
  }
}

/// With slews, and white noise of 0.3″ about each axis beside these errors.
sim::SimulatedPass with_errors(double time_s, std::uint64_t seed = 1) {
  Scenario scenario = scenario_in_eq1(seed, kPass);
  scenario.star_tracker.noise_rad.setConstant(0.3 * kArcsecond);
  sim::SimulatedPass simulated = sim::simulate(scenario);
  add_errors(simulated.pass.star_tracker, time_s, kErrors_rad, seed);
  simulated.pass.settings.star_tracker_noise_rad = kErrors_rad;
  return simulated;
}

TEST(CorrelatedFixes, AreLeftOutSoThatThoseThatStayAreIndependent) {
  for (const Estimator estimator : {Estimator::kInvariant, Estimator::kBatch}) {
    const sim::SimulatedPass simulated = with_errors(10);
    const CalibrationRun run = calibrate(simulated.pass, {.estimator = estimator});
    ASSERT_EQ(run.correlated_fixes.size(), 1U);
    const CorrelatedFixes& its = run.correlated_fixes[0];
    EXPECT_EQ(its.head, 0);
    EXPECT_NEAR(its.time_s, 10, 2);  // a step of the search is 5 %, chance in six hours some percent more
    EXPECT_GT(its.part, 0.9);        // all but 0.3″ and what the readings have
    EXPECT_NEAR(its.apart_s, 3.04 * its.time_s, 3);
    EXPECT_EQ(static_cast<std::size_t>(its.left_out) + run.fixes.size(), simulated.pass.star_tracker.size());
    EXPECT_TRUE(run.calibration.verdict.has(FindingCode::kCorrelatedFixes));
    EXPECT_TRUE(run.calibration.verdict.trustworthy);
    EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);  // 20 degrees of freedom, once in a thousand
  }
}

TEST(CorrelatedFixes, OfWhichAllAreUsedForbidUse) {
  const CalibrationRun run = calibrate(with_errors(10).pass, told());
  EXPECT_TRUE(run.correlated_fixes.empty());
  EXPECT_FALSE(run.calibration.verdict.trustworthy);
}

TEST(CorrelatedFixes, AreFoundForTimesOfAMinute) {
  const sim::SimulatedPass simulated = with_errors(60);
  const CalibrationRun run = calibrate(simulated.pass, {});
  ASSERT_EQ(run.correlated_fixes.size(), 1U);
  EXPECT_NEAR(run.correlated_fixes[0].time_s, 60, 25);  // six hours have few differences over minutes
  EXPECT_TRUE(run.calibration.verdict.trustworthy);
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);
}

TEST(CorrelatedFixes, AreLeftOutForNavigationToo) {
  const sim::SimulatedPass simulated = with_errors(10);
  const NavigationRun run = navigate(simulated.pass, {});
  ASSERT_EQ(run.correlated_fixes.size(), 1U);
  EXPECT_LT(run.fixes.size(), simulated.pass.star_tracker.size() / 6);
  EXPECT_TRUE(run.verdict.has(FindingCode::kCorrelatedFixes));
}

/// As of a star tracker that is mounted at an angle: about no axis of c alone.
TEST(CorrelatedFixes, AreNotThoseWithWhiteNoiseAboutATiltedAxis) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    Scenario scenario = scenario_in_eq1(seed, std::chrono::hours(3));
    scenario.star_tracker.noise_rad.setConstant(3 * kArcsecond);
    Pass pass = sim::simulate(scenario).pass;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const Eigen::Vector3d tilted_rad = 20 * kArcsecond * Eigen::Vector3d(std::sqrt(0.75), 0, 0.5);
    for (Eigen::Quaterniond& q_in_c : pass.star_tracker.q_in_c) {
      q_in_c = q_in_c * Rot<C, C>::exp(Vec<C>::assume(Eigen::Vector3d(normal(random) * tilted_rad))).quaternion();
    }
    EXPECT_THAT(correlated_fixes(pass), testing::IsEmpty()) << seed;
  }
}

TEST(CorrelatedFixes, AreNotThoseWithWhiteNoise) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const sim::SimulatedPass simulated =
        sim::simulate(scenario_in_eq1(seed, std::chrono::hours(1) + seed * std::chrono::minutes(10)));
    EXPECT_TRUE(correlated_fixes(simulated.pass).empty()) << seed;
  }
}

TEST(CorrelatedFixes, AreFoundWhereAPartOfTheErrorsIsAlike) {
  Pass pass = sim::simulate(scenario_in_eq1(4, kPass)).pass;
  add_errors(pass.star_tracker, 30, 2.0 / 3 * kErrors_rad, 4);
  const std::vector<CorrelatedFixes> found = correlated_fixes(pass);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].part, 0.31, 0.1);  // of 1 + 4/9
  EXPECT_NEAR(found[0].time_s, 30, 15);
  EXPECT_NEAR(found[0].apart_s, found[0].time_s * std::log(1 + found[0].part / 0.05), 3);
}

TEST(CorrelatedFixes, AreFoundBesideDropoutsAndStampsThatJitter) {
  Pass pass = with_errors(10).pass;
  std::mt19937 random(1);
  StarTrackerTelemetry kept;
  for (std::size_t i = 0; i < pass.star_tracker.size(); ++i) {
    if (random() % 10 != 0) {
      kept.add(pass.star_tracker, i);
      kept.t.back() += std::chrono::milliseconds(random() % 10);
    }
  }
  pass.star_tracker = kept;
  const std::vector<CorrelatedFixes> found = correlated_fixes(pass);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].time_s, 10, 2);
}

TEST(CorrelatedFixes, AreNotThoseOfAxesThatAreExchanged) {
  Pass pass = with_errors(10).pass;
  for (Eigen::Quaterniond& q_in_c : pass.star_tracker.q_in_c) {
    q_in_c.coeffs().head<3>() *= -1;
  }
  EXPECT_TRUE(correlated_fixes(pass).empty());
}

TEST(CorrelatedFixes, ThatAreNoRotationsAreLeftOut) {
  Pass pass = with_errors(10).pass;
  std::vector<CorrelatedFixes> found = correlated_fixes(pass);
  ASSERT_EQ(found.size(), 1U);
  for (std::size_t i = 0; i < pass.star_tracker.size(); i += 2) {
    pass.star_tracker.q_in_c[i].coeffs().setConstant(std::nan(""));
  }
  leave_out(found, pass);
  EXPECT_TRUE(
      std::ranges::all_of(pass.star_tracker.q_in_c, [](const auto& q_in_c) { return q_in_c.coeffs().allFinite(); }));
  EXPECT_NEAR(static_cast<double>(pass.star_tracker.size()), to_seconds(kPass) / (found[0].apart_s + 3), 30);
}

TEST(CorrelatedFixes, LeaveTheRateOfTheOrbitWhatItIs) {
  Pass pass = with_errors(60).pass;
  const double rate_rad_s = orbital_rate_rad_s(pass.star_tracker);
  std::vector<CorrelatedFixes> found = correlated_fixes(pass);
  ASSERT_EQ(found.size(), 1U);
  leave_out(found, pass);
  EXPECT_NEAR(shown_orbital_rate_rad_s(pass.star_tracker).value(), rate_rad_s, 1e-3 * rate_rad_s);
}

TEST(CorrelatedFixes, AreNotLookedForByEstimatorPaper) {
  EXPECT_TRUE(calibrate(with_errors(10).pass, {.estimator = Estimator::kPaper}).correlated_fixes.empty());
}

TEST(CorrelatedFixes, AreNotWhatABodyThatWobblesShowsOfTheAlignments) {
  Scenario scenario = scenario_in_eq1(1, kPass);
  scenario.star_tracker.noise_rad = 0.3 * kErrors_rad;
  scenario.attitude.jitter_rad = 0.05 * kDegree;
  scenario.attitude.jitter_bandwidth_hz = 0.015;
  EXPECT_TRUE(correlated_fixes(sim::simulate(scenario).pass).empty());
}

TEST(CorrelatedFixes, AreFoundWhereTheBodyIsSteeredInYaw) {
  Scenario scenario = scenario_in_eq1(1, kPass);
  scenario.attitude.reference = AttitudeScenario::Reference::kYawSteered;
  Pass pass = sim::simulate(scenario).pass;
  EXPECT_TRUE(correlated_fixes(pass).empty());
  add_errors(pass.star_tracker, 20, kErrors_rad, 1);
  EXPECT_EQ(correlated_fixes(pass).size(), 1U);
}

TEST(CorrelatedFixes, AreNotThoseOfAStarTrackerThatIsFrozen) {
  Pass pass = sim::simulate(scenario_in_eq1(1, kPass)).pass;
  auto& q_in_c = pass.star_tracker.q_in_c;
  std::fill(q_in_c.begin() + 3000, q_in_c.begin() + 4200, q_in_c[3000]);
  EXPECT_TRUE(correlated_fixes(pass).empty());
}

TEST(CorrelatedFixes, AreNotThoseOfErrorsThatLast) { EXPECT_TRUE(correlated_fixes(with_errors(600).pass).empty()); }

TEST(CorrelatedFixes, OfFewAreNotLookedFor) {
  Pass pass = with_errors(10).pass;
  pass.star_tracker.t.resize(500);
  pass.star_tracker.q_in_c.resize(500);
  EXPECT_TRUE(correlated_fixes(pass).empty());
  pass.gyro = {};
  EXPECT_TRUE(correlated_fixes(pass).empty());
}

TEST(CorrelatedFixes, AreThoseOfEachStarTracker) {
  Scenario scenario = scenario_in_eq1(2, kPass);
  scenario.further_star_trackers.resize(1);
  Pass pass = sim::simulate(scenario).pass;
  add_errors(pass.further_star_trackers.at(0), 10, 3 * kErrors_rad, 2);
  std::vector<CorrelatedFixes> found = correlated_fixes(pass);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].head, 1);
  const std::size_t of_first = pass.star_tracker.size();
  const std::size_t of_second = pass.further_star_trackers[0].size();
  leave_out(found, pass);
  EXPECT_EQ(pass.star_tracker.size(), of_first);
  EXPECT_EQ(pass.further_star_trackers[0].size() + static_cast<std::size_t>(found[0].left_out), of_second);
  EXPECT_GT(found[0].left_out, 0);
  EXPECT_GE(to_seconds(pass.further_star_trackers[0].t[1] - pass.further_star_trackers[0].t[0]), found[0].apart_s - 1);
}

}  // namespace
}  // namespace trihedron::ground
