#include "trihedron/ground/clocks/regular_stamps.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "passes.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

/// Off by up to `most_s` to both sides.
std::vector<Time> scattered(std::vector<Time> t, double most_s) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> off_s(-most_s, most_s);
  for (Time& its : t) {
    its += from_seconds(off_s(random));
  }
  return t;
}

double rms_s(const std::vector<Time>& a, const std::vector<Time>& b) {
  double squares = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    squares += std::pow(to_seconds(a[i] - b[i]), 2) / static_cast<double>(a.size());
  }
  return std::sqrt(squares);
}

TEST(RegularStamps, TakeThePlaceOfThoseThatScatter) {
  Pass pass = two_hours().pass;
  const std::vector<Time> right = pass.gyro.t;
  for (const double most_s : {0.003, 0.03}) {
    pass.gyro.t = scattered(right, most_s);
    const auto regular = regular_stamps(pass);
    ASSERT_TRUE(regular) << most_s;
    EXPECT_NEAR(regular->scatter_s, most_s / std::sqrt(3.0), 0.02 * most_s);
    EXPECT_LT(rms_s(regular->t, right), 0.02 * most_s);  // the mean of 4097
  }
}

TEST(RegularStamps, AreFoundOnBothSidesOfAGap) {
  Pass pass = two_hours().pass;
  std::vector<Time> right = pass.gyro.t;
  const std::size_t gap = right.size() / 3;
  for (std::size_t i = gap; i < right.size(); ++i) {
    right[i] += std::chrono::milliseconds(61234);
  }
  pass.gyro.t = scattered(right, 0.03);
  const auto regular = regular_stamps(pass);
  ASSERT_TRUE(regular);
  EXPECT_LT(rms_s(regular->t, right), 2e-3);
}

TEST(RegularStamps, AreNothingWhereStampsAreRegularOrRight) {
  Pass pass = two_hours().pass;
  EXPECT_FALSE(regular_stamps(pass));
  // Readings taken when their stamps say, each off the path by what the body turns meanwhile.
  const std::vector<Time> stamps = scattered(pass.gyro.t, 0.03);
  Pass irregular = pass;
  for (std::size_t i = 1; i + 1 < stamps.size(); ++i) {
    const Time from = pass.gyro.t[i - 1];
    const double part = to_seconds(stamps[i] - from) / to_seconds(pass.gyro.t[i + 1] - from);
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector3d before = pass.gyro.direction(i - 1, k);
      const Eigen::Vector3d moved = (part - 0.5) * (pass.gyro.direction(i + 1, k) - before);
      Eigen::Map<Eigen::Vector3d>(&irregular.gyro.h[3 * (2 * i + static_cast<std::size_t>(k))]) += moved;
    }
  }
  irregular.gyro.t = stamps;
  EXPECT_FALSE(regular_stamps(irregular));
}

TEST(RegularStamps, AreNothingOfABodyAtRestOrOfAFewSamples) {
  Pass pass = two_hours().pass;
  const std::vector<double> first(pass.gyro.h.begin(), pass.gyro.h.begin() + 6);
  std::mt19937_64 random(9);
  std::normal_distribution<double> noise(0, 1e-5);
  for (std::size_t i = 0; i < pass.gyro.h.size(); ++i) {
    pass.gyro.h[i] = first[i % 6] + noise(random);
  }
  pass.gyro.t = scattered(pass.gyro.t, 0.03);
  EXPECT_FALSE(regular_stamps(pass));
  Pass few = two_hours().pass;
  few.gyro.t = scattered(few.gyro.t, 0.03);
  few.gyro.t.resize(2000);
  few.gyro.h.resize(12000);
  EXPECT_FALSE(regular_stamps(few));
  few.gyro.t.clear();
  few.gyro.h.clear();
  EXPECT_FALSE(regular_stamps(few));
}

}  // namespace
}  // namespace trihedron::ground
