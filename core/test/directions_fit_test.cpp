#include "trihedron/core/directions_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "flight.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron {
namespace {

constexpr int kFittedGyros = 2;

Time at(double t_s) { return Time(from_seconds(t_s)); }

/// Two directions that turn ever faster about different axes: h(t) = exp(a(t)) h0, a cubic in small angles.
Directions sample(double t_s, double noise_rad = 0, std::mt19937* random = nullptr) {
  std::normal_distribution<double> normal;
  Directions h_b;
  const double angle = 1e-3 * t_s + 2e-4 * t_s * t_s - 1e-7 * t_s * t_s * t_s;
  h_b[0] = rotated<double>(Eigen::Vector3d(0.6, 0, 0.8), Eigen::Vector3d(0, angle, 0));
  h_b[1] = rotated<double>(Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(angle, 0, angle));
  for (int k = 0; k < kFittedGyros && random != nullptr; ++k) {
    h_b[k] += noise_rad * test::white(*random, normal);
    h_b[k].normalize();
  }
  return h_b;
}

/// Of so many samples, one each 125 ms from 0 on.
FittedDirections fit(int samples, double t_s, int degree, double noise_rad = 0, std::mt19937* random = nullptr) {
  DirectionsFit fit(at(t_s), at(0), at(0.125 * (samples - 1)), samples, degree, kFittedGyros);
  for (int i = 0; i < samples; ++i) {
    fit.add(at(0.125 * i), sample(0.125 * i, noise_rad, random));
  }
  return fit.solve();
}

TEST(DirectionsFit, FollowsTheBodyAtAnyTimeOfTheWindow) {
  for (const double t_s : {1.375, 1.4, 2.75}) {
    const FittedDirections fitted = fit(23, t_s, 3);
    const Directions truth = sample(t_s);
    const Eigen::Vector3d rate = (sample(t_s + 1e-3)[1] - sample(t_s - 1e-3)[1]) / 2e-3;
    for (int k = 0; k < kFittedGyros; ++k) {
      // The products of the angles have powers of time above the third: 1e-9 of them are left.
      EXPECT_LT(angle_between<double>(fitted.h_b[k], truth[k]), 2e-9) << t_s;
    }
    EXPECT_LT((fitted.h_b_rate[1] - rate).norm(), 1e-3 * rate.norm()) << t_s;
  }
}

TEST(DirectionsFit, HasTheNoiseItClaims) {
  std::mt19937 random(4);
  constexpr double kNoise = 1e-5;
  for (const auto& [at_s, degree] : {std::pair{1.375, 3}, std::pair{2.75, 2}}) {
    double square = 0;
    double residual = 0;
    double freedom = 0;
    double claimed = 0;
    constexpr int kRuns = 400;
    for (int run = 0; run < kRuns; ++run) {
      const FittedDirections fitted = fit(23, at_s, degree, kNoise, &random);
      const Directions truth = sample(at_s);
      claimed = fitted.noise_factor * kNoise;
      freedom = fitted.freedom;
      for (int k = 0; k < kFittedGyros; ++k) {
        square += std::pow(angle_between<double>(fitted.h_b[k], truth[k]), 2) / (4 * kRuns);
        residual += fitted.residual_square[k] / (kNoise * kNoise) / (2 * kRuns);
      }
    }
    // Four components per run: 1600 squares, a relative 1-sigma of √(2/1600) = 3.5 %.
    EXPECT_NEAR(square / (claimed * claimed), 1, 0.14) << degree;
    EXPECT_NEAR(residual / freedom, 1, 0.05) << degree;
  }
}

TEST(DirectionsFit, TakesALowerDegreeOfFewSamples) {
  const FittedDirections one = fit(1, 0, 3);
  EXPECT_LT((one.h_b[0] - sample(0)[0]).norm(), 1e-15);
  EXPECT_EQ(one.h_b_rate[0].norm(), 0);
  EXPECT_DOUBLE_EQ(one.noise_factor, 1);
  const FittedDirections three = fit(3, 0.125, 3);
  EXPECT_LT(angle_between<double>(three.h_b[0], sample(0.125)[0]), 1e-5);
  EXPECT_NEAR(three.noise_factor, std::sqrt(1.0 / 3), 1e-12);
}

TEST(DirectionsFit, ExplainsWhatIsOnlyNoise) {
  std::mt19937 random(5);
  constexpr double kNoise = 1e-5;
  PerGyro<double> noise_rad;
  noise_rad[0] = noise_rad[1] = kNoise;
  FittedDirections fitted = fit(23, 1.375, 3, kNoise, &random);
  EXPECT_TRUE(fitted.explains(all_gyros(kFittedGyros), noise_rad));
  EXPECT_FALSE(fit(23, 1.375, 3, 2 * kNoise, &random).explains(all_gyros(kFittedGyros), noise_rad));
  // A gyro that is not used is not asked.
  fitted.residual_square[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(fitted.explains(all_gyros(kFittedGyros), noise_rad));
  EXPECT_TRUE(fitted.explains(all_gyros(1), noise_rad));
}

}  // namespace
}  // namespace trihedron
