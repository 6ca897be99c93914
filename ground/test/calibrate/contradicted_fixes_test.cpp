// Fixes that the filter believes and the rest of the pass contradicts.

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>

#include "named.hpp"
#include "passes.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

using testing::Contains;
using testing::Field;
using testing::Not;

/// Two hours in which the star tracker is off by 5° over an interval.
Pass with_tracker_off(Duration from, Duration to) {
  Pass pass = two_hours().pass;
  const Eigen::Quaterniond off(Eigen::AngleAxisd(0.09, Eigen::Vector3d(1, 2, -2).normalized()));
  StarTrackerTelemetry& fixes = pass.star_tracker;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const Duration age = fixes.t[i] - pass.settings.epoch;
    fixes.q_in_c[i] = age >= from && age < to ? off * fixes.q_in_c[i] : fixes.q_in_c[i];
  }
  return pass;
}

long left_out(const CalibrationRun& run) {
  return std::ranges::count_if(run.fixes, [](const FixRecord& fix) { return fix.jumped && !fix.used(); });
}

double largest_error_rad(const CalibrationRun& run) {
  const AttitudeErrors errors = attitude_errors(run.attitude, two_hours().truth.t, two_hours().truth.q_in_c);
  double largest_rad = 0;
  for (const Eigen::Vector3d& error_rad : errors.error_rad) {
    largest_rad = std::max(largest_rad, error_rad.norm());
  }
  return largest_rad;
}

TEST(ContradictedFixes, AtTheStartDoNotStayInTheAttitude) {
  const CalibrationRun run = calibrate(with_tracker_off({}, std::chrono::minutes(10)), told());
  EXPECT_LT(largest_error_rad(run), 100 * kArcsecond);
  EXPECT_EQ(run.attitude.t.front(), two_hours().pass.settings.epoch + std::chrono::minutes(10));
  EXPECT_EQ(left_out(run), 200);
  EXPECT_EQ(run.fixes.size(), two_hours().pass.star_tracker.size());
  EXPECT_TRUE(std::ranges::is_sorted(run.fixes, {}, &FixRecord::t));
  const Statistics& statistics = run.calibration.statistics;
  EXPECT_EQ(statistics.fixes_rejected_as_outliers, 200);
  EXPECT_EQ(statistics.reopened, 0);
  EXPECT_THAT(run.calibration.verdict.findings, Contains(Field(&Finding::code, FindingCode::kStarTrackerOff)));
  EXPECT_LT(nees_of(two_hours().truth, run.calibration), 45);
}

TEST(ContradictedFixes, LaterDoNotEither) {
  // So long that the filter follows them.
  const Pass pass = with_tracker_off(std::chrono::minutes(60), std::chrono::minutes(83));
  const CalibrationRun run = calibrate(pass, told());
  EXPECT_LT(largest_error_rad(run), 100 * kArcsecond);
  EXPECT_EQ(left_out(run), 460);
  EXPECT_EQ(run.calibration.statistics.reopened, 0);
}

TEST(ContradictedFixes, AreNotTheRightOnesOfAMomentumThatJumped) {
  sim::SimulatedPass simulated = two_hours();
  GyroTelemetry& gyro = simulated.pass.gyro;
  for (std::size_t i = gyro.size() / 2; i < gyro.size(); ++i) {  // both, by 2′
    for (std::size_t k = 0; k < 2; ++k) {
      Eigen::Map<Eigen::Vector3d> h_b(&gyro.h[3 * (2 * i + k)]);
      h_b = (h_b + 6e-4 * h_b.unitOrthogonal()).normalized().eval();
    }
  }
  const CalibrationRun run = calibrate(simulated.pass, told());
  EXPECT_GE(run.calibration.statistics.reopened, 1);
  EXPECT_LT(run.calibration.statistics.fixes_rejected_as_outliers, 400);  // not half of them
  EXPECT_THAT(run.calibration.verdict.findings, Not(Contains(Field(&Finding::code, FindingCode::kStarTrackerOff))));
}

TEST(ContradictedFixes, UpToTheEndByWhichTheStarTrackerIsRightNameTheGyroWhoseCaseMoved) {
  Pass pass = two_hours().pass;
  const Eigen::Quaterniond by(Eigen::AngleAxisd(600 * kArcsecond, Eigen::Vector3d(1, -2, 2).normalized()));
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    if (pass.gyro.t[i] - pass.settings.epoch >= std::chrono::minutes(112)) {
      Eigen::Map<Eigen::Vector3d> h_b(&pass.gyro.h[3 * (2 * i + 1)]);
      h_b = (by * h_b).eval();
    }
  }
  for (const Estimator estimator : {Estimator::kInvariant, Estimator::kBatch}) {
    CalibrationOptions options = told();
    options.estimator = estimator;
    const Verdict verdict = calibrate(pass, options).calibration.verdict;
    EXPECT_FALSE(verdict.trustworthy);
    const auto moved = std::ranges::find(verdict.findings, FindingCode::kGyroMountingMoved, &Finding::code);
    ASSERT_NE(moved, verdict.findings.end());
    EXPECT_THAT(moved->evidence, testing::StartsWith("gyro 2, "));
    EXPECT_THAT(moved->evidence, testing::EndsWith(" fixes from 112.0 min on"));
  }
}

}  // namespace
}  // namespace trihedron::ground
