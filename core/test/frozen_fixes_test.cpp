#include "trihedron/core/frozen_fixes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "flight.hpp"

namespace trihedron {
namespace {

using Pair = test::PairEstimator;
using Full = test::FullEstimator;

TEST(ShowsTurn, ByMoreThanTwoFixesDiffer) {
  const double sigma_rad = 1e-5;
  const Eigen::Matrix3d R_c = sigma_rad * sigma_rad * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d h_c(0, 0, 1);
  const auto after = [&](double x_rad, double reading_rad) {
    return shows_turn(h_c, test::turn(x_rad, 0, 0).transpose() * h_c, R_c, reading_rad, 30);
  };
  // √30 of √2 sigmas of the fixes, and of the readings.
  EXPECT_FALSE(after(0, 1e-9));
  EXPECT_FALSE(after(7.6 * sigma_rad, 1e-9));
  EXPECT_TRUE(after(7.9 * sigma_rad, 1e-9));
  EXPECT_FALSE(after(7.9 * sigma_rad, sigma_rad));
  EXPECT_TRUE(after(9.6 * sigma_rad, sigma_rad));
  EXPECT_TRUE(after(1, sigma_rad));
  EXPECT_TRUE(after(3, sigma_rad));
  EXPECT_TRUE(after(std::numeric_limits<double>::quiet_NaN(), sigma_rad));
}

TEST(ShowsTurn, KnowsAboutWhichAxisTheStarTrackerIsNoisy) {
  const Eigen::Matrix3d R_c = test::Flight::kTracker_rad.cwiseAbs2().asDiagonal();
  const Eigen::Vector3d h_c(1, 0, 0);
  const double turn_rad = 2e-4;
  EXPECT_TRUE(shows_turn(h_c, test::turn(0, turn_rad, 0) * h_c, R_c, 1e-6, 30));
  EXPECT_FALSE(shows_turn(h_c, test::turn(0, 0, turn_rad) * h_c, R_c, 1e-6, 30));
}

/// A star tracker that is looked at directly, on a body that turns about x.
class Looked : public testing::Test {
 protected:
  Looked() : gyros_(test::PairGiven().prior), setup_(test::nominal_setup()) {}

  /// The fix of the attitude at `q_rad`, on a body that has turned to `body_rad`.
  bool look(double t_s, double q_rad, double body_rad, int head = 0, GyroMask used = all_gyros(2)) {
    StarFix fix{Time(from_seconds(t_s)), Eigen::Quaterniond(test::turn(q_rad, 0, 0)), head};
    FixReadings readings;
    readings.used = used;
    readings.h_b[0] = test::turn(body_rad, 0, 0).transpose() * Eigen::Vector3d::UnitX();  // sees nothing of it
    readings.h_b[1] = test::turn(body_rad, 0, 0).transpose() * Eigen::Vector3d::UnitY();
    return frozen_.look_at(fix, readings, setup_, gyros_);
  }

