#include "judge/wander_by_angle.hpp"

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

/// Of gyros that are known, with noise that was found to be this.
Calibration known(const sim::SimulatedPass& simulated, double sigma_rad_s, double walk_rad_sqrt_s = 0) {
  Calibration calibration;
  calibration.gyros = ground::true_gyros(simulated.truth, 0);
  calibration.noise = CalibrationNoise{.direction_random_walk_rad_sqrt_s = walk_rad_sqrt_s,
                                       .wandering_drift_rad_s = sigma_rad_s,
                                       .wandering_time_s = kTime_s};
  return calibration;
}

TEST(WanderByAngle, IsOneWhereDriftWandersAsFound) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const sim::SimulatedPass simulated = wandering(seed, kSigma_rad_s);
    const WanderByAngle found = wander_by_angle(simulated.pass.gyro, known(simulated, kSigma_rad_s)).value();
    // Some ten correlation times of two gyros: within a factor of two.
    EXPECT_GE(found.part, 0.5) << seed;
    EXPECT_LE(found.part, 2) << seed;
    EXPECT_LT(found.log_odds, -10) << seed;
    EXPECT_NEAR(found.seen_rad / found.expected_rad, 1, 0.5) << seed;
  }
}

TEST(WanderByAngle, IsFourWhereHalfOfTheWanderingWasFound) {
  const sim::SimulatedPass simulated = wandering(1, kSigma_rad_s);
  EXPECT_NEAR(wander_by_angle(simulated.pass.gyro, known(simulated, kSigma_rad_s / 2)).value().part, 4, 2);
}

TEST(WanderByAngle, IsNothingWhereTheGyrosAreQuiet) {
  const sim::SimulatedPass simulated = wandering(4, 0);
  const WanderByAngle found = wander_by_angle(simulated.pass.gyro, known(simulated, kSigma_rad_s)).value();
  EXPECT_LT(found.part, 0.01);
  EXPECT_GT(found.log_odds, 10);
  // The median of 480 readings of the angle, each with the noise of two direction cosines.
  EXPECT_NEAR(found.seen_rad, simulated.pass.settings.gyros[0].readout_noise_rad * std::sqrt(2 * 1.57 / 480),
              0.2 * found.seen_rad);
  EXPECT_GT(found.expected_rad, 5 * found.seen_rad);
  const WanderByAngle of_walk = wander_by_angle(simulated.pass.gyro, known(simulated, 0, 1e-6)).value();
  EXPECT_GT(of_walk.log_odds, 10);
}

TEST(WanderByAngle, TakesWrongParametersForDriftThatIsThere) {
  const sim::SimulatedPass simulated = wandering(5, 0);
  Calibration calibration = known(simulated, kSigma_rad_s);
  calibration.gyros[0].drift_rad_s[Esg7::kMu12] += 1e-7;
  calibration.gyros[1].alignment_rotation_vector_rad.x() += kArcminute;
  const WanderByAngle found = wander_by_angle(simulated.pass.gyro, calibration).value();
  EXPECT_LT(found.part, 0.01);
}

TEST(WanderByAngle, OutlastsSpikesAndGaps) {
  for (const double sigma_rad_s : {0.0, kSigma_rad_s}) {
    sim::SimulatedPass simulated = wandering(6, sigma_rad_s);
    GyroTelemetry& gyro = simulated.pass.gyro;
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
    const WanderByAngle found = wander_by_angle(kept, known(simulated, kSigma_rad_s)).value();
    EXPECT_EQ(found.log_odds > 10, sigma_rad_s == 0) << sigma_rad_s;
  }
}

TEST(WanderByAngle, IsNotToldWithoutWhatItNeeds) {
  const sim::SimulatedPass simulated = wandering(7, 0);
  const GyroTelemetry& gyro = simulated.pass.gyro;
  Calibration calibration = known(simulated, kSigma_rad_s);
  EXPECT_TRUE(wander_by_angle(gyro, calibration));
  EXPECT_FALSE(wander_by_angle({}, calibration));
  GyroTelemetry hour{gyro.gyros, {gyro.t.begin(), gyro.t.begin() + 8 * 3000}, gyro.h};
  EXPECT_FALSE(wander_by_angle(hour, calibration));
  GyroTelemetry unreadable = gyro;
  std::ranges::fill(unreadable.h, 0);
  EXPECT_FALSE(wander_by_angle(unreadable, calibration));
  calibration.noise.reset();
  EXPECT_FALSE(wander_by_angle(gyro, calibration));
  calibration = known(simulated, kSigma_rad_s);
  calibration.gyros.pop_back();
  EXPECT_FALSE(wander_by_angle(gyro, calibration));
}

}  // namespace
}  // namespace trihedron::ground
