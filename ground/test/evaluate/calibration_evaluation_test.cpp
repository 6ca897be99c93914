#include "trihedron/ground/evaluate/calibration_evaluation.hpp"

#include <gmock/gmock.h>

#include <chrono>

#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/evaluate/used_fixes.hpp"

namespace trihedron::ground {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;
using testing::IsEmpty;

Eigen::Quaterniond rolled(double rad) { return Eigen::Quaterniond(Eigen::AngleAxisd(rad, Eigen::Vector3d::UnitX())); }

/// Two hours of fixes, one a minute, of a body at rest, and an attitude that is off in roll by 1e-4 for each minute
/// since its correction, every half hour.
struct AtRest {
  Pass pass;
  AttitudeHistory attitude;

  AtRest() {
    pass.settings.star_tracker_noise_rad = {3e-4, 4e-4, 5e-4};
    for (int i = 0; i < 120; ++i) {
      const Time t{minutes(i)};
      pass.star_tracker.t.push_back(t);
      pass.star_tracker.q_in_c.push_back(rolled(0));
      attitude.t.push_back(t);
      attitude.q_in_c.push_back(rolled(1e-4 * (i % 30)));
      attitude.sigma_rad.emplace_back(4e-4, 3e-4, 0);
      attitude.age_s.push_back(60.0 * (i % 30));
    }
  }

