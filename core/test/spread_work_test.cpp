// The work of a fix, spread over the samples after it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "flight.hpp"
#include "mission.hpp"

namespace trihedron {
namespace {

using Numbers = std::vector<double>;

void append(const Eigen::Ref<const Eigen::MatrixXd>& matrix, Numbers& numbers) {
  for (const double its : matrix.reshaped()) {
    numbers.push_back(its);
  }
}
void append(const std::optional<AttitudeSolution>& solution, Numbers& numbers) {
  numbers.push_back(solution.has_value() ? 1 : 0);
  if (solution) {
    append(solution->C_in_c.raw(), numbers);
    append(solution->covariance_rad2, numbers);
  }
}

/// All that came out of a flight, and what its end left.
struct Outcomes {
  std::vector<Numbers> fixes;
  std::vector<Numbers> angles;
  Numbers end;
  std::set<FixStatus> statuses;

  void note(const StepReport& report) {
    if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
      const FixReport& fix = report.fix;
      statuses.insert(fix.status);
      Numbers& its = fixes.emplace_back();
      its = {to_seconds(fix.t.time_since_epoch()),
             static_cast<double>(fix.status),
             fix.nis,
             fix.weight,
             static_cast<double>(fix.rejections_in_a_row),
             fix.jumped ? 1.0 : 0.0,
             static_cast<double>(fix.odd_gyro),
             report.corrected ? 1.0 : 0.0};
      append(fix.innovation, its);
      append(fix.innovation_covariance, its);
      append(report.calibrated, its);
      append(report.navigated, its);
    }
    if (report.angles.status != FixStatus::kNone) {
      angles.push_back({to_seconds(report.angles.t.time_since_epoch()), static_cast<double>(report.angles.status),
                        report.angles.nis, static_cast<double>(report.angles.rejections_in_a_row)});
    }
  }
  template <class OnBoard>
  void note_end(const OnBoard& on_board) {
    const auto& estimator = on_board.estimator();
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> root(estimator.error_layout().shared(),
                                                                                estimator.states());
    estimator.error_root(rows_of(root));
    append(root, end);
    for (int k = 0; k < estimator.layout().gyros; ++k) {
      for (const auto* its : {&estimator.gyros()[k], &on_board.navigator().gyros()[k]}) {
        append(its->h_in, end);
        append(its->drift_rad_s, end);
        append(its->C_c_b, end);
      }
    }
    if (on_board.navigator().started()) {
      append(std::optional(on_board.navigation_attitude().value()), end);
    }
  }
};

struct Events {
  std::vector<GyroSample> samples;
  std::vector<StarFix> fixes;
};

/// Without the fixes of the last ten seconds, after which everything has been dealt with.
Events ended(Events events) {
  const Time end = events.samples.back().t - std::chrono::seconds(10);
  std::erase_if(events.fixes, [&](const StarFix& fix) { return fix.t > end; });
  return events;
}

template <class Estimator>
Outcomes outcomes(const Events& events, const test::Given<Estimator>& given, CorrectionPolicy policy, int spread_over) {
  policy.spread_over = spread_over;
  const auto on_board = given.on_board(policy);
  Outcomes found;
  test::fly(events.samples, events.fixes, *on_board, [&](const StepReport& report) { found.note(report); });
  found.note_end(*on_board);
  return found;
}

template <class Estimator>
Outcomes expect_the_bits_of_all_at_once(const Events& events, const test::Given<Estimator>& given,
                                        const CorrectionPolicy& policy = {}) {
  const Outcomes at_once = outcomes(events, given, policy, 0);
  for (const int spread_over : {1, 3, 20}) {
    const Outcomes spread = outcomes(events, given, policy, spread_over);
    EXPECT_EQ(spread.fixes, at_once.fixes) << spread_over;
    EXPECT_EQ(spread.angles, at_once.angles) << spread_over;
    EXPECT_EQ(spread.end, at_once.end) << spread_over;
  }
  return at_once;
}

Events events_of(const test::FlightPlan& plan) {
  test::Flight flight(plan);
  return ended({std::move(flight.samples), std::move(flight.fixes)});
}

TEST(SpreadWork, HasTheBitsOfAllAtOnceAtEachRateOfFixes) {
  for (const auto& [interval_s, jitter_s] : {std::pair(3.0, 0.0), {3.0, 0.5}, {1.0, 0.0}, {0.7, 0.6}}) {
    const Events events =
        events_of({.duration_s = 900, .fix_offset_s = 0.03, .fix_interval_s = interval_s, .fix_jitter_s = jitter_s});
    const auto all = expect_the_bits_of_all_at_once(events, test::PairGiven());
    EXPECT_EQ(all.fixes.size(), events.fixes.size());
  }
}

TEST(SpreadWork, HasTheBitsOfAllAtOnceAtEachKindOfCorrection) {
  const Events events = events_of({.duration_s = 900, .fix_jitter_s = 0.5});
  for (const Duration interval :
       {CorrectionPolicy::kEveryFix, CorrectionPolicy::kOnlyFirst, Duration(std::chrono::seconds(100))}) {
    for (const bool take_parameters : {true, false}) {
      expect_the_bits_of_all_at_once(events, test::PairGiven(), {interval, take_parameters});
    }
  }
  expect_the_bits_of_all_at_once(events, test::PairGiven(), {.navigate = false});
  expect_the_bits_of_all_at_once(events, test::PaperGiven());
}

TEST(SpreadWork, HasTheBitsOfAllAtOnceWhateverBecomesOfAFix) {
  // Single outliers; none for two minutes; and from then on all of them off by a degree, twice.
  Events events = events_of({.duration_s = 2400, .fix_jitter_s = 0.5});
  std::erase_if(events.fixes, [](const StarFix& fix) {
    const double t_s = to_seconds(fix.t.time_since_epoch());
    return t_s > 400 && t_s < 520;
  });
  std::mt19937 random(1);
  for (StarFix& fix : events.fixes) {
    const double t_s = to_seconds(fix.t.time_since_epoch());
    const bool is_outlier = t_s > 100 && random() % 20 == 0;
    const double off_rad = (is_outlier ? 0.1 : 0) + (t_s > 800 ? 0.017 : 0) - (t_s > 1000 ? 0.034 : 0);
    fix.q_in_c = fix.q_in_c * Eigen::Quaterniond(test::turn(off_rad, -off_rad, 0));
  }
  test::PairGiven given;
  given.setup.reopen_after_jump_rejections = 20;
  const auto all = expect_the_bits_of_all_at_once(events, given, {.interval = std::chrono::seconds(60)});
  for (const FixStatus status : {FixStatus::kStarted, FixStatus::kUsed, FixStatus::kRejectedByGate,
                                 FixStatus::kUsedAfterReopening, FixStatus::kRestarted}) {
    EXPECT_TRUE(all.statuses.contains(status)) << static_cast<int>(status);
  }
  EXPECT_GT(all.angles.size(), 10U);
  given.setup.student_t_freedom = 4;
  expect_the_bits_of_all_at_once(events, given);
}

TEST(SpreadWork, HasTheBitsOfAllAtOnceWithMoreGyrosAndStarTrackersAtOtherRates) {
  for (const double gyro_period_s : {0.08, 0.125, 1.0}) {
    const test::Mission mission({.layout = {.gyros = 3, .star_trackers = 2}, .gyro_period_s = gyro_period_s});
    expect_the_bits_of_all_at_once(ended({mission.samples, mission.fixes}), mission.given);
  }
}

/// From the fix on: the navigator goes on as if there was none, until it is corrected.
TEST(SpreadWork, LeavesTheAttitudeThatOfBeforeTheFix) {
  const Events events = events_of({.duration_s = 600});
  const auto with = test::PairGiven().on_board({.interval = CorrectionPolicy::kEveryFix, .spread_over = 20});
  const std::size_t first = 8 * 300;
  Events before = events;
  before.samples.resize(first);
  before.fixes.resize(first / 24);
  test::fly(before.samples, before.fixes, *with);
  const auto without = std::make_unique<PairOnBoard>(*with);
  int alike = 0;
  StepReport report;
  with->on_fix(events.fixes[first / 24]);
  for (std::size_t i = first; report.fix.t != events.fixes[first / 24].t || report.fix.status == FixStatus::kPending;
       ++i) {
    ASSERT_LT(i, first + 60);
    report = with->on_gyro(events.samples[i]);
    without->on_gyro(events.samples[i]);
    const auto its = with->navigation_attitude().value();
    const auto expected = without->navigation_attitude().value();
    if (with->corrected_t() == without->corrected_t()) {
      ++alike;
      EXPECT_EQ(its.C_in_c.raw(), expected.C_in_c.raw());
      // The sensitivities, which the estimator integrates, wait for it: up to two seconds of drift errors.
      EXPECT_LT((its.covariance_rad2 - expected.covariance_rad2).norm(), 0.02 * expected.covariance_rad2.norm());
    } else {
      EXPECT_EQ(with->corrected_t(), events.fixes[first / 24].t);
      EXPECT_NE(its.C_in_c.raw(), expected.C_in_c.raw());
    }
  }
  EXPECT_TRUE(report.corrected);
  EXPECT_GT(alike, 16);
}

TEST(SpreadWork, OfFixesThatComeFasterThanItIsDoneLosesNone) {
  for (const double interval_s : {0.125, 0.05}) {
    const Events events = events_of({.duration_s = 60, .fix_offset_s = 0.02, .fix_interval_s = interval_s});
    // With a correction at each fix: without one the navigator's attitude at a fix that had to wait differs by
    // rounding.
    const CorrectionPolicy policy{.interval = CorrectionPolicy::kEveryFix};
    const Outcomes at_once = outcomes(events, test::PairGiven(), policy, 0);
    const Outcomes spread = outcomes(events, test::PairGiven(), policy, 20);
    EXPECT_EQ(at_once.fixes.size(), events.fixes.size());
    EXPECT_EQ(spread.fixes, at_once.fixes);
    EXPECT_EQ(spread.end, at_once.end);
  }
}

/// A clock that is set back at any time after a fix: what was being dealt with is reported before.
TEST(SpreadWork, IsDoneBeforeTheClockIsBelievedToBeSetBack) {
  int during = 0;
  for (int samples = 8 * 60; samples < 8 * 60 + 24; ++samples) {
    Events events = events_of({.duration_s = 100});
    const Time set_back_t = events.samples[static_cast<std::size_t>(samples)].t;
    const auto set_back = [&](auto& its) { its.t -= its.t >= set_back_t ? std::chrono::seconds(10) : Duration(0); };
    std::for_each(events.samples.begin(), events.samples.end(), set_back);
    std::erase_if(events.fixes, [&](const StarFix& fix) { return fix.t >= set_back_t; });
    const auto on_board = test::PairGiven().on_board({.interval = CorrectionPolicy::kEveryFix, .spread_over = 20});
    const auto at_once = test::PairGiven().on_board({.interval = CorrectionPolicy::kEveryFix});
    Outcomes outcome;
    Outcomes expected;
    auto fix = events.fixes.begin();
    for (const GyroSample& sample : events.samples) {
      const StepReport report = on_board->on_gyro(sample);
      outcome.note(report);
      expected.note(at_once->on_gyro(sample));
      during += report.sample == SampleStatus::kRejectedOutOfOrder && report.fix.status == FixStatus::kUsed ? 1 : 0;
      if (report.sample == SampleStatus::kUsedAfterClockSetBack) {
        EXPECT_EQ(report.fix.status, FixStatus::kNone);
      }
      for (; fix != events.fixes.end() && fix->t <= sample.t; ++fix) {
        outcome.note(on_board->on_fix(*fix));
        expected.note(at_once->on_fix(*fix));
      }
    }
    outcome.note_end(*on_board);
    expected.note_end(*at_once);
    EXPECT_EQ(outcome.fixes, expected.fixes) << samples;
    EXPECT_EQ(outcome.end, expected.end) << samples;
  }
  EXPECT_GT(during, 10);
}

/// The clock is set back by 10 s, from sample `first` on.
void set_back(std::vector<GyroSample>& samples, std::size_t first) {
  for (std::size_t i = first; i < samples.size(); ++i) {
    samples[i].t -= std::chrono::seconds(10);
  }
}

TEST(SpreadWork, BeginsNoFixWhileItIsInDoubtWhetherTheClockHasBeenSetBack) {
  // At 62.5 s the fix at 60 s is half done; another one comes late and is due at once, and then the clock is set
  // back.
  Events events = events_of({.duration_s = 80});
  const std::size_t first = 8 * 62 + 5;
  set_back(events.samples, first);
  const auto on_board = test::PairGiven().on_board({.spread_over = 20});
  Events before = events;
  before.samples.resize(first);
  before.fixes.resize(21);
  test::fly(before.samples, before.fixes, *on_board);
  const StarFix late{Time(from_seconds(60.3)), Eigen::Quaterniond(test::Flight::attitude(60.3, 0.5))};
  ASSERT_EQ(on_board->on_fix(late).fix.status, FixStatus::kPending);
  std::vector<Time> dealt_with;
  for (std::size_t i = first; i < first + 20; ++i) {
    const StepReport report = on_board->on_gyro(events.samples[i]);
    if (report.fix.status != FixStatus::kNone) {
      dealt_with.push_back(report.fix.t);
    }
    EXPECT_EQ(report.sample, i < first + 15    ? SampleStatus::kRejectedOutOfOrder
                             : i == first + 15 ? SampleStatus::kUsedAfterClockSetBack
                                               : SampleStatus::kUsed);
    EXPECT_EQ(report.fixes_dropped, i == first + 15 ? 1 : 0);
  }
  EXPECT_EQ(dealt_with, std::vector{events.fixes[20].t});
}

TEST(SpreadWork, OfABurstOfFixesIsDoneWhenTheClockIsSetBack) {
  // Without fixes the angles are due at 78 s, and wait until 82.2 s. Before that the clock is set back, and in the last
  // moment fixes come that are due; the first of them is an outlier, so that the angles are used with it.
  Events events = events_of({.duration_s = 120});
  const std::size_t first = 8 * 81 + 4;
  set_back(events.samples, first);
  events.fixes.resize(7);
  const auto on_board = test::PairGiven().on_board({.spread_over = 20});
  Events before = events;
  before.samples.resize(first);
  test::fly(before.samples, before.fixes, *on_board);
  for (std::size_t i = first; i < first + 15; ++i) {
    EXPECT_EQ(on_board->on_gyro(events.samples[i]).fix.status, FixStatus::kNone);
  }
  constexpr int kBurst = 7;
  const Time burst_t(from_seconds(79.4));
  for (int i = 0; i < kBurst; ++i) {
    const Time t = burst_t + i * std::chrono::milliseconds(80);
    const Eigen::Matrix3d attitude = test::Flight::attitude(to_seconds(t.time_since_epoch()), 0.5);
    EXPECT_EQ(on_board->on_fix({t, Eigen::Quaterniond(attitude * test::turn(i == 0 ? 0.01 : 0, 0, 0))}).fix.status,
              FixStatus::kPending);
  }
  const StepReport report = on_board->on_gyro(events.samples[first + 15]);
  EXPECT_EQ(report.sample, SampleStatus::kUsedAfterClockSetBack);
  EXPECT_EQ(report.fixes_dropped, kBurst - 1);
  EXPECT_EQ(report.fix.status, FixStatus::kRejectedByGate);
  EXPECT_EQ(report.angles.status, FixStatus::kUsed);
  // By the clock as it is now.
  EXPECT_EQ(report.fix.t - events.samples[first + 15].t, burst_t - events.samples[first - 1].t);
}

TEST(SpreadWork, TakesAFixThatComesWhileTheAnglesAreDealtWith) {
  const Events events = events_of({.duration_s = 100});
  const auto without = test::PairGiven().on_board({.spread_over = 20});
  int looks = 0;
  for (std::size_t i = 0; i < events.samples.size(); ++i) {
    looks += without->on_gyro(events.samples[i]).angles.status == FixStatus::kUsed ? 1 : 0;
    if (i % 24 == 0 && i <= 8 * 18) {
      without->on_fix(events.fixes[i / 24]);
    }
    if (i < 8 * 83 || i >= 8 * 86) {  // the time of one look and the next
      continue;
    }
    const auto with = std::make_unique<PairOnBoard>(*without);
    const double t_s = 0.125 * static_cast<double>(i);
    const Time t = events.samples[i].t;
    EXPECT_EQ(with->on_fix({t, Eigen::Quaterniond(test::Flight::attitude(t_s, 0.5))}).fix.status, FixStatus::kPending);
    FixReport fix;
    for (std::size_t next = i + 1; next < i + 50; ++next) {
      const StepReport report = with->on_gyro(events.samples[next]);
      fix = report.fix.status != FixStatus::kNone ? report.fix : fix;
    }
    EXPECT_EQ(fix.status, FixStatus::kUsed) << i;
    EXPECT_EQ(fix.t, t);
  }
  EXPECT_GE(looks, 4);
}

TEST(SpreadWork, OfAFixWhoseGyroSticksAfterItHasNoAttitudeOfTheNavigatorThere) {
  // The fix at 60.5 s waits for that at 60 s, until 62.5 s. By then gyro 2 is known to have stuck.
  Events events = events_of({.duration_s = 80});
  events.fixes.resize(21);
  events.fixes.push_back({Time(from_seconds(60.5)), Eigen::Quaterniond(test::Flight::attitude(60.5, 0.5))});
  for (std::size_t i = 8 * 62 + 2; i < 8 * 72; ++i) {
    events.samples[i].h_b[1] = events.samples[8 * 62 + 2].h_b[1];
  }
  const auto on_board = test::PairGiven().on_board({.interval = std::chrono::hours(1), .spread_over = 20});
  std::vector<StepReport> reports;
  test::fly(events.samples, events.fixes, *on_board, [&](const StepReport& report) {
    if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
      reports.push_back(report);
    }
  });
  ASSERT_EQ(reports.size(), 22U);
  EXPECT_TRUE(reports[20].navigated);
  EXPECT_EQ(reports[21].fix.status, FixStatus::kUsed);
  EXPECT_TRUE(reports[21].calibrated);
  EXPECT_FALSE(reports[21].navigated);
  EXPECT_LT(reports[21].t, Time(std::chrono::seconds(72)));  // while the gyro sticks
}

