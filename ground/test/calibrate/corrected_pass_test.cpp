// What is corrected of a pass before it is calibrated.

#include "calibrate/corrected_pass.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "passes.hpp"

namespace trihedron::ground {
namespace {

TEST(CorrectedPass, IsThePassItselfWhereNothingIsWrong) {
  StopRequest stop_screening;
  const CorrectedPass corrected(two_hours().pass, {}, stop_screening);
  EXPECT_EQ(&corrected.pass(), &two_hours().pass);
  EXPECT_FALSE(stop_screening.made());
}

TEST(CorrectedPass, StopsTheScreeningOfThePassAsGiven) {
  Pass late = two_hours().pass;
  for (Time& t : late.star_tracker.t) {
    t += std::chrono::milliseconds(400);
  }
  StopRequest stop_screening;
  const CorrectedPass corrected(late, {}, stop_screening);
  EXPECT_NE(&corrected.pass(), &late);
  EXPECT_TRUE(stop_screening.made());
  EXPECT_EQ(corrected.options().further_states[FurtherState::kClockOffset], FurtherStateOptions::Choice::kOn);
  CalibrationRun run;
  corrected.put_into(run);
  EXPECT_NEAR(run.clock_correction.offset_s, -0.4, 0.01);
}

}  // namespace
}  // namespace trihedron::ground
