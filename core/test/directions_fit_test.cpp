#include "trihedron/core/directions_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "trihedron/core/frames.hpp"

namespace trihedron {
namespace {

using Buffer = SampleBuffer<2, 64>;

Time at(double t_s) { return Time(from_seconds(t_s)); }

/// Two directions that turn ever faster about different axes: h(t) = exp(a(t)) h0, a cubic in small angles.
GyroSample<2> sample(double t_s, double noise_rad = 0, std::mt19937* random = nullptr) {
  std::normal_distribution<double> normal;
  GyroSample<2> s;
  s.t = at(t_s);
  const double angle = 1e-3 * t_s + 2e-4 * t_s * t_s - 1e-7 * t_s * t_s * t_s;
  s.h_b[0] = rotated<double>(Eigen::Vector3d(0.6, 0, 0.8), Eigen::Vector3d(0, angle, 0));
  s.h_b[1] = rotated<double>(Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(angle, 0, angle));
  for (Eigen::Vector3d& h : s.h_b) {
    if (random != nullptr) {
      h += noise_rad * Eigen::Vector3d(normal(*random), normal(*random), normal(*random));
      h.normalize();
    }
  }
  return s;
}

TEST(SampleBuffer, KeepsTheLatest) {
  SampleBuffer<2, 3> buffer;
  EXPECT_EQ(buffer.size(), 0);
  for (int i = 0; i < 5; ++i) {
    buffer.push(sample(i));
  }
  ASSERT_EQ(buffer.size(), 3);
  EXPECT_EQ(buffer[0].t, at(2));
  EXPECT_EQ(buffer.latest().t, at(4));
}

TEST(FitDirections, FollowsTheBodyAtAnyTimeOfTheWindow) {
  Buffer buffer;
  for (int i = 0; i <= 22; ++i) {
    buffer.push(sample(0.125 * i));
  }
  for (const double t_s : {1.375, 1.4, 2.75}) {
    const auto fit = fit_directions<2>(buffer, 0, 23, at(t_s), 3);
    const GyroSample<2> truth = sample(t_s);
    const Eigen::Vector3d rate = (sample(t_s + 1e-3).h_b[1] - sample(t_s - 1e-3).h_b[1]) / 2e-3;
    for (int k = 0; k < 2; ++k) {
      // The products of the angles have powers of time above the third: 1e-9 of them are left.
      EXPECT_LT(angle_between<double>(fit.h_b[k], truth.h_b[k]), 2e-9) << t_s;
    }
    EXPECT_LT((fit.h_b_rate[1] - rate).norm(), 1e-3 * rate.norm()) << t_s;
  }
}

TEST(FitDirections, HasTheNoiseItClaims) {
  std::mt19937 random(4);
  constexpr double kNoise = 1e-5;
  for (const auto& [at_s, degree] : {std::pair{1.375, 3}, std::pair{2.75, 2}}) {
    double square = 0;
    double residual = 0;
    double freedom = 0;
    double claimed = 0;
    constexpr int kRuns = 400;
    for (int run = 0; run < kRuns; ++run) {
      Buffer buffer;
      for (int i = 0; i <= 22; ++i) {
        buffer.push(sample(0.125 * i, kNoise, &random));
      }
      const auto fit = fit_directions<2>(buffer, 0, 23, at(at_s), degree);
      const GyroSample<2> truth = sample(at_s);
      claimed = fit.noise_factor * kNoise;
      freedom = fit.freedom;
      for (int k = 0; k < 2; ++k) {
        square += std::pow(angle_between<double>(fit.h_b[k], truth.h_b[k]), 2) / (4 * kRuns);
        residual += fit.residual_square[k] / (kNoise * kNoise) / (2 * kRuns);
      }
    }
    // Four components per run: 1600 squares, a relative 1-sigma of √(2/1600) = 3.5 %.
    EXPECT_NEAR(square / (claimed * claimed), 1, 0.14) << degree;
    EXPECT_NEAR(residual / freedom, 1, 0.05) << degree;
  }
}

TEST(FitDirections, TakesALowerDegreeOfFewSamples) {
  Buffer buffer;
  buffer.push(sample(0));
  const auto one = fit_directions<2>(buffer, 0, 1, at(0), 3);
  EXPECT_LT((one.h_b[0] - sample(0).h_b[0]).norm(), 1e-15);
  EXPECT_EQ(one.h_b_rate[0].norm(), 0);
  EXPECT_DOUBLE_EQ(one.noise_factor, 1);
  buffer.push(sample(0.125));
  buffer.push(sample(0.25));
  const auto three = fit_directions<2>(buffer, 0, 3, at(0.125), 3);
  EXPECT_LT(angle_between<double>(three.h_b[0], sample(0.125).h_b[0]), 1e-5);
  EXPECT_NEAR(three.noise_factor, std::sqrt(1.0 / 3), 1e-12);
}

}  // namespace
}  // namespace trihedron
