// Fixes that come with a covariance of their own.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "passes.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {
namespace {

FixCovariance told_as(const Eigen::Matrix3d& its) {
  return {{its(0, 0), its(1, 1), its(2, 2), its(0, 1), its(0, 2), its(1, 2)}};
}

/// Two hours, in which every other ten minutes the fixes are much noisier about an axis that is none of c; each comes
/// with its covariance.
Pass noisy_by_turns() {
  Pass pass = two_hours().pass;
  const Eigen::Vector3d own = pass.settings.star_tracker_noise_rad;
  const Eigen::Vector3d axis = Eigen::Vector3d(2, -1, 0.5).normalized();
  constexpr double kMore_rad = 40 * kArcsecond;
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < pass.star_tracker.size(); ++i) {
    Eigen::Matrix3d covariance = own.cwiseAbs2().asDiagonal();
    if (i / 200 % 2 == 1) {
      covariance += kMore_rad * kMore_rad * axis * axis.transpose();
      const Eigen::Vector3d error = kMore_rad * normal(random) * axis;
      pass.star_tracker.q_in_c[i] = pass.star_tracker.q_in_c[i] * Rot<C, C>::exp(Vec<C>::assume(error)).quaternion();
    }
    pass.star_tracker.covariances.push_back(told_as(covariance));
  }
  return pass;
}

CalibrationOptions with(Estimator estimator) {
  CalibrationOptions options = told();
  options.estimator = estimator;
  return options;
}

class FixCovariances : public testing::TestWithParam<Estimator> {};

/// Of every hundredth fix it is a hundred times too small by its sigmas.
TEST_P(FixCovariances, ThatAreFarTooSmallForbidUse) {
  Pass pass = two_hours().pass;
  const Eigen::Matrix3d covariance = pass.settings.star_tracker_noise_rad.cwiseAbs2().asDiagonal();
  for (std::size_t i = 0; i < pass.star_tracker.size(); ++i) {
    pass.star_tracker.covariances.push_back(told_as(i % 100 == 50 ? Eigen::Matrix3d(1e-4 * covariance) : covariance));
  }
  const CalibrationRun run = calibrate(pass, with(GetParam()));
  double weight = 0;  // the batch uses hardly one of them
  for (const FixRecord& fix : run.fixes) {
    weight += fix.used() && fix.told_sigma_rad < 1e-6 ? 1e4 : 0;
  }
  EXPECT_EQ(run.calibration.verdict.has(FindingCode::kFixCovariancesTooSmall), weight > 1e4) << weight;
  EXPECT_TRUE(navigate(pass, with(GetParam())).verdict.has(FindingCode::kFixCovariancesTooSmall));
}

TEST_P(FixCovariances, OfTheSettingsNoiseChangeNoBit) {
  Pass pass = two_hours().pass;
  const auto before = calibrate(pass, with(GetParam())).calibration;
  const Eigen::Vector3d square =
      pass.settings.star_tracker_noise_rad.cwiseProduct(pass.settings.star_tracker_noise_rad);
  pass.star_tracker.covariances.assign(pass.star_tracker.size(), told_as(square.asDiagonal()));
  const auto after = calibrate(pass, with(GetParam())).calibration;
  EXPECT_EQ(after.covariance, before.covariance);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(after.gyros[k].drift_rad_s, before.gyros[k].drift_rad_s);
    EXPECT_EQ(after.gyros[k].momentum_in, before.gyros[k].momentum_in);
  }
}

