// What is corrected of a pass before it is calibrated, and what is done meanwhile with the pass as it was given.

#include "calibrate/corrected_pass.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "choose/decide.hpp"
#include "passes.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

const Pass& clean_pass() {
  static const Pass its = sim::simulate(scenario_in_eq1(3, std::chrono::hours(2))).pass;
  return its;
}

TEST(CorrectedPass, IsThePassItselfWhereNothingIsWrong) {
  StopRequest is_another;
  const CorrectedPass corrected(clean_pass(), {}, is_another);
  EXPECT_EQ(&corrected.pass(), &clean_pass());
  EXPECT_FALSE(is_another.made());
}

TEST(CorrectedPass, SaysAtOnceThatItIsAnother) {
  Pass late = clean_pass();
  for (Time& t : late.star_tracker.t) {
    t += std::chrono::milliseconds(400);
  }
  StopRequest is_another;
  const CorrectedPass corrected(late, {}, is_another);
  EXPECT_NE(&corrected.pass(), &late);
  EXPECT_TRUE(is_another.made());
  EXPECT_EQ(corrected.options().further_states[FurtherState::kClockOffset], FurtherStateOptions::Choice::kOn);
  CalibrationRun run;
  corrected.put_into(run);
  EXPECT_NEAR(run.clock_correction.offset_s, -0.4, 0.01);
}

TEST(Decide, IsTheSameByAPassThatWasScreenedBefore) {
  const Decision decided = decide(clean_pass(), {});
  std::optional<Screened> screened = screened_to_decide(clean_pass(), {});
  ASSERT_TRUE(screened);
  const Decision by_it = decide(clean_pass(), {}, {}, std::move(screened));
  EXPECT_EQ(by_it.log_likelihood, decided.log_likelihood);
  EXPECT_EQ(by_it.options.direction_random_walk_rad_sqrt_s, decided.options.direction_random_walk_rad_sqrt_s);
  EXPECT_EQ(by_it.run.has_value(), decided.run.has_value());
}

TEST(Decide, ScreensNothingWhereNothingIsToBeDecided) {
  CalibrationOptions paper;
  paper.estimator = Estimator::kPaper;
  EXPECT_FALSE(screened_to_decide(clean_pass(), paper));
}

TEST(Decide, RefusesBeforeItScreens) {
  Pass pass = clean_pass();
  pass.settings.gyros.push_back(pass.settings.gyros.back());
  EXPECT_THROW(static_cast<void>(screened_to_decide(pass, {})), SetupError);
}

}  // namespace
}  // namespace trihedron::ground