  test::PairGyros gyros_;
  CalibrationSetup setup_;
  FrozenFixes<2, 2> frozen_{1e-6};
};

TEST_F(Looked, IsFrozenUntilItsQuaternionChanges) {
  EXPECT_FALSE(look(0, 0.1, 0.1));
  EXPECT_FALSE(look(3, 0.2, 0.2));
  EXPECT_TRUE(look(6, 0.2, 0.3));
  EXPECT_TRUE(look(9, 0.2, 0.2));  // the body has turned back
  EXPECT_FALSE(look(12, 0.3, 0.3));
  EXPECT_FALSE(look(15, 0.3, 0.3));
  EXPECT_TRUE(look(18, 0.3, 0.4));
}

TEST_F(Looked, IsFrozenOnEachHeadByItself) {
  EXPECT_FALSE(look(0, 0.1, 0.1, 0));
  EXPECT_FALSE(look(0, 0.1, 0.1, 1));
  EXPECT_TRUE(look(3, 0.1, 0.2, 1));
  EXPECT_FALSE(look(3, 0.2, 0.2, 0));
  EXPECT_TRUE(look(6, 0.1, 0.3, 1));
}

TEST_F(Looked, IsNotFrozenByReadingsOfAGyroThatIsNotUsed) {
  GyroMask first = all_gyros(1);
  EXPECT_FALSE(look(0, 0.1, 0.1, 0, first));
  EXPECT_FALSE(look(3, 0.1, 0.2));  // only the first can be compared
  EXPECT_FALSE(look(6, 0.2, 0.2));
  EXPECT_FALSE(look(9, 0.2, 0.3, 0, first));
  EXPECT_TRUE(look(12, 0.2, 0.3));
}

TEST_F(Looked, IsNotFrozenByDrift) {
  EXPECT_FALSE(look(0, 0.1, 0.1));
  EXPECT_FALSE(look(3600, 0.1, 0.1 + 3e-3));
  EXPECT_TRUE(look(3603, 0.1, 0.1 + 0.03));
}

TEST_F(Looked, StaysFrozenWhenTheClockIsSetBack) {
  EXPECT_FALSE(look(10000, 0.1, 0.1));
  frozen_.set_clock(-std::chrono::seconds(9000));
  // By the time of before, drift over hours would explain it.
  EXPECT_TRUE(look(1003, 0.1, 0.11));
  frozen_.forget();
  EXPECT_FALSE(look(1006, 0.1, 0.3));
}

/// Fixes of this interval, the first excluded, repeat the first.
void freeze(std::vector<StarFix>& fixes, std::size_t first, std::size_t last) {
  for (std::size_t i = first + 1; i <= last; ++i) {
    fixes[i].q_in_c.coeffs() = (i % 3 == 0 ? -1 : 1) * fixes[first].q_in_c.coeffs();  // of either sign
  }
}

template <class Estimator>
class FrozenTracker : public testing::Test {};
using AllEstimators = testing::Types<PaperEstimator, Pair, Full>;
TYPED_TEST_SUITE(FrozenTracker, AllEstimators);

TYPED_TEST(FrozenTracker, IsAsIfThereWereNoFixes) {
  constexpr std::size_t kFirst = 300;
  for (const std::size_t length : {std::size_t{1}, std::size_t{23}, std::size_t{400}}) {  // 3 s, 70 s, 20 min
    test::Flight flight({.duration_s = 2700});
    test::Flight gap = flight;
    freeze(flight.fixes, kFirst, kFirst + length);
    gap.fixes.erase(gap.fixes.begin() + kFirst + 1, gap.fixes.begin() + kFirst + 1 + static_cast<long>(length));
    for (const int spread : {0, 20}) {
      CorrectionPolicy policy{.interval = std::chrono::minutes(5)};
      policy.spread_over = spread;
      const test::Given<TypeParam> given;
      const auto on_board = given.on_board(policy);
      std::vector<FixStatus> statuses;
      const auto note = [&](const StepReport& report) {
        if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
          statuses.push_back(report.fix.status);
        }
      };
      test::fly(flight, *on_board, note);
      test::flush(*on_board, note);
      ASSERT_EQ(statuses.size(), flight.fixes.size());
      for (std::size_t i = 1; i < statuses.size(); ++i) {
        const bool frozen = i > kFirst && i <= kFirst + length;
        EXPECT_EQ(statuses[i], frozen ? FixStatus::kRejectedFrozen : FixStatus::kUsed) << i;
      }
      const auto other = test::flown(gap, given, policy);
      for (int k = 0; k < 2; ++k) {
        EXPECT_LT(
            angle_between<double>(on_board->estimator().gyros()[k].h_in, flight.truth[k].h_in),
            angle_between<double>(other->estimator().gyros()[k].h_in, flight.truth[k].h_in) + 0.05 * test::kArcsecond);
      }
    }
  }
}

TYPED_TEST(FrozenTracker, RoundACorrectionDoesNotMoveTheNavigator) {
  test::Flight flight({.duration_s = 1500});
  freeze(flight.fixes, 180, 220);  // from 540 to 660 s; a correction is due at 600 s
  const auto on_board = test::Given<TypeParam>().on_board({.interval = std::chrono::minutes(10)});
  std::vector<double> corrected_s;
  double worst = 0;
  std::size_t sample = 0;
  test::fly(flight, *on_board, [&](const StepReport& report) {
    if (report.corrected) {
      corrected_s.push_back(to_seconds(report.fix.t.time_since_epoch()));
    }
    if (report.sample != SampleStatus::kUsed) {
      return;
    }
    if (on_board->navigator().started()) {
      const auto attitude = on_board->navigation_attitude();
      ASSERT_TRUE(attitude);
      const Eigen::Vector3d error = test::attitude_error(flight.C_in_c_at_samples[sample], attitude.value());
      worst = std::max(
          worst, error.cwiseQuotient(attitude.value().covariance_rad2.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff());
    }
    ++sample;
  });
  ASSERT_EQ(corrected_s.size(), 3U);
  EXPECT_EQ(corrected_s[1], 663);
  EXPECT_LT(worst, 6);  // of 36 000 errors of three axes; frozen fixes made it thousands
}

/// A body at rest in inertial space, whose momenta drift as any, and a star tracker rounded to a whole arcsecond that
/// has no other noise.
template <class Estimator>
struct Rest {
  test::Flight flight{{.duration_s = 2700, .slews_rad = 0}};
  test::Given<Estimator> given;

  explicit Rest(double turns_from_s) {
    const DriftModel eq1;
    test::PairGyros truth = flight.truth;
    truth[0].h_in = Eigen::Vector3d(0.51, 0.59, 0.63).normalized();
    truth[1].h_in = Eigen::Vector3d(-0.72, 0.49, 0.49).normalized();
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    const auto attitude = [&](double t_s) { return test::turn(0, 1e-3 * std::max(t_s - turns_from_s, 0.0), 0); };
    for (GyroSample& sample : flight.samples) {
      const double t_s = to_seconds(sample.t.time_since_epoch());
      for (int k = 0; k < 2; ++k) {
        const Eigen::Matrix3d C_b_in = truth[k].C_c_b.transpose() * attitude(t_s).transpose();
        sample.h_b[k] = C_b_in * truth[k].h_in + test::Flight::kReadout_rad * test::white(random, normal);
        precess(truth[k], eq1, attitude(t_s + 0.0625), Eigen::Vector3d(C_b_in * truth[k].h_in), {}, 0.125);
      }
    }
    flight.truth = truth;
    for (StarFix& fix : flight.fixes) {
      const Eigen::Quaterniond q(attitude(to_seconds(fix.t.time_since_epoch())));
      constexpr double kStep = test::kArcsecond / 2;
      fix.q_in_c.coeffs() = (q.coeffs() / kStep).array().round().matrix() * kStep;
    }
  }

  [[nodiscard]] std::vector<FixStatus> fly() const {
    const auto on_board = given.on_board();
    std::vector<FixStatus> statuses;
    const auto note = [&](const StepReport& report) {
      if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
        statuses.push_back(report.fix.status);
      }
    };
    test::fly(flight, *on_board, note);
    test::flush(*on_board, note);
    return statuses;
  }
};

TYPED_TEST(FrozenTracker, IsNotSeenInARoundedOneOnABodyAtRest) {
  const Rest<TypeParam> rest(1800);
  const std::vector<FixStatus> statuses = rest.fly();
  EXPECT_EQ(rest.flight.fixes[500].q_in_c.coeffs(), rest.flight.fixes[1].q_in_c.coeffs());
  EXPECT_EQ(std::count(statuses.begin(), statuses.end(), FixStatus::kRejectedFrozen), 0);
  EXPECT_GE(std::count(statuses.begin(), statuses.end(), FixStatus::kUsed), 890);
}

TYPED_TEST(FrozenTracker, IsSeenWhenABodyAtRestBeginsToTurn) {
  Rest<TypeParam> rest(1800);
  freeze(rest.flight.fixes, 600, 900);
  const std::vector<FixStatus> statuses = rest.fly();
  // A drift of 5.3e-6 rad/s, which the prior gives 1-sigma, takes the momenta 3° far in 30 min at √30 sigmas, which the
  // body turns in a minute; the true drift adds some seconds. From then on all are refused.
  constexpr std::ptrdiff_t kSeen = 625;
  EXPECT_EQ(std::count(statuses.begin(), statuses.begin() + 601, FixStatus::kRejectedFrozen), 0);
  EXPECT_EQ(std::count(statuses.begin() + kSeen, statuses.end(), FixStatus::kRejectedFrozen), 901 - kSeen);
}

}  // namespace
}  // namespace trihedron
