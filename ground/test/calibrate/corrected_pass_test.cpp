// What is corrected of a pass before it is calibrated.

#include "calibrate/corrected_pass.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "passes.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

const Pass& clean_pass() {
  static const Pass its = sim::simulate(scenario_in_eq1(3, std::chrono::hours(2))).pass;
  return its;
}

TEST(CorrectedPass, IsThePassItselfWhereNothingIsWrong) {
  StopRequest stop_screening;
  const CorrectedPass corrected(clean_pass(), {}, stop_screening);
  EXPECT_EQ(&corrected.pass(), &clean_pass());
  EXPECT_FALSE(stop_screening.made());
}

TEST(CorrectedPass, StopsTheScreeningOfThePassAsGiven) {
  Pass late = clean_pass();
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
