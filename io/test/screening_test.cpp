#include "screening.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "fixtures.hpp"

namespace trihedron::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Kind = Defect::Kind;

/// Every claim holds in both formats: the rows go through a file of the format that is the parameter.
class Screening : public testing::TestWithParam<std::string> {
 protected:
  [[nodiscard]] bool csv() const { return GetParam() == "csv"; }
  [[nodiscard]] std::string gyro_table() const { return csv() ? "gyro.csv" : "group gyro"; }
  [[nodiscard]] std::string fix_table() const { return csv() ? "star_tracker.csv" : "group star_tracker"; }

  [[nodiscard]] LoadedPass load() const {
    const std::filesystem::path path = directory_ / (csv() ? "pass" : "pass.nc");
    csv() ? raw_.save_directory(path) : raw_.save_netcdf(path);
    return read_pass(path);
  }
  [[nodiscard]] std::string load_refused() const {
    return refusal([&] { static_cast<void>(load()); });
  }

  TemporaryDirectory directory_;
  RawPass raw_ = clean_pass();
};

INSTANTIATE_TEST_SUITE_P(Formats, Screening, testing::Values("csv", "netcdf"),
                         [](const auto& format) { return format.param; });

TEST_P(Screening, FindsNothingInACleanPass) { EXPECT_THAT(load().defects, IsEmpty()); }

TEST_P(Screening, RefusesAPeriodThatTheRowsDoNotHave) {
  const std::string told = raw_.toml;
  raw_.toml = replaced(told, "period_s = 0.5", "period_s = 50");
  const std::string settings = (directory_ / (csv() ? "pass/pass.toml" : "pass.nc:pass_toml")).string();
  EXPECT_THAT(load_refused(), HasSubstr(gyro_table() + " has a row every 0.5 s, and period_s in [gyro] of " + settings +
                                        " is 50 s: one of them is wrong; both are in seconds: set period_s = 0.5 "
                                        "there, or correct t_s"));
  raw_.toml = replaced(told, "period_s = 0.5", "period_s = 0.0005");
  EXPECT_THAT(load_refused(), HasSubstr("the times t_s look like milliseconds"));
  raw_.toml = replaced(told, "period_s = 3", "period_s = 3000");
  EXPECT_THAT(load_refused(),
              HasSubstr("in [star_tracker] of " + settings + " is 3000 s: the period looks like millisec"));
}

TEST_P(Screening, RefusesRowsThatHaveTheTimeOfTheirPacket) {
  for (std::size_t i = 0; i < raw_.gyro.rows.size(); ++i) {
    raw_.gyro.rows[i][0] = raw_.gyro.rows[i - i % 4][0];
  }
  const std::string refused = load_refused();
  EXPECT_THAT(refused,
              HasSubstr(gyro_table() + " has about 4 rows of the same t_s, and another t_s every 2 s, as of packets"));
  EXPECT_THAT(refused, HasSubstr("give each row the time at which it was taken"));
}

// Half of the samples and most of the fixes are gone.
TEST_P(Screening, TakesAPeriodOfWhichManyRowsAreMissing) {
  int row = 0;
  std::erase_if(raw_.gyro.rows, [&](const auto&) { return ++row % 4 < 2; });
  EXPECT_EQ(load().pass.gyro.size(), raw_.gyro.rows.size());
}

// Fixes mostly a minute apart, as of a star tracker that seldom sees enough stars, and two that follow each other.
TEST_P(Screening, TakesAPeriodOfWhichNearlyAllRowsAreMissing) {
  raw_.toml = replaced(raw_.toml, "duration_s = 90", "duration_s = 6000");
  raw_.star_tracker.rows.resize(2);
  for (int i = 1; i < 100; ++i) {
    const double t = 60.0 * i;
    raw_.star_tracker.rows.push_back({t, 0, 0, std::sin(5e-4 * t), std::cos(5e-4 * t)});
  }
  EXPECT_EQ(load().pass.star_tracker.size(), 101U);
  raw_.star_tracker.rows.erase(raw_.star_tracker.rows.begin() + 1);
  EXPECT_THAT(load_refused(), HasSubstr("has a row every 60 s"));
}

