#include "trihedron/sim/unmodelled.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "statistics.hpp"
#include "trihedron/sim/gyro.hpp"
#include "trihedron/sim/harmonics.hpp"
#include "trihedron/sim/random.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Vector3d;

Vector3d turned(const Vector3d& h, const Vector3d& axis, double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, axis.normalized()) * h;
}

TEST(DriftBump, ActsWithinItsRadiusAcrossTheMomentumAndReachesItsAmplitude) {
  const Vector3d centre = Vector3d(1, 0.4, -0.3).normalized();
  const DriftBump bump(1e-7, 3 * centre, 20 * kDegree);
  const Vector3d axis = centre.unitOrthogonal();
  double largest = 0;
  for (int i = 0; i <= 4000; ++i) {
    const double angle = i * 0.01 * kDegree;
    const Vector3d h = turned(centre, axis, angle);
    const Vector3d rate = bump.rate(h);
    EXPECT_LT(std::abs(rate.dot(h)), 1e-21);  // rounding: 1e-14 of the amplitude
    EXPECT_TRUE(angle < 20 * kDegree || rate.norm() == 0) << angle;
    largest = std::max(largest, rate.norm());
  }
  // On a grid of 0.01° the top is missed by less than 1e-6 of it.
  EXPECT_NEAR(largest / 1e-7, 1, 1e-6);
  EXPECT_THROW(DriftBump(1e-7, Vector3d::Zero(), 0.3), std::invalid_argument);
  EXPECT_THROW(DriftBump(1e-7, centre, 0), std::invalid_argument);
  EXPECT_THROW(DriftBump(1e-7, centre, 2), std::invalid_argument);
}

TEST(DriftBump, WithoutACentreIsDrawnFromTheSeed) {
  DriftScenario scenario;
  scenario.bump_rad_s = 1e-7;
  const Vector3d first = Drift(scenario, 1, 0).bump()->centre();
  EXPECT_EQ(first, Drift(scenario, 1, 0).bump()->centre());
  EXPECT_NE(first, Drift(scenario, 1, 1).bump()->centre());
  EXPECT_NE(first, Drift(scenario, 2, 0).bump()->centre());
  scenario.bump_centre = Vector3d(0, 0, 2);
  EXPECT_EQ(Drift(scenario, 1, 0).bump()->centre(), Vector3d::UnitZ());
}

TEST(DriftHysteresis, PointsAlongTheMotionAndTurnsWithIt) {
  const double width = 5 * kDegree;
  DriftHysteresis hysteresis(2e-8, width);
  const Vector3d axis = Vector3d::UnitZ();
  const auto at = [&](double degrees) { return turned(Vector3d::UnitX(), axis, degrees * kDegree); };
  hysteresis.move_to(at(0));
  EXPECT_TRUE(hysteresis.rate(at(0)).isZero(1e-30));
  for (int i = 1; i <= 30; ++i) {
    hysteresis.move_to(at(i));
  }
  const Vector3d forwards = hysteresis.rate(at(30));
  EXPECT_NEAR(forwards.norm(), 2e-8, 1e-20);
  EXPECT_NEAR(forwards.dot(axis.cross(at(30))), 2e-8, 1e-20);
  EXPECT_LT(std::abs(forwards.dot(at(30))), 1e-22);
  for (int i = 29; i >= 15; --i) {
    hysteresis.move_to(at(i));
  }
  // The same direction, reached from the other side.
  EXPECT_NEAR((hysteresis.rate(at(15)) + turned(forwards, axis, -15 * kDegree)).norm(), 0, 1e-20);
  EXPECT_THROW(DriftHysteresis(1e-8, 0), std::invalid_argument);
}

TEST(DriftModulation, IsFullInASlewAndDecaysAfterIt) {
  DriftScenario scenario;
  scenario.slew_fraction = 0.1;
  scenario.slew_time_s = 100;
  DriftModulation modulation(scenario, 0);
  modulation.next_step(0, 1, {1e-3, false});
  EXPECT_EQ(modulation.now(), 0);
  modulation.next_step(1, 1, {5e-3, false});
  EXPECT_EQ(modulation.now(), 0.1);
  for (int i = 1; i <= 100; ++i) {
    modulation.next_step(1 + i, 1, {1e-3, false});
  }
  EXPECT_NEAR(modulation.now(), 0.1 * std::exp(-1), 1e-12);
  // ∑ of the steps' values over their time.
  EXPECT_NEAR(modulation.mean(), 0.1 * (1 - std::exp(-1.01)) / (1 - std::exp(-0.01)) / 102, 1e-12);
}

