#include "trihedron/ground/calibrate/history.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <random>

#include "named.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::ground {
namespace {

using std::chrono::hours;
using testing::IsEmpty;
using testing::SizeIs;

/// Of one gyro with k0 and the alignment about x.
CatalogueEntry entry(const char* start_up, int at_h, double k0_rad_s, double align_x_rad) {
  CatalogueEntry result{"Resurs-DK1", "pass", start_up, 1, {}};
  Calibration& calibration = result.calibration;
  calibration.epoch = calibration.t = Time(hours(at_h));
  calibration.gyros.resize(1);
  calibration.gyros[0].drift_rad_s = {k0_rad_s};
  calibration.gyros[0].alignment_rotation_vector_rad = {align_x_rad, 0, 0};
  calibration.states = parameters({"gyro1.k0", "gyro1.align_x"});
  calibration.covariance = Eigen::Vector2d(1e-9, kArcsecond).cwiseAbs2().asDiagonal();
  calibration.verdict.trustworthy = true;
  return result;
}

TEST(History, TakesOfEachStartUpTheCalibrationOfMostPassesAndThenTheLatest) {
  std::vector<CatalogueEntry> catalogue = {entry("a", 1, 1e-6, 0), entry("a", 2, 2e-6, 0), entry("a", 3, 3e-6, 0),
                                           entry("b", 9, 4e-6, 0), entry("b", 8, 5e-6, 0)};
  catalogue[1].passes = 2;
  const History history = compare_start_ups(catalogue);
  ASSERT_THAT(history.start_ups, SizeIs(2));
  EXPECT_EQ(history.start_ups[0].calibration, &catalogue[1].calibration);
  EXPECT_EQ(history.start_ups[1].calibration, &catalogue[3].calibration);
}

TEST(History, LeavesOutWhatIsNotTrustworthy) {
  std::vector<CatalogueEntry> catalogue = {entry("a", 1, 1e-6, 0), entry("a", 2, 2e-6, 0), entry("b", 3, 3e-6, 0)};
  catalogue[1].calibration.verdict.trustworthy = false;
  catalogue[2].calibration.verdict.trustworthy = false;
  const History history = compare_start_ups(catalogue);
  ASSERT_THAT(history.start_ups, SizeIs(1));
  EXPECT_EQ(history.start_ups[0].calibration, &catalogue[0].calibration);
  EXPECT_THAT(history.changes, IsEmpty());
  EXPECT_THAT(history.spreads, IsEmpty());
}

TEST(History, ComparesNeighboursInTime) {
  const std::vector<CatalogueEntry> catalogue = {entry("z", 1, 1e-6, 0), entry("a", 20, 1.002e-6, kArcsecond)};
  const History history = compare_start_ups(catalogue);
  ASSERT_THAT(history.changes, SizeIs(1));
  const StartUpChange& change = history.changes[0];
  EXPECT_EQ(change.from, "z");
  EXPECT_EQ(change.to, "a");
  EXPECT_NEAR(change.parameters[0].change, 2e-9, 1e-20);
  EXPECT_NEAR(change.parameters[0].sigma, std::sqrt(2) * 1e-9, 1e-20);
  EXPECT_NEAR(change.coefficients.chi_square, 2, 1e-9);
  EXPECT_NEAR(change.alignments.chi_square, 0.5, 1e-9);
  EXPECT_THAT(history.findings, IsEmpty());
}

TEST(History, FindsAnAlignmentThatMovedAtAStart) {
  // 5σ of the difference.
  const History history = compare_start_ups({entry("a", 1, 1e-6, 0), entry("b", 20, 9e-6, 7.1 * kArcsecond)});
  ASSERT_THAT(history.findings, SizeIs(1));
  EXPECT_EQ(history.findings[0].code, FindingCode::kAlignmentMoved);
  EXPECT_FALSE(history.changes[0].coefficients.holds());
}

TEST(History, ComparesOnlyWhatBothStartUpsHave) {
  std::vector<CatalogueEntry> catalogue = {entry("a", 1, 1e-6, 0), entry("b", 2, 1e-6, 0)};
  catalogue[1].calibration.states = parameters({"gyro1.W(1,0)", "star_tracker_2_align_x_rad"});
  const History history = compare_start_ups(catalogue);
  EXPECT_THAT(history.changes[0].parameters, IsEmpty());
  EXPECT_TRUE(history.changes[0].coefficients.holds());
  EXPECT_EQ(history.changes[0].coefficients.text(), "nothing that both determine");
  EXPECT_THAT(history.spreads, IsEmpty());
}

TEST(Spread, IsTheSampleVarianceLessThatOfEqualSigmas) {
  const Spread spread = spread_of({1, 2, 3, 6}, {0.5, 0.5, 0.5, 0.5});
  EXPECT_EQ(spread.start_ups, 4);
  EXPECT_NEAR(spread.mean, 3, 1e-12);
  const double variance = 14.0 / 3 - 0.25;
  EXPECT_NEAR(spread.deviation, std::sqrt(variance), 1e-9);
  EXPECT_NEAR(spread.next_sigma, std::sqrt(variance + (14.0 / 3) / 4), 1e-9);
}

TEST(Spread, IsZeroWhereTheSigmasExplainTheDifferences) {
  const Spread spread = spread_of({1, 1.1}, {0.1, 0.2});
  EXPECT_EQ(spread.deviation, 0);
  EXPECT_NEAR(spread.mean, (1 / 0.01 + 1.1 / 0.04) / (1 / 0.01 + 1 / 0.04), 1e-12);
  EXPECT_NEAR(spread.next_sigma, std::sqrt(1 / (1 / 0.01 + 1 / 0.04)), 1e-12);
}

TEST(Spread, FindsTheVarianceBetweenStartUpsThatAreKnownUnequallyWell) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const std::vector<double> sigmas = {0.01, 0.1, 0.2, 0.5, 0.5};
  constexpr int kDraws = 4000;
  double variance = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<double> values;
    for (const double sigma : sigmas) {
      values.push_back(3 + normal(random) + sigma * normal(random));
    }
    variance += std::pow(spread_of(values, sigmas).deviation, 2) / kDraws;
  }
  // Of a variance from five values 1-sigma is about 0.75: over the draws 0.012. 3.3 of them.
  EXPECT_NEAR(variance, 1, 0.04);
}

}  // namespace
}  // namespace trihedron::ground
