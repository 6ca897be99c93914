// Readings that are wrong for a moment.

#include "calibrate/bursts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

constexpr std::size_t kEvery = 1000;  // samples from one burst to the next

/// Bursts of so many samples, in each of which the readings of a gyro are off by one turn.
Pass with_bursts(Pass pass, int gyro, std::size_t samples, double sigma_rad, std::size_t every = kEvery) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> off_rad(0, sigma_rad);
  for (std::size_t from = every; from + samples < pass.gyro.size(); from += every) {
    const Eigen::Vector3d turn(off_rad(random), off_rad(random), off_rad(random));
    for (std::size_t i = from; i < from + samples; ++i) {
      const Eigen::Vector3d h_b = pass.gyro.direction(i, gyro);
      const Eigen::Vector3d read = (h_b + turn.cross(h_b)).normalized();
      std::ranges::copy(
          read, &pass.gyro.h[(i * static_cast<std::size_t>(pass.gyro.gyros) + static_cast<std::size_t>(gyro)) * 3]);
    }
  }
  return pass;
}

/// The part of the attitudes that are off by more than four of their sigmas about an axis.
double part_beyond_4_sigmas(const AttitudeHistory& attitude, const Truth& truth) {
  std::size_t beyond = 0;
  for (std::size_t i = 0; i < attitude.t.size(); ++i) {
    const auto at = std::ranges::lower_bound(truth.t, attitude.t[i]) - truth.t.begin();
    const Eigen::Quaterniond off = truth.q_in_c[static_cast<std::size_t>(at)].conjugate() * attitude.q_in_c[i];
    const Eigen::Vector3d error_rad = 2 * off.vec() * (off.w() < 0 ? -1 : 1);
    beyond += (error_rad.array().abs() > 4 * attitude.sigma_rad[i].array()).any() ? 1 : 0;
  }
  return static_cast<double>(beyond) / static_cast<double>(attitude.t.size());
}

TEST(Bursts, AreLeftOut) {
  const sim::SimulatedPass flown = sim::simulate(scenario_in_eq1(3, std::chrono::hours(3)));
  for (const double sigma_arcsec : {200.0, 3000.0}) {
    const Pass pass = with_bursts(flown.pass, 1, 8, sigma_arcsec / 206265);
    const auto wrong = wrong_for_a_moment(pass);
    ASSERT_TRUE(wrong);
    const auto rest = without(*wrong, pass);
    ASSERT_TRUE(rest);
    const long bursts = std::ssize(pass.gyro.t) / static_cast<long>(kEvery);
    EXPECT_NEAR(static_cast<double>(wrong->bursts.bursts), static_cast<double>(bursts),
                0.1 * static_cast<double>(bursts));
    EXPECT_LT(wrong->bursts.samples, 12 * bursts);
    EXPECT_EQ(rest->gyro.t.size() + static_cast<std::size_t>(wrong->bursts.samples), pass.gyro.t.size());

    const CalibrationRun run = calibrate(pass, {});
    EXPECT_TRUE(run.calibration.verdict.trustworthy);
    EXPECT_TRUE(run.calibration.verdict.has(FindingCode::kGyroReadingsWrong));
    EXPECT_LT(part_beyond_4_sigmas(run.attitude, flown.truth), 1e-3);
  }
}

TEST(Bursts, ForbidTheUseOfANavigation) {
  const sim::SimulatedPass flown = sim::simulate(scenario_in_eq1(3, std::chrono::hours(1)));
  EXPECT_FALSE(navigate(flown.pass, {}).verdict.has(FindingCode::kGyroReadingsWrong));
  const NavigationRun run = navigate(with_bursts(flown.pass, 1, 8, 1e-3), {});
  EXPECT_TRUE(run.verdict.has(FindingCode::kGyroReadingsWrong));
  EXPECT_FALSE(run.verdict.trustworthy);
}

