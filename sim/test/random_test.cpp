#include "trihedron/sim/random.hpp"

#include <gtest/gtest.h>

#include <set>

#include "statistics.hpp"

namespace trihedron::sim {
namespace {

using test::Sequence;

constexpr std::size_t kMany = 1'000'000;

Sequence normals(Stream stream, std::size_t n = kMany) {
  Sequence x(n);
  for (double& value : x) {
    value = stream.normal();
  }
  return x;
}

TEST(Random, Splitmix64GivesItsPublishedSequence) {
  std::uint64_t state = 0;
  EXPECT_EQ(splitmix64(state), 0xe220a8397b1dcdafU);
  EXPECT_EQ(splitmix64(state), 0x6e789e6aa1b965f4U);
  EXPECT_EQ(splitmix64(state), 0x06c45d188009454fU);
}

TEST(Random, UniformIsEvenWithinItsHalfOpenInterval) {
  Stream stream(1, Source::kJitter);
  std::array<int, 16> counts{};
  for (std::size_t i = 0; i < kMany; ++i) {
    const double x = stream.uniform();
    ASSERT_GE(x, 0);
    ASSERT_LT(x, 1);
    ++counts[static_cast<std::size_t>(x * 16)];
  }
  double chi2 = 0;
  for (const int count : counts) {
    chi2 += std::pow(count - kMany / 16.0, 2) / (kMany / 16.0);
  }
  EXPECT_LT(chi2, 44.3);  // 99.99 % of χ² with 15 degrees of freedom
}

TEST(Random, NormalHasTheMomentsOfTheStandardNormal) {
  const Sequence x = normals(Stream(1, Source::kReadoutNoise));
  const double n = static_cast<double>(kMany);
  double third = 0;
  double fourth = 0;
  for (const double value : x) {
    third += std::pow(value, 3) / n;
    fourth += std::pow(value, 4) / n;
  }
  EXPECT_NEAR(test::mean(x), 0, test::kBand / std::sqrt(n));
  EXPECT_NEAR(test::mean_square(x), 1, test::kBand * test::mean_square_sigma(kMany));
  EXPECT_NEAR(third, 0, test::kBand * std::sqrt(15 / n));   // var x³ = E x⁶
  EXPECT_NEAR(fourth, 3, test::kBand * std::sqrt(96 / n));  // var x⁴ = E x⁸ − 9
}

TEST(Random, NormalHasTheTailsOfTheStandardNormal) {
  const Sequence x = normals(Stream(2, Source::kReadoutNoise));
  for (const double limit : {1.0, 2.0, 3.0, 4.0}) {
    const double expected = std::erfc(limit / std::numbers::sqrt2) * static_cast<double>(kMany);
    double count = 0;
    for (const double value : x) {
      count += std::abs(value) > limit ? 1 : 0;
    }
    EXPECT_NEAR(count, expected, test::kBand * std::sqrt(expected)) << limit;
  }
}

TEST(Random, NormalIsWhite) {
  const Sequence x = normals(Stream(3, Source::kReadoutNoise));
  for (std::size_t lag = 1; lag <= 8; ++lag) {
    EXPECT_NEAR(test::correlation(x, x, lag), 0, test::kBand * test::correlation_sigma(kMany)) << lag;
  }
}

TEST(Random, DirectionsAreEvenOverTheSphere) {
  Stream stream(1, Source::kMisalignment);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  constexpr int kN = 100'000;
  for (int i = 0; i < kN; ++i) {
    const Eigen::Vector3d d = stream.direction();
    ASSERT_NEAR(d.norm(), 1, 1e-15);
    sum += d / kN;
    second += d * d.transpose() / kN;
  }
  // Per axis: mean 0 ± √(1/3n), mean square 1/3 ± √((1/5 − 1/9)/n), product 0 ± √(1/15n).
  EXPECT_LT(sum.cwiseAbs().maxCoeff(), test::kBand * std::sqrt(1.0 / 3 / kN));
  EXPECT_LT((second - Eigen::Matrix3d::Identity() / 3).cwiseAbs().maxCoeff(), test::kBand * std::sqrt(0.0889 / kN));
}

TEST(Random, NeighbouringStreamsShareNoNumberAndAreUncorrelated) {
  std::vector<Stream> streams;
  for (const std::uint64_t seed : {0U, 1U, 2U}) {
    for (const Source source : {Source::kKappa, Source::kMisalignment, Source::kReadoutNoise}) {
      for (const std::uint64_t index : {0U, 1U, 2U}) {
        streams.emplace_back(seed, source, index);
      }
    }
  }
  std::set<std::uint64_t> first;
  for (Stream stream : streams) {
    for (int i = 0; i < 100; ++i) {
      first.insert(stream.bits());
    }
  }
  EXPECT_EQ(first.size(), 100 * streams.size());

  constexpr std::size_t kN = 20'000;
  std::vector<Sequence> x;
  for (const Stream& stream : streams) {
    x.push_back(normals(stream, kN));
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      ASSERT_NEAR(test::correlation(x[i], x[j]), 0, test::kBand * test::correlation_sigma(kN)) << i << " " << j;
    }
  }
}

}  // namespace
}  // namespace trihedron::sim
