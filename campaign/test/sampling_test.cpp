#include "trihedron/campaign/sampling.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace trihedron::campaign {
namespace {

using Kind = Distribution::Kind;

CampaignInput input_of(std::string key, Distribution distribution) {
  CampaignInput input;
  input.key = std::move(key);
  input.distribution = std::move(distribution);
  return input;
}

CampaignInput uniform(std::string key, double from, double to) {
  return input_of(std::move(key), {.kind = Kind::kUniform, .a = from, .b = to, .least = from, .most = to});
}

std::vector<double> draws_of(const CampaignPlan& plan, std::size_t input = 0) {
  std::vector<double> draws;
  for (std::uint64_t run = 0; run < plan.runs; ++run) {
    draws.push_back(draws_of_run(plan, run)[input]);
  }
  return draws;
}

struct Moments {
  double mean = 0;
  double sigma = 0;
};

Moments moments_of(const std::vector<double>& values) {
  Moments moments;
  const auto n = static_cast<double>(values.size());
  for (const double value : values) {
    moments.mean += value / n;
  }
  for (const double value : values) {
    moments.sigma += (value - moments.mean) * (value - moments.mean) / n;
  }
  moments.sigma = std::sqrt(moments.sigma);
  return moments;
}

constexpr std::uint64_t kRuns = 20000;
/// Of the mean of kRuns values, four standard deviations: 6e-5 of right programs are beyond.
double tolerance_of_mean(double sigma) { return 4 * sigma / std::sqrt(static_cast<double>(kRuns)); }

TEST(Sampling, IsBelowOneForTheLargestNumberThatIsDrawn) {
  // splitmix64 is a bijection: for this flight all bits of its last value are ones.
  EXPECT_EQ(uniform_of(1, 0x8e1310d3876fac59, "u"), std::nextafter(1.0, 0.0));
}

TEST(Sampling, HasTheMomentsOfItsDistributions) {
  CampaignPlan plan;
  plan.seed = 7;
  plan.runs = kRuns;
  const double ln2 = std::numbers::ln2;
  plan.inputs = {
      uniform("u", 2, 6), input_of("n", {.kind = Kind::kNormal, .a = 5, .b = 2, .least = -7, .most = 17}),
      input_of("ln", {.kind = Kind::kLognormal, .a = 3, .b = 2, .least = 3.0 / 64, .most = 3.0 * 64}),
      input_of("lu", {.kind = Kind::kLoguniform, .a = 1, .b = std::exp(4.0), .least = 1, .most = std::exp(4.0)}),
      input_of("half", {.kind = Kind::kNormal, .a = 0, .b = 1, .least = 0, .most = 6})};
  const Moments u = moments_of(draws_of(plan, 0));
  EXPECT_NEAR(u.mean, 4, tolerance_of_mean(4 / std::sqrt(12.0)));
  EXPECT_NEAR(u.sigma, 4 / std::sqrt(12.0), 0.02);  // its standard deviation is 0.004
  const Moments n = moments_of(draws_of(plan, 1));
  EXPECT_NEAR(n.mean, 5, tolerance_of_mean(2));
  EXPECT_NEAR(n.sigma, 2, 4 * 2 / std::sqrt(2.0 * kRuns));
  std::vector<double> logarithms = draws_of(plan, 2);
  for (double& value : logarithms) {
    value = std::log(value);
  }
  const Moments ln = moments_of(logarithms);
  EXPECT_NEAR(ln.mean, std::log(3.0), tolerance_of_mean(ln2));
  EXPECT_NEAR(ln.sigma, ln2, 4 * ln2 / std::sqrt(2.0 * kRuns));
  std::vector<double> uniform_logarithms = draws_of(plan, 3);
  for (double& value : uniform_logarithms) {
    value = std::log(value);
  }
  EXPECT_NEAR(moments_of(uniform_logarithms).mean, 2, tolerance_of_mean(4 / std::sqrt(12.0)));
  // Half of a normal: its mean is sqrt(2/pi).
  EXPECT_NEAR(moments_of(draws_of(plan, 4)).mean, std::sqrt(2 / std::numbers::pi), tolerance_of_mean(0.603));
}

TEST(Sampling, StaysWithinTheEndsOfADistribution) {
  for (const Kind kind : {Kind::kNormal, Kind::kLognormal, Kind::kUniform, Kind::kLoguniform}) {
    const Distribution distribution{.kind = kind, .a = 2, .b = 3, .least = 2.5, .most = 2.75};
    for (const double u : {0x1p-54, 0.5, 1 - 0x1p-53}) {
      EXPECT_GE(quantile_of(distribution, u), 2.5) << static_cast<int>(kind);
      EXPECT_LE(quantile_of(distribution, u), 2.75) << static_cast<int>(kind);
    }
  }
}

TEST(Sampling, KeepsItsDigitsFarInTheTail) {
  const Distribution upper{.kind = Kind::kNormal, .a = 0, .b = 1, .least = 5, .most = 6};
  const Distribution lower{.kind = Kind::kNormal, .a = 0, .b = 1, .least = -6, .most = -5};
  EXPECT_NEAR(quantile_of(upper, 0.3), -quantile_of(lower, 0.7), 1e-12);  // some roundings of 5
  // P(Z > 5) = 2.8665157e-7, P(Z > 6) = 9.865876e-10; the middle of what is between is passed by 1.4381908e-7.
  EXPECT_NEAR(std::erfc(quantile_of(upper, 0.5) / std::numbers::sqrt2) / 2, 1.4381908e-7, 1e-13);
}

TEST(Sampling, ChoosesByWeight) {
  CampaignPlan plan;
  plan.runs = kRuns;
  plan.inputs = {input_of("c", {.kind = Kind::kChoice, .weights = {1, 3, 6}, .options = 3})};
  std::array<int, 3> counts{};
  for (const double draw : draws_of(plan)) {
    ++counts[static_cast<std::size_t>(draw)];
  }
  const double tolerance = 4 * std::sqrt(kRuns * 0.25);  // of a binomial of at most this deviation
  EXPECT_NEAR(counts[0], 0.1 * kRuns, tolerance);
  EXPECT_NEAR(counts[1], 0.3 * kRuns, tolerance);
  EXPECT_NEAR(counts[2], 0.6 * kRuns, tolerance);
}

TEST(Sampling, OfALatinHypercubeHasOneRunInEachPartOfEachKey) {
  for (const std::uint64_t runs : {1U, 2U, 3U, 7U, 64U, 65U, 1000U}) {
    CampaignPlan plan;
    plan.seed = 11;
    plan.runs = runs;
    plan.latin_hypercube = true;
    plan.inputs = {uniform("a", 0, 1), uniform("b", 0, 1)};
    for (std::size_t input = 0; input < 2; ++input) {
      std::set<int> strata;
      for (const double draw : draws_of(plan, input)) {
        strata.insert(static_cast<int>(draw * static_cast<double>(runs)));
      }
      EXPECT_EQ(strata.size(), runs);
      EXPECT_LT(*strata.rbegin(), static_cast<int>(runs));
    }
  }
}

TEST(Sampling, OfALatinHypercubeLeavesKeysUncorrelated) {
  CampaignPlan plan;
  plan.seed = 5;
  plan.runs = 2000;
  plan.latin_hypercube = true;
  plan.inputs = {uniform("a", -1, 1), uniform("b", -1, 1)};
  double product = 0;
  for (std::uint64_t run = 0; run < plan.runs; ++run) {
    const std::vector<double> draws = draws_of_run(plan, run);
    product += draws[0] * draws[1] * 3 / static_cast<double>(plan.runs);
  }
  EXPECT_LT(std::abs(product), 4 / std::sqrt(2000.0));  // four standard deviations of a correlation
}

TEST(Sampling, PermutesEachNumberOnce) {
  for (const std::uint64_t count : {1U, 2U, 5U, 16U, 17U, 1000U}) {
    std::set<std::uint64_t> seen;
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t place = permuted(i, count, 99);
      EXPECT_LT(place, count);
      seen.insert(place);
    }
    EXPECT_EQ(seen.size(), count);
  }
  EXPECT_LT(permuted(123'456'789, 1'000'000'000'000, 1), 1'000'000'000'000U);
}