TEST(Bursts, OfOneOfThreeGyrosLeaveTheOthers) {
  Scenario scenario = scenario_in_eq1(3, std::chrono::hours(2));
  scenario.gyros.push_back(scenario.gyros[0]);
  scenario.gyros[2].start_direction_c = {0.1, -0.6, 0.79};
  const Pass pass = with_bursts(sim::simulate(scenario).pass, 2, 8, 3e-3);
  const auto wrong = wrong_for_a_moment(pass);
  ASSERT_TRUE(wrong);
  const auto rest = without(*wrong, pass);
  ASSERT_TRUE(rest);
  EXPECT_EQ(rest->gyro.t.size(), pass.gyro.t.size());
  const std::size_t in_burst = 3 * kEvery + 4;
  EXPECT_TRUE(rest->gyro.direction(in_burst, 0).allFinite());
  EXPECT_TRUE(rest->gyro.direction(in_burst, 1).allFinite());
  EXPECT_FALSE(rest->gyro.direction(in_burst, 2).allFinite());
}

/// Slews, a case of which nothing is known but that it is mounted to a degree, a momentum that jumps, noise that is
/// told too small, clocks of the gyros that are apart.
TEST(Bursts, AreNotSeenWhereThereAreNone) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    Scenario scenario = scenario_in_eq1(seed, std::chrono::hours(3));
    EXPECT_FALSE(wrong_for_a_moment(sim::simulate(scenario).pass));
    scenario.gyros[0].misalignment_magnitude_rad = 0.0175;
    scenario.gyros[0].mounting_change.step_rad = {1e-3, -1e-3, 1e-3};
    scenario.gyros[0].mounting_change.step_at_s = 5000;
    scenario.gyros[0].readout.noise_rad *= 2;
    scenario.gyros[1].readout.latency_s = 0.01;
    EXPECT_FALSE(wrong_for_a_moment(sim::simulate(scenario).pass)) << seed;
  }
}

/// The screening and the fits see these, but for spikes of some sigmas that come one after the other.
TEST(Bursts, AreNotSpikesOrReadingsThatAreStuck) {
  Scenario scenario = scenario_in_eq1(4, std::chrono::hours(3));
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.readout.spike_probability = 1e-3;
    gyro.readout.stuck_probability = 1e-4;
  }
  const auto wrong = wrong_for_a_moment(sim::simulate(scenario).pass);
  EXPECT_LE(wrong ? wrong->bursts.bursts : 0, 2);
}

TEST(Bursts, ThatAreManyForbidTheUse) {
  const sim::SimulatedPass flown = sim::simulate(scenario_in_eq1(3, std::chrono::hours(1)));
  const Pass pass = with_bursts(flown.pass, 1, 8, 1e-3, 100);
  const auto wrong = wrong_for_a_moment(pass);
  ASSERT_TRUE(wrong);
  EXPECT_FALSE(without(*wrong, pass));
  const Verdict verdict = calibrate(pass, {}).calibration.verdict;
  EXPECT_TRUE(verdict.has(FindingCode::kGyroReadingsWrong));
  EXPECT_FALSE(verdict.trustworthy);
}

TEST(Bursts, LastNoLongerThanSeconds) {
  const sim::SimulatedPass flown = sim::simulate(scenario_in_eq1(3, std::chrono::hours(1)));
  EXPECT_FALSE(wrong_for_a_moment(with_bursts(flown.pass, 0, 100, 1e-3)));
}

TEST(Bursts, AreNotLookedForInSamplesThatAreFarApart) {
  Pass pass = with_bursts(sim::simulate(scenario_in_eq1(3, std::chrono::hours(1))).pass, 1, 8, 1e-3);
  ASSERT_TRUE(wrong_for_a_moment(pass));
  pass.settings.gyro_period = std::chrono::seconds(2);
  EXPECT_FALSE(wrong_for_a_moment(pass));
}

}  // namespace
}  // namespace trihedron::ground
