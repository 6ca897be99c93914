#include "trihedron/ground/evaluate/evaluate.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>

#include "named.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

using std::chrono::milliseconds;
using std::chrono::minutes;
using std::chrono::seconds;

Time at(Duration since) { return Time(since); }

Eigen::Quaterniond turned(const Eigen::Quaterniond& q, const Eigen::Vector3d& by_c) {
  return q * Eigen::Quaterniond(Eigen::AngleAxisd(by_c.norm(), by_c.normalized()));
}

const Eigen::Quaterniond kAttitude(Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 2, 3).normalized()));

TEST(AttitudeErrors, AreRotationsFromReferenceToSolutionInBodyAxes) {
  const Eigen::Vector3d error(1e-5, -2e-5, 3e-5);
  AttitudeHistory solution;
  solution.t = {at(seconds(1))};
  solution.q_in_c = {turned(kAttitude, error)};
  Eigen::Quaterniond flipped = kAttitude;
  flipped.coeffs() *= -1;  // the sign of a quaternion means nothing
  const auto errors = attitude_errors(solution, {at(seconds(1))}, {flipped});
  ASSERT_EQ(errors.t.size(), 1U);
  EXPECT_LT((errors.error_rad[0] - error).norm(), 1e-14);
  EXPECT_TRUE(errors.sigma_rad.empty());
}

