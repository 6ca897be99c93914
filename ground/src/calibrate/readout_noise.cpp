#include "calibrate/readout_noise.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numbers>
#include <vector>

#include "calibrate/at_rest.hpp"
#include "clocks/turns.hpp"
#include "model/scatter.hpp"
#include "model/slews.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/core/optimal_attitude.hpp"

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

/// Sizes of each component of what is looked at.
template <std::size_t Components>
using Sizes = std::array<std::vector<double>, Components>;

/// Sizes of third differences of what is read in samples `lag` apart: add(i, sizes) adds those from sample i on.
/// Without those over a gap.
template <std::size_t Components, class Add>
Sizes<Components> third_differences(const Pass& pass, const Hour& hour, std::size_t lag, const Add& add) {
  const GyroTelemetry& readings = pass.gyro;
  const double period_s = to_seconds(pass.settings.gyro_period);
  const double step_s = static_cast<double>(lag) * period_s;
  const std::size_t every = 2 * (hour.end - hour.begin) / kEnoughDifferences + 1;
  Sizes<Components> sizes;
  for (std::size_t i = hour.begin; i + 3 * lag < hour.end; i += every) {
    const auto is_even = [&](std::size_t j) {
      return std::abs(to_seconds(readings.t[i + (j + 1) * lag] - readings.t[i + j * lag]) - step_s) < kEven * period_s;
    };
    if (is_even(0) && is_even(1) && is_even(2)) {
      add(i, sizes);
    }
  }
  return sizes;
}

/// 1-sigma of what is read by the lags that show most and least of it; 0 where there are too few readings.
struct NoiseOfLags {
  double most = 0;
  double least = 0;

  /// Whether it is as large from one reading to the next as over half a second: what shakes the body, at some
  /// frequency, is not.
  [[nodiscard]] bool is_white() const { return least > 0.8 * most; }
};

/// The root of the mean square of all components, each without its outliers: those of one do not pass for outliers of
/// another that has less noise.
template <std::size_t Components, class AddOfLag>
NoiseOfLags noise_over(const Pass& pass, const Hour& hour, const AddOfLag& add_of_lag) {
  constexpr double kFarthest_s = 0.5;
  const double per_sigma = 1 / std::sqrt(1.0 + 9 + 9 + 1);
  NoiseOfLags noise;
  for (std::size_t lag = 1; lag == 1 || static_cast<double>(lag) * to_seconds(pass.settings.gyro_period) <= kFarthest_s;
       lag *= 2) {
    Sizes<Components> sizes = third_differences<Components>(pass, hour, lag, add_of_lag(lag));
    if (sizes[0].size() * Components < kLeastDifferences) {
      continue;
    }
    double square = 0;
    for (std::vector<double>& of_component : sizes) {
      square += std::pow(per_sigma * sigma_without_outliers(of_component), 2) / Components;
    }
    const double its = std::sqrt(square);
    noise.least = noise.most > 0 ? std::min(noise.least, its) : its;
    noise.most = std::max(noise.most, its);
  }
  return noise;
}

/// Of a gyro, by the components across its momentum. Not of readings that repeat themselves.
NoiseOfLags noise_of_gyro(const Pass& pass, int gyro, const Hour& hour) {
  return noise_over<2>(pass, hour, [&](std::size_t lag) {
    return [&pass, gyro, lag](std::size_t i, Sizes<2>& sizes) {
      const auto h = [&](std::size_t j) { return pass.gyro.direction(i + j * lag, gyro); };
      const Eigen::Vector3d difference = h(3) - h(0) - 3 * (h(2) - h(1));
      const bool repeats = h(0) == h(1) && h(1) == h(2) && h(2) == h(3);
      if (difference.allFinite() && !repeats) {
        const Eigen::Vector3d across = h(1).unitOrthogonal();
        sizes[0].push_back(std::abs(across.dot(difference)));
        sizes[1].push_back(std::abs(h(1).normalized().cross(across).dot(difference)));
      }
    };
  });
}

/// The momentum of each gyro and that of the next one: the angle between them, which no motion of the body changes, and
/// what they do in their plane.
class Pairs {
 public:
  Pairs(const Pass& pass, int gyros) : readings_(pass.gyro) {
    for (int k = 0; k < gyros; ++k) {
      const GyroPrior& prior = pass.settings.gyros[static_cast<std::size_t>(k)];
      C_c_b_[k] = Rot<C, B<1>>::exp(Vec<C>::assume(prior.alignment_rotation_vector_rad)).raw();
    }
  }
  /// As read in a sample, c axes.
  [[nodiscard]] Eigen::Vector3d momentum(std::size_t sample, int gyro) const {
    return C_c_b_[gyro] * readings_.direction(sample, gyro);
  }
  [[nodiscard]] double angle(std::size_t sample, int gyro) const {
    const Eigen::Vector3d a = momentum(sample, gyro);
    const Eigen::Vector3d b = momentum(sample, gyro + 1);
    return std::atan2(a.cross(b).norm(), a.dot(b));
  }