/// How long after the fix at 80 s its report comes, where fixes come each second from `from_s` on, and each
/// other second before.
double delay_at_80_s(double from_s) {
  Events events = events_of({.duration_s = 100, .fix_interval_s = 1});
  const Time looked_at = events.fixes[80].t;
  std::erase_if(events.fixes, [&](const StarFix& fix) {
    const double t_s = to_seconds(fix.t.time_since_epoch());
    return t_s < from_s && std::fmod(t_s, 2) != 0;
  });
  const auto on_board = test::PairGiven().on_board({.interval = CorrectionPolicy::kEveryFix, .spread_over = 20});
  double delay_s = 0;
  test::fly(events.samples, events.fixes, *on_board, [&](const StepReport& report) {
    delay_s =
        report.sample != SampleStatus::kNone && report.fix.t == looked_at ? to_seconds(report.t - looked_at) : delay_s;
  });
  return delay_s;
}

TEST(SpreadWork, ThatBeginsLateSinceFixesComeFasterIsInTimeAgainAfterSomeOfThem) {
  EXPECT_GT(delay_at_80_s(0), 1.4);
  EXPECT_GT(delay_at_80_s(79), delay_at_80_s(0));
  EXPECT_EQ(delay_at_80_s(60), delay_at_80_s(0));
}