TEST(AttitudeErrors, MatchEpochsWithinHalfAMillisecond) {
  AttitudeHistory solution;
  for (const int ms : {0, 125, 3000, 3125, 6001, 9000}) {
    solution.t.push_back(at(milliseconds(ms)));
    solution.q_in_c.push_back(kAttitude);
    solution.sigma_rad.emplace_back(1e-5, 1e-5, 1e-5);
    solution.age_s.push_back(ms / 1000.0);
  }
  const std::vector<Time> reference = {at(Duration(400'000)), at(seconds(3)), at(seconds(6)), at(seconds(12))};
  const auto errors = attitude_errors(solution, reference, std::vector<Eigen::Quaterniond>(4, kAttitude));
  ASSERT_EQ(errors.t.size(), 2U);
  EXPECT_EQ(errors.t[1], at(seconds(3)));
  EXPECT_EQ(errors.sigma_rad.size(), 2U);
  EXPECT_EQ(errors.age_s[1], 3);
}

TEST(AttitudeErrors, PassOverReferencesThatAreNoRotation) {
  AttitudeHistory solution;
  solution.t = {at(seconds(0)), at(seconds(3))};
  solution.q_in_c = {kAttitude, kAttitude};
  Eigen::Quaterniond bad;
  bad.coeffs().setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(attitude_errors(solution, solution.t, {bad, kAttitude}).t, std::vector<Time>{at(seconds(3))});
}

AttitudeErrors ramp() {
  // Total error grows by 1e-5 rad per minute after each correction, at 0 and 30 min.
  AttitudeErrors errors;
  for (int minute = 0; minute < 60; ++minute) {
    errors.t.push_back(at(minutes(minute)));
    errors.error_rad.emplace_back(0, 0, 1e-5 * (minute % 30));
    errors.sigma_rad.emplace_back(1, 1, 1e-5 * (minute % 30) + 1e-9);
    errors.age_s.push_back(60.0 * (minute % 30));
  }
  return errors;
}

TEST(ErrorStatistics, SumUpTheWholeAndEachStretch) {
  const auto errors = ramp();
  const auto whole = statistics(errors);
  EXPECT_EQ(whole.count, 60U);
  EXPECT_DOUBLE_EQ(whole.max_rad.z(), 2.9e-4);
  EXPECT_DOUBLE_EQ(whole.max_total_rad, 2.9e-4);
  EXPECT_EQ(whole.rms_rad.x(), 0);
  // rms of 0 … 29: √(29·59/6)
  EXPECT_NEAR(whole.rms_rad.z(), 1e-5 * std::sqrt(29.0 * 59 / 6), 1e-15);
  EXPECT_NEAR(*whole.normalised_square, 29.0 / 30 / 3, 1e-3);
  const auto stretches = statistics_by_stretch(errors, at(minutes(-10)), minutes(30));
  ASSERT_EQ(stretches.size(), 3U);
  EXPECT_EQ(stretches[0].count, 20U);
  EXPECT_EQ(stretches[1].from, at(minutes(20)));
  EXPECT_EQ(stretches[1].to, at(minutes(49)));
}

/// The fix at the boundary corrects the attitude from two epochs later on.
TEST(ErrorStatistics, AStretchBeginsWhereItsCorrectionShows) {
  AttitudeErrors errors;
  for (int i = 0; i < 20; ++i) {
    errors.t.push_back(at(seconds(i)));
    errors.error_rad.emplace_back(i < 12 ? 1e-3 : 1e-6, 0, 0);
    errors.age_s.push_back(i < 12 ? i : i - 10);
  }
  const auto stretches = statistics_by_stretch(errors, at(seconds(0)), seconds(10));
  ASSERT_EQ(stretches.size(), 2U);
  EXPECT_EQ(stretches[1].from, at(seconds(12)));
  EXPECT_EQ(stretches[1].max_total_rad, 1e-6);
  errors.age_s.clear();
  EXPECT_EQ(statistics_by_stretch(errors, at(seconds(0)), seconds(10))[1].from, at(seconds(10)));
}

TEST(ErrorStatistics, OfNothingAreEmpty) {
  const auto nothing = statistics({});
  EXPECT_EQ(nothing.count, 0U);
  EXPECT_FALSE(nothing.normalised_square);
  EXPECT_TRUE(statistics_by_stretch({}, at(minutes(0)), minutes(30)).empty());
}

TEST(CorrectionIntervals, LastUntilTheErrorFirstPassesTheLimit) {
  const auto intervals = correction_intervals(ramp(), 1.05e-4);
  ASSERT_EQ(intervals.size(), 2U);
  EXPECT_EQ(intervals[1].corrected, at(minutes(30)));
  EXPECT_EQ(intervals[1].observed, minutes(29));
  EXPECT_EQ(intervals[1].passed, minutes(11));
  EXPECT_DOUBLE_EQ(intervals[1].max_total_rad, 2.9e-4);
  for (const auto& interval : correction_intervals(ramp(), 1)) {
    EXPECT_FALSE(interval.passed);
  }
}

TEST(CorrectionIntervals, AreUnknownWithoutAges) {
  auto errors = ramp();
  errors.age_s.clear();
  EXPECT_TRUE(correction_intervals(errors, 1e-4).empty());
}

IntervalPair pair(std::optional<Duration> before, std::optional<Duration> after, Duration watched = minutes(100)) {
  return {{at(seconds(0)), watched, before, 0}, {at(seconds(0)), watched, after, 0}};
}

TEST(Extension, IsTheRatioOfTheIntervals) {
  EXPECT_EQ(pair(minutes(5), minutes(20)).extension(), 4);
  EXPECT_EQ(pair(minutes(5), std::nullopt).extension(), 20);
  EXPECT_EQ(pair(std::nullopt, minutes(20)).extension(), std::nullopt);
  EXPECT_EQ(pair(minutes(5), std::nullopt, Duration::zero()).extension(), std::nullopt);
  EXPECT_EQ(pair(Duration::zero(), minutes(1)).extension(), 60);
}

TEST(Extension, OfSeveralIsTheirMedianAndALowerBoundWhereOneThatBearsOnItIs) {
  EXPECT_FALSE(median_extension(std::vector<IntervalPair>{}).has_value());
  const auto exact =
      median_extension({pair(minutes(5), minutes(20)), pair(minutes(5), std::nullopt), pair(minutes(5), minutes(10))});
  EXPECT_EQ(exact->factor, 4);
  EXPECT_FALSE(exact->is_lower_bound);
  const auto bound =
      median_extension({pair(minutes(5), minutes(20)), pair(minutes(50), std::nullopt), pair(minutes(5), minutes(30))});
  EXPECT_EQ(bound->factor, 4);
  EXPECT_TRUE(bound->is_lower_bound);
}

TEST(Extension, PairsCorrectionsOfTheSameTime) {
  const auto corrected = [](int s) { return CorrectionInterval{at(seconds(s)), minutes(10), {}, 0}; };
  const auto pairs = paired({corrected(0), corrected(5400)}, {corrected(1), corrected(900), corrected(5400)});
  ASSERT_EQ(pairs.size(), 2U);
  EXPECT_EQ(pairs[1].calibrated.corrected, at(seconds(5400)));
}

TEST(ParameterErrors, AreEstimateLessTruth) {
  Truth truth;
  truth.gyros.resize(1);
  truth.gyros[0].drift_rad_s = {{coefficient("k0"), 3e-6}};
  truth.gyros[0].unmodelled_rad_s = {{"W(1,0)", 4e-9}};
  truth.gyros[0].alignment_rotation_vector_rad = {1e-3, 0, 0};
  Calibration calibration;
  GyroCalibration& gyro = calibration.gyros.emplace_back();
  gyro.drift_model = kEsg20;
  gyro.drift_rad_s.resize(20);
  gyro.drift_rad_s[0] = 1e-6;
  gyro.drift_rad_s[8] = 5e-9;   // W(1,0)
  gyro.drift_rad_s[19] = 1e-9;  // D(k0)
  gyro.alignment_rotation_vector_rad = {0, 0, 2e-3};
  calibration.states = parameters(
      {"gyro1.k0", "gyro1.align_x", "gyro1.align_y", "gyro1.align_z", "gyro1.D(k0)", "gyro1.W(1,0)", "gyro2.k0"});
  const Eigen::VectorXd errors = estimate_minus_truth(calibration, truth);
  ASSERT_EQ(errors.size(), 7);
  EXPECT_NEAR(errors(0), -2e-6, 1e-18);
  // Second order: half of the product of the two rotations.
  EXPECT_LT((errors.segment<3>(1) - Eigen::Vector3d(-1e-3, 0, 2e-3)).norm(), 1.1e-6);
  EXPECT_TRUE(std::isnan(errors(4)));
  EXPECT_NEAR(errors(5), 1e-9, 1e-21);
  EXPECT_TRUE(std::isnan(errors(6)));
  EXPECT_EQ(estimate_minus_truth(calibration, truth, UnnamedDrift::kIsZero)(4), 1e-9);
}

TEST(ParameterErrors, AreTheRotationFromTheTrueAlignmentToTheEstimate) {
  const auto C_c_b = [](const Eigen::Vector3d& v) { return Rot<C, B<1>>::exp(Vec<C>::assume(v)); };
  Truth truth;
  truth.gyros.resize(1);
  truth.gyros[0].alignment_rotation_vector_rad = {0.3, -0.2, 0.5};
  const Eigen::Vector3d delta(0.01, 0.02, -0.03);
  Calibration calibration;
  calibration.gyros.resize(1);
  calibration.gyros[0].alignment_rotation_vector_rad =
      (Rot<C, C>::exp(Vec<C>::assume(delta)) * C_c_b(truth.gyros[0].alignment_rotation_vector_rad)).log().raw();
  calibration.states = parameters({"gyro1.align_x", "gyro1.align_y", "gyro1.align_z"});
  EXPECT_LT((estimate_minus_truth(calibration, truth) - delta).norm(), 1e-12);
}

TEST(NormalisedSquare, IsThatOfAnyUnitsAndNoNumberWhereTheCovarianceIsNone) {
  const Eigen::Vector2d error(2e-9, 3e-3);
  Eigen::Matrix2d covariance;
  covariance << 1e-18, 0.5e-12, 0.5e-12, 1e-6;
  // (4 - 2 · 0.5 · 2 · 3 + 9) / (1 - 0.5²)
  EXPECT_NEAR(normalised_square(error, covariance), 28.0 / 3, 1e-12);
  covariance(0, 1) = covariance(1, 0) = 1.1e-12;
  EXPECT_TRUE(std::isnan(normalised_square(error, covariance)));
  EXPECT_TRUE(std::isnan(normalised_square(error, Eigen::Matrix2d::Zero())));
}

TEST(AttitudeErrors, AreSolutionLessReference) {
  AttitudeHistory solution;
  solution.t = {at(seconds(0))};
  solution.q_in_c = {Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ())) *
                     Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitX()))};
  const auto errors =
      attitude_errors(solution, solution.t, {Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()))});
  EXPECT_LT((errors.error_rad.at(0) - Eigen::Vector3d(0.01, 0, 0)).norm(), 1e-12);
}

}  // namespace
}  // namespace trihedron::ground
