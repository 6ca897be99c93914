#include "trihedron/core/elementary.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

namespace trihedron::elementary {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kHalfPi = std::numbers::pi / 2;

/// The nearest whole number; |x| must be below 1e15.
std::int64_t nearest(double x) { return static_cast<std::int64_t>(x < 0 ? x - 0.5 : x + 0.5); }

/// Σ c_k z^k, from the last.
template <std::size_t N>
double polynomial(const std::array<double, N>& c, double z) {
  double sum = c[N - 1];
  for (std::size_t k = N - 1; k > 0; --k) {
    sum = c[k - 1] + z * sum;
  }
  return sum;
}

/// ∓ 1/n! for n = first, first + 2, …, beginning with a minus.
template <std::size_t N>
constexpr std::array<double, N> alternating_factorials(int first) {
  std::array<double, N> c{};
  double factorial = 1;
  const int last = first + 2 * static_cast<int>(N) - 2;
  for (int n = 1; n <= last; ++n) {
    factorial *= n;
    if (n >= first && (n - first) % 2 == 0) {
      c[static_cast<std::size_t>((n - first) / 2)] = ((n - first) % 4 == 0 ? -1 : 1) / factorial;
    }
  }
  return c;
}

/// x less the nearest multiple of π/2, and which multiple, modulo 4. The three parts of π/2 have 33 bits each, so that
/// the products are exact.
struct Reduced {
  double rest;
  int quarter;
};
Reduced reduced(double x) {
  constexpr double kFirst = 1.57079632673412561417e+00;
  constexpr double kSecond = 6.07710050630396597660e-11;
  constexpr double kThird = 2.02226624879595063154e-21;
  const std::int64_t quarters = nearest(x / kHalfPi);
  const auto n = static_cast<double>(quarters);
  return {((x - n * kFirst) - n * kSecond) - n * kThird, static_cast<int>(quarters & 3)};
}

/// |x| ≤ π/4.
double small_sin(double x) {
  static constexpr auto kSeries = alternating_factorials<8>(3);
  const double z = x * x;
  return x + x * z * polynomial(kSeries, z);
}
double small_cos(double x) {
  static constexpr auto kSeries = alternating_factorials<7>(4);
  const double z = x * x;
  return 1 - (z / 2 + z * z * polynomial(kSeries, z));
}

bool in_range(double x) { return x >= -1e6 && x <= 1e6; }

/// 0 ≤ t ≤ 1.
double arc_tangent(double t) {
  constexpr double kTanOfEighth = 0.41421356237309503;  // tan π/8
  static constexpr auto kSeries = [] {
    std::array<double, 22> c{};
    for (std::size_t k = 0; k < c.size(); ++k) {
      c[k] = (k % 2 == 0 ? -1.0 : 1.0) / (2 * static_cast<double>(k) + 3);
    }
    return c;
  }();
  const bool beyond = t > kTanOfEighth;
  const double u = beyond ? (t - 1) / (t + 1) : t;
  const double z = u * u;
  const double angle = u + u * z * polynomial(kSeries, z);
  return beyond ? kHalfPi / 2 + angle : angle;
}

}  // namespace

double sin(double x) {
  if (!in_range(x)) {
    return kNaN;
  }
  const auto [rest, quarter] = reduced(x);
  const double size = quarter % 2 == 0 ? small_sin(rest) : small_cos(rest);
  return quarter < 2 ? size : -size;
}

double cos(double x) {
  if (!in_range(x)) {
    return kNaN;
  }
  const auto [rest, quarter] = reduced(x);
  const double size = quarter % 2 == 0 ? small_cos(rest) : small_sin(rest);
  return quarter == 0 || quarter == 3 ? size : -size;
}

double atan2(double y, double x) {
  const double along = std::abs(x);
  const double across = std::abs(y);
  if (along == 0 && across == 0) {
    return 0;
  }
  const bool steep = across > along;
  double angle = arc_tangent(steep ? along / across : across / along);
  angle = steep ? kHalfPi - angle : angle;
  angle = x < 0 ? std::numbers::pi - angle : angle;
  return y < 0 ? -angle : angle;
}

double exp(double x) {
  constexpr double kLargest = 700;
  if (!(x >= -kLargest)) {
    return x < 0 ? 0 : kNaN;
  }
  if (x > kLargest) {
    return std::numeric_limits<double>::infinity();
  }
  // ln 2 in two parts, the first of 33 bits.
  constexpr double kFirst = 6.93147180369123816490e-01;  // NOLINT(modernize-use-std-numbers): a part of it
  constexpr double kSecond = 1.90821492927058770002e-10;
  static constexpr auto kSeries = [] {
    std::array<double, 14> c{1};
    for (std::size_t k = 1; k < c.size(); ++k) {
      c[k] = c[k - 1] / static_cast<double>(k);
    }
    return c;
  }();
  const std::int64_t twos = nearest(x / std::numbers::ln2);
  const auto n = static_cast<double>(twos);
  const double rest = (x - n * kFirst) - n * kSecond;
  return std::ldexp(polynomial(kSeries, rest), static_cast<int>(twos));
}

double cube_root(double x) {
  if (!(x > 0) || std::isinf(x)) {
    return x;
  }
  int twos = 0;
  static_cast<void>(std::frexp(x, &twos));
  double root = std::ldexp(1.0, twos / 3);  // within a factor of 2
  for (int step = 0; step < 8; ++step) {    // Newton's method doubles the digits
    root -= (root - x / root / root) / 3;
  }
  return root;
}

}  // namespace trihedron::elementary