TEST(DriftModulation, PolhodeTurnsWithAPeriodThatGrows) {
  DriftScenario scenario;
  scenario.polhode_fraction = 0.05;
  scenario.polhode_period_s = 1000;
  scenario.polhode_period_rate = 0.1;
  DriftModulation modulation(scenario, 0.5);
  // Phase by summing dt / period in small steps.
  double turns = 0;
  const double step_s = 0.1;
  for (int i = 0; i < 50'000; ++i) {
    const double t = i * step_s;
    modulation.next_step(t, step_s, {});
    ASSERT_NEAR(modulation.now(), 0.05 * std::cos(0.5 + 2 * std::numbers::pi * turns), 1e-7) << t;
    turns += step_s / (1000 + 0.1 * (t + step_s / 2));
  }
  EXPECT_NEAR(turns, std::log(1.5) / 0.1, 1e-6);
  EXPECT_EQ(modulation.mean(), 0);  // it comes back
}

TEST(DriftModulation, FollowsLightAndShadowWithItsTimeConstant) {
  DriftScenario scenario;
  scenario.thermal_fraction = 0.2;
  scenario.thermal_time_s = 50;
  DriftModulation modulation(scenario, 0);
  for (int i = 0; i < 50; ++i) {
    modulation.next_step(i, 1, {0, true});
  }
  EXPECT_NEAR(modulation.now(), 0.2 * (1 - std::exp(-1)), 1e-12);
  for (int i = 0; i < 5000; ++i) {
    modulation.next_step(i, 1, {0, false});
  }
  EXPECT_NEAR(modulation.now(), -0.2, 1e-12);
}

TEST(Drift, CoefficientsJumpOnceByTheirSigma) {
  DriftScenario scenario;
  scenario.outside_sigma_rad_s = 0;
  scenario.jump_sigma_rad_s = 1e-8;
  scenario.jump_at_s = 100;
  test::Sequence jumps;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    Drift drift(scenario, seed, 0);
    const Esg7::Coefficients<double> before = drift.kappa_rad_s();
    drift.next_step(99.9, 0.125);
    ASSERT_EQ(drift.kappa_rad_s(), before);
    drift.next_step(100, 0.125);
    const Esg7::Coefficients<double> after = drift.kappa_rad_s();
    drift.next_step(5000, 0.125);
    ASSERT_EQ(drift.kappa_rad_s(), after);
    ASSERT_EQ(drift.part_in_eq1_rad_s(), after);
    for (int i = 0; i < Esg7::kSize; ++i) {
      jumps.push_back((after - before)(i));
    }
  }
  EXPECT_NEAR(test::mean_square(jumps) / 1e-16, 1, test::kBand * test::mean_square_sigma(jumps.size()));
}

TEST(PartInEq1, FindsEq1ItselfAndNothingInWhatIsOrthogonalToIt) {
  Esg7::Coefficients<double> kappa;
  kappa << 1, -2, 3, -4, 5, -6, 7;
  const Esg7::Coefficients<double> found =
      part_in_eq1([&](const Vector3d& h) -> Vector3d { return Esg7::rate<double>(h, kappa); });
  EXPECT_LT((found - kappa).norm(), 1e-12);
  const HarmonicField outside({{DriftHarmonic::Potential::kW, 1, 0, 1},
                               {DriftHarmonic::Potential::kD, 2, -2, 1},
                               {DriftHarmonic::Potential::kW, 3, 0, 1},
                               {DriftHarmonic::Potential::kD, 6, 4, 1}});
  EXPECT_LT(part_in_eq1([&](const Vector3d& h) -> Vector3d { return outside.rate<double>(h); }).norm(), 1e-12);
}

