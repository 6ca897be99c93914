#include "judge/shape_of_errors.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <random>
#include <utility>

#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"

namespace trihedron::ground {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

const Eigen::Vector3d kTrackerNoise_rad = Eigen::Vector3d(3, 3, 20) * kArcsecond;
const Eigen::Vector3d kOffAxis{0.6, -0.64, 0.48};

using Draw = std::function<Eigen::Vector3d(std::mt19937_64&)>;

Eigen::Vector3d normal(std::mt19937_64& random) {
  std::normal_distribution<double> draw;
  return kTrackerNoise_rad.cwiseProduct(Eigen::Vector3d(draw(random), draw(random), draw(random)));
}

/// What is added to normal errors.
Eigen::Vector3d nothing(std::mt19937_64& /*random*/) { return Eigen::Vector3d::Zero(); }

Eigen::Vector3d two_heads(std::mt19937_64& random) {
  return std::bernoulli_distribution(0.5)(random) ? 10 * kArcsecond * kOffAxis : Eigen::Vector3d::Zero().eval();
}

Eigen::Vector3d one_sided(std::mt19937_64& random) {
  return std::bernoulli_distribution(0.1)(random) ? 12 * kArcsecond * kOffAxis : Eigen::Vector3d::Zero().eval();
}

Eigen::Vector3d heavy_tails(std::mt19937_64& random) {
  return std::bernoulli_distribution(0.05)(random) ? 4 * normal(random) : Eigen::Vector3d::Zero().eval();
}

/// With normal errors, those of a star tracker that is three times as noisy, at every other fix.
Draw three_times_by_turns() {
  return [is_noisy = false](std::mt19937_64& random) mutable {
    is_noisy = !is_noisy;
    return is_noisy ? Eigen::Vector3d(std::sqrt(8.0) * normal(random)) : Eigen::Vector3d::Zero().eval();
  };
}

Eigen::Vector3d three_times_at_random(std::mt19937_64& random) {
  return std::bernoulli_distribution(0.5)(random) ? Eigen::Vector3d(std::sqrt(8.0) * normal(random))
                                                  : Eigen::Vector3d::Zero().eval();
}

/// One in twenty is off by 20 sigmas about x, to either side.
Eigen::Vector3d gross(std::mt19937_64& random) {
  const double side = std::bernoulli_distribution(0.5)(random) ? 1 : -1;
  return std::bernoulli_distribution(0.05)(random) ? Eigen::Vector3d(side * 20 * kTrackerNoise_rad.x(), 0, 0)
                                                   : Eigen::Vector3d::Zero().eval();
}

/// Fixes of four hours, with these errors beside normal ones, and a navigator that moves off by a minute of arc.
std::vector<FixRecord> fixes_with(const Draw& more, std::uint64_t seed = 1, int count = 4800) {
  std::mt19937_64 random(seed);
  std::vector<FixRecord> fixes;
  for (int i = 0; i < count; ++i) {
    FixRecord& fix = fixes.emplace_back();
    fix.status = FixStatus::kUsed;
    fix.corrected_navigator = i < 2;
    fix.off_navigator_rad = normal(random) + more(random) + kArcminute * std::sin(i / 700.0) * kOffAxis;
  }
  return fixes;
}

TEST(ShapeOfErrors, OfNormalOnesIsNone) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
    const ShapeOfErrors shape = shape_of_errors(fixes_with(nothing, seed), 0).value();
    EXPECT_LT(shape.skewness, 0.15);
    EXPECT_GT(shape.least_kurtosis, -0.25);
    EXPECT_LT(shape.mean_off_median_rad.norm(), kArcsecond);
  }
}

TEST(ShapeOfErrors, OfHeavyTailsThatAreSymmetricIsNone) {
  const ShapeOfErrors shape = shape_of_errors(fixes_with(heavy_tails), 0).value();
  EXPECT_LT(shape.skewness, 4 * shape.skewness_sigma);
  EXPECT_GT(shape.least_kurtosis, -0.1);
}

// The errors of the noisier one are no outliers, and the mixture is as symmetric as each.
TEST(ShapeOfErrors, OfTwoNoisesIsNone) {
  for (const Draw& two_noises : {three_times_by_turns(), Draw(three_times_at_random)}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const std::vector<FixRecord> fixes = fixes_with(two_noises, seed);
      const ShapeOfErrors shape = shape_of_errors(fixes, 0).value();
      // All after the second correction but half a window at either end.
      EXPECT_EQ(shape.fixes, fixes.size() - 1 - (ShapeOfErrors::kNeighbours - 1));
      EXPECT_LT(shape.skewness, 4 * shape.skewness_sigma);
      EXPECT_GT(shape.least_kurtosis, -0.1);
    }
  }
}

TEST(ShapeOfErrors, LeavesOutOutliers) {
  const ShapeOfErrors without = shape_of_errors(fixes_with(nothing), 0).value();
  const ShapeOfErrors shape = shape_of_errors(fixes_with(gross), 0).value();
  const auto count = static_cast<double>(without.fixes);
  // A binomial of one in twenty, to three of its standard deviations.
  EXPECT_NEAR(static_cast<double>(shape.fixes), 0.95 * count, 3 * std::sqrt(0.05 * 0.95 * count));
  EXPECT_LT(shape.skewness, 0.15);
  EXPECT_GT(shape.least_kurtosis, -0.25);
}