TEST(Sampling, OfARunDependsOnNoOtherKeyAndNoOtherRun) {
  CampaignPlan plan;
  plan.seed = 3;
  plan.runs = 100;
  plan.inputs = {uniform("a", 0, 1), uniform("b", 0, 1)};
  CampaignPlan larger = plan;
  larger.runs = 1000;
  larger.inputs = {uniform("c", 0, 1), uniform("b", 0, 1), uniform("a", 0, 1)};
  EXPECT_EQ(draws_of_run(plan, 17)[0], draws_of_run(larger, 17)[2]);
  EXPECT_EQ(draws_of_run(plan, 17)[1], draws_of_run(larger, 17)[1]);
  EXPECT_EQ(seed_of_run(plan, 17), seed_of_run(larger, 17));
  CampaignPlan other = plan;
  other.seed = 4;
  EXPECT_NE(draws_of_run(plan, 17), draws_of_run(other, 17));
  EXPECT_NE(draws_of_run(plan, 17), draws_of_run(plan, 18));
  larger.runs = 10000;
  std::set<std::uint64_t> seeds;
  for (std::uint64_t run = 0; run < larger.runs; ++run) {
    EXPECT_LT(seed_of_run(larger, run), std::uint64_t{1} << 63U);
    seeds.insert(seed_of_run(larger, run));
  }
  EXPECT_EQ(seeds.size(), 10000U);
}