TEST(Drift, TruthHoldsThePartOfHarmonicsAndOfABumpThatEq1Contains) {
  DriftScenario scenario;
  scenario.kappa_rad_s.emplace();
  scenario.outside_sigma_rad_s = 0;
  // xyz = Y(3,−2) / √(105/4π), and −P∇(xyz)-fields are eq. (1) with μ12 = μ23 = μ31 or ν12 = ν23 = ν31.
  scenario.harmonics = {{DriftHarmonic::Potential::kW, 3, -2, 1e-8}};
  const double size = 1e-8 * std::sqrt(105 / (4 * std::numbers::pi));
  const Esg7::Coefficients<double> of_xyz = Drift(scenario, 0, 0).part_in_eq1_rad_s();
  for (int i = Esg7::kNu12; i <= Esg7::kNu31; ++i) {
    EXPECT_NEAR(of_xyz(i), -size, 1e-20);
  }
  EXPECT_LT(of_xyz.head(4).norm(), 1e-20);

  // What is left of a bump after its part is orthogonal to eq. (1): the part of the rest is nothing.
  scenario.harmonics.clear();
  scenario.bump_rad_s = 1e-7;
  const Drift bumped(scenario, 5, 0);
  const Esg7::Coefficients<double> of_bump = bumped.part_in_eq1_rad_s();
  EXPECT_GT(of_bump.norm(), 1e-9);
  const auto rest = [&](const Vector3d& h) -> Vector3d {
    return bumped.bump()->rate(h) - Esg7::rate<double>(h, of_bump);
  };
  EXPECT_LT(part_in_eq1(rest).norm(), 1e-19);
}

/// A pass of one revolution with one key of the drift set, against the one without it: how far apart the momenta of
/// the first gyro end, rad.
template <class Set>
double moved_by(const Set& set) {
  Scenario scenario;
  scenario.seed = 3;
  scenario.duration = std::chrono::minutes{92};
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.outside_sigma_rad_s = 0;
  }
  const SimulatedPass without = simulate(scenario);
  for (GyroScenario& gyro : scenario.gyros) {
    set(gyro.drift);
  }
  const SimulatedPass with = simulate(scenario);
  EXPECT_EQ(with.pass.star_tracker.q_in_c.back().coeffs(), without.pass.star_tracker.q_in_c.back().coeffs());
  const auto last = [](const SimulatedPass& pass) { return Vector3d(&pass.truth.h_in[pass.truth.h_in.size() - 6]); };
  return (last(with) - last(without)).norm();
}

TEST(Simulate, EachDriftOutsideTheModelsMovesTheMomentumByWhatItsSizeAllows) {
  // Over 92 min 1e-8 rad/s make at most 5.5e-5 rad; κ of 2e-6 rad/s changed by 1 % the same to some. A tenth of a
  // percent of that is above any rounding.
  const auto expect_between = [](double moved, double least, double most) {
    EXPECT_GT(moved, least);
    EXPECT_LT(moved, most);
  };
  expect_between(moved_by([](DriftScenario& drift) {
                   drift.bump_rad_s = 1e-8;
                   drift.bump_centre = Vector3d::UnitX();
                 }),
                 1e-7, 5.6e-5);
  expect_between(moved_by([](DriftScenario& drift) { drift.hysteresis_rad_s = 1e-8; }), 1e-6, 5.6e-5);
  expect_between(moved_by([](DriftScenario& drift) { drift.slew_fraction = 0.01; }), 1e-7, 5e-4);
  expect_between(moved_by([](DriftScenario& drift) { drift.polhode_fraction = 0.01; }), 1e-7, 5e-4);
  expect_between(moved_by([](DriftScenario& drift) { drift.thermal_fraction = 0.01; }), 1e-7, 5e-4);
  expect_between(moved_by([](DriftScenario& drift) {
                   drift.jump_sigma_rad_s = 1e-8;
                   drift.jump_at_s = 2760;
                 }),
                 1e-6, 1e-4);
}

TEST(Simulate, RefusesDriftOutsideTheModelsThatMakesNoSense) {
  const auto refused = [](auto set) {
    Scenario scenario;
    scenario.duration = std::chrono::minutes{1};
    set(scenario.gyros[0].drift);
    EXPECT_THROW(static_cast<void>(simulate(scenario)), std::invalid_argument);
  };
  refused([](DriftScenario& drift) { drift.jump_sigma_rad_s = -1e-8; });
  refused([](DriftScenario& drift) { drift.slew_time_s = 0; });
  refused([](DriftScenario& drift) { drift.polhode_period_s = 0; });
  refused([](DriftScenario& drift) {
    drift.polhode_period_s = 30;
    drift.polhode_period_rate = -0.6;
  });
  refused([](DriftScenario& drift) { drift.thermal_time_s = -1; });
}

}  // namespace
}  // namespace trihedron::sim