TEST_P(FixCovariances, GiveEachFixItsWeight) {
  Pass pass = noisy_by_turns();
  const auto run = calibrate(pass, with(GetParam()));
  // 2400 fixes of χ² with 4 degrees of freedom: 0.058 of the mean is one sigma.
  EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), 4, 0.3);
  if (GetParam() != Estimator::kPaper) {                         // which is known not to be consistent
    EXPECT_LT(nees_of(two_hours().truth, run.calibration), 45);  // χ² of 20, once in 1000
  }
  // Weighed alike, with the noise that they have on the whole, they give less.
  pass.star_tracker.covariances.clear();
  const double more = 40 * kArcsecond / std::sqrt(2);
  pass.settings.star_tracker_noise_rad = (pass.settings.star_tracker_noise_rad.array().square() + more * more).sqrt();
  const auto alike = calibrate(pass, with(GetParam()));
  const auto sigma = [](const CalibrationRun& its) { return std::sqrt(its.calibration.covariance(9, 9)); };
  EXPECT_LT(sigma(run), 0.7 * sigma(alike));
}

INSTANTIATE_TEST_SUITE_P(Estimators, FixCovariances,
                         testing::Values(Estimator::kInvariant, Estimator::kPaper, Estimator::kBatch));

/// Every second fix twenty times as noisy, beside readings that are noisier than the others; told is a factor of it.
CalibrationRun of_good_and_poor_fixes(double told) {
  constexpr double kGood_rad = 1 * kArcsecond;
  constexpr double kPoor_rad = 20 * kArcsecond;
  Scenario scenario = scenario_in_eq1(11, std::chrono::hours(3));
  scenario.star_tracker.noise_rad.setConstant(kGood_rad);
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.readout.noise_rad = 9 * kArcsecond;
  }
  Pass pass = sim::simulate(scenario).pass;
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < pass.star_tracker.size(); ++i) {
    double variance = kGood_rad * kGood_rad;
    if (i % 2 == 1) {
      const Eigen::Vector3d error = kPoor_rad * Eigen::Vector3d(normal(random), normal(random), normal(random));
      pass.star_tracker.q_in_c[i] = pass.star_tracker.q_in_c[i] * Rot<C, C>::exp(Vec<C>::assume(error)).quaternion();
      variance += kPoor_rad * kPoor_rad;
    }
    pass.star_tracker.covariances.push_back(told_as(told * told * variance * Eigen::Matrix3d::Identity()));
  }
  return calibrate(pass, CalibrationOptions());
}

TEST(FindNoise, LeavesCovariancesThatDifferAsTheyAreWhereTheyAreRight) {
  const CalibrationRun run = of_good_and_poor_fixes(1);
  EXPECT_FALSE(run.options.star_tracker_noise_rad.has_value()) << run.options.star_tracker_noise_rad->transpose();
  EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), 4, 0.2);
}

TEST(FindNoise, OfCovariancesThatDifferAndAreTooSmall) {
  const CalibrationRun run = of_good_and_poor_fixes(0.5);
  ASSERT_TRUE(run.options.star_tracker_noise_rad.has_value());
  const Eigen::Vector3d factor = *run.options.star_tracker_noise_rad / kArcsecond;  // told is 1″
  EXPECT_LT((factor - Eigen::Vector3d(2, 2, 2)).cwiseAbs().maxCoeff(), 0.2) << factor.transpose();
  EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), 4, 0.3);
}

TEST(FindNoise, OfCovariancesThatAreTooSmall) {
  Pass pass = noisy_by_turns();
  pass.settings.star_tracker_noise_rad /= 2;
  for (FixCovariance& its : pass.star_tracker.covariances) {
    for (double& element : its.rad2) {
      element /= 4;
    }
  }
  CalibrationOptions options = told();
  options.find_noise = true;
  const auto run = calibrate(pass, options);
  ASSERT_TRUE(run.options.star_tracker_noise_rad.has_value());
  const Eigen::Vector3d factor =
      run.options.star_tracker_noise_rad->cwiseQuotient(pass.settings.star_tracker_noise_rad);
  EXPECT_LT((factor - Eigen::Vector3d(2, 2, 2)).cwiseAbs().maxCoeff(), 0.15) << factor.transpose();
  EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), 4, 0.4);
}

}  // namespace
}  // namespace trihedron::ground
