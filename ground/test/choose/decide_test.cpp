// What is decided of a pass, with the screening done before or not.

#include "choose/decide.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <utility>

#include "passes.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

TEST(Decide, IsTheSameByAPassThatWasScreenedBefore) {
  const Decision decided = decide(two_hours().pass, {});
  std::optional<Screened> screened = screened_to_decide(two_hours().pass, {});
  ASSERT_TRUE(screened);
  const Decision by_it = decide(two_hours().pass, {}, {}, std::move(screened));
  EXPECT_EQ(by_it.log_likelihood, decided.log_likelihood);
  EXPECT_EQ(by_it.options.direction_random_walk_rad_sqrt_s, decided.options.direction_random_walk_rad_sqrt_s);
  EXPECT_EQ(by_it.run.has_value(), decided.run.has_value());
}

TEST(Decide, ScreensNothingWhereNothingIsToBeDecided) {
  CalibrationOptions paper;
  paper.estimator = Estimator::kPaper;
  EXPECT_FALSE(screened_to_decide(two_hours().pass, paper));
}

TEST(Decide, RefusesBeforeItScreens) {
  Pass pass = two_hours().pass;
  pass.settings.gyros.push_back(pass.settings.gyros.back());
  EXPECT_THROW(static_cast<void>(screened_to_decide(pass, {})), SetupError);
}

}  // namespace
}  // namespace trihedron::ground
