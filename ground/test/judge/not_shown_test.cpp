#include "judge/not_shown.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <vector>

#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

using ::testing::HasSubstr;

/// Of a body that turns evenly, with a fix each 40 s.
CalibrationRun turning(double rate_rad_s, double sigma_rad) {
  CalibrationRun run;
  for (int i = 0; i < 100; ++i) {
    run.attitude.t.push_back(Time(std::chrono::seconds(40 * i)));
    run.attitude.q_in_c.emplace_back(Eigen::AngleAxisd(rate_rad_s * 40 * i, Eigen::Vector3d::UnitY()));
    run.attitude.sigma_rad.emplace_back(2 * sigma_rad, sigma_rad, 9 * sigma_rad);
  }
  return run;
}

std::vector<Finding> not_shown_by(const CalibrationRun& run) {
  std::vector<Finding> findings;
  judge_what_is_not_shown(run, findings);
  return findings;
}

Evidence of(FurtherState state, std::optional<double> open_sigma) { return {state, -1, false, open_sigma}; }

TEST(NotShown, TellsHowFarAClockOffsetMayTurnTheAttitude) {
  CalibrationRun run = turning(1e-3, kArcsecond);
  run.evidence = {of(FurtherState::kClockOffset, 0.02), of(FurtherState::kReadoutBias, 1e-3)};
  const std::vector<Finding> findings = not_shown_by(run);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, FindingCode::kStarTrackerErrorsNotShown);
  EXPECT_EQ(findings[0].severity, FindingSeverity::kWarning);
  EXPECT_THAT(findings[0].evidence, HasSubstr("1.0″ is claimed about the best known: Clock offset 4.1″"));
  EXPECT_THAT(findings[0].cure, HasSubstr("(clock_offset = \"off\")"));
  // A body that looks at one star turns nothing by it.
  CalibrationRun still = turning(1e-5, kArcsecond);
  still.evidence = run.evidence;
  EXPECT_TRUE(not_shown_by(still).empty());
}

TEST(NotShown, IsNothingWhereTheSigmasAreLargerOrThereIsNoAttitude) {
  CalibrationRun run = turning(1e-3, 3 * kArcsecond);
  run.evidence = {of(FurtherState::kClockOffset, 0.02)};
  EXPECT_TRUE(not_shown_by(run).empty());
  run.attitude = {};
  EXPECT_TRUE(not_shown_by(run).empty());
  // One fix tells no rate.
  run.attitude.t.emplace_back();
  run.attitude.q_in_c.emplace_back(1, 0, 0, 0);
  run.attitude.sigma_rad.emplace_back(1e-6, 1e-6, 1e-6);
  EXPECT_TRUE(not_shown_by(run).empty());
}

TEST(NotShown, TellsOfAnErrorAtOrbitalPeriodAndOfBoth) {
  CalibrationRun run = turning(1e-3, kArcsecond);
  run.evidence = {of(FurtherState::kOrbitalError, 10 * kArcsecond), of(FurtherState::kClockOffset, 0.02)};
  const std::vector<Finding> findings = not_shown_by(run);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_THAT(findings[0].evidence, HasSubstr("10.0″, Clock offset"));
  EXPECT_THAT(findings[0].cure, HasSubstr("orbital_error = \"off\", clock_offset = \"off\""));
  // What was estimated, or told, is not open.
  run.evidence = {of(FurtherState::kOrbitalError, {})};
  EXPECT_TRUE(not_shown_by(run).empty());
}

}  // namespace
}  // namespace trihedron::ground
