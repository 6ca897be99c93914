#include "judge/contradictions.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <vector>

namespace trihedron::ground {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kInnovationSigma_rad = 1e-5;

/// An hour of fixes, of which a hundred in its middle contradict two gyros by so many sigmas, and what came after them.
CalibrationRun run_with(double sigmas1, double sigmas2, FixStatus next, bool jumped = true) {
  CalibrationRun run;
  for (int i = 0; i < 1200; ++i) {
    FixRecord& fix = run.fixes.emplace_back();
    fix.t = Time(std::chrono::seconds(3 * i));
    fix.status = FixStatus::kUsed;
    fix.innovation_sigma.assign(4, kInnovationSigma_rad);
    fix.innovation.assign(4, 0);
    if (i >= 500 && i < 600) {
      fix.status = FixStatus::kRejectedByGate;
      fix.innovation = {sigmas1 * kInnovationSigma_rad, 0, 0, sigmas2 * kInnovationSigma_rad};
      fix.jumped = jumped;
    }
  }
  run.fixes[600].status = next;
  return run;
}

std::vector<Finding> judged(const CalibrationRun& run, std::vector<Finding> findings = {}) {
  judge_contradictions(run.fixes, run.gyro_events, {}, findings);
  return findings;
}

std::vector<FindingCode> codes_of(const std::vector<Finding>& findings) {
  std::vector<FindingCode> all;
  for (const Finding& finding : findings) {
    all.push_back(finding.code);
  }
  return all;
}

Finding finding_of(FindingCode code) { return {code, "", "", ""}; }

TEST(Contradictions, OfOneGyroByFarAreOfThatGyro) {
  const auto findings = judged(run_with(0, 1000, FixStatus::kUsed), {finding_of(FindingCode::kStarTrackerOff)});
  ASSERT_THAT(codes_of(findings), ElementsAre(FindingCode::kGyroContradicted));
  EXPECT_EQ(findings[0].evidence, "gyro 2, 100 fixes from 25.0 min on");
  EXPECT_EQ(findings[0].severity, FindingSeverity::kDoNotUse);
}

/// Of both gyros; or of one by so little that the star tracker may have turned nearly about the momentum of the other.
TEST(Contradictions, OfTheStarTrackerAreLeftToIt) {
  for (const auto& [first, second] : {std::pair(1000, 1000), std::pair(0, 100)}) {
    const auto findings = judged(run_with(first, second, FixStatus::kUsed), {finding_of(FindingCode::kStarTrackerOff)});
    EXPECT_THAT(codes_of(findings), ElementsAre(FindingCode::kStarTrackerOff));
  }
}

TEST(Contradictions, OfAGyroDoNotAcquitAStarTrackerThatIsOffAtTheEnd) {
  CalibrationRun run = run_with(0, 1000, FixStatus::kUsed);
  for (std::size_t i = 1100; i < run.fixes.size(); ++i) {
    run.fixes[i].status = FixStatus::kRejectedByGate;
    run.fixes[i].innovation.assign(4, 1000 * kInnovationSigma_rad);
  }
  EXPECT_THAT(codes_of(judged(run, {finding_of(FindingCode::kStarTrackerOff)})),
              ElementsAre(FindingCode::kStarTrackerOff, FindingCode::kGyroContradicted));
}

TEST(Contradictions, AfterALeapAreOfTheGyros) {
  CalibrationRun run = run_with(1000, 1000, FixStatus::kUsed);
  const auto at = [](int s) { return Time(std::chrono::seconds(s)); };
  run.gyro_events = {{at(900), 1, GyroState::kLeapt}, {at(1480), 1, GyroState::kUsed}};
  ASSERT_THAT(codes_of(judged(run)), ElementsAre(FindingCode::kGyroContradicted));
  EXPECT_THAT(judged(run)[0].evidence, HasSubstr("after readings that had leapt were used again"));
  run.gyro_events.back().t = at(1400);
  EXPECT_THAT(judged(run), IsEmpty());  // long before
  run.gyro_events = {{at(900), 1, GyroState::kStuck}, {at(1480), 1, GyroState::kUsed}};
  EXPECT_THAT(judged(run), IsEmpty());  // it had only stood still
}

TEST(Contradictions, ThatTheFilterGaveInToForbidUse) {
  const std::vector<Finding> reopened = {finding_of(FindingCode::kReopened)};
  for (const FixStatus next : {FixStatus::kUsedAfterReopening, FixStatus::kRestarted}) {
    const auto findings = judged(run_with(1000, 1000, next), reopened);
    ASSERT_THAT(codes_of(findings), ElementsAre(FindingCode::kReopened));
    EXPECT_EQ(findings[0].severity, FindingSeverity::kDoNotUse);
    EXPECT_THAT(findings[0].evidence, HasSubstr("100 fixes after a jump"));
  }
  // Drift that the model does not contain moves away slowly.
  EXPECT_EQ(judged(run_with(6, 6, FixStatus::kUsedAfterReopening, false), reopened)[0].severity,
            FindingSeverity::kWarning);
}

}  // namespace
}  // namespace trihedron::ground