TEST(Sampling, OfAGridTakesEachPointAsOftenAsItIsRepeated) {
  CampaignPlan plan;
  plan.repeats = 2;
  plan.runs = 12;
  plan.inputs = {input_of("a", {.kind = Kind::kGrid, .options = 2}), uniform("b", 0, 1),
                 input_of("c", {.kind = Kind::kGrid, .options = 3})};
  std::map<std::pair<double, double>, int> points;
  for (std::uint64_t run = 0; run < plan.runs; ++run) {
    const std::vector<double> draws = draws_of_run(plan, run);
    ++points[{draws[0], draws[2]}];
  }
  EXPECT_EQ(points.size(), 6U);
  for (const auto& [point, count] : points) {
    EXPECT_EQ(count, 2);
  }
  EXPECT_EQ(draws_of_run(plan, 2)[2], 1);  // the last key changes first
  EXPECT_EQ(draws_of_run(plan, 2)[0], 0);
}

/// Two estimators over the same flights, and a value that another follows.
TEST(Sampling, CalibratesEachFlightByAllSettings) {
  CampaignPlan plan;
  plan.repeats = 2;
  plan.runs = 12;
  CampaignInput follows = input_of("gyro.alignment_prior_sigma", {.kind = Kind::kFollows, .a = 0.5});
  follows.followed = 3;
  plan.inputs = {input_of("calibration.estimator", {.kind = Kind::kGrid, .options = 2}), follows, uniform("b", 0, 1),
                 input_of("c", {.kind = Kind::kGrid, .options = 3})};
  plan.inputs[3].numbers = {10, 20, 60};
  ASSERT_EQ(flights_of(plan), 6U);
  CampaignPlan one_estimator = plan;
  one_estimator.inputs.erase(one_estimator.inputs.begin());
  one_estimator.inputs.front().followed = 2;
  one_estimator.runs = 6;
  for (std::uint64_t run = 0; run < plan.runs; ++run) {
    const std::vector<double> draws = draws_of_run(plan, run);
    EXPECT_EQ(draws[0], run < 6 ? 0 : 1);
    EXPECT_EQ(draws[1], plan.inputs[3].numbers[static_cast<std::size_t>(draws[3])] / 2);
    EXPECT_EQ(flight_of_run(plan, run), run % 6);
    EXPECT_EQ(seed_of_run(plan, run), seed_of_run(one_estimator, run % 6));
    EXPECT_EQ(std::vector<double>(draws.begin() + 1, draws.end()), draws_of_run(one_estimator, run % 6));
  }
  plan.latin_hypercube = true;
  EXPECT_EQ(draws_of_run(plan, 1)[2], draws_of_run(plan, 7)[2]);
}

}  // namespace
}  // namespace trihedron::campaign