TEST(SpreadWork, OverMoreSamplesThanTheBufferHoldsIsThatOverTheMost) {
  const Events events = events_of({.duration_s = 120});
  const Outcomes most = outcomes(events, test::PairGiven(), {}, CorrectionPolicy::kMostSpread);
  EXPECT_EQ(outcomes(events, test::PairGiven(), {}, 10'000).fixes, most.fixes);
}

/// Samples that come much faster than the set-up says would fill the buffer before they are used.
TEST(SpreadWork, OfSamplesFasterThanTheSetUpSaysHasRoom) {
  const Events events = events_of({.duration_s = 300, .fix_interval_s = 4});
  for (const int period_s : {1, 5}) {
    test::PairGiven given;
    given.setup.gyro_period = std::chrono::seconds(period_s);
    const auto all = expect_the_bits_of_all_at_once(events, given, {.interval = CorrectionPolicy::kEveryFix});
    EXPECT_TRUE(all.statuses.contains(FixStatus::kUsed));
  }
}

TEST(SpreadWork, RefusesAFixThatIsRepeatedWhileItIsDealtWith) {
  const Events events = events_of({.duration_s = 60});
  const auto on_board = test::PairGiven().on_board({.spread_over = 20});
  int refused = 0;
  test::fly(events.samples, events.fixes, *on_board, [&](const StepReport& report) {
    if (report.sample == SampleStatus::kUsed && report.t > events.fixes[8].t && report.t < events.fixes[9].t) {
      EXPECT_EQ(on_board->on_fix(events.fixes[8]).fix.status, FixStatus::kRejectedOutOfOrder);
      ++refused;
    }
  });
  EXPECT_EQ(refused, 23);
}

TEST(SpreadWork, IsFinishedByFlushAndCarryOn) {
  const Events events = events_of({.duration_s = 60});
  for (const bool flushes : {true, false}) {
    const auto on_board = test::PairGiven().on_board({.spread_over = 20});
    Events some = events;
    some.samples.resize(8 * 33 + 16);  // the fix at 33 s became due half a second ago
    some.fixes.resize(12);
    test::fly(some.samples, some.fixes, *on_board);
    const StepReport report = flushes ? on_board->flush() : on_board->carry_on();
    EXPECT_EQ(report.fix.t, some.fixes.back().t);
    EXPECT_EQ(report.fix.status, FixStatus::kUsed);
    EXPECT_EQ((flushes ? on_board->flush() : on_board->carry_on()).fix.status, FixStatus::kNone);
  }
}

}  // namespace
}  // namespace trihedron
