#include "choose/trial.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "choose/decide.hpp"
#include "choose/noise_search.hpp"
#include "passes.hpp"

namespace trihedron::ground {
namespace {

/// A field and nothing else is left to find.
CalibrationOptions field() {
  CalibrationOptions options = told();
  options.estimator = Estimator::kBatch;
  options.drift_model = kLargestDriftModel;
  options.drift_field = true;
  return options;
}

ProcessNoise walk(double rad_sqrt_s) { return {.direction_random_walk_rad_sqrt_s = rad_sqrt_s, .wandering_drift = {}}; }

/// Two hours with a random walk of the momenta.
const sim::SimulatedPass& walking() {
  static const sim::SimulatedPass simulated = [] {
    Scenario scenario = scenario_in_eq1(5, std::chrono::hours(2));
    for (GyroScenario& gyro : scenario.gyros) {
      gyro.drift.direction_walk_rad_sqrt_s = 1e-7;
    }
    return sim::simulate(scenario);
  }();
  return simulated;
}

TEST(Trial, KnowsBeforeTheSpectrumHowLikelyThePassIsAtMost) {
  const Screened screened = screen(walking().pass, field());
  const Trial trial(walking().pass, screened, field(), walk(1e-7));
  for (const double level : {3e-9, 3e-8, 1e-7, 1e-6}) {
    const Trial::ByNoise by = trial.by_noise(trial.found().linear, walk(level));
    EXPECT_LT(trial.log_likelihood(by), by.at_most) << level;
  }
}

TEST(Trial, RefittedIsAsLikelyAsFittedAnew) {
  const Screened screened = screen(walking().pass, field());
  Trial trial(walking().pass, screened, field(), walk(3e-9));
  trial.refit(walk(1e-7));
  const Trial anew(walking().pass, screened, field(), walk(1e-7));
  EXPECT_NEAR(trial.log_likelihood(), anew.log_likelihood(), 0.5);
  // Begun where it ended, there is nothing left to do: one linearisation, and the same result.
  const Trial again(walking().pass, screened, field(), walk(1e-7), &trial);
  EXPECT_EQ(again.found().iterations, 1);
  EXPECT_NEAR(again.log_likelihood(), trial.log_likelihood(), 0.1);
}

TEST(NoiseSearch, LeavesOutNoiseWithWhichNoFieldFits) {
  Scenario scenario = scenario_in_eq1(6, std::chrono::hours(2));
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.direction_walk_rad_sqrt_s = 6e-7;
  }
  const sim::SimulatedPass simulated = sim::simulate(scenario);
  const Screened screened = screen(simulated.pass, field());
  Trial trial(simulated.pass, screened, field(), walk(3e-7));
  const NoiseFit found = with_most_likely_walk(trial, field());
  EXPECT_NEAR(found.noise.direction_random_walk_rad_sqrt_s, 6e-7, 2e-7);
  EXPECT_TRUE(std::isinf(found.gain));
  const auto by = [&](double level) { return trial.by_noise(trial.found().linear, walk(level)); };
  EXPECT_LT(by(kLeastWalk_rad_sqrt_s).at_most, found.log_likelihood - kLogOddsToAccept);
  for (const double factor : {0.5, 2.0}) {
    EXPECT_LT(trial.log_likelihood(by(factor * found.noise.direction_random_walk_rad_sqrt_s)), found.log_likelihood);
  }
}

}  // namespace
}  // namespace trihedron::ground
