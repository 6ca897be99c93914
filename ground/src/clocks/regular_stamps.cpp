#include "trihedron/ground/clocks/regular_stamps.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "model/scatter.hpp"

namespace trihedron::ground {
namespace {

/// Samples to both sides over which stamps are averaged.
constexpr std::size_t kAverage = 2048;
/// Periods that two samples of a stretch may be apart.
constexpr double kMostPeriodsApart = 10;
/// Part of the period below which nothing is to be gained.
constexpr double kRegular = 2e-3;
/// Of the sum of differences, in its sigmas; neighbours have readings in common.
constexpr double kSureSigmas = 10;
/// Noises of a reading beyond which it is off for another reason.
constexpr double kMostNoises = 30;

/// Samples `begin` to `end`, each so many whole periods after the first.
struct SampleStretch {
  std::size_t begin = 0;
  std::vector<double> periods;
};

double median_step_s(const std::vector<Time>& t) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < t.size(); ++i) {
    steps.push_back(to_seconds(t[i] - t[i - 1]));
  }
  return median_of(steps);
}

std::vector<SampleStretch> stretches_of(const std::vector<Time>& t, double period_s) {
  std::vector<SampleStretch> stretches = {{0, {0}}};
  for (std::size_t i = 1; i < t.size(); ++i) {
    const double periods = std::round(to_seconds(t[i] - t[i - 1]) / period_s);
    if (periods >= 1 && periods <= kMostPeriodsApart) {
      stretches.back().periods.push_back(stretches.back().periods.back() + periods);
    } else {
      stretches.push_back({i, {0}});
    }
  }
  std::erase_if(stretches, [](const SampleStretch& its) { return its.periods.size() < 2 * kAverage; });
  return stretches;
}

/// The line through its stamps, and along it the mean of what they are off.
void make_regular(const SampleStretch& its, std::vector<Time>& t) {
  const std::size_t size = its.periods.size();
  const auto count = static_cast<double>(size);
  const Time first = t[its.begin];
  std::vector<double> x(size);
  double mean_n = 0;
  double mean_x = 0;
  for (std::size_t i = 0; i < size; ++i) {
    x[i] = to_seconds(t[its.begin + i] - first);
    mean_n += its.periods[i] / count;
    mean_x += x[i] / count;
  }
  double square = 0;
  double product = 0;
  for (std::size_t i = 0; i < size; ++i) {
    square += (its.periods[i] - mean_n) * (its.periods[i] - mean_n);
    product += (its.periods[i] - mean_n) * (x[i] - mean_x);
  }
  const double period_s = product / square;
  std::vector<double> sums(size + 1, 0);
  for (std::size_t i = 0; i < size; ++i) {
    sums[i + 1] = sums[i] + x[i] - period_s * its.periods[i];
  }
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t from = i < kAverage ? 0 : i - kAverage;
    const std::size_t to = std::min(i + kAverage + 1, size);
    const double off_s = (sums[to] - sums[from]) / static_cast<double>(to - from);
    t[its.begin + i] = first + from_seconds(period_s * its.periods[i] + off_s);
  }
}

/// Square of what a direction is off the line between its neighbours, in its expectation by noise of 1.
double square_off(const GyroTelemetry& gyro, const std::vector<Time>& t, std::size_t i, int k) {
  const double part = to_seconds(t[i] - t[i - 1]) / to_seconds(t[i + 1] - t[i - 1]);
  const Eigen::Vector3d off =
      gyro.direction(i, k) - (1 - part) * gyro.direction(i - 1, k) - part * gyro.direction(i + 1, k);
  return off.squaredNorm() / (1 + (1 - part) * (1 - part) + part * part);
}

/// Whether the directions are sure to go on more evenly by `regular` than by the stamps.
bool are_more_even(const Pass& pass, const std::vector<SampleStretch>& stretches, const std::vector<Time>& regular) {
  double sum = 0;
  double squares = 0;
  for (int k = 0; k < std::min(pass.gyro.gyros, static_cast<int>(pass.settings.gyros.size())); ++k) {
    const double noise_rad = pass.settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad;
    const double most = kMostNoises * kMostNoises * noise_rad * noise_rad;
    for (const SampleStretch& its : stretches) {
      for (std::size_t i = its.begin + 1; i + 1 < its.begin + its.periods.size(); ++i) {
        const double by_stamps = square_off(pass.gyro, pass.gyro.t, i, k);
        const double by_regular = square_off(pass.gyro, regular, i, k);
        const double gained = std::min(by_stamps, most) - std::min(by_regular, most);
        if (std::isfinite(by_stamps) && std::isfinite(by_regular)) {
          sum += gained;
          squares += gained * gained;
        }
      }
    }
  }
  return sum > kSureSigmas * std::sqrt(squares);
}

}  // namespace

std::optional<RegularStamps> regular_stamps(const Pass& pass) {
  const std::vector<Time>& t = pass.gyro.t;
  if (t.size() < 2 * kAverage) {
    return std::nullopt;
  }
  const double period_s = median_step_s(t);
  if (!(period_s > 0)) {
    return std::nullopt;
  }
  const std::vector<SampleStretch> stretches = stretches_of(t, period_s);
  RegularStamps found{t, 0};
  double squares = 0;
  double count = 0;
  for (const SampleStretch& its : stretches) {
    make_regular(its, found.t);
    for (std::size_t i = its.begin; i < its.begin + its.periods.size(); ++i) {
      squares += std::pow(to_seconds(t[i] - found.t[i]), 2);
      ++count;
    }
  }
  found.scatter_s = std::sqrt(squares / std::max(count, 1.0));
  const bool in_order = std::ranges::is_sorted(found.t) || !std::ranges::is_sorted(t);
  if (!(found.scatter_s > kRegular * period_s) || !in_order || !are_more_even(pass, stretches, found.t)) {
    return std::nullopt;
  }
  return found;
}

}  // namespace trihedron::ground
