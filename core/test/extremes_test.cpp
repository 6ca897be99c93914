// Whatever a set-up holds, and whatever is read: a fault or a status, never an abort. On board an abort would lose the
// attitude.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "flight.hpp"

namespace trihedron {
namespace {

using test::Flight;

const std::vector<double> kExtremes = {0,
                                       -1,
                                       std::numeric_limits<double>::denorm_min(),
                                       1e-300,
                                       1e-30,
                                       1e10,
                                       1e30,
                                       1e100,
                                       std::numeric_limits<double>::max(),
                                       std::numeric_limits<double>::infinity(),
                                       std::numeric_limits<double>::quiet_NaN()};

/// Long enough for some fixes, and for the angles between the momenta after the last of them.
Flight short_flight() {
  Flight flight({.duration_s = 60});
  std::erase_if(flight.fixes,
                [&](const StarFix& fix) { return fix.t > flight.fixes.front().t + std::chrono::seconds(30); });
  return flight;
}

struct Seen {
  int started = 0;
  int used = 0;
  int lost = 0;
};

/// What becomes of the fixes and angles; each report has to have a status of its own for each event.
template <class OnBoard>
Seen seen_in(const Flight& flight, OnBoard& on_board) {
  Seen seen;
  const auto note = [&](const StepReport& report) {
    EXPECT_LT(static_cast<std::size_t>(report.fix.status), kFixStatuses);
    seen.started += report.fix.status == FixStatus::kStarted ? 1 : 0;
    seen.used += report.fix.status == FixStatus::kUsed ? 1 : 0;
    seen.lost +=
        report.fix.status == FixStatus::kEstimateLost || report.angles.status == FixStatus::kEstimateLost ? 1 : 0;
    static_cast<void>(on_board.navigation_attitude());
  };
  test::fly(flight, on_board, note);
  test::flush(on_board, note);
  return seen;
}

/// Flies with each thing of the set-up at each extreme; returns how often the estimate was lost.
template <class Given>
int losses(const Layout& layout, const std::vector<std::function<void(Given&, double)>>& things) {
  const Flight flight = short_flight();
  auto on_board = Given(layout).on_board();
  int losses = 0;
  for (const auto& put : things) {
    for (const double value : kExtremes) {
      Given given(layout);
      given.setup.angles_after = std::chrono::seconds(5);
      put(given, value);
      if (on_board->set_up(given.setup, given.prior, given.covariance, {})) {
        continue;
      }
      losses += seen_in(flight, *on_board).lost;
    }
  }
  // The same object, set up anew with what is right, works.
  const Given nominal(layout);
  EXPECT_FALSE(on_board->set_up(nominal.setup, nominal.prior, nominal.covariance, {}));
  const Seen seen = seen_in(flight, *on_board);
  EXPECT_EQ(seen.started, 1);
  EXPECT_GT(seen.used, 5);
  EXPECT_EQ(seen.lost, 0);
  return losses;
}

/// What all estimators have. All variances; those of the drift; one; a correlation; one mean; noise.
template <class Given>
std::vector<std::function<void(Given&, double)>> common_things() {
  return {[](Given& given, double value) { given.covariance.diagonal().setConstant(value); },
          [](Given& given, double value) { given.covariance.diagonal().template head<7>().setConstant(value); },
          [](Given& given, double value) { given.covariance(8, 8) = value; },
          [](Given& given, double value) { given.covariance(3, 1) = given.covariance(1, 3) = value; },
          [](Given& given, double value) { given.prior[0].drift_rad_s(0) = value; },
          [](Given& given, double value) { given.prior[1].drift_rad_s.setConstant(value); },
          [](Given& given, double value) { given.prior[1].C_c_b *= value; },
          [](Given& given, double value) { given.setup.readout_noise_rad[0] = value; },
          [](Given& given, double value) { given.setup.star_trackers[0].noise_rad.setConstant(value); },
          [](Given& given, double value) { given.setup.star_trackers[0].noise_rad.x() = value; },
          [](Given& given, double value) { given.setup.direction_random_walk_rad_sqrt_s = value; },
          [](Given& given, double value) { given.setup.gate_nis = value; },
          [](Given& given, double value) {
            given.setup.gate_nis = 1e-3;
            given.setup.student_t_freedom = value;
          }};
}

TEST(Extremes, SetUpOfThePapersFilterEndsInAFaultOrAStatus) {
  EXPECT_GT(losses<test::PaperGiven>({}, common_things<test::PaperGiven>()), 0);
}

TEST(Extremes, SetUpOfThePairEndsInAFaultOrAStatus) {
  EXPECT_GT(losses<test::PairGiven>({}, common_things<test::PairGiven>()), 0);
}

TEST(Extremes, SetUpWithAllFurtherStatesEndsInAFaultOrAStatus) {
  using Given = test::FullGiven;
  std::vector<std::function<void(Given&, double)>> things = {
      [](Given& given, double value) { given.covariance.diagonal().setConstant(value); },
      [](Given& given, double value) { given.setup.star_trackers[0].noise_rad.setConstant(value); },
      [](Given& given, double value) { given.setup.wandering_drift.sigma = value; },
      [](Given& given, double value) { given.setup.wandering_drift.time_s = value; },
      [](Given& given, double value) { given.setup.change.duration_s = value; },
      [](Given& given, double value) { given.setup.orbital_rate_rad_s = value; }};
  for (const FurtherStateKind& kind : kFurtherStateKinds) {
    things.emplace_back([state = kind.state](Given& given, double value) { given.setup.further_sigma[state] = value; });
  }
  EXPECT_GT(losses<Given>({.drift_model = vsh(1), .further = kAllFurtherStates}, things), 0);
}

/// Readings, fixes and times at their extremes, between good ones.
template <class Given>
void expect_work_after_extreme_readings() {
  Flight flight({.duration_s = 300});
  const auto on_board = Given().on_board();
  std::size_t next = 0;
  for (std::size_t i = 100; i < flight.samples.size() && next < kExtremes.size() * 4; i += 50, ++next) {
    const double value = kExtremes[next % kExtremes.size()];
    GyroSample& sample = flight.samples[i];
    if (next % 4 < 2) {
      sample.h_b[static_cast<int>(next % 2)](static_cast<int>(next % 3)) = value;
    } else {
      sample.h_b[static_cast<int>(next % 2)].setConstant(value);
    }
  }
  for (std::size_t i = 0; i < kExtremes.size(); ++i) {
    flight.fixes[4 + 4 * i].q_in_c.coeffs()(static_cast<int>(i % 4)) = kExtremes[i];
  }
  flight.samples[90].t = Time(-std::chrono::hours(24 * 365 * 100));
  flight.fixes[3].head = 7;
  flight.fixes[4].head = -1;
  const Seen seen = seen_in(flight, *on_board);
  EXPECT_EQ(seen.started, 1);
  EXPECT_EQ(seen.lost, 0);
  EXPECT_GT(seen.used, 20);
}

TEST(Extremes, ReadingsEndInAStatusAndDoNotSpoilTheEstimate) {
  expect_work_after_extreme_readings<test::PaperGiven>();
  expect_work_after_extreme_readings<test::PairGiven>();
}

// With a random walk that leaves nothing known the estimate is lost after each start, and the next fix starts it again.
TEST(Extremes, LostEstimateIsStartedAgainByTheNextFix) {
  const Flight flight = short_flight();
  test::PaperGiven given;
  given.setup.direction_random_walk_rad_sqrt_s = 1e200;
  const auto on_board = given.on_board();
  bool was_lost = false;
  int started_after_loss = 0;
  test::fly(flight, *on_board, [&](const StepReport& report) {
    if (report.fix.status == FixStatus::kEstimateLost) {
      was_lost = true;
      EXPECT_FALSE(on_board->estimator().started());
      EXPECT_FALSE(report.calibrated);
    }
    started_after_loss += was_lost && report.fix.status == FixStatus::kStarted ? 1 : 0;
  });
  EXPECT_TRUE(was_lost);
  EXPECT_GT(started_after_loss, 0);
}

}  // namespace
}  // namespace trihedron