TEST_P(Screening, LeavesOutRowsWithoutATime) {
  raw_.gyro.rows[10][0] = kNaN;
  raw_.gyro.rows[20][0] = std::numeric_limits<double>::infinity();
  const LoadedPass loaded = load();
  EXPECT_EQ(loaded.pass.gyro.size(), 179U);
  const Defect defect = only(loaded.defects, Kind::kMissingTime);
  EXPECT_EQ(defect.count, 2);
  EXPECT_EQ(defect.where, gyro_table());
  EXPECT_EQ(defect.first[0].sample, 10);
  EXPECT_EQ(defect.first[0].line, csv() ? 12 : 0);
}

TEST_P(Screening, LeavesOutRepeatedTimesKeepingTheFirst) {
  const auto row = raw_.gyro.rows[10];
  raw_.gyro.rows.insert(raw_.gyro.rows.begin() + 11, {row[0], 0, 0, 1, 1, 0, 0});
  const LoadedPass loaded = load();
  EXPECT_EQ(loaded.pass.gyro.size(), 181U);
  EXPECT_EQ(loaded.pass.gyro.direction(10, 0).x(), row[1]);
  const Defect defect = only(loaded.defects, Kind::kRepeatedTime);
  EXPECT_EQ(defect.count, 1);
  EXPECT_EQ(defect.first[0].sample, 11);
  EXPECT_EQ(loaded.defects.size(), 1U);
}

TEST_P(Screening, LeavesOutATimeThatRunsBackward) {
  raw_.gyro.rows[100][0] = 1.25;
  const LoadedPass loaded = load();
  EXPECT_EQ(loaded.pass.gyro.size(), 180U);
  const Defect defect = only(loaded.defects, Kind::kBackwardTime);
  EXPECT_EQ(defect.count, 1);
  EXPECT_EQ(defect.first[0].t_s, 1.25);
}

TEST_P(Screening, ATimeThatJumpsAheadCostsOnlyItsOwnRow) {
  raw_.gyro.rows[10][0] = 80.1;
  const LoadedPass loaded = load();
  EXPECT_EQ(loaded.pass.gyro.size(), 180U);
  EXPECT_EQ(only(loaded.defects, Kind::kBackwardTime).count, 1);
}

// Twenty readings, ten seconds, of a body that turns by 200 arcseconds a second. The others stay, also those whose
// times they have taken.
TEST_P(Screening, LeavesOutPacketsThatBearAnotherTime) {
  const RawPass clean = raw_;
  for (const double late_s : {5.0, 1.0, -1.0, -5.0}) {
    SCOPED_TRACE(late_s);
    raw_ = clean;
    for (std::size_t i = 60; i < 80; ++i) {
      raw_.gyro.rows[i][0] += late_s;
    }
    const LoadedPass loaded = load();
    const auto repeated = static_cast<std::int64_t>(2 * std::max(-late_s, 0.0));
    EXPECT_EQ(only(loaded.defects, Kind::kLeapingTime).count, 20 - repeated);
    EXPECT_TRUE(repeated == 0 || only(loaded.defects, Kind::kRepeatedTime).count == repeated);
    EXPECT_EQ(only(loaded.defects, Kind::kGap).longest, from_seconds(10.5));
    ASSERT_EQ(loaded.pass.gyro.size(), 161U);
    for (std::size_t i = 0; i < loaded.pass.gyro.size(); ++i) {
      const auto& row = clean.gyro.rows[i < 60 ? i : i + 20];
      EXPECT_EQ(to_seconds(loaded.pass.gyro.t[i] - loaded.pass.settings.epoch), row[0]);
      EXPECT_EQ(loaded.pass.gyro.direction(i, 0).x(), row[1]);
    }
  }
}

// From then on the clock is another: which of its times is the right one does not show.
TEST_P(Screening, KeepsReadingsFromAClockThatSteps) {
  raw_.toml = replaced(raw_.toml, "duration_s = 90", "duration_s = 95");
  for (std::size_t i = 60; i < raw_.gyro.rows.size(); ++i) {
    raw_.gyro.rows[i][0] += 5;
  }
  EXPECT_EQ(load().pass.gyro.size(), 181U);
}

