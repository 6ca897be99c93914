#include "calibrate/beside_outages.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "passes.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

constexpr int kOutages = 4;

/// Six hours with four outages of twenty minutes, after each of which, or before, the star tracker is off by so much,
/// less and less with five minutes.
const sim::SimulatedPass& undisturbed() {
  static const sim::SimulatedPass its = [] {
    Scenario scenario = scenario_in_eq1(3, std::chrono::hours(6));
    for (int n = 0; n < kOutages; ++n) {
      const double begin_s = 3600 + 4800 * n;
      scenario.star_tracker.outages.push_back({begin_s, begin_s + 1200});
    }
    return sim::simulate(scenario);
  }();
  return its;
}

Pass pass_with(const Eigen::Vector3d& error_rad, bool before) {
  Pass pass = undisturbed().pass;
  StarTrackerTelemetry& fixes = pass.star_tracker;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const double t_s = to_seconds(fixes.t[i] - pass.settings.epoch);
    for (int n = 0; n < kOutages; ++n) {
      const double begin_s = 3600 + 4800 * n;
      const double apart_s = before ? begin_s - t_s : t_s - (begin_s + 1200);
      if (apart_s >= 0 && apart_s < 1800) {
        const Eigen::Vector3d off_rad = error_rad * std::exp(-apart_s / 300);
        fixes.q_in_c[i] = fixes.q_in_c[i] * Rot<C, C>::exp(Vec<C>::assume(off_rad)).quaternion();
      }
    }
  }
  return pass;
}

bool has(const CalibrationRun& run, FindingCode code) {
  return std::ranges::any_of(run.calibration.verdict.findings, [&](const Finding& its) { return its.code == code; });
}

TEST(BesideOutages, AreLeftOutWhereTheStarTrackerIsOff) {
  for (const bool before : {false, true}) {
    const CalibrationRun run = calibrate(pass_with(Eigen::Vector3d(0, 10, 0) * kArcsecond, before), {});
    ASSERT_TRUE(run.beside_outages.has_value()) << before;
    EXPECT_EQ(run.beside_outages->before, before);
    EXPECT_EQ(run.beside_outages->outages, kOutages);
    EXPECT_NEAR(static_cast<double>(run.beside_outages->fixes), kOutages * 200, 5);
    EXPECT_EQ(run.beside_outages->minute, 0);
    EXPECT_NEAR(run.beside_outages->error_rad, 8 * kArcsecond, 2 * kArcsecond);
    EXPECT_TRUE(has(run, FindingCode::kErrorsBesideOutages));
    EXPECT_LT(nees_of(undisturbed().truth, run.calibration), 45);
  }
}

TEST(BesideOutages, AreUsedWhereItIsNot) {
  const CalibrationRun run = calibrate(undisturbed().pass, {});
  EXPECT_FALSE(run.beside_outages.has_value());
  EXPECT_EQ(run.fixes.size(), undisturbed().pass.star_tracker.size());
}

TEST(BesideOutages, AreUsedWhereTheBatchRefusesThePass) {
  Pass pass = undisturbed().pass;
  for (std::size_t i = pass.gyro.t.size() / 2; i < pass.gyro.t.size(); ++i) {
    pass.gyro.t[i] -= std::chrono::minutes(10);
  }
  EXPECT_FALSE(calibrate(pass, {}).beside_outages.has_value());
}

TEST(BesideOutages, AreThoseUpToTenMinutesFromThem) {
  const Pass& pass = undisturbed().pass;
  const auto left = [&](BesideOutages sides) {
    return std::ssize(pass.star_tracker.t) -
           std::ssize(without_fixes_beside_outages(pass, sides).value().star_tracker.t);
  };
  EXPECT_NEAR(static_cast<double>(left({.before = true, .after = false})), kOutages * 200, 5);
  EXPECT_EQ(left({}), left({.before = true, .after = false}) + left({.before = false, .after = true}));
  const auto t = without_fixes_beside_outages(pass).value().star_tracker.t;
  EXPECT_EQ(
      std::ranges::count_if(t, [&](Time its) { return std::abs(to_seconds(its - pass.settings.epoch) - 4200) < 1190; }),
      0);
}

TEST(BesideOutages, OfFewAreNotLookedAt) {
  Pass two = undisturbed().pass;
  const auto until = std::ranges::lower_bound(two.star_tracker.t, two.settings.epoch + std::chrono::minutes(200));
  const auto size = static_cast<std::size_t>(until - two.star_tracker.t.begin());
  two.star_tracker.t.resize(size);
  two.star_tracker.q_in_c.resize(size);
  EXPECT_FALSE(without_fixes_beside_outages(two).has_value());
  Pass with_further = undisturbed().pass;
  with_further.further_star_trackers.resize(1);
  EXPECT_FALSE(without_fixes_beside_outages(with_further).has_value());
}

}  // namespace
}  // namespace trihedron::ground
