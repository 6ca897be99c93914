// Whether simulated flights bear out what was predicted.

#include "trihedron/plan/confirm.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string_view>

#include "flights.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::plan {
namespace {

/// Twelve flights of an hour with one slew. The mean square of 2 × 12 errors in their sigmas is χ² of 24 over 24; the
/// NEES of 12 runs χ² of 240 over 12; both within their 0.1 % and 99.9 %.
TEST(Confirmation, AgreesWithThePrediction) {
  Scenario scenario = steady_flight();
  scenario.duration = std::chrono::hours(1);
  const auto without = ground::observe(sim::simulate(scenario).pass, told());
  scenario.attitude.slews = std::vector<Slew>{{.begin_s = 600, .yaw_rad = 30 * kDegree}, {.begin_s = 1000}};
  const auto predicted = ground::observe(sim::simulate(scenario).pass, told());
  std::vector<ground::Combination> harmful;
  for (const ground::Combination& combination : without.weak) {
    if (combination.is_harmful) {
      harmful.push_back(combination);
    }
  }
  ASSERT_EQ(harmful.size(), 2U);
  double last = 0;
  const Confirmation confirmation =
      confirm(scenario, harmful, predicted, 12, [&](std::string_view, double fraction) { last = fraction; });
  EXPECT_EQ(last, 1);
  EXPECT_EQ(confirmation.runs, 12);
  EXPECT_EQ(confirmation.parameters, 20);
  EXPECT_GT(confirmation.ratio * confirmation.ratio, 8.1 / 24);
  EXPECT_LT(confirmation.ratio * confirmation.ratio, 51.2 / 24);
  EXPECT_GT(confirmation.nees, 177.9 / 12);
  EXPECT_LT(confirmation.nees, 313.4 / 12);
  ASSERT_EQ(confirmation.along.size(), 2U);
  for (const Confirmation::Along& along : confirmation.along) {
    EXPECT_LT(along.predicted, sigma_along(along.combination, without, without.covariance) / 20);
  }
}

TEST(Confirmation, ContradictsWhereErrorsAreLargerThanPredicted) {
  Confirmation confirmation{.runs = 10, .parameters = 20};
  for (const auto& [nees, contradicts] : {std::pair(20.0, false), {28.0, false}, {36.0, true}, {1e5, true}}) {
    confirmation.nees = nees;
    EXPECT_EQ(confirmation.contradicts(), contradicts) << nees;
  }
  confirmation.runs = 1000;
  confirmation.nees = 25;  // not chance, but sigmas are too small by 1.1 only
  EXPECT_FALSE(confirmation.contradicts());
  confirmation.nees = std::nan("");
  EXPECT_TRUE(confirmation.contradicts());
}

}  // namespace
}  // namespace trihedron::plan