TEST_P(Screening, KeepsReadingsThatStandStillBetweenGaps) {
  for (std::size_t i = 0; i < raw_.gyro.rows.size(); ++i) {
    const auto& row = raw_.gyro.rows[60];
    std::copy(row.begin() + 1, row.end(), raw_.gyro.rows[i].begin() + 1);
  }
  std::erase_if(raw_.gyro.rows, [](const auto& row) { return std::fmod(row[0], 20) > 15; });
  EXPECT_EQ(load().pass.gyro.size(), raw_.gyro.rows.size());
}

TEST_P(Screening, LeavesOutTimesOutsideThePass) {
  raw_.star_tracker.rows[5][0] = -4;
  raw_.star_tracker.rows[6][0] = 1e300;
  raw_.star_tracker.rows[30][0] = 94;
  const LoadedPass loaded = load();
  EXPECT_EQ(loaded.pass.star_tracker.size(), 28U);
  EXPECT_EQ(only(loaded.defects, Kind::kTimeOutsidePass).count, 3);
}

TEST_P(Screening, CountsMissingValuesAndKeepsTheirRows) {
  raw_.gyro.rows[7][2] = kNaN;
  raw_.gyro.rows[8][4] = -std::numeric_limits<double>::infinity();
  raw_.star_tracker.rows[4][3] = kNaN;
  const LoadedPass loaded = load();
  EXPECT_EQ(loaded.pass.gyro.size(), 181U);
  EXPECT_EQ(loaded.pass.star_tracker.size(), 31U);
  ASSERT_EQ(loaded.defects.size(), 3U);
  EXPECT_EQ(loaded.defects[0].where, gyro_table() + ", gyro 1");
  EXPECT_EQ(loaded.defects[1].where, gyro_table() + ", gyro 2");
  EXPECT_EQ(loaded.defects[2].where, fix_table());
  for (const Defect& defect : loaded.defects) {
    EXPECT_EQ(defect.kind, Kind::kMissingValue);
    EXPECT_EQ(defect.count, 1);
  }
}

TEST_P(Screening, TellsAWrongNormFromAZeroOneAndFromATolerableOne) {
  raw_.gyro.rows[3] = {1.5, 1.0011, 0, 0, 0, 0, 0};
  raw_.gyro.rows[4] = {2.0, 1.0009, 0, 0, 0, 0.9989, 0};
  raw_.star_tracker.rows[2] = {6, 0, 0, 0, 0.998};
  raw_.star_tracker.rows[3] = {9, 0, 0, 0, 0};
  const LoadedPass loaded = load();
  EXPECT_EQ(loaded.pass.gyro.size(), 181U);
  std::vector<std::pair<std::string, Kind>> found;
  for (const Defect& defect : loaded.defects) {
    EXPECT_EQ(defect.count, 1);
    found.emplace_back(defect.where, defect.kind);
  }
  EXPECT_THAT(found, ElementsAre(std::pair(gyro_table() + ", gyro 1", Kind::kWrongNorm),
                                 std::pair(gyro_table() + ", gyro 2", Kind::kZeroNorm),
                                 std::pair(gyro_table() + ", gyro 2", Kind::kWrongNorm),
                                 std::pair(fix_table(), Kind::kZeroNorm), std::pair(fix_table(), Kind::kWrongNorm)));
}

TEST_P(Screening, CountsSignFlipsOfTheQuaternion) {
  for (std::size_t i = 10; i < 15; ++i) {
    std::for_each(raw_.star_tracker.rows[i].begin() + 1, raw_.star_tracker.rows[i].end(), [](double& v) { v = -v; });
  }
  const LoadedPass loaded = load();
  EXPECT_EQ(only(loaded.defects, Kind::kSignFlip).count, 2);
  EXPECT_EQ(loaded.pass.star_tracker.q_in_c[12].w(), -std::cos(5e-4 * 36));
}