 private:
  const GyroTelemetry& readings_;
  PerGyro<Eigen::Matrix3d> C_c_b_;
};

double noise_of_angle(const Pass& pass, const Pairs& pairs, int gyro, const Hour& hour) {
  const auto add_of_lag = [&](std::size_t lag) {
    return [&pairs, gyro, lag](std::size_t i, Sizes<1>& sizes) {
      const auto angle = [&](std::size_t j) { return pairs.angle(i + j * lag, gyro); };
      const double difference = angle(3) - angle(0) - 3 * (angle(2) - angle(1));
      if (std::isfinite(difference)) {
        sizes[0].push_back(std::abs(difference));
      }
    };
  };
  return noise_over<1>(pass, hour, add_of_lag).most;
}

/// Of both momenta of a pair together, in their plane: as much as of the angle between them where the body is still
/// about the normal of the plane.
double noise_in_plane(const Pass& pass, const Pairs& pairs, int gyro, const Hour& hour) {
  const auto add_of_lag = [&](std::size_t lag) {
    return [&pairs, gyro, lag](std::size_t i, Sizes<2>& sizes) {
      const auto difference = [&](int k) -> Eigen::Vector3d {
        const auto h = [&](std::size_t j) { return pairs.momentum(i + j * lag, k); };
        return h(3) - h(0) - 3 * (h(2) - h(1));
      };
      const Eigen::Vector3d a = pairs.momentum(i + lag, gyro);
      const Eigen::Vector3d b = pairs.momentum(i + lag, gyro + 1);
      const Eigen::Vector3d normal = a.cross(b).normalized();
      const double of_a = normal.cross(a).dot(difference(gyro));
      const double of_b = normal.cross(b).dot(difference(gyro + 1));
      if (std::isfinite(of_a) && std::isfinite(of_b)) {
        sizes[0].push_back(std::abs(of_a));
        sizes[1].push_back(std::abs(of_b));
      }
    };
  };
  return std::numbers::sqrt2 * noise_over<2>(pass, hour, add_of_lag).most;
}

/// That of each gyro, for an hour; 0 where there are too few readings. What shakes the body is in none of the angles:
/// where they show less than the readings, that is divided between the gyros as the settings have it. Unless the body
/// is still about the normal of the momenta's plane and the readings of both gyros are of white noise: then it is noise
/// of axes that the angle does not show.
PerGyro<double> noise_of_hour(const Pass& pass, const Pairs& pairs, int gyros, const Hour& hour) {
  constexpr double kMoreThanChance = 1.2;
  const auto told_rad = [&](int k) { return pass.settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad; };
  PerGyro<double> noise_rad{};
  GyroMask is_white{};
  for (int k = 0; k < gyros; ++k) {
    const NoiseOfLags noise = noise_of_gyro(pass, k, hour);
    noise_rad[k] = noise.most;
    is_white[k] = noise.is_white();
  }
  for (int k = 0; k + 1 < gyros; ++k) {
    const double of_angle = noise_of_angle(pass, pairs, k, hour);
    const double of_readings = std::hypot(noise_rad[k], noise_rad[k + 1]);
    const double told = std::hypot(told_rad(k), told_rad(k + 1));
    const auto is_of_body = [&] {
      return !is_white[k] || !is_white[k + 1] || noise_in_plane(pass, pairs, k, hour) > kMoreThanChance * of_angle;
    };
    if (of_angle > 0 && told > 0 && of_readings > kMoreThanChance * of_angle && is_of_body()) {
      noise_rad[k] = of_angle * told_rad(k) / told;
      noise_rad[k + 1] = of_angle * told_rad(k + 1) / told;
    }
  }
  return noise_rad;
}

/// Of the hours of the pass that have enough readings, gyro by gyro, in ascending order.
PerGyro<std::vector<double>> noise_by_hours(const Pass& pass, const Pairs& pairs, int gyros) {
  const std::size_t size = pass.gyro.size();
  const double hours = static_cast<double>(size) * to_seconds(pass.settings.gyro_period) / 3600;
  const auto stretches = std::max<std::size_t>(static_cast<std::size_t>(hours), 1);
  PerGyro<std::vector<double>> noise_rad;
  for (std::size_t n = 0; n < stretches; ++n) {
    const PerGyro<double> its = noise_of_hour(pass, pairs, gyros, {n * size / stretches, (n + 1) * size / stretches});
    for (int k = 0; k < gyros; ++k) {
      if (its[k] > 0) {
        noise_rad[k].push_back(its[k]);
      }
    }
  }
  for (int k = 0; k < gyros; ++k) {
    std::ranges::sort(noise_rad[k]);
  }
  return noise_rad;
}

