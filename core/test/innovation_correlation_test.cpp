#include "trihedron/core/innovation_correlation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "application_flight.hpp"
#include "flight.hpp"

namespace trihedron {
namespace {

using test::kArcsecond;

// ---- The evidence

/// Innovations with noise of `sigma`, and a mean along all components; how many of `fixes` it takes to find, or 0.
template <int kComponents>
int found_after(int fixes, double sigma, double mean, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  InnovationCorrelation<kComponents> correlation;
  for (int i = 1; i <= fixes; ++i) {
    Eigen::Matrix<double, kComponents, 1> white;
    for (double& its : white) {
      its = sigma * normal(random) + mean;
    }
    correlation.add(white);
    if (correlation.found()) {
      return i;
    }
  }
  return 0;
}

TEST(InnovationCorrelation, IsNoneOfWhiteNoiseOfAnySize) {
  for (const double sigma : {0.3, 1.0, 4.0}) {
    EXPECT_EQ(found_after<4>(100'000, sigma, 0, 1), 0) << sigma;
    EXPECT_EQ(found_after<6>(100'000, sigma, 0, 2), 0) << sigma;
    EXPECT_EQ(found_after<8>(100'000, sigma, 0, 3), 0) << sigma;
  }
}

TEST(InnovationCorrelation, IsFoundTheSoonerTheLargerItIs) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const int small = found_after<4>(10'000, 1, 0.35, seed);  // 20 · 4 · 0.35², of which 4 are tolerated
    EXPECT_GT(small, 2 * InnovationCorrelation<4>::kBlock);
    EXPECT_LE(small, 40 * InnovationCorrelation<4>::kBlock);
    EXPECT_EQ(found_after<4>(10'000, 1, 1, seed), 2 * InnovationCorrelation<4>::kBlock);
  }
}

TEST(InnovationCorrelation, IsToleratedWhereItIsSmallAgainstTheNoise) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    EXPECT_EQ(found_after<4>(10'000, 1, 0.1, seed), 0);
    EXPECT_EQ(found_after<4>(10'000, 10, 1, seed), 0);
  }
}

TEST(InnovationCorrelation, BeginsAnewWithOtherGyros) {
  InnovationCorrelation<6> correlation;
  const auto add = [&](int components, int fixes) {
    for (int i = 0; i < fixes; ++i) {
      correlation.add(Eigen::VectorXd::Ones(components));
    }
  };
  constexpr int kBlock = InnovationCorrelation<6>::kBlock;
  add(6, 2 * kBlock - 1);
  add(4, 1);
  EXPECT_FALSE(correlation.found());
  add(4, 2 * kBlock - 2);
  EXPECT_FALSE(correlation.found());
  add(4, 1);
  EXPECT_TRUE(correlation.found());
}

// ---- What the filter does about it

constexpr double kChanged_s = 3600;
constexpr double kDrift_rad_s = 3e-7;

/// A flight in which the momentum of gyro 1 turns from kChanged_s on about an axis across it, in addition to what it
/// did before.
test::Flight with_drift(double rate_rad_s) {
  test::Flight flight({.duration_s = 6000});
  const Eigen::Matrix3d C_c_b = flight.truth[0].C_c_b;
  for (std::size_t i = 0; i < flight.samples.size(); ++i) {
    const double since_s = to_seconds(flight.samples[i].t.time_since_epoch()) - kChanged_s;
    if (since_s > 0) {
      const Eigen::Matrix3d C_in_b = flight.C_in_c_at_samples[i] * C_c_b;
      const Eigen::Matrix3d turned = test::turn(0, rate_rad_s * since_s, 0);
      flight.samples[i].h_b[0] = C_in_b.transpose() * turned * C_in_b * flight.samples[i].h_b[0];
    }
  }
  return flight;
}

struct Flown {
  int widenings = 0;
  int corrections = 0;
  double square = 0;  ///< of the attitude's error, in its sigmas, over the last twenty minutes; 1 where it is honest
};

Flown honesty_of(const test::Flight& flight, bool widens, const CorrectionPolicy& policy) {
  test::PairGiven given;
  given.setup.widen_where_correlated = widens;
  const auto on_board = given.on_board(policy);
  Flown flown;
  int count = 0;
  test::fly(flight, *on_board, [&](const StepReport& report) {
    flown.widenings += report.fix.status == FixStatus::kUsedAfterWidening ? 1 : 0;
    flown.corrections += report.corrected ? 1 : 0;
    const double t_s = to_seconds(report.t.time_since_epoch());
    if (is_used(report.sample) && t_s > 4800) {
      const auto attitude = on_board->navigation_attitude().value();
      const auto i = static_cast<std::size_t>(std::lround(8 * t_s));
      flown.square += test::normalised_square(test::attitude_error(flight.C_in_c_at_samples[i], attitude),
                                              attitude.covariance_rad2) /
                      3;
      ++count;
    }
  });
  flown.square /= count;
  return flown;
}

constexpr CorrectionPolicy kEachFix{.interval = CorrectionPolicy::kEveryFix};

TEST(Widening, KeepsTheAttitudeHonestWhereTheDriftChanges) {
  const test::Flight flight = with_drift(kDrift_rad_s);
  const Flown without = honesty_of(flight, false, kEachFix);
  const Flown with = honesty_of(flight, true, kEachFix);
  EXPECT_EQ(without.widenings, 0);
  EXPECT_GT(without.square, 10);
  EXPECT_GT(with.widenings, 0);
  EXPECT_LT(with.square, 4);
}

TEST(Widening, IsNotNeededWhereTheModelHolds) {
  const test::Flight flight = with_drift(0);
  const Flown without = honesty_of(flight, false, kEachFix);
  const Flown with = honesty_of(flight, true, kEachFix);
  EXPECT_EQ(with.widenings, 0);
  EXPECT_EQ(with.square, without.square);
}

TEST(Widening, CorrectsTheNavigatorAtOnce) {
  const Flown flown = honesty_of(with_drift(kDrift_rad_s), true, {.interval = CorrectionPolicy::kOnlyFirst});
  EXPECT_GT(flown.widenings, 0);
  EXPECT_EQ(flown.corrections, 1 + flown.widenings);
  // Held parameters owe nothing to the filter.
  const Flown held =
      honesty_of(with_drift(kDrift_rad_s), true, {.interval = CorrectionPolicy::kOnlyFirst, .take_parameters = false});
  EXPECT_GT(held.widenings, 0);
  EXPECT_EQ(held.corrections, 1);
}

TEST(Widening, GoesToThePriorAtMost) {
  test::PairGiven given;
  given.setup.widen_where_correlated = true;
  const Eigen::VectorXd prior = given.covariance.diagonal().cwiseSqrt();
  Eigen::VectorXd before = prior;
  int seen = 0;
  const auto on_board = given.on_board(kEachFix);
  test::fly(with_drift(kDrift_rad_s), *on_board, [&](const StepReport& report) {
    if (!report.fix.used()) {
      return;
    }
    const Eigen::VectorXd now = test::error_root(on_board->estimator()).middleRows(6, 20).rowwise().norm();
    if (report.fix.status == FixStatus::kUsedAfterWidening && ++seen == 1) {
      EXPECT_LE((now.array() / prior.array()).maxCoeff(), 1 + 1e-9);
      EXPECT_LE((now.array() / before.array()).maxCoeff(), 3 + 1e-9);
      EXPECT_GT((now.array() / before.array()).mean(), 1.5);
    }
    before = now;
  });
  EXPECT_GT(seen, 0);
}

TEST(WideningOfApplication, IsCountedAndCanBeSwitchedOff) {
  const test::Flight flight = with_drift(kDrift_rad_s);
  Parameters parameters = test::nominal_parameters();
  for (const std::uint32_t widens : {0U, 1U}) {
    parameters.widen_where_correlated = widens;
    const auto application = test::started<PairApplication>(parameters);
    test::fly(flight, *application);
    EXPECT_EQ(application->housekeeping().widenings > 0, widens == 1);
  }
}

}  // namespace
}  // namespace trihedron