// E z³ of a mixture that is off by a in a part p: p (1 − p) (1 − 2 p) a³ / σ³, its mean off by p a.
TEST(ShapeOfErrors, OfOneSidedOnesHasTheSkewnessOfTheMixture) {
  const ShapeOfErrors shape = shape_of_errors(fixes_with(one_sided), 0).value();
  // Along the axis of most skewness; about z the noise is far larger.
  const double square = std::pow(12, 2) * (kOffAxis.array() / Eigen::Array3d(3, 3, 20)).square().sum();
  EXPECT_NEAR(shape.skewness, 0.1 * 0.9 * 0.8 * std::pow(square, 1.5) / std::pow(1 + 0.09 * square, 1.5), 0.15);
  // About x and y the mean is off by 0.1 of 7.2″ and −7.7″, the median by the 0.4″ at which 0.9 Φ + 0.1 Φ is a half:
  // 0.3″ and −0.34″ between them, to 0.03″ by chance.
  EXPECT_NEAR(shape.mean_off_median_rad.x(), 0.31 * kArcsecond, 0.15 * kArcsecond);
  EXPECT_NEAR(shape.mean_off_median_rad.y(), -0.34 * kArcsecond, 0.15 * kArcsecond);
}

TEST(ShapeOfErrors, OfTwoHeadsHasTheKurtosisOfTheMixture) {
  const ShapeOfErrors shape = shape_of_errors(fixes_with(two_heads), 0).value();
  const double square = 25 * (kOffAxis.array() / Eigen::Array3d(3, 3, 20)).square().sum();
  EXPECT_NEAR(shape.least_kurtosis, -2 * std::pow(square / (1 + square), 2), 0.2);
  EXPECT_LT(shape.skewness, 0.25);
}

TEST(ShapeOfErrors, IsToldOfTheUsedFixesOfOneHead) {
  std::vector<FixRecord> fixes = fixes_with(nothing);
  for (FixRecord& fix : fixes_with(one_sided)) {
    fix.corrected_navigator = false;
    fix.head = 1;
    fixes.push_back(fix);
    fix.head = 0;
    fix.status = FixStatus::kRejectedByGate;
    fixes.push_back(fix);
  }
  EXPECT_LT(shape_of_errors(fixes, 0).value().skewness, 0.15);
  EXPECT_GT(shape_of_errors(fixes, 1).value().skewness, 0.5);
  EXPECT_FALSE(shape_of_errors(fixes, 2));
}

TEST(ShapeOfErrors, IsNotToldWithoutASecondCorrectionOfFewFixesOrOfNoErrorsAtAll) {
  std::vector<FixRecord> fixes = fixes_with(nothing);
  EXPECT_TRUE(shape_of_errors(fixes, 0));
  fixes[1].corrected_navigator = false;
  EXPECT_FALSE(shape_of_errors(fixes, 0));
  EXPECT_FALSE(shape_of_errors(fixes_with(nothing, 1, 1000), 0));
  EXPECT_TRUE(shape_of_errors(fixes_with(nothing, 1, 1100), 0));
  fixes[1].corrected_navigator = true;
  for (FixRecord& fix : fixes) {
    fix.off_navigator_rad = Eigen::Vector3d::Zero();
  }
  EXPECT_FALSE(shape_of_errors(fixes, 0));
}

/// Of what a flight of five hours is told whose star tracker has these errors beside normal ones.
std::vector<Finding> findings_with(const Draw& more, Estimator estimator) {
  Pass pass = sim::simulate(scenario_in_eq1(4, std::chrono::hours(5))).pass;
  std::mt19937_64 random(9);
  for (Eigen::Quaterniond& q_in_c : pass.star_tracker.q_in_c) {
    q_in_c = q_in_c * Rot<C, C>::exp(Vec<C>::assume(more(random))).quaternion();
  }
  CalibrationOptions options = told();
  options.estimator = estimator;
  std::vector<Finding> findings = calibrate(pass, options).calibration.verdict.findings;
  std::erase_if(findings, [](const Finding& its) { return its.code != FindingCode::kStarTrackerErrorsNotNormal; });
  return findings;
}

TEST(ErrorsNotNormal, AreNamedWithTheirCause) {
  for (const Estimator estimator : {Estimator::kInvariant, Estimator::kBatch}) {
    EXPECT_THAT(findings_with(nothing, estimator), IsEmpty());
    EXPECT_THAT(findings_with(heavy_tails, estimator), IsEmpty());
    for (const auto& [more, cause] : {std::pair<Draw, const char*>(two_heads, "two heaps"), {one_sided, "one side"}}) {
      const std::vector<Finding> findings = findings_with(more, estimator);
      ASSERT_EQ(findings.size(), 1U) << cause;
      EXPECT_THAT(findings[0].text, HasSubstr(cause));
      EXPECT_EQ(findings[0].severity, FindingSeverity::kDoNotUse);
    }
  }
}

}  // namespace
}  // namespace trihedron::ground
