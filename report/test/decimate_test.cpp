#include "decimate.hpp"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace trihedron::report {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::Le;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::vector<double> count_up(std::size_t n) {
  std::vector<double> t(n);
  std::iota(t.begin(), t.end(), 0.0);
  return t;
}

std::vector<double> chosen(const std::vector<double>& values, const std::vector<std::size_t>& rows) {
  std::vector<double> result;
  for (const std::size_t row : rows) {
    result.push_back(values[row]);
  }
  return result;
}

TEST(Decimate, KeepsASpikeOfOneSample) {
  const auto t = count_up(100000);
  std::vector<std::vector<double>> channels{std::vector<double>(t.size(), 0.0)};
  channels[0][54321] = 7;
  channels[0][54400] = -3;
  const auto kept = chosen(channels[0], decimate(t, channels, 100));
  EXPECT_EQ(*std::max_element(kept.begin(), kept.end()), 7);
  EXPECT_EQ(*std::min_element(kept.begin(), kept.end()), -3);
}

TEST(Decimate, KeepsTheExtremesOfEveryChannel) {
  const auto t = count_up(1000);
  std::vector<std::vector<double>> channels(2, std::vector<double>(t.size(), 0.0));
  channels[0][500] = 1;
  channels[1][501] = -1;
  const auto rows = decimate(t, channels, 10);
  EXPECT_THAT(rows, testing::IsSupersetOf({500U, 501U}));
}

TEST(Decimate, KeepsAGap) {
  const auto t = count_up(1000);
  std::vector<std::vector<double>> channels{t};
  std::fill(channels[0].begin() + 300, channels[0].begin() + 400, kNaN);
  const auto kept = chosen(channels[0], decimate(t, channels, 20));
  EXPECT_TRUE(std::any_of(kept.begin(), kept.end(), [](double v) { return std::isnan(v); }));
}

TEST(Decimate, KeepsTheFirstAndTheLastRow) {
  const auto t = count_up(1000);
  const std::vector<std::vector<double>> channels{std::vector<double>(t.size(), 1.0)};
  const auto rows = decimate(t, channels, 3);
  EXPECT_EQ(rows.front(), 0U);
  EXPECT_EQ(rows.back(), 999U);
}

TEST(Decimate, OfNothingIsNothing) { EXPECT_TRUE(decimate({}, {}, 10).empty()); }

TEST(Decimate, OfOneRowIsThatRow) {
  const std::vector<std::vector<double>> channels{{5.0}};
  EXPECT_THAT(decimate(std::vector<double>{1.0}, channels, 10), ElementsAre(0U));
}

RC_GTEST_PROP(Decimate, NeverLosesTheExtremesOfTheWhole, (std::vector<int> values)) {
  RC_PRE(!values.empty());
  const std::vector<std::vector<double>> channels{std::vector<double>(values.begin(), values.end())};
  const auto rows = decimate(count_up(values.size()), channels, 5);
  const auto kept = chosen(channels[0], rows);
  const auto [least, greatest] = std::minmax_element(channels[0].begin(), channels[0].end());
  RC_ASSERT(*std::min_element(kept.begin(), kept.end()) == *least);
  RC_ASSERT(*std::max_element(kept.begin(), kept.end()) == *greatest);
  RC_ASSERT(std::is_sorted(rows.begin(), rows.end()));
  RC_ASSERT(rows.size() <= 2 * (5 + 1) + 2);
}

TEST(Series, PutsAGapBetweenRowsFarApart) {
  Series series(1, 10);
  series.add(0, {1});
  series.add(1, {2});
  series.add(50, {3});
  EXPECT_EQ(series.drawn(100).dump(), R"({"t":[0.0,1.0,25.5,50.0],"y":[[1.0,2.0,null,3.0]]})");
}

TEST(Series, DrawsNoMoreThanAScreenShows) {
  Series series(1, 10);
  for (int i = 0; i < 100000; ++i) {
    series.add(i, {std::sin(i * 0.37)});
  }
  EXPECT_LE(series.drawn(400).at("t").size(), 2U * 401 + 2);
}

TEST(Rounded, KeepsSignificantDigits) {
  EXPECT_EQ(rounded(1.23456789e-9, 5), 1.2346e-9);
  EXPECT_EQ(rounded(-987654.321, 3), -988000);
  EXPECT_EQ(rounded(0, 5), 0);
  EXPECT_TRUE(std::isnan(rounded(kNaN, 5)));
}

}  // namespace
}  // namespace trihedron::report