TEST_P(Screening, AChangeOfHemisphereOverAGapIsNoFlip) {
  raw_.star_tracker.rows.erase(raw_.star_tracker.rows.begin() + 10, raw_.star_tracker.rows.begin() + 20);
  for (std::size_t i = 10; i < raw_.star_tracker.rows.size(); ++i) {
    std::for_each(raw_.star_tracker.rows[i].begin() + 1, raw_.star_tracker.rows[i].end(), [](double& v) { v = -v; });
  }
  const LoadedPass loaded = load();
  ASSERT_EQ(loaded.defects.size(), 1U);
  EXPECT_EQ(loaded.defects[0].kind, Kind::kGap);
}

TEST_P(Screening, CountsEightIdenticalSamplesAsStuckButNotSeven) {
  const auto freeze = [&](std::size_t first, std::size_t count, std::size_t gyro) {
    for (std::size_t i = first; i < first + count; ++i) {
      std::copy_n(raw_.gyro.rows[first].begin() + 1 + static_cast<std::ptrdiff_t>(gyro * 3), 3,
                  raw_.gyro.rows[i].begin() + 1 + static_cast<std::ptrdiff_t>(gyro * 3));
    }
  };
  freeze(20, 7, 0);
  EXPECT_THAT(load().defects, IsEmpty());
  freeze(40, 8, 1);
  freeze(173, 8, 1);
  const LoadedPass loaded = load();
  const Defect defect = only(loaded.defects, Kind::kStuckSamples);
  EXPECT_EQ(defect.where, gyro_table() + ", gyro 2");
  EXPECT_EQ(defect.count, 16);
  EXPECT_EQ(defect.total, std::chrono::seconds(7));
  EXPECT_EQ(defect.longest, std::chrono::milliseconds(3500));
  EXPECT_EQ(loaded.defects.size(), 1U);
}

TEST_P(Screening, MeasuresGapsInsideAndAtBothEnds) {
  auto& gyro = raw_.gyro.rows;
  gyro.erase(gyro.begin() + 170, gyro.end());          // 84.5 s … 90 s
  gyro.erase(gyro.begin() + 100, gyro.begin() + 110);  // 49.5 s … 55 s
  gyro.erase(gyro.begin(), gyro.begin() + 4);          // 0 s … 2 s
  const LoadedPass loaded = load();
  const Defect defect = only(loaded.defects, Kind::kGap);
  EXPECT_EQ(defect.count, 3);
  EXPECT_EQ(defect.total, std::chrono::seconds(13));
  EXPECT_EQ(defect.longest, std::chrono::milliseconds(5500));
  EXPECT_THAT(defect.text(), HasSubstr(": 3 gaps, 13 s in total, the longest 5.5 s, not filled; first: "));
}

TEST_P(Screening, OneAndAHalfPeriodsAreNoGapYet) {
  raw_.star_tracker.rows[10][0] += 1.5;
  EXPECT_THAT(load().defects, IsEmpty());
  raw_.star_tracker.rows[10][0] += 0.1;
  EXPECT_EQ(only(load().defects, Kind::kGap).count, 1);
}

TEST_P(Screening, ReportsAGyroThatIsSilentForAMinute) {
  for (std::size_t i = 20; i <= 140; ++i) {
    raw_.gyro.rows[i][4] = raw_.gyro.rows[i][5] = raw_.gyro.rows[i][6] = i % 2 == 0 ? kNaN : 0;
  }
  const Defect defect = only(load().defects, Kind::kSilentGyro);
  EXPECT_EQ(defect.count, 1);
  EXPECT_EQ(defect.where, gyro_table() + ", gyro 2");
  EXPECT_EQ(defect.longest, std::chrono::seconds(60));
}

TEST_P(Screening, RefusesAGyroThatIsSilentAllPassLong) {
  for (const double silence : {kNaN, 0.0}) {
    for (auto& row : raw_.gyro.rows) {
      row[4] = row[5] = row[6] = silence;
    }
    EXPECT_THAT(load_refused(), HasSubstr(gyro_table() + ", gyro 2 is silent all pass long"));
  }
}

