#include <gmock/gmock.h>

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <chrono>
#include <string>
#include <vector>

#include "forecasts/flight.hpp"

namespace trihedron::forecasts {
namespace {

using std::chrono::hours;
using std::chrono::minutes;

/// Nothing is left to decide, which would take most of the time.
CalibrationOptions told(Estimator estimator, double walk_rad_sqrt_s) {
  CalibrationOptions options;
  options.estimator = estimator;
  options.drift_model = kEsg7;
  options.find_noise = false;
  options.direction_random_walk_rad_sqrt_s = walk_rad_sqrt_s;
  options.further_states = FurtherStateOptions::none();
  return options;
}

/// Forecasts of passes with other seeds each, which are independent.
std::vector<Forecast> independent(const World& world, Estimator estimator, int passes) {
  const Flight flight{hours(3), {minutes(90)}};
  const double walk = world.scenario.gyros.front().drift.direction_walk_rad_sqrt_s;
  std::vector<Forecast> last;
  for (int seed = 1; seed <= passes; ++seed) {
    last.push_back(fly(world, seed, flight, told(estimator, walk)).back());
  }
  return last;
}

// Bands that a right forecast leaves once in a thousand.
void expect_covered(const std::vector<Forecast>& forecasts) {
  double sum = 0;
  int beyond_2_sigmas = 0;
  int beyond = 0;
  for (const Forecast& forecast : forecasts) {
    sum += forecast.square;
    beyond_2_sigmas += forecast.square > 8.025 ? 1 : 0;
    beyond += forecast.error_rad > forecast.error_997_rad ? 1 : 0;
  }
  const auto count = static_cast<double>(forecasts.size());
  const boost::math::chi_squared all(3 * count);
  EXPECT_GT(sum, boost::math::quantile(all, 0.0005));
  EXPECT_LT(sum, boost::math::quantile(boost::math::complement(all, 0.0005)));
  EXPECT_LE(beyond_2_sigmas,
            boost::math::quantile(boost::math::complement(boost::math::binomial(count, 0.0455), 0.001)));
  EXPECT_LE(beyond, 2);
}

World world_named(const std::string& name) {
  const std::vector<World> all = worlds();
  return *std::ranges::find(all, name, &World::name);
}

TEST(Forecasts, OfTheFilterHold) { expect_covered(independent(world_named("nominal"), Estimator::kInvariant, 12)); }
TEST(Forecasts, OfTheFilterHoldInSteadyFlight) {
  expect_covered(independent(world_named("steady"), Estimator::kInvariant, 12));
}
TEST(Forecasts, OfTheFilterHoldWithARandomWalk) {
  expect_covered(independent(world_named("walk"), Estimator::kInvariant, 12));
}
TEST(Forecasts, OfTheBatchHold) { expect_covered(independent(world_named("nominal"), Estimator::kBatch, 6)); }

}  // namespace
}  // namespace trihedron::forecasts
