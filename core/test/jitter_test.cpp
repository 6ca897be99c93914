#include "trihedron/core/jitter.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <random>

#include "flight.hpp"
#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron {
namespace {

constexpr UnfollowedMotion kNothing{0, 1e-10};
constexpr Duration kReach = std::chrono::milliseconds(1400);

/// One after another, of a fix each three seconds.
struct OverTime {
  Jitter jitter;
  int fixes = 0;
  void add(const UnfollowedMotion& seen) { jitter.add(Time(3 * ++fixes * std::chrono::seconds(1)), kReach, seen); }
  [[nodiscard]] float square_rad2() const { return jitter.square_rad2(); }
};

TEST(Jitter, IsNoneWhereNothingIsKnown) {
  OverTime jitter;
  EXPECT_EQ(jitter.square_rad2(), 0);
  jitter.add({});
  jitter.add({1, std::numeric_limits<double>::quiet_NaN()});
  EXPECT_EQ(jitter.square_rad2(), 0);
}

TEST(Jitter, IsNoneByChance) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  OverTime jitter;
  int told = 0;
  for (int i = 0; i < 10000; ++i) {
    jitter.add({1e-10 * normal(random), 1e-10});
    told += jitter.square_rad2() > 0 ? 1 : 0;
  }
  EXPECT_LT(told, 100);
}

TEST(Jitter, IsTheMeanOfTheLatest) {
  OverTime jitter;
  for (int i = 0; i < 40; ++i) {
    jitter.add({2e-10, 1e-10});
  }
  EXPECT_NEAR(jitter.square_rad2(), 2e-10, 1e-15);
  for (int i = 0; i < 1000; ++i) {
    jitter.add({1e-10, 1e-10});
  }
  EXPECT_NEAR(jitter.square_rad2(), 1e-10, 1e-14);
  for (int i = 0; i < 500; ++i) {
    jitter.add(kNothing);
  }
  EXPECT_EQ(jitter.square_rad2(), 0);
}

TEST(Jitter, IsNotWhereTheBodyOnceBeginsToTurn) {
  OverTime jitter;
  for (int i = 0; i < 200; ++i) {
    jitter.add(kNothing);
  }
  jitter.add({1, 1e-10});
  EXPECT_EQ(jitter.square_rad2(), 0);
}

TEST(Jitter, OfPolynomialsThatShareSamplesIsThatOfOne) {
  Jitter jitter;
  for (int i = 0; i < 10; ++i) {
    jitter.add(Time(i * std::chrono::milliseconds(200)), kReach, {2e-10, 1e-10});
  }
  EXPECT_EQ(jitter.square_rad2(), 0);  // two sigmas
  for (int i = 0; i < 10; ++i) {
    jitter.add(Time(i * std::chrono::milliseconds(2800)), kReach, {2e-10, 1e-10});
  }
  EXPECT_GT(jitter.square_rad2(), 0);
}

/// Cubics through 23 samples of a body that turns, by momenta 60° apart and readouts of different noise.
struct Unfollowed {
  double mean_rad2;
  double scatter_rad2;
  double sigma_rad2;
};
Unfollowed unfollowed_over_many(double shake_rad) {
  constexpr int kSamples = 23;
  constexpr int kFits = 2000;
  PerGyro<double> noise_rad;
  noise_rad[0] = 1e-5;
  noise_rad[1] = 1.5e-5;
  Directions h_c;
  h_c[0] = Eigen::Vector3d::UnitX();
  h_c[1] = {0.5, std::sqrt(0.75), 0};
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  Unfollowed found{};
  for (int n = 0; n < kFits; ++n) {
    const Time middle(from_seconds(0.125 * (kSamples / 2)));
    DirectionsFit fit(middle, Time{}, middle + middle.time_since_epoch(), kSamples, 3, 2);
    for (int i = 0; i < kSamples; ++i) {
      // Shaking anew at each sample: all of it but what a cubic takes.
      const Eigen::Vector3d turn_rad = Eigen::Vector3d(1e-3, 2e-3, -1e-3) * i + shake_rad * test::white(random, normal);
      Directions h_b;
      for (int k = 0; k < 2; ++k) {
        h_b[k] = (rotated<double>(h_c[k], turn_rad) + noise_rad[k] * test::white(random, normal)).normalized();
      }
      fit.add(Time(from_seconds(0.125 * i)), h_b, h_b[0].dot(h_b[1]));
    }
    const FittedDirections fitted = fit.solve();
    const UnfollowedMotion its = fitted.unfollowed(0, 1, fitted.h_b[0].dot(fitted.h_b[1]), noise_rad);
    found.mean_rad2 += its.square_rad2 / kFits;
    found.scatter_rad2 += its.square_rad2 * its.square_rad2 / kFits;
    found.sigma_rad2 = its.sigma_rad2;
  }
  found.scatter_rad2 = std::sqrt(found.scatter_rad2);
  return found;
}

TEST(UnfollowedMotion, IsNoneOfNoiseAndAsUncertainAsItSays) {
  const Unfollowed found = unfollowed_over_many(0);
  EXPECT_NEAR(found.mean_rad2, 0, 3 * found.sigma_rad2 / std::sqrt(2000));
  EXPECT_NEAR(found.scatter_rad2, found.sigma_rad2, 0.05 * found.sigma_rad2);
}

TEST(UnfollowedMotion, IsWhatShakesTheBody) { EXPECT_NEAR(unfollowed_over_many(1e-5).mean_rad2, 1e-10, 5e-12); }

TEST(UnfollowedMotion, IsNotKnownWhereTheMomentaAreNearlyParallel) {
  const FittedDirections fitted = {.freedom = 38};
  PerGyro<double> noise_rad;
  noise_rad[0] = noise_rad[1] = 1e-5;
  EXPECT_GT(fitted.unfollowed(0, 1, 0.9, noise_rad).sigma_rad2, 0);
  EXPECT_EQ(fitted.unfollowed(0, 1, 0.96, noise_rad).sigma_rad2, 0);
  EXPECT_EQ(fitted.unfollowed(0, 1, std::numeric_limits<double>::quiet_NaN(), noise_rad).sigma_rad2, 0);
}

}  // namespace
}  // namespace trihedron
