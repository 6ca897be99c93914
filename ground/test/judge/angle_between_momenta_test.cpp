#include "judge/angle_between_momenta.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "passes.hpp"

namespace trihedron::ground {
namespace {

constexpr double kSigma_rad_s = 5e-8;
constexpr double kTime_s = 1200;

/// Five hours with slews in which the drift of both gyros wanders by this.
sim::SimulatedPass wandering(std::uint64_t seed, double sigma_rad_s) {
  Scenario scenario = scenario_in_eq1(seed, std::chrono::hours(5));
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.markov_sigma_rad_s = sigma_rad_s;
    gyro.drift.markov_time_s = kTime_s;
  }
  return sim::simulate(scenario);
}

CalibrationNoise noise_of(double sigma_rad_s, double walk_rad_sqrt_s = 0) {
  return {.direction_random_walk_rad_sqrt_s = walk_rad_sqrt_s,
          .star_tracker_noise_rad = {},
          .wandering_drift_rad_s = sigma_rad_s,
          .wandering_time_s = kTime_s};
}

AngleBetweenMomenta angle_of(const sim::SimulatedPass& simulated) {
  return AngleBetweenMomenta::of(simulated.pass.gyro, ground::true_gyros(simulated.truth, 0)).value();
}

TEST(AngleBetweenMomenta, MovesAsMuchAsDriftThatWanders) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const AngleBetweenMomenta angle = angle_of(wandering(seed, kSigma_rad_s));
    const AngleBetweenMomenta::Wander found = angle.wander(noise_of(kSigma_rad_s));
    // Some ten correlation times of two gyros: within a factor of two.
    EXPECT_GE(found.part, 0.5) << seed;
    EXPECT_LE(found.part, 2) << seed;
    EXPECT_LT(found.log_odds, -10) << seed;
    EXPECT_NEAR(angle.left_rad() / found.expected_rad, 1, 0.5) << seed;
    EXPECT_NEAR(angle.wander(noise_of(kSigma_rad_s / 2)).part, 4 * found.part, found.part) << seed;
  }
}

TEST(AngleBetweenMomenta, StandsStillWhereTheGyrosAreQuiet) {
  const sim::SimulatedPass simulated = wandering(4, 0);
  const AngleBetweenMomenta angle = angle_of(simulated);
  // The median of 480 readings of the angle, each with the noise of two direction cosines.
  EXPECT_NEAR(angle.left_rad(), simulated.pass.settings.gyros[0].readout_noise_rad * std::sqrt(2 * 1.57 / 480),
              0.2 * angle.left_rad());
  const AngleBetweenMomenta::Wander found = angle.wander(noise_of(kSigma_rad_s));
  EXPECT_LT(found.part, 0.01);
  EXPECT_GT(found.log_odds, 10);
  EXPECT_GT(found.expected_rad, 5 * angle.left_rad());
  EXPECT_GT(angle.wander(noise_of(0, 1e-6)).log_odds, 10);
}

TEST(AngleBetweenMomenta, DoesNotDependOnTheAlignmentsOfTheCalibration) {
  const sim::SimulatedPass simulated = wandering(5, 0);
  std::vector<GyroCalibration> gyros = ground::true_gyros(simulated.truth, 0);
  gyros[1].alignment_rotation_vector_rad.x() += 5 * kArcsecond;
  const auto angle = AngleBetweenMomenta::of(simulated.pass.gyro, gyros).value();
  EXPECT_NEAR(angle.left_rad(), angle_of(simulated).left_rad(), 0.02 * angle.left_rad());
}

TEST(AngleBetweenMomenta, LeavesOfALineWhatDriftAtItsPeriodCannotMake) {
  const AngleBetweenMomenta angle = angle_of(wandering(4, 0));
  // Of a whole line the root mean square is √½. Drift of eq. (1) makes lines at the orbital rate and twice it.
  EXPECT_NEAR(angle.largest_line_rad(600), std::sqrt(2) * angle.left_rad(), 0.2 * angle.left_rad());
  EXPECT_GT(angle.largest_line_rad(5700), 3 * angle.largest_line_rad(600));
}

TEST(AngleBetweenMomenta, OutlastsSpikesAndGaps) {
  for (const double sigma_rad_s : {0.0, kSigma_rad_s}) {
    sim::SimulatedPass simulated = wandering(6, sigma_rad_s);
    const GyroTelemetry& gyro = simulated.pass.gyro;
    std::mt19937_64 random(6);
    std::bernoulli_distribution is_spike(0.01);
    GyroTelemetry kept{gyro.gyros, {}, {}};
    for (std::size_t i = 0; i < gyro.size(); ++i) {
      const double t_s = to_seconds(gyro.t[i] - gyro.t[0]);
      if (t_s > 6000 && t_s < 6600) {
        continue;
      }
      kept.t.push_back(gyro.t[i]);
      const double spike = is_spike(random) ? 0.02 : 0;
      for (std::size_t j = 6 * i; j < 6 * i + 6; ++j) {
        kept.h.push_back(gyro.h[j] + spike);
      }
    }
    simulated.pass.gyro = kept;
    EXPECT_EQ(angle_of(simulated).wander(noise_of(kSigma_rad_s)).log_odds > 10, sigma_rad_s == 0) << sigma_rad_s;
  }
}

TEST(AngleBetweenMomenta, NeedsTwoGyrosAndHours) {
  const sim::SimulatedPass simulated = wandering(7, 0);
  const GyroTelemetry& gyro = simulated.pass.gyro;
  std::vector<GyroCalibration> gyros = ground::true_gyros(simulated.truth, 0);
  EXPECT_TRUE(AngleBetweenMomenta::of(gyro, gyros));
  EXPECT_FALSE(AngleBetweenMomenta::of({}, gyros));
  const GyroTelemetry hour{gyro.gyros, {gyro.t.begin(), gyro.t.begin() + 8 * 3600}, gyro.h};
  EXPECT_FALSE(AngleBetweenMomenta::of(hour, gyros));
  GyroTelemetry unreadable = gyro;
  std::ranges::fill(unreadable.h, 0);
  EXPECT_FALSE(AngleBetweenMomenta::of(unreadable, gyros));
  gyros.pop_back();
  EXPECT_FALSE(AngleBetweenMomenta::of(gyro, gyros));
}

}  // namespace
}  // namespace trihedron::ground
