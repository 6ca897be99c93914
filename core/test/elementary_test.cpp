#include "trihedron/core/elementary.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace trihedron {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr double kNotNumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kLastDigits = 4e-16;

/// Numbers of both signs whose logarithm is even between those of `least` and `most`.
template <class Check>
void at_many_sizes(double least, double most, Check&& check) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> logarithm(std::log(least), std::log(most));
  for (int i = 0; i < 20000; ++i) {
    const double x = std::exp(logarithm(random));
    check(x);
    check(-x);
  }
}

void expect_same_digits(double value, double exact, double absolute) {
  EXPECT_LE(std::abs(value - exact), std::max(kLastDigits * std::abs(exact), absolute)) << exact;
}

TEST(Elementary, SineAndCosineAreThoseOfTheLibraryToTheLastDigits) {
  const auto check = [](double x) {
    expect_same_digits(elementary::sin(x), std::sin(x), 2e-16);
    expect_same_digits(elementary::cos(x), std::cos(x), 2e-16);
  };
  at_many_sizes(1e-12, 1e6, check);
  for (int i = -16; i <= 16; ++i) {
    check(i * std::numbers::pi / 8);
    check(std::nextafter(i * std::numbers::pi / 4, kUnbounded));
  }
  at_many_sizes(1e-300, 1e-3, [](double x) { expect_same_digits(elementary::sin(x), std::sin(x), 0); });
  EXPECT_EQ(elementary::sin(0), 0);
  EXPECT_EQ(elementary::cos(0), 1);
}

TEST(Elementary, SineAndCosineOutOfRangeAreNotNumbers) {
  for (const double x : {1.0001e6, -1.0001e6, kUnbounded, -kUnbounded, kNotNumber}) {
    EXPECT_TRUE(std::isnan(elementary::sin(x)));
    EXPECT_TRUE(std::isnan(elementary::cos(x)));
  }
}

TEST(Elementary, ArcTangentIsThatOfTheLibraryInAllQuadrants) {
  at_many_sizes(1e-200, 1e200, [](double y) {
    for (const double x : {1.0, -1.0, 3e-5, -2e7}) {
      expect_same_digits(elementary::atan2(y, x), std::atan2(y, x), 0);
    }
  });
  at_many_sizes(0.01, 100, [](double y) { expect_same_digits(elementary::atan2(y, 1), std::atan2(y, 1), 0); });
  EXPECT_EQ(elementary::atan2(0, 0), 0);
  EXPECT_EQ(elementary::atan2(0, 2), 0);
  EXPECT_EQ(elementary::atan2(0, -2), std::numbers::pi);
  EXPECT_EQ(elementary::atan2(3, 0), std::numbers::pi / 2);
  EXPECT_EQ(elementary::atan2(-3, 0), -std::numbers::pi / 2);
  EXPECT_EQ(elementary::atan2(kUnbounded, 1), std::numbers::pi / 2);
  EXPECT_TRUE(std::isnan(elementary::atan2(kNotNumber, 1)));
  EXPECT_TRUE(std::isnan(elementary::atan2(1, kNotNumber)));
  EXPECT_TRUE(std::isnan(elementary::atan2(kUnbounded, kUnbounded)));
}

TEST(Elementary, ExponentialIsThatOfTheLibrary) {
  at_many_sizes(1e-18, 699, [](double x) { expect_same_digits(elementary::exp(x), std::exp(x), 0); });
  EXPECT_EQ(elementary::exp(0), 1);
  EXPECT_EQ(elementary::exp(-701), 0);
  EXPECT_EQ(elementary::exp(-kUnbounded), 0);
  EXPECT_EQ(elementary::exp(701), kUnbounded);
  EXPECT_TRUE(std::isnan(elementary::exp(kNotNumber)));
}

// That of doubles is wrong by 6e-16 in some libraries.
TEST(Elementary, CubeRootIsThatOfTheLibraryForLongerNumbers) {
  at_many_sizes(1e-300, 1e300, [](double x) {
    if (x > 0) {
      const auto longer = static_cast<long double>(x);
      expect_same_digits(elementary::cube_root(x), static_cast<double>(std::cbrt(longer)), 0);
    }
  });
  EXPECT_EQ(elementary::cube_root(0), 0);
  EXPECT_EQ(elementary::cube_root(kUnbounded), kUnbounded);
  EXPECT_TRUE(std::isnan(elementary::cube_root(kNotNumber)));
}

TEST(Elementary, RootOfSquaresIsTheHypotenuse) { EXPECT_EQ(elementary::root_of_squares(3, -4), 5); }

}  // namespace
}  // namespace trihedron
