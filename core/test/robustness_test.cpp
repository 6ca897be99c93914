// What goes wrong in flight, and that it does not take the calibration with it: flights with one thing wrong against
// the same flights without.

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numbers>
#include <vector>

#include "flight.hpp"
#include "trihedron/core/cycle.hpp"
#include "trihedron/core/invariant_estimator.hpp"

namespace trihedron {
namespace {

constexpr double kArcsecond = std::numbers::pi / 180 / 3600;
constexpr double kDegree = std::numbers::pi / 180;

/// As nominal_setup(), for any estimator of a pair.
template <class Estimator>
typename Estimator::Setup nominal() {
  typename Estimator::Setup setup;
  static_cast<CalibrationSetup<Esg7, 2>&>(setup) = test::nominal_setup();
  return setup;
}

template <class Estimator>
std::unique_ptr<Cycle<Estimator>> make_cycle(const typename Estimator::Setup& setup) {
  return std::make_unique<Cycle<Estimator>>(Cycle<Estimator>::create(setup, {}).value());
}

/// What was done with each fix.
template <class Cycle>
std::vector<typename Cycle::Report> fly(const test::Flight& flight, Cycle& cycle) {
  std::vector<typename Cycle::Report> fixes;
  const auto note = [&](const auto& report) {
    if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
      fixes.push_back(report);
    }
  };
  test::fly(flight, cycle, note);
  for (auto report = cycle.flush(); report.fix.status != FixStatus::kNone; report = cycle.flush()) {
    note(report);
  }
  return fixes;
}

template <class Report>
long count(const std::vector<Report>& fixes, FixStatus status) {
  return std::count_if(fixes.begin(), fixes.end(), [&](const Report& report) { return report.fix.status == status; });
}

/// Turns the fixes of an interval by an angle about x.
void turn_fixes(test::Flight& flight, std::size_t begin, std::size_t end, double angle_rad) {
  for (std::size_t i = begin; i < std::min(end, flight.fixes.size()); ++i) {
    flight.fixes[i].q_in_c =
        flight.fixes[i].q_in_c * Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitX()));
  }
}

/// Largest error of the momenta at the end, rad.
template <class Cycle>
double momentum_error(const Cycle& cycle, const test::Flight& flight) {
  double worst = 0;
  for (int k = 0; k < 2; ++k) {
    worst = std::max(worst, angle_between<double>(cycle.estimator().gyros()[k].h_in, flight.truth[k].h_in));
  }
  return worst;
}

// ---- A star tracker that lies

template <class Estimator>
class LyingTracker : public testing::Test {};
using Estimators = testing::Types<PaperEstimator<Esg7>, InvariantEstimator<Esg7, 2>>;
TYPED_TEST_SUITE(LyingTracker, Estimators);

TYPED_TEST(LyingTracker, IsNotBelievedForMinutes) {
  constexpr std::size_t kFirst = 300;
  for (const std::size_t length : {std::size_t{40}, std::size_t{200}}) {  // 2 and 10 min
    test::Flight flight({.duration_s = 2700});
    turn_fixes(flight, kFirst, kFirst + length, 3 * kDegree);
    auto cycle = make_cycle<TypeParam>(nominal<TypeParam>());
    const auto fixes = fly(flight, *cycle);
    EXPECT_EQ(count(fixes, FixStatus::kRejectedByGate), static_cast<long>(length));
    EXPECT_EQ(count(fixes, FixStatus::kUsed), static_cast<long>(flight.fixes.size() - length) - 1);
    EXPECT_TRUE(fixes[kFirst + length - 1].fix.jumped);
    EXPECT_FALSE(fixes[kFirst + length].fix.jumped);
    // As if there had been no fixes at all in that time.
    test::Flight gap({.duration_s = 2700});
    gap.fixes.erase(gap.fixes.begin() + kFirst, gap.fixes.begin() + kFirst + static_cast<long>(length));
    auto other = make_cycle<TypeParam>(nominal<TypeParam>());
    fly(gap, *other);
    EXPECT_LT(momentum_error(*cycle, flight), momentum_error(*other, gap) + 0.05 * kArcsecond);
  }
}

TYPED_TEST(LyingTracker, IsBelievedInTheEnd) {
  // Turned in its mount for good, by more than drift can make: not locked out.
  test::Flight flight({.duration_s = 2700});
  turn_fixes(flight, 300, flight.fixes.size(), kDegree);
  auto cycle = make_cycle<TypeParam>(nominal<TypeParam>());
  const auto fixes = fly(flight, *cycle);
  EXPECT_EQ(std::count_if(fixes.begin(), fixes.end(), [](const auto& report) { return report.fix.jumped; }), 399);
  EXPECT_EQ(fixes[300 + 399].fix.status, FixStatus::kUsedAfterReopening);
  EXPECT_EQ(fixes.back().fix.status, FixStatus::kUsed);
}

TYPED_TEST(LyingTracker, IsNotTakenForOneWhenTheModelGoesWrongStepByStep) {
  // All that is seen turns by 1e-5 rad/s, which no parameter explains: 6″ a minute.
  test::Flight flight({.duration_s = 1800});
  for (std::size_t i = 300; i < flight.fixes.size(); ++i) {
    turn_fixes(flight, i, i + 1, std::min(1e-5 * 3 * static_cast<double>(i - 300), 2e-3));
  }
  auto cycle = make_cycle<TypeParam>(nominal<TypeParam>());
  const auto fixes = fly(flight, *cycle);
  EXPECT_GE(count(fixes, FixStatus::kUsedAfterReopening), 1);
  int longest = 0;
  for (const auto& report : fixes) {
    longest = std::max(longest, report.fix.rejections_in_a_row);
  }
  EXPECT_EQ(longest, 19);
  EXPECT_EQ(fixes.back().fix.status, FixStatus::kUsed);
}

TYPED_TEST(LyingTracker, OfTheFirstFixOnlyIsOutvotedByThoseAfterIt) {
  test::Flight flight({.duration_s = 1800});
  turn_fixes(flight, 0, 1, 3 * kDegree);
  auto cycle = make_cycle<TypeParam>(nominal<TypeParam>());
  const auto fixes = fly(flight, *cycle);
  EXPECT_EQ(count(fixes, FixStatus::kRejectedByGate), 19);
  EXPECT_EQ(count(fixes, FixStatus::kUsedAfterReopening), 1);
  EXPECT_LT(momentum_error(*cycle, flight), 60 * kArcsecond);
}

}  // namespace
}  // namespace trihedron
