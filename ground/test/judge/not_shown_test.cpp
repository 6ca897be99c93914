#include "judge/not_shown.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <vector>

#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Fixes of a body that turns evenly.
Pass turning(double rate_rad_s) {
  Pass pass;
  for (int i = 0; i < 100; ++i) {
    pass.star_tracker.t.push_back(Time(std::chrono::seconds(3 * i)));
    pass.star_tracker.q_in_c.emplace_back(Eigen::AngleAxisd(rate_rad_s * 3 * i, Eigen::Vector3d::UnitY()));
  }
  return pass;
}

CalibrationRun claiming(double sigma_rad) {
  CalibrationRun run;
  run.attitude.sigma_rad.assign(5, Eigen::Vector3d(2 * sigma_rad, sigma_rad, 9 * sigma_rad));
  return run;
}

std::vector<Finding> found(const Pass& pass, const CalibrationRun& run) {
  std::vector<Finding> findings;
  judge_what_is_not_shown(pass, run, findings);
  return findings;
}

Evidence of(FurtherState state, std::optional<double> open_sigma) { return {state, -1, false, open_sigma}; }

TEST(NotShown, TellsHowFarAClockOffsetMayTurnTheAttitude) {
  CalibrationRun run = claiming(kArcsecond);
  run.evidence = {of(FurtherState::kClockOffset, 0.02), of(FurtherState::kReadoutBias, 1e-3)};
  const std::vector<Finding> findings = found(turning(1e-3), run);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, FindingCode::kStarTrackerErrorsNotShown);
  EXPECT_EQ(findings[0].severity, FindingSeverity::kWarning);
  EXPECT_THAT(findings[0].evidence, HasSubstr("1.0″ is claimed about the best known: Clock offset 4.1″"));
  EXPECT_THAT(findings[0].cure, HasSubstr("clock_offset = \"off\""));
  EXPECT_THAT(findings[0].cure, Not(HasSubstr("readout")));
  // The body of a star camera that looks at one place turns nothing by it.
  EXPECT_TRUE(found(turning(1e-5), run).empty());
}

TEST(NotShown, IsNothingWhereTheSigmasAreLarger) {
  CalibrationRun run = claiming(3 * kArcsecond);
  run.evidence = {of(FurtherState::kClockOffset, 0.02)};
  EXPECT_TRUE(found(turning(1e-3), run).empty());
  run.attitude.sigma_rad.clear();
  EXPECT_TRUE(found(turning(1e-3), run).empty());
}

TEST(NotShown, TellsOfAnErrorAtOrbitalPeriodAndOfBoth) {
  CalibrationRun run = claiming(kArcsecond);
  run.evidence = {of(FurtherState::kOrbitalError, 10 * kArcsecond), of(FurtherState::kClockOffset, 0.02)};
  const std::vector<Finding> findings = found(turning(1e-3), run);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_THAT(findings[0].evidence, HasSubstr("10.0″, Clock offset"));
  EXPECT_THAT(findings[0].cure, HasSubstr("orbital_error = \"off\", clock_offset = \"off\""));
  // What was estimated, or told, is not open.
  run.evidence = {of(FurtherState::kOrbitalError, {})};
  EXPECT_TRUE(found(turning(1e-3), run).empty());
  // Fixes too few for a rate.
  run.evidence = {of(FurtherState::kClockOffset, 0.02)};
  EXPECT_TRUE(found(Pass(), run).empty());
}

}  // namespace
}  // namespace trihedron::ground
