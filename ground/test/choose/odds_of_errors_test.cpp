#include "choose/odds_of_errors.hpp"

#include <gtest/gtest.h>

#include "added_drift.hpp"
#include "model/orbital_rate.hpp"
#include "onboard/screen.hpp"
#include "passes.hpp"

namespace trihedron::ground {
namespace {

TEST(OrbitalOdds, TellAnErrorOfTheStarTrackerFromDrift) {
  const auto odds_of = [](const Pass& pass) {
    CalibrationOptions options = told();
    options.estimator = Estimator::kBatch;
    options.drift_model = kEsg7;
    options.orbital_rate_rad_s = orbital_rate_rad_s(pass.star_tracker);
    const Screened screened = screen(pass, options);
    return orbital_odds(Trial(pass, screened, options));
  };
  const auto over_drift = [&](const Pass& pass) {
    const OrbitalOdds odds = odds_of(pass);
    return odds.error.by_prior_as_it_is - odds.drift.by_prior_as_it_is;
  };
  Scenario scenario = scenario_in_eq1(6, std::chrono::hours(3));
  const sim::SimulatedPass quiet = sim::simulate(scenario);
  EXPECT_LT(odds_of(quiet.pass).drift.by_prior_as_it_is, -10);  // from there on it is worth a try
  EXPECT_LT(odds_of(quiet.pass).error.value, 0);
  Pass drifting = quiet.pass;
  add_orbital_drift(quiet.truth, {4e-8, -3e-8, 2e-8}, {-2e-8, 3e-8, 5e-8}, 0, drifting.gyro);
  add_orbital_drift(quiet.truth, {-3e-8, 5e-8, 1e-8}, {4e-8, 2e-8, -3e-8}, 1, drifting.gyro);
  EXPECT_LT(over_drift(drifting), -5);
  // Of both momenta alike it is an error of the star tracker but in slews: neither is sure after three hours.
  Pass alike = quiet.pass;
  for (int k = 0; k < 2; ++k) {
    add_orbital_drift(quiet.truth, {4e-8, -3e-8, 2e-8}, {-2e-8, 3e-8, 5e-8}, k, alike.gyro);
  }
  EXPECT_LT(over_drift(alike), 5);
  scenario.star_tracker.orbital_sine_rad = Eigen::Vector3d(6, -5, 8) / 206265;
  EXPECT_GT(over_drift(sim::simulate(scenario).pass), 5);
}

}  // namespace
}  // namespace trihedron::ground
