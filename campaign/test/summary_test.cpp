#include "trihedron/campaign/summary.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "trihedron/campaign/statistics.hpp"

namespace trihedron::campaign {
namespace {

std::vector<double> one_to(int n) {
  std::vector<double> values(static_cast<std::size_t>(n));
  std::iota(values.begin(), values.end(), 1.0);
  return values;
}

TEST(OrderStatistics, NeedAsManyRunsAsTheClosedFormSays) {
  EXPECT_EQ(runs_needed(0.997, 0.9), 767U);  // 1 − 0.997^766 = 0.8999, 1 − 0.997^767 = 0.9002
  EXPECT_EQ(runs_needed(0.95, 0.95), 59U);   // Wilks 1941
  EXPECT_EQ(runs_needed(0.9, 0.9), 22U);
  EXPECT_NEAR(std::pow(quantile_supported(767), 767), 0.1, 1e-12);  // rounding
}

TEST(OrderStatistics, BoundAQuantileByTheLargestValueFromThatNumberOn) {
  EXPECT_EQ(quantile_bounds(one_to(59), 0.95, 0.95).upper, 59);
  EXPECT_FALSE(quantile_bounds(one_to(58), 0.95, 0.95).upper.has_value());
  EXPECT_EQ(quantile_bounds(one_to(93), 0.95, 0.95).upper, 92);  // Wilks' second order
  EXPECT_EQ(quantile_bounds(one_to(92), 0.95, 0.95).upper, 92);
}

TEST(OrderStatistics, OfAMedianAreThoseOfTheSignTest) {
  // n = 10: P(Bin(10, 1/2) ≤ 6) = 848/1024 < 0.9 ≤ P(≤ 7) = 968/1024: ranks 8 and, by symmetry, 3.
  const QuantileBounds bounds = quantile_bounds(one_to(10), 0.5);
  EXPECT_EQ(bounds.estimate, 5);
  EXPECT_EQ(bounds.upper, 8);
  EXPECT_EQ(bounds.lower, 3);
}

TEST(OrderStatistics, OfASingleValueBoundNothing) {
  const QuantileBounds bounds = quantile_bounds(one_to(1), 0.5);
  EXPECT_EQ(bounds.estimate, 1);
  EXPECT_FALSE(bounds.upper.has_value());
  EXPECT_FALSE(bounds.lower.has_value());
}

TEST(RankCorrelation, IsOneForWhatGrowsTogetherWhateverItsScale) {
  const std::vector<double> x = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  const std::vector<double> y = {-5, -4, -3, -2, -1, 1, 10, 100, 1000, std::numeric_limits<double>::infinity()};
  ASSERT_TRUE(rank_correlation(x, y).has_value());
  EXPECT_EQ(rank_correlation(x, y)->rho, 1);
  EXPECT_EQ(rank_correlation(x, y)->p_value, 0);
}

TEST(RankCorrelation, HasTheValueOfTheTextbookAndMeanRanksForTies) {
  // Ranks of y: 4, 1, 2, 3, 5, 9, 6, 10, 7, 8: rho = 1 − 6·34/(10·99) = 0.793939; t = 3.69344 of 8 degrees of freedom,
  // two-sided p 0.0061.
  const std::vector<double> x = {10, 20, 30, 40, 50, 60, 70, 80, 90, 100};
  const std::vector<double> y = {0.4, 0.1, 0.2, 0.3, 0.5, 9, 6, 10, 7, 8};
  const auto correlation = rank_correlation(x, y);
  ASSERT_TRUE(correlation.has_value());
  EXPECT_NEAR(correlation->rho, 0.793939, 1e-6);
  EXPECT_NEAR(correlation->p_value, 0.0061, 1e-6);
  // Ranks 1.5, 1.5, 3, …, 10 against 1, 2, 3, …, 10: 82/√(82·82.5).
  EXPECT_NEAR(rank_correlation(std::vector<double>{7, 7, 8, 9, 10, 11, 12, 13, 14, 15}, x)->rho,
              82 / std::sqrt(82 * 82.5), 1e-12);
}

TEST(RankCorrelation, OfTwoValuesTakesMorePairs) {
  std::vector<double> x;
  std::vector<double> y;
  for (int i = 0; i < 40; ++i) {
    x.push_back(i % 2);
    y.push_back(i);
  }
  EXPECT_FALSE(rank_correlation(std::span(x).first(39), std::span(y).first(39)).has_value());
  EXPECT_TRUE(rank_correlation(x, y).has_value());
}

TEST(RankCorrelation, IsNoneForFewPairsOrWhatDoesNotChange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> x = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  const std::vector<double> y = x;
  EXPECT_FALSE(rank_correlation(std::span(x).first(9), std::span(y).first(9)).has_value());
  EXPECT_FALSE(rank_correlation(std::vector<double>(10, 5), y).has_value());
  x.back() = nan;
  EXPECT_FALSE(rank_correlation(x, y).has_value());
}

TEST(OrderScores, AreTheOrderOfTheRanksWhereAllIsKnown) {
  const std::vector<double> values = {5, 1, 5, 9};
  EXPECT_THAT(order_scores(values, std::vector<char>(4)), testing::ElementsAre(0, -3, 0, 3));
}

/// 3 is below 5 and above 1. That something is more than 2 does not say whether it is more than 3 or 5.
TEST(OrderScores, OfALowerBoundCountOnlyWhatIsSurelyBelowIt) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> values = {1, 3, 5, 2, nan, 5};
  const std::vector<char> is_lower_bound = {0, 0, 0, 1, 1, 1};
  const std::vector<double> scores = order_scores(values, is_lower_bound);
  EXPECT_THAT(std::vector<double>(scores.begin(), scores.begin() + 4), testing::ElementsAre(-4, -1, 1, 1));
  EXPECT_TRUE(std::isnan(scores[4]));
  EXPECT_EQ(scores[5], 3);
}

TEST(ChiSquareBounds, AreThoseOfTheTable) {
  const ChiSquareBounds bounds = chi_square_bounds(10, 0.95);  // 3.247 and 20.483
  EXPECT_NEAR(bounds.low * 10, 3.247, 5e-4);
  EXPECT_NEAR(bounds.high * 10, 20.483, 5e-4);
}

/// A run with honest sigmas and a NEES of its degrees of freedom.
RunRecord run_of(std::uint64_t number, double nees = 20) {
  RunRecord record;
  record.run = number;
  record.outcome = RunOutcome::kTrustworthy;
  record.draws = {static_cast<double>(number)};
  for (const RunQuantityRow& row : kRunQuantityRows) {
    record[row.quantity].assign(size_of(row.shape, 2), 1);
  }
  record[RunQuantity::kNees] = {nees};
  record[RunQuantity::kNeesFreedom] = {20};
  record[RunQuantity::kNisMean] = {4};
  record[RunQuantity::kNisFreedom] = {4};
  record[RunQuantity::kNisFixes] = {10000};
  record[RunQuantity::kOpenLoopError] = {1e-4 + 1e-6 * static_cast<double>(number)};
  return record;
}

CampaignPlan plan_of(std::size_t runs) {
  CampaignPlan plan;
  plan.runs = runs;
  CampaignInput input;
  input.key = "gyro.readout.noise";
  plan.inputs = {input};
  return plan;
}

std::vector<RunRecord> runs_of(std::size_t count, double nees = 20) {
  std::vector<RunRecord> records;
  for (std::size_t i = 0; i < count; ++i) {
    records.push_back(run_of(i, nees));
  }
  return records;
}

std::vector<std::string> codes_of(const CampaignSummary& summary) {
  std::vector<std::string> codes;
  for (const CampaignFinding& finding : summary.campaign_findings) {
    codes.push_back(finding.code);
  }
  return codes;
}

TEST(CampaignSummary, OfConsistentRunsIsTrustworthy) {
  const CampaignSummary summary = summarise(plan_of(800), runs_of(800));
  EXPECT_TRUE(summary.trustworthy_campaign());
  EXPECT_THAT(codes_of(summary), testing::IsEmpty());
  EXPECT_EQ(summary.nees->mean, 20);
  EXPECT_NEAR(summary.nees->sigma_factor(), 1, 1e-15);
}

TEST(CampaignSummary, SaysHowManyRunsTheHighestQuantileTakes) {
  const CampaignSummary summary = summarise(plan_of(100), runs_of(100));
  EXPECT_THAT(codes_of(summary), testing::ElementsAre("too-few-runs"));
  EXPECT_THAT(summary.campaign_findings.front().evidence, testing::HasSubstr("767"));
  EXPECT_TRUE(summary.trustworthy_campaign());
}

TEST(CampaignSummary, OfSigmasThatAreTooSmallIsNotToBeUsed) {
  const CampaignSummary slightly = summarise(plan_of(800), runs_of(800, 22));
  EXPECT_THAT(codes_of(slightly), testing::ElementsAre("nees-above-bounds"));
  EXPECT_TRUE(slightly.trustworthy_campaign());
  const CampaignSummary badly = summarise(plan_of(800), runs_of(800, 30));
  EXPECT_FALSE(badly.trustworthy_campaign());
  const CampaignSummary cautious = summarise(plan_of(800), runs_of(800, 15));
  EXPECT_THAT(codes_of(cautious), testing::ElementsAre("nees-below-bounds"));
  EXPECT_TRUE(cautious.trustworthy_campaign());
}

TEST(CampaignSummary, NamesRunsThatAreTrustedButWrong) {
  std::vector<RunRecord> records = runs_of(800);
  records[17][RunQuantity::kNees] = {100};  // χ² of 20 passes 68 once in a million
  const CampaignSummary summary = summarise(plan_of(800), records);
  EXPECT_THAT(codes_of(summary), testing::ElementsAre("trusted-but-wrong"));
  EXPECT_THAT(summary.campaign_findings.front().evidence,
              testing::HasSubstr("1 of 800 trustworthy runs have a NEES that chance passes once in a million: run 17"));
  EXPECT_EQ(summary.worst.front().run, 17U);
}

TEST(CampaignSummary, WithManyRunsThatAreTrustedButWrongIsNotToBeUsed) {
  // Of 100, one percent is exceeded with 90 % confidence by three: P(3 or more of Bin(100, 0.01)) = 0.079, P(2 or more)
  // = 0.26.
  EXPECT_FALSE(is_share_above(2, 100, 0.01));
  EXPECT_TRUE(is_share_above(3, 100, 0.01));
  EXPECT_FALSE(is_share_above(0, 100, 0.01));
  std::vector<RunRecord> records = runs_of(100, 19);
  for (std::size_t i = 0; i < 3; ++i) {
    records[i][RunQuantity::kNees] = {75};
  }
  EXPECT_FALSE(summarise(plan_of(100), records).trustworthy_campaign());
}

TEST(CampaignSummary, OfRunsThatFailedIsNotToBeUsed) {
  std::vector<RunRecord> records = runs_of(800);
  records[3].outcome = RunOutcome::kFailed;
  records[3].reason = "no fix";
  const CampaignSummary summary = summarise(plan_of(800), records);
  EXPECT_FALSE(summary.trustworthy_campaign());
  EXPECT_THAT(codes_of(summary), testing::ElementsAre("runs-failed"));
  EXPECT_EQ(summary.reasons.at("no fix"), 1U);
  EXPECT_EQ(summary.nees->runs, 799U);
  EXPECT_EQ(summary.worst.front().run, 3U);
}

TEST(CampaignSummary, CountsReasonsTogetherThatDifferInNumbersAlone) {
  std::vector<RunRecord> records = runs_of(800);
  for (const std::size_t run : {3U, 5U, 9U, 10U}) {
    records[run].outcome = RunOutcome::kFailed;
    records[run].reason = "perigee 428.795km above apogee 1e+03km";
  }
  records[5].reason = "perigee 500km above apogee 4.5e-05km";
  records[9].reason = "no fix";
  const CampaignSummary summary = summarise(plan_of(800), records);
  EXPECT_EQ(summary.reasons.size(), 2U);
  EXPECT_EQ(summary.reasons.at("perigee 428.795km above apogee 1e+03km"), 3U);
  EXPECT_THAT(summary.campaign_findings.front().evidence,
              testing::EndsWith("most often: perigee 428.795km above apogee 1e+03km"));
}

TEST(CampaignSummary, WithoutATrustworthyRunIsNotToBeUsed) {
  std::vector<RunRecord> records = runs_of(10);
  for (RunRecord& record : records) {
    record.outcome = RunOutcome::kDoNotUse;
  }
  const CampaignSummary summary = summarise(plan_of(10), records);
  EXPECT_FALSE(summary.trustworthy_campaign());
  EXPECT_FALSE(summary.nees.has_value());
  EXPECT_EQ(summary.nees_of_all->runs, 10U);
}

/// Not a finding that many trustworthy runs have as well.
TEST(CampaignSummary, NamesWhyRunsAreRefused) {
  std::vector<RunRecord> records = runs_of(800);
  for (RunRecord& record : records) {
    record.findings = {"weak-alignment-axis"};
  }
  for (const std::size_t i : {3U, 4U, 5U}) {
    records[i].outcome = RunOutcome::kDoNotUse;
  }
  const auto evidence = [&] {
    const CampaignSummary summary = summarise(plan_of(800), records);
    EXPECT_THAT(codes_of(summary), testing::ElementsAre("runs-not-trustworthy"));
    return summary.campaign_findings.front().evidence;
  };
  EXPECT_EQ(evidence(), "0.4 % of the runs");
  records[4].findings = {"gyro-stuck", "gyro-stuck", "weak-alignment-axis"};
  EXPECT_THAT(evidence(), testing::HasSubstr("most often gyro-stuck, in 1 of these"));
}

TEST(CampaignSummary, NamesTheSecondOfTwoWords) {
  CampaignInput input;
  input.key = "attitude.slews";
  EXPECT_EQ(influential(input), "attitude.slews");
  input.distribution.kind = Distribution::Kind::kChoice;
  input.distribution.options = 2;
  input.options = {"auto", "none"};
  EXPECT_EQ(influential(input), "attitude.slews = none");
  input.numbers = {1, 2};
  EXPECT_EQ(influential(input), "attitude.slews");
}

TEST(CampaignSummary, FindsWhatMatters) {
  const CampaignSummary summary = summarise(plan_of(100), runs_of(100));
  ASSERT_FALSE(summary.influences.empty());
  EXPECT_EQ(summary.influences.front().measure->key, "open_loop_error");
  EXPECT_EQ(summary.influences.front().correlation.rho, 1);
  EXPECT_TRUE(summary.influences.front().is_significant);
}

/// Of longer passes the bounds are higher, and nothing else.
TEST(CampaignSummary, DoesNotTakeLowerBoundsForValues) {
  std::vector<RunRecord> records = runs_of(100);
  for (std::size_t i = 0; i < records.size(); ++i) {
    records[i][RunQuantity::kExtension] = {i % 2 == 0 ? 10.0 : 20.0 + static_cast<double>(i)};
    records[i][RunQuantity::kExtensionIsLowerBound] = {i % 2 == 0 ? 0.0 : 1.0};
    records[i].draws = {static_cast<double>(i % 2 == 0 ? 0 : i)};
  }
  const auto of_extension = [&] {
    const CampaignSummary summary = summarise(plan_of(100), records);
    const auto found = std::ranges::find_if(
        summary.influences, [](const Influence& influence) { return influence.measure->key == "extension"; });
    return found != summary.influences.end() ? std::optional(found->correlation.rho) : std::nullopt;
  };
  const std::optional<double> both = of_extension();  // all that is drawn above 0 has more than 10
  ASSERT_TRUE(both.has_value());
  EXPECT_NEAR(*both, std::sqrt(62500 / 72912.5), 1e-12);  // 50 below and 50 above, and no order among these
  for (RunRecord& record : records) {
    record[RunQuantity::kExtensionIsLowerBound] = {1};
  }
  EXPECT_FALSE(of_extension().has_value());  // bounds alone say nothing
}

/// Each flight by three settings, which change nothing: as many independent numbers as flights.
TEST(CampaignSummary, CountsAFlightOnceForWhatIsDrawnOfTheScenario) {
  CampaignPlan plan = plan_of(30);
  plan.inputs.front().distribution = {.kind = Distribution::Kind::kUniform, .a = 0, .b = 10};
  CampaignInput setting;
  setting.key = "calibration.filter.gate";
  setting.distribution = {.kind = Distribution::Kind::kGrid, .options = 3};
  setting.options = {"1", "2", "3"};
  setting.numbers = {1, 2, 3};
  plan.inputs.push_back(setting);
  std::vector<RunRecord> records = runs_of(30);
  for (RunRecord& record : records) {
    const std::uint64_t flight = record.run % 10;
    record.draws = {static_cast<double>(flight), static_cast<double>(record.run / 10)};
    record[RunQuantity::kOpenLoopError] = {1e-4 * static_cast<double>(flight * flight)};
  }
  const CampaignSummary summary = summarise(plan, records);
  std::map<std::size_t, std::size_t> count;
  for (const Influence& influence : summary.influences) {
    if (influence.measure->key == "open_loop_error") {
      count[influence.input] = influence.correlation.count;
    }
  }
  EXPECT_THAT(count, testing::ElementsAre(testing::Pair(0, 10), testing::Pair(1, 30)));
}

TEST(CampaignSummary, CountsWhatHasNotSettledAsLaterThanAll) {
  std::vector<RunRecord> records = runs_of(100);
  for (std::size_t i = 0; i < 20; ++i) {
    records[i][RunQuantity::kDriftSettled] = {std::numeric_limits<double>::quiet_NaN()};
  }
  const CampaignSummary summary = summarise(plan_of(100), records);
  for (const MeasureStatistics& its : summary.all) {
    if (its.measure->key == "drift_settled") {
      EXPECT_EQ(its.runs, 100U);
      EXPECT_EQ(its.quantiles[0].estimate, 1);
      EXPECT_TRUE(std::isinf(its.quantiles[1].estimate));
    }
  }
}

TEST(CampaignSummary, CountsTheQuantilesOfAnExtensionFromAbove) {
  std::vector<RunRecord> records = runs_of(100);
  for (std::size_t i = 0; i < 100; ++i) {
    records[i][RunQuantity::kExtension] = {static_cast<double>(i + 1)};
  }
  const CampaignSummary summary = summarise(plan_of(100), records);
  const QuantileBounds& ninety = summary.all.back().quantiles[1];
  EXPECT_EQ(ninety.estimate, 11);  // 90 of 100 reach it
  EXPECT_LT(*ninety.lower, 11);
  EXPECT_GT(*ninety.upper, 11);
}

/// A grid of two by three, two runs at each point.
CampaignPlan grid_of_six() {
  CampaignPlan plan;
  plan.repeats = 2;
  plan.runs = 12;
  for (const std::size_t options : {2U, 3U}) {
    CampaignInput input;
    input.key = options == 2 ? "attitude" : "gyro.readout.noise";
    input.distribution = {.kind = Distribution::Kind::kGrid, .options = options};
    plan.inputs.push_back(input);
  }
  plan.inputs[0].options = {"slews", "none"};
  plan.inputs[1].options = {"1arcsec", "2arcsec", "4arcsec"};
  plan.inputs[1].numbers = {1, 2, 4};
  plan.inputs[1].unit = "arcsec";
  return plan;
}

std::vector<RunRecord> runs_of_grid() {
  std::vector<RunRecord> records = runs_of(12);
  for (RunRecord& record : records) {
    record.draws = {std::floor(static_cast<double>(record.run) / 6), static_cast<double>(record.run / 2 % 3)};
  }
  return records;
}

TEST(CampaignSummary, TellsEachPointOfAGridApart) {
  const CampaignPlan plan = grid_of_six();
  std::vector<RunRecord> records = runs_of_grid();
  records[4][RunQuantity::kNees] = {40};
  records[5][RunQuantity::kNees] = {60};
  records[6].outcome = RunOutcome::kDoNotUse;
  records[6][RunQuantity::kNees] = {1e6};
  records[8].outcome = records[9].outcome = RunOutcome::kFailed;
  const CampaignSummary summary = summarise(plan, records);
  ASSERT_EQ(summary.cells.size(), 6U);
  EXPECT_THAT(summary.grid, testing::ElementsAre(0, 1));
  EXPECT_THAT(summary.cells[2].point, testing::ElementsAre(0, 2));
  EXPECT_EQ(text_of_draw(plan.inputs[0], summary.cells[2].point[0]), "slews");
  EXPECT_EQ(text_of_draw(plan.inputs[1], summary.cells[2].point[1]), "4arcsec");
  EXPECT_EQ(summary.cells[2].nees->mean, 50);
  EXPECT_EQ(summary.cells[2].nees->side(), 1);
  EXPECT_EQ(quantile_of(summary.cells[2].measures[1], 0.5), 1e-4 + 4e-6);  // of two the smaller
  EXPECT_EQ(quantile_of(summary.cells[2].measures[1], kCellQuantile), 1e-4 + 5e-6);
  EXPECT_EQ(summary.cells[0].nees->mean, 20);
  EXPECT_EQ(summary.cells[0].nees->side(), 0);
  // 40 degrees of freedom of two runs: 95 % between 24.433 and 59.342.
  EXPECT_NEAR(summary.cells[0].nees->usual.low * 20, 24.433 / 2, 1e-3);
  EXPECT_NEAR(summary.cells[0].nees->usual.high * 20, 59.342 / 2, 1e-3);
  EXPECT_EQ(summary.cells[3].nees->mean, 20);  // of the trustworthy run alone
  EXPECT_EQ(summary.cells[3].trustworthy, 1U);
  EXPECT_EQ(summary.cells[3].finished, 2U);
  EXPECT_EQ(summary.cells[4].failed, 2U);
  EXPECT_FALSE(summary.cells[4].nees.has_value());
  EXPECT_FALSE(quantile_of(summary.cells[4].measures[0], 0.5).has_value());
}

TEST(CampaignSummary, HasNoCellsOfSingleRunsOrWithoutAGrid) {
  CampaignPlan plan = grid_of_six();
  plan.repeats = 1;
  EXPECT_TRUE(summarise(plan, runs_of_grid()).cells.empty());
  CampaignPlan of_one = grid_of_six();
  of_one.inputs.front().distribution.options = 1;
  EXPECT_EQ(summarise(of_one, runs_of_grid()).grid, (std::vector<std::size_t>{1}));
  EXPECT_TRUE(summarise(plan_of(12), runs_of(12)).cells.empty());
}

TEST(Consistency, TellsTheSideAndDoesNotTakeNaNForInside) {
  // χ² of one run with 20 degrees of freedom: 9.591 … 34.170.
  EXPECT_EQ(consistency_of(9.5, 20, 1).side(), -1);
  EXPECT_EQ(consistency_of(9.6, 20, 1).side(), 0);
  EXPECT_EQ(consistency_of(34.1, 20, 1).side(), 0);
  EXPECT_EQ(consistency_of(34.2, 20, 1).side(), 1);
  EXPECT_EQ(consistency_of(std::nan(""), 20, 1).side(), 1);
}

TEST(Consistency, OfManyHasTheBoundsOfTheNormalDistribution) {
  const Consistency many = consistency_of(4e6, 4e6, 1e6);
  EXPECT_EQ(many.mean, 4);
  EXPECT_EQ(many.freedom, 4);
  const double half = 1.959964 * std::sqrt(8 / 1e6);
  EXPECT_NEAR(many.usual.low * 4, 4 - half, 1e-2 * half);
  EXPECT_NEAR(many.usual.high * 4, 4 + half, 1e-2 * half);
}

}  // namespace
}  // namespace trihedron::campaign