/// As of a mapping that names the columns of one gyro twice.
TEST_P(Screening, RefusesAGyroThatIsACopyOfAnother) {
  for (auto& row : raw_.gyro.rows) {
    std::copy_n(row.begin() + 1, 3, row.begin() + 4);
  }
  const auto rows = raw_.gyro.rows.size();
  EXPECT_THAT(load_refused(),
              HasSubstr(fmt::format("gyro 2 has the readings of gyro 1, {} of {} to the last digit", rows, rows)));
  raw_.gyro.rows[0][4] = kNaN;
  EXPECT_THAT(load_refused(), HasSubstr(fmt::format("{} of {} to the last digit", rows - 1, rows - 1)));
  const RawPass clean = clean_pass();
  for (std::size_t i = 0; i < rows / 4; ++i) {
    raw_.gyro.rows[i] = clean.gyro.rows[i];
  }
  EXPECT_EQ(load_refused(), "");
}

TEST_P(Screening, RefusesTelemetryShorterThanAMinute) {
  raw_.gyro.rows.resize(119);
  EXPECT_THAT(load_refused(), HasSubstr("covers less than a minute"));
  raw_ = clean_pass();
  raw_.gyro.rows.resize(120);
  EXPECT_EQ(load_refused(), "");
}

TEST_P(Screening, RefusesSamplesThatAreAllOutsideThePass) {
  for (auto& row : raw_.gyro.rows) {
    row[0] += 1e6;
  }
  EXPECT_THAT(load_refused(), HasSubstr("has no samples with a time inside the pass"));
}

TEST_P(Screening, RefusesFixesOfWhichNotOneIsUsable) {
  for (auto& row : raw_.star_tracker.rows) {
    row[4] = kNaN;
  }
  EXPECT_THAT(load_refused(), HasSubstr("no fix at all"));
}

TEST_P(Screening, KeepsTheFirstPlacesAndTheWholeCount) {
  for (std::size_t i = 0; i < 20; ++i) {
    raw_.gyro.rows[2 * i][1] = kNaN;
  }
  const Defect defect = only(load().defects, Kind::kMissingValue);
  EXPECT_EQ(defect.count, 20);
  EXPECT_EQ(defect.first.size(), Defect::kPlaces);
  EXPECT_EQ(defect.text(), gyro_table() +
                               ", gyro 1: 20 rows with a missing value, kept for the estimator to reject; first: " +
                               (csv() ? "line 2 (t_s 0), line 4 (t_s 1), line 6 (t_s 2)."
                                      : "sample 0 (t_s 0), sample 2 (t_s 1), sample 4 (t_s 2)."));
}

TEST(Defect, EveryKindHasASentenceAndItsOwnName) {
  std::set<std::string> names;
  for (int kind = 0; kind <= static_cast<int>(Kind::kGap); ++kind) {
    const Defect defect{static_cast<Kind>(kind), "gyro.csv", 2, {{7, 5, kNaN}}, {}, {}};
    EXPECT_THAT(defect.text(), testing::StartsWith("gyro.csv: 2 ")) << kind;
    EXPECT_THAT(defect.text(), testing::EndsWith("; first: line 7.")) << kind;
    names.insert(name_of(defect.kind));
  }
  EXPECT_EQ(names.size(), static_cast<std::size_t>(Kind::kGap) + 1);
}

RC_GTEST_PROP(LongestIncreasing, KeepsTheMostRowsThatIncrease, ()) {
  const auto ticks = *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 30));
  RC_PRE(ticks.size() <= 60U);
  std::vector<Time> t;
  std::vector<std::size_t> rows;
  for (const int tick : ticks) {
    rows.push_back(rows.size());
    t.push_back(Time(Duration(tick)));
  }
  const auto kept = longest_increasing(t, rows);
  for (std::size_t i = 1; i < kept.size(); ++i) {
    RC_ASSERT(kept[i] > kept[i - 1]);
    RC_ASSERT(t[kept[i]] > t[kept[i - 1]]);
  }
  // The plain quadratic recursion, for comparison.
  std::vector<std::size_t> best(t.size(), 1);
  for (std::size_t i = 0; i < t.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (t[j] < t[i]) {
        best[i] = std::max(best[i], best[j] + 1);
      }
    }
  }
  RC_ASSERT(kept.size() == (best.empty() ? 0 : *std::ranges::max_element(best)));
}

}  // namespace
}  // namespace trihedron::io
