// What is decided of a pass, with the screening done before or not.

#include "choose/decide.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <utility>

#include "passes.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

const Pass& pass_to_decide() {
  static const Pass its = sim::simulate(scenario_in_eq1(3, std::chrono::hours(2))).pass;
  return its;
}

TEST(Decide, IsTheSameByAPassThatWasScreenedBefore) {
  const Decision decided = decide(pass_to_decide(), {});
  std::optional<Screened> screened = screened_to_decide(pass_to_decide(), {});
  ASSERT_TRUE(screened);
  const Decision by_it = decide(pass_to_decide(), {}, {}, std::move(screened));
  EXPECT_EQ(by_it.log_likelihood, decided.log_likelihood);
  EXPECT_EQ(by_it.options.direction_random_walk_rad_sqrt_s, decided.options.direction_random_walk_rad_sqrt_s);
  EXPECT_EQ(by_it.run.has_value(), decided.run.has_value());
}

TEST(Decide, ScreensNothingWhereNothingIsToBeDecided) {
  CalibrationOptions paper;
  paper.estimator = Estimator::kPaper;
  EXPECT_FALSE(screened_to_decide(pass_to_decide(), paper));
}

TEST(Decide, RefusesBeforeItScreens) {
  Pass pass = pass_to_decide();
  pass.settings.gyros.push_back(pass.settings.gyros.back());
  EXPECT_THROW(static_cast<void>(screened_to_decide(pass, {})), SetupError);
}

}  // namespace
}  // namespace trihedron::ground
