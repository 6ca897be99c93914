#pragma once
/// Estimates of a sequence's statistics, and how far they may be from the truth by chance.

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

namespace trihedron::sim::test {

using Sequence = std::vector<double>;

/// Band of chance in sigmas. Seeds are fixed, so it guards the choice of seed only: by chance 1 claim of 1.7 million
/// fails.
inline constexpr double kBand = 5;

inline double mean(const Sequence& x) {
  double sum = 0;
  for (const double value : x) {
    sum += value;
  }
  return sum / static_cast<double>(x.size());
}

/// About a mean known to be zero.
inline double mean_square(const Sequence& x) {
  double sum = 0;
  for (const double value : x) {
    sum += value * value;
  }
  return sum / static_cast<double>(x.size());
}

/// Sample correlation of two zero-mean sequences, y taken `lag` later.
inline double correlation(const Sequence& x, const Sequence& y, std::size_t lag = 0) {
  const std::size_t n = x.size() - lag;
  double xy = 0;
  for (std::size_t i = 0; i < n; ++i) {
    xy += x[i] * y[i + lag];
  }
  return xy / static_cast<double>(n) / std::sqrt(mean_square(x) * mean_square(y));
}

/// Chance of mean_square against its expectation, relative, 1-sigma: χ² with n degrees of freedom, √(2/n).
inline double mean_square_sigma(std::size_t n) { return std::sqrt(2 / static_cast<double>(n)); }

/// Chance of a correlation that is zero, 1-sigma.
inline double correlation_sigma(std::size_t n) { return 1 / std::sqrt(static_cast<double>(n)); }

/// Allan variance over blocks of m samples, not overlapping (IEEE Std 952).
inline double allan_variance(const Sequence& x, std::size_t m) {
  Sequence averages;
  for (std::size_t begin = 0; begin + m <= x.size(); begin += m) {
    averages.push_back(mean(
        Sequence(x.begin() + static_cast<std::ptrdiff_t>(begin), x.begin() + static_cast<std::ptrdiff_t>(begin + m))));
  }
  double sum = 0;
  for (std::size_t i = 1; i < averages.size(); ++i) {
    sum += std::pow(averages[i] - averages[i - 1], 2);
  }
  return sum / (2 * static_cast<double>(averages.size() - 1));
}

/// Chance of allan_variance, relative, 1-sigma, for white noise and k blocks: differences share blocks, √(3/(k − 1)).
inline double allan_variance_sigma(std::size_t blocks) { return std::sqrt(3 / (static_cast<double>(blocks) - 1)); }

/// Power of x at a frequency in cycles per sample, by the definition of the Fourier sum.
inline double power_at(const Sequence& x, double frequency) {
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sum += x[i] * std::polar(1.0, -2 * std::numbers::pi * frequency * static_cast<double>(i));
  }
  return std::norm(sum) / static_cast<double>(x.size());
}

}  // namespace trihedron::sim::test
