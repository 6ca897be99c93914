#include "calibrate/readout_noise.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <vector>

#include "model/scatter.hpp"

namespace trihedron::ground {
namespace {

/// Differences from which a noise is told, to some percent, and those that are enough.
constexpr std::size_t kLeastDifferences = 1000;
constexpr std::size_t kEnoughDifferences = 4000;
/// Samples are evenly apart to this part of their period.
constexpr double kEven = 0.05;

/// Samples from one number to before another.
struct Hour {
  std::size_t begin, end;
};

/// Sizes of the components across the momentum of third differences of readings `lag` samples apart, over their
/// 1-sigma by noise of 1. Without those over a gap, and of readings that repeat themselves.
std::vector<double> third_differences(const Pass& pass, int gyro, const Hour& hour, std::size_t lag) {
  const GyroTelemetry& readings = pass.gyro;
  const double period_s = to_seconds(pass.settings.gyro_period);
  const double step_s = static_cast<double>(lag) * period_s;
  const double per_sigma = 1 / std::sqrt(1.0 + 9 + 9 + 1);
  const std::size_t every = 2 * (hour.end - hour.begin) / kEnoughDifferences + 1;
  std::vector<double> differences;
  for (std::size_t i = hour.begin; i + 3 * lag < hour.end; i += every) {
    const auto is_even = [&](std::size_t j) {
      return std::abs(to_seconds(readings.t[i + (j + 1) * lag] - readings.t[i + j * lag]) - step_s) < kEven * period_s;
    };
    const auto h = [&](std::size_t j) { return readings.direction(i + j * lag, gyro); };
    const Eigen::Vector3d difference = per_sigma * (h(3) - h(0) - 3 * (h(2) - h(1)));
    const bool repeats = h(0) == h(1) && h(1) == h(2) && h(2) == h(3);
    if (!is_even(0) || !is_even(1) || !is_even(2) || !difference.allFinite() || repeats) {
      continue;
    }
    const Eigen::Vector3d across = h(1).unitOrthogonal();
    differences.push_back(std::abs(across.dot(difference)));
    differences.push_back(std::abs(h(1).normalized().cross(across).dot(difference)));
  }
  return differences;
}

/// 0 where there are too few readings.
double noise_over(const Pass& pass, int gyro, const Hour& hour) {
  constexpr double kFarthest_s = 0.5;
  double noise_rad = 0;
  for (std::size_t lag = 1; lag == 1 || static_cast<double>(lag) * to_seconds(pass.settings.gyro_period) <= kFarthest_s;
       lag *= 2) {
    std::vector<double> differences = third_differences(pass, gyro, hour, lag);
    if (differences.size() >= kLeastDifferences) {
      noise_rad = std::max(noise_rad, sigma_without_outliers(differences));
    }
  }
  return noise_rad;
}

/// Of the hours of the pass that have enough readings.
std::vector<double> noise_by_hours(const Pass& pass, int gyro) {
  const std::size_t size = pass.gyro.size();
  const double hours = static_cast<double>(size) * to_seconds(pass.settings.gyro_period) / 3600;
  const auto stretches = std::max<std::size_t>(static_cast<std::size_t>(hours), 1);
  std::vector<double> noise_rad;
  for (std::size_t n = 0; n < stretches; ++n) {
    const double its = noise_over(pass, gyro, {n * size / stretches, (n + 1) * size / stretches});
    if (its > 0) {
      noise_rad.push_back(its);
    }
  }
  return noise_rad;
}

}  // namespace

std::optional<ReadoutNoise> other_readout_noise(const Pass& pass) {
  constexpr Duration kSlowest = std::chrono::seconds(1);
  constexpr double kTolerance = 0.2;
  if (pass.settings.gyro_period > kSlowest) {
    return std::nullopt;
  }
  ReadoutNoise noise;
  noise.gyros = std::min({pass.gyro.gyros, static_cast<int>(pass.settings.gyros.size()), kMaxGyros});
  bool is_other = false;
  for (int k = 0; k < noise.gyros; ++k) {
    noise.told_rad[k] = noise.found_rad[k] = noise.most_rad[k] =
        pass.settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad;
    std::vector<double> hours = noise_by_hours(pass, k);
    if (!hours.empty()) {
      std::ranges::sort(hours);
      noise.found_rad[k] = hours[hours.size() / 2];
      noise.most_rad[k] = hours.back();
    }
    is_other = is_other || std::abs(noise.found_rad[k] - noise.told_rad[k]) > kTolerance * noise.told_rad[k];
  }
  return is_other || !noise.is_steady() ? std::optional(noise) : std::nullopt;
}

Pass with(const ReadoutNoise& noise, Pass pass) {
  for (int k = 0; k < noise.gyros; ++k) {
    pass.settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad = noise.found_rad[k];
  }
  return pass;
}

}  // namespace trihedron::ground