/// Samples from which a sixth difference is taken.
constexpr std::size_t kOfSixth = 7;

/// How fast the body turns over a window, as far as the readings show it: rad/s. NaN over a gap.
double rate_over(const Pass& pass, std::size_t first) {
  const GyroTelemetry& readings = pass.gyro;
  const double span_s = (kOfSixth - 1) * to_seconds(pass.settings.gyro_period);
  const std::size_t last = first + kOfSixth - 1;
  if (std::abs(to_seconds(readings.t[last] - readings.t[first]) - span_s) > kEven * span_s) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double turn_rad = 0;
  for (int k = 0; k < readings.gyros; ++k) {
    turn_rad = std::max(turn_rad, (readings.direction(last, k) - readings.direction(first, k)).norm());
  }
  return turn_rad / span_s;
}

/// Size of the sixth difference of an angle. What is as smooth as a polynomial of fifth degree is not in it.
double sixth_difference(const Pairs& pairs, int gyro, std::size_t first) {
  constexpr double kBinomial[kOfSixth] = {1, -6, 15, -20, 15, -6, 1};
  double sum = 0;
  for (std::size_t i = 0; i < kOfSixth; ++i) {
    sum += kBinomial[i] * pairs.angle(first + i, gyro);
  }
  return std::abs(sum);
}

/// Noise of the angles between the momenta where the body turns fast over that where it does not: the most of the pairs
/// of gyros, 1 where the pass has too few such readings.
double noise_in_slews_over_rest(const Pass& pass, const Pairs& pairs, int gyros) {
  constexpr std::size_t kMostSixths = 20000;
  constexpr std::size_t kFewestSixths = 300;
  if (pass.gyro.size() < kOfSixth) {
    return 1;
  }
  const std::size_t windows = pass.gyro.size() - kOfSixth + 1;
  const std::size_t every = windows / kMostSixths + 1;
  std::vector<double> rates;
  for (std::size_t i = 0; i < windows; i += every) {
    rates.push_back(rate_over(pass, i));
  }
  std::vector<double> known;
  std::ranges::copy_if(rates, std::back_inserter(known), [](double rate) { return std::isfinite(rate); });
  const double usual_rad_s = known.empty() ? 0 : median_of(known);
  double most = 1;
  for (int k = 0; k + 1 < gyros; ++k) {
    std::vector<double> in_slews;
    std::vector<double> at_rest;
    for (std::size_t n = 0; n < rates.size(); ++n) {
      const double size = sixth_difference(pairs, k, n * every);
      if (!(size > 0)) {  // readings that are missing, or repeat themselves
        continue;
      }
      if (is_in_slew(rates[n], usual_rad_s)) {
        in_slews.push_back(size);
      } else if (is_at_rest(rates[n], usual_rad_s)) {
        at_rest.push_back(size);
      }
    }
    if (in_slews.size() >= kFewestSixths && at_rest.size() >= kFewestSixths) {
      most = std::max(most, sigma_without_outliers(in_slews) / sigma_without_outliers(at_rest));
    }
  }
  return most;
}

/// Angles between the momenta of a gyro and the next one by readings that are fitted together, as for a fix; no two of
/// these fits share a reading, and there is no spike in them by these 1-sigmas.
struct AnglesOfFits {
  AnglesOfFits(const GyroReadings& readings, const PerGyro<double>& noise_rad, int gyro) {
    const Duration apart = 2 * readings.reach();
    const GyroMask all = all_gyros(readings.gyros());
    std::size_t from = 0;
    Time next = readings.t(0);
    for (std::size_t i = 0; i < readings.size(); ++i) {
      const Time t = readings.t(i);
      if (t < next) {
        continue;
      }
      next = t + apart;
      const std::optional<FittedDirections> fitted = readings.at(t, from);
      if (fitted && fitted->explains(all, noise_rad)) {
        const Eigen::Vector3d& a = fitted->h_b[gyro];
        const Eigen::Vector3d& b = fitted->h_b[gyro + 1];
        angles_rad.push_back(std::atan2(a.cross(b).norm(), a.dot(b)));
        axes_c.emplace_back(a.cross(b).normalized());
        noise_factors.push_back(fitted->noise_factor);
        at_rest.add(to_seconds(t - readings.t(0)), rate_by_directions(fitted->h_b, fitted->h_b_rate, all));
      }
    }
    at_rest.settle();
  }