  [[nodiscard]] Truth truth() const {
    Truth truth;
    truth.t = {pass.star_tracker.t[1], pass.star_tracker.t[2]};
    truth.q_in_c = {rolled(0), rolled(0)};
    return truth;
  }
};

TEST(AttitudeEvaluation, IsAgainstTheTruthWhereThereIsOne) {
  const AtRest flight;
  const Truth truth = flight.truth();
  const AttitudeEvaluation evaluation = evaluate_attitude(flight.pass, flight.attitude, &truth);
  EXPECT_EQ(evaluation.reference, ReferenceKind::kTruth);
  EXPECT_EQ(evaluation.whole.count, 2U);
  EXPECT_NEAR(evaluation.whole.max_total_rad, 2e-4, 1e-9);
  EXPECT_EQ(evaluation.errors.sigma_rad[0], Eigen::Vector3d(4e-4, 3e-4, 0));
}

TEST(AttitudeEvaluation, AgainstTheStarTrackerHasItsNoiseInTheSigmas) {
  const AtRest flight;
  const AttitudeEvaluation evaluation = evaluate_attitude(flight.pass, flight.attitude, nullptr);
  EXPECT_EQ(evaluation.reference, ReferenceKind::kStarTracker);
  EXPECT_EQ(evaluation.whole.count, 120U);
  EXPECT_TRUE(evaluation.errors.sigma_rad[0].isApprox(Eigen::Vector3d::Constant(5e-4), 1e-12));
  ASSERT_EQ(evaluation.stretches.size(), 2U);
  EXPECT_EQ(evaluation.stretches[1].from, Time(minutes(90)));
}

TEST(AttitudeEvaluation, CountsIntervalsByTheLimit) {
  const AtRest flight;
  const AttitudeEvaluation usual = evaluate_attitude(flight.pass, flight.attitude, nullptr);
  ASSERT_EQ(usual.intervals.size(), 4U);
  EXPECT_EQ(usual.limit_rad, 5 * kArcminute);
  EXPECT_EQ(usual.intervals[0].passed, minutes(15));  // 1.5e-3 is the first above 5′
  const AttitudeEvaluation strict = evaluate_attitude(flight.pass, flight.attitude, nullptr, kArcminute);
  EXPECT_EQ(strict.intervals[0].passed, minutes(3));
}

TEST(AttitudeEvaluation, OfANavigationIsAgainstTheFixesThatItUsed) {
  const AtRest flight;
  NavigationRun run;
  run.attitude = flight.attitude;
  for (int i = 0; i < 120; ++i) {
    FixRecord& fix = run.fixes.emplace_back();
    fix.t = Time(minutes(i));
    fix.status = i % 2 == 0 ? FixStatus::kUsed : FixStatus::kRejectedByGate;
  }
  EXPECT_EQ(evaluate_navigation(flight.pass, run, nullptr).whole.count, 60U);
  const Truth truth = flight.truth();
  EXPECT_EQ(evaluate_navigation(flight.pass, run, &truth).whole.count, 2U);
}

TEST(AttitudeEvaluation, ComparesTheIntervalsOfTwoAttitudes) {
  const AtRest flight;
  AttitudeHistory better = flight.attitude;
  for (std::size_t i = 0; i < better.size(); ++i) {
    better.q_in_c[i] = rolled(0.6e-4 * static_cast<double>(i % 30));
  }
  const IntervalExtension extension = extension_between(evaluate_attitude(flight.pass, flight.attitude, nullptr),
                                                        evaluate_attitude(flight.pass, better, nullptr));
  ASSERT_EQ(extension.pairs.size(), 4U);
  ASSERT_TRUE(extension.median);
  EXPECT_DOUBLE_EQ(extension.median->factor, 25.0 / 15);
  EXPECT_FALSE(extension.median->is_lower_bound);
}

class EvaluatedCalibration : public testing::Test {
 protected:
  static const CalibrationRun& run() {
    static const CalibrationRun run = calibrate(two_hours().pass, told());
    return run;
  }
  const Pass& pass_ = two_hours().pass;
  const Truth& truth_ = two_hours().truth;
};

TEST_F(EvaluatedCalibration, AgainstTheTruthHoldsWhatItsPartsSay) {
  const CalibrationEvaluation evaluation = evaluate_calibration(pass_, run(), &truth_);
  EXPECT_EQ(evaluation.attitude.reference, ReferenceKind::kTruth);
  EXPECT_EQ(evaluation.navigation.errors.t, attitude_errors(run().navigation, truth_.t, truth_.q_in_c).t);
  EXPECT_LT(evaluation.attitude.whole.rms_rad.maxCoeff(), evaluation.navigation.whole.rms_rad.maxCoeff());
  EXPECT_EQ(evaluation.estimate_minus_truth, estimate_minus_truth(run().calibration, truth_));
  ASSERT_EQ(evaluation.convergence.size(), run().calibration.states.size());
  ASSERT_TRUE(evaluation.alignment_settled);
  EXPECT_EQ(evaluation.alignment_settled, settled(run(), evaluation.convergence, true));
  EXPECT_EQ(evaluation.drift_settled, settled(run(), evaluation.convergence, false));
  // Corrected at the start and after 90 min; the median leaves out the first.
  ASSERT_EQ(evaluation.open_loops.size(), 2U);
  ASSERT_EQ(evaluation.extension.pairs.size(), 2U);
  EXPECT_EQ(evaluation.extension.pairs[1].calibrated.observed, evaluation.open_loops[1].intervals.calibrated.observed);
  ASSERT_TRUE(evaluation.extension.median);
  EXPECT_EQ(evaluation.extension.median->factor, evaluation.extension.pairs[1].extension());
}

TEST_F(EvaluatedCalibration, WithoutATruthIsAgainstTheFixesUsed) {
  const CalibrationEvaluation evaluation = evaluate_calibration(pass_, run(), nullptr);
  EXPECT_EQ(evaluation.attitude.reference, ReferenceKind::kStarTracker);
  EXPECT_EQ(evaluation.navigation.reference, ReferenceKind::kStarTracker);
  EXPECT_EQ(evaluation.estimate_minus_truth.size(), 0);
  EXPECT_EQ(evaluation.attitude.errors.t.size(), used_fixes(pass_, run().fixes).size());
}

TEST_F(EvaluatedCalibration, TakesTheLimitEverywhere) {
  const CalibrationEvaluation evaluation = evaluate_calibration(pass_, run(), &truth_, kArcminute);
  EXPECT_EQ(evaluation.limit_rad, kArcminute);
  EXPECT_EQ(evaluation.navigation.limit_rad, kArcminute);
  EXPECT_EQ(evaluation.attitude.limit_rad, kArcminute);
  EXPECT_LT(evaluation.extension.pairs[0].known_before.passed.value(), seconds(300));
}

}  // namespace
}  // namespace trihedron::ground