  AtRest at_rest;
  std::vector<double> angles_rad;
  std::vector<Eigen::Array3d> axes_c;  ///< about which alignments turn the momenta apart
  std::vector<double> noise_factors;   ///< over that of a reading
};

/// Variance of an angle by angles so many fits apart, over `told_rad2`; 1 where it is more by chance alone, or not
/// known.
double variance_over(double told_rad2, const AnglesOfFits& fits, std::size_t lag) {
  constexpr double kMoreThanReadings = 1.2;
  constexpr double kSureOfMore = 5;
  std::vector<double> differences_rad;
  std::vector<double> by_alignments;  // three each
  fits.at_rest.for_each_five(lag, [&](const AtRest::Five& five) {
    std::array<double, 5> angles{};
    std::array<Eigen::Array3d, 5> axes;
    std::ranges::transform(five, angles.begin(), [&](std::size_t i) { return fits.angles_rad[i]; });
    std::ranges::transform(five, axes.begin(), [&](std::size_t i) { return fits.axes_c[i]; });
    const double turned_rad = (axes.back() - axes.front()).matrix().norm();
    if (AtRest::may_be_alignment(std::abs(angles.back() - angles.front()), turned_rad)) {
      differences_rad.push_back(AtRest::fourth_difference(angles));
      const Eigen::Array3d row = AtRest::fourth_difference(axes);
      by_alignments.insert(by_alignments.end(), row.begin(), row.end());
    }
  });
  const auto count = std::ssize(differences_rad);
  if (differences_rad.size() < AtRest::kFewest) {
    return 1;
  }
  const double its_rad = sigmas_less_alignments(Eigen::VectorXd::Map(differences_rad.data(), count),
                                                Eigen::Matrix3Xd::Map(by_alignments.data(), 3, count).transpose(), 1)
                             .value();
  const double chance = AtRest::kChanceOfOne / std::sqrt(static_cast<double>(count));
  const double ratio = its_rad * its_rad / AtRest::kSquares / told_rad2;
  return ratio > std::pow(kMoreThanReadings, 2) + kSureOfMore * chance ? ratio : 1;
}

/// By how much more than single readings of noise without correlation say, these 1-sigmas, the angle between the
/// momenta of a gyro and the next one scatters where readings are fitted together; 1 where it is no more, or not known.
double noise_of_fits_over_told(const GyroReadings& readings, const PerGyro<double>& noise_rad, int gyro) {
  if (readings.size() == 0 || !(noise_rad[gyro] > 0) || !(noise_rad[gyro + 1] > 0)) {
    return 1;
  }
  AnglesOfFits fits(readings, noise_rad, gyro);
  if (fits.noise_factors.empty()) {
    return 1;
  }
  const double told_rad = median_of(fits.noise_factors) * std::hypot(noise_rad[gyro], noise_rad[gyro + 1]);
  double most = 1;
  for (const std::size_t lag : {std::size_t{1}, std::size_t{4}, std::size_t{12}}) {
    most = std::max(most, variance_over(told_rad * told_rad, fits, lag));
  }
  return std::sqrt(most);
}

/// The same of each gyro by itself: it is in all angles to others.
PerGyro<double> lasting_noise(const Pass& pass, const PerGyro<double>& noise_rad, int gyros) {
  const GyroReadings readings(pass);
  PerGyro<double> times{};
  for (int k = 0; k + 1 < gyros; ++k) {
    const double its = noise_of_fits_over_told(readings, noise_rad, k);
    times[k] = k == 0 ? its : std::min(times[k], its);
    times[k + 1] = its;
  }
  return times;
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
  const Pairs pairs(pass, noise.gyros);
  const PerGyro<std::vector<double>> by_hours = noise_by_hours(pass, pairs, noise.gyros);
  bool is_found = noise.gyros >= 2;
  for (int k = 0; k < noise.gyros; ++k) {
    noise.told_rad[k] = noise.found_rad[k] = noise.most_rad[k] =
        pass.settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad;
    noise.lasting[k] = 1;
    if (const std::vector<double>& hours = by_hours[k]; !hours.empty()) {
      noise.found_rad[k] = hours[hours.size() / 2];
      noise.most_rad[k] = hours.back();
    } else {
      is_found = false;
    }
  }
  noise.in_slews = noise_in_slews_over_rest(pass, pairs, noise.gyros);
  if (is_found && noise.is_steady()) {
    noise.lasting = lasting_noise(pass, noise.found_rad, noise.gyros);
  }
  bool is_other = false;
  for (int k = 0; k < noise.gyros; ++k) {
    noise.found_rad[k] *= noise.lasting[k];
    noise.most_rad[k] *= noise.lasting[k];
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
