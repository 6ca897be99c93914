#include "calibrate/bursts.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "clocks/turns.hpp"
#include "model/scatter.hpp"

namespace trihedron::ground {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Duration kSlowestSamples = std::chrono::seconds(1);
constexpr double kLongestBurst_s = 4;
constexpr std::size_t kLongest = 32;  // samples of a burst; the lengths looked for are 2, 4, 8 and so on
/// The course is the median of what is read from this long before to this long after, by means over half a second.
constexpr double kCourse_s = 6;
constexpr double kMeanOver_s = 0.5;
constexpr double kBeyond = 8;  // sigmas of a sum

/// Samples from one number to before another, between which there is no gap, or which are a burst.
struct Span {
  std::size_t begin = 0, end = 0;

  [[nodiscard]] std::size_t size() const { return end - begin; }
};

std::vector<Span> spans_without_gaps(const std::vector<Time>& t, Duration period) {
  std::vector<Span> spans;
  for (std::size_t i = 0, begin = 0; i < t.size(); ++i) {
    if (i + 1 == t.size() || t[i + 1] - t[i] > 3 * period) {
      spans.push_back({begin, i + 1});
      begin = i + 1;
    }
  }
  return spans;
}

double median_of_known(std::span<const double> values) {
  std::vector<double> known;
  std::ranges::copy_if(values, std::back_inserter(known), [](double value) { return std::isfinite(value); });
  return known.empty() ? kNaN : median_of(known);
}

/// The numbers among some values that come and go, in order.
class SortedKnown {
 public:
  void add(double value) {
    if (std::isfinite(value)) {
      sorted_.insert(std::ranges::lower_bound(sorted_, value), value);
    }
  }
  /// Takes away one that was added.
  void remove(double value) {
    if (std::isfinite(value)) {
      sorted_.erase(std::ranges::lower_bound(sorted_, value));
    }
  }
  /// As median_of(); NaN where there is none.
  [[nodiscard]] double median() const { return sorted_.empty() ? kNaN : sorted_[sorted_.size() / 2]; }

 private:
  std::vector<double> sorted_;
};

/// What an angle is off its course, sample by sample; NaN where it is not known, or too near to an end of the span.
class OffCourse {
 public:
  OffCourse(std::span<const double> angles_rad, double period_s)
      : per_mean_(std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(kMeanOver_s / period_s)))),
        means_(angles_rad.size() / per_mean_),
        off_rad_(angles_rad.size(), kNaN) {
    for (std::size_t j = 0; j < means_.size(); ++j) {
      double sum = 0;
      int count = 0;
      for (const double angle : angles_rad.subspan(j * per_mean_, per_mean_)) {
        sum += std::isfinite(angle) ? angle : 0;
        count += std::isfinite(angle) ? 1 : 0;
      }
      means_[j] = count > 0 ? sum / count : kNaN;
    }
    constexpr std::size_t kFewestMeans = 6;
    const double mean_s = static_cast<double>(per_mean_) * period_s;
    const std::size_t half = std::max(kFewestMeans, static_cast<std::size_t>(std::ceil(kCourse_s / mean_s)));
    course_.assign(means_.size(), kNaN);
    SortedKnown around;
    for (std::size_t j = 0; j < means_.size(); ++j) {
      around.add(means_[j]);
      if (j >= 2 * half) {
        course_[j - half] = around.median();
        around.remove(means_[j - 2 * half]);
      }
    }
    for (std::size_t i = 0; i < off_rad_.size(); ++i) {
      off_rad_[i] = angles_rad[i] - course_at(i);
    }
  }

  [[nodiscard]] const std::vector<double>& rad() const { return off_rad_; }

  /// By how much the course is another after a burst than before it.
  [[nodiscard]] double step_over(const Span& burst) const {
    const std::size_t before = burst.begin / per_mean_;
    const std::size_t after = burst.end / per_mean_;
    constexpr std::size_t kBlocksBeside = 2;
    return before < kBlocksBeside || after + kBlocksBeside >= course_.size()
               ? kNaN
               : course_[after + kBlocksBeside] - course_[before - kBlocksBeside];
  }

 private:
  /// Means are of the middles of their samples.
  [[nodiscard]] double course_at(std::size_t sample) const {
    const double at = (static_cast<double>(sample) + 0.5) / static_cast<double>(per_mean_) - 0.5;
    const auto j = static_cast<std::size_t>(std::max(at, 0.0));
    return j + 1 < course_.size() ? course_[j] + (at - static_cast<double>(j)) * (course_[j + 1] - course_[j]) : kNaN;
  }

  std::size_t per_mean_;
  std::vector<double> means_;
  std::vector<double> course_;
  std::vector<double> off_rad_;
};

/// 1-sigma of sums over so many samples, minute by minute; not less than in most of the pass, or than is told of them.
class SigmaOfSums {
 public:
  SigmaOfSums(std::span<const double> sums, double period_s, double told)
      : per_minute_(std::max<std::size_t>(1, static_cast<std::size_t>(60 / period_s))) {
    constexpr double kSigmaPerMedian = 1.4826;
    for (std::size_t from = 0; from < sums.size(); from += per_minute_) {
      std::vector<double> sizes;
      for (const double sum : sums.subspan(from, std::min(per_minute_, sums.size() - from))) {
        if (std::isfinite(sum)) {
          sizes.push_back(std::abs(sum));
        }
      }
      sigmas_.push_back(sizes.empty() ? kNaN : kSigmaPerMedian * median_of(sizes));
    }
    least_ = std::max(told, median_of_known(sigmas_));
  }
  [[nodiscard]] double at(std::size_t sample) const {
    const double its = sigmas_[sample / per_minute_];
    return its > least_ ? its : least_;
  }

 private:
  std::size_t per_minute_;
  std::vector<double> sigmas_;
  double least_ = 0;
};

/// Sums over twice as many samples, from each one on; `sums`: over `length`.
std::vector<double> sums_over_twice(std::size_t length, const std::vector<double>& sums) {
  std::vector<double> twice(sums.size(), kNaN);
  for (std::size_t i = 0; i + length < sums.size(); ++i) {
    twice[i] = sums[i] + sums[i + length];
  }
  return twice;
}

/// The angle between the momenta of two gyros, sample by sample; NaN where it is not known. Less what turns of the one
/// case against the other make of it as the body turns: these are not known before to more than a degree, and over
/// seconds an angle off by them is no straight line in slews.
std::vector<double> angles_between(const GyroReadings& readings, int one, int other, double period_s) {
  constexpr double kApart_s = 8;
  constexpr double kOutlier = 4;
  std::vector<double> angles_rad(readings.size(), kNaN);
  std::vector<Eigen::Vector3d> axes_c(readings.size(), Eigen::Vector3d::Zero());
  const auto repeats = [&](std::size_t i, int gyro) {
    return i > 0 && readings.reading(i, gyro) == readings.reading(i - 1, gyro);
  };
  for (std::size_t i = 0; i < angles_rad.size(); ++i) {
    if (repeats(i, one) || repeats(i, other)) {
      continue;
    }
    if (const auto a = readings.reading(i, one), b = readings.reading(i, other); a && b) {
      const Eigen::Vector3d normal = a->cross(*b);
      axes_c[i] = normal.normalized();
      angles_rad[i] = std::atan2(normal.norm(), a->dot(*b));
    }
  }
  // Differences over seconds by the turn of the axis and by drift.
  const auto apart = static_cast<std::size_t>(std::ceil(kApart_s / period_s));
  std::vector<Eigen::Vector4d> rows;
  std::vector<double> differences_rad;
  for (std::size_t i = 0; i + apart < angles_rad.size(); i += apart) {
    const double difference = angles_rad[i + apart] - angles_rad[i];
    const double span_s = to_seconds(readings.t(i + apart) - readings.t(i));
    if (std::isfinite(difference) && span_s < 2 * kApart_s) {
      Eigen::Vector4d& row = rows.emplace_back();
      row << axes_c[i + apart] - axes_c[i], span_s;
      differences_rad.push_back(difference);
    }
  }
  Eigen::Vector4d x = Eigen::Vector4d::Zero();
  double gate_rad = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 3; ++round) {
    Eigen::Matrix4d N = 1e-12 * Eigen::Matrix4d::Identity();
    Eigen::Vector4d y = Eigen::Vector4d::Zero();
    std::vector<double> sizes;
    for (std::size_t n = 0; n < rows.size(); ++n) {
      const double off = differences_rad[n] - rows[n].dot(x);
      sizes.push_back(std::abs(off));
      if (std::abs(off) <= gate_rad) {
        N += rows[n] * rows[n].transpose();
        y += differences_rad[n] * rows[n];
      }
    }
    x = N.ldlt().solve(y);
    gate_rad = sizes.empty() ? 0 : kOutlier * sigma_without_outliers(sizes);
  }
  for (std::size_t i = 0; i < angles_rad.size(); ++i) {
    angles_rad[i] -= axes_c[i].dot(x.head<3>());
  }
  return angles_rad;
}

struct Burst {
  Span samples;
  double sigmas = 0;
  double off_rad = 0;
};

/// Goes on to both sides as long as single samples are clearly off.
Span widened(Span burst, const std::vector<double>& off, double sigma) {
  constexpr double kClearly = 3;
  while (burst.begin > 0 && std::abs(off[burst.begin - 1]) > kClearly * sigma) {
    --burst.begin;
  }
  while (burst.end < off.size() && std::abs(off[burst.end]) > kClearly * sigma) {
    ++burst.end;
  }
  return {burst.begin - std::min<std::size_t>(burst.begin, 1), std::min(burst.end + 1, off.size())};
}

/// Whether most of these samples are off, and to the same side: not some wild ones among good ones.
bool is_of_most(const Span& burst, const std::vector<double>& off) {
  const auto its = std::span(off).subspan(burst.begin, burst.size());
  double sum = 0;
  for (const double each : its) {
    sum += each;
  }
  std::vector<double> sorted(its.begin(), its.end());
  std::ranges::sort(sorted, [&](double a, double b) { return sum > 0 ? a < b : a > b; });
  const double middle = sorted[(sorted.size() - 1) / 2];
  return 2 * middle * static_cast<double>(its.size()) / sum > 1;
}

/// Of one angle over a span without gaps. `told_rad`: 1-sigma of a reading of it.
std::vector<Burst> bursts_in(std::span<const double> angles_rad, double period_s, double told_rad) {
  const OffCourse course(angles_rad, period_s);
  const std::vector<double>& off = course.rad();
  std::vector<Burst> likely;
  std::vector<double> sums = off;
  for (std::size_t length = 2; length <= kLongest && static_cast<double>(length) * period_s <= kLongestBurst_s;
       length *= 2) {
    sums = sums_over_twice(length / 2, sums);
    const SigmaOfSums sigma(sums, period_s, told_rad * std::sqrt(static_cast<double>(length)));
    for (std::size_t i = 0; i < sums.size(); ++i) {
      if (const double sigmas = std::abs(sums[i]) / sigma.at(i); sigmas > kBeyond) {
        likely.push_back({{i, i + length}, sigmas, std::abs(sums[i]) / static_cast<double>(length)});
      }
    }
  }
  std::ranges::sort(likely, [](const Burst& a, const Burst& b) { return a.sigmas > b.sigmas; });
  std::vector<Burst> bursts;
  std::vector<char> is_taken(off.size());
  const SigmaOfSums of_one(off, period_s, told_rad);
  const auto longest = static_cast<std::size_t>(kLongestBurst_s / period_s);
  for (Burst burst : likely) {
    const bool is_even = is_of_most(burst.samples, off);
    burst.samples = widened(burst.samples, off, of_one.at(burst.samples.begin));
    const std::span taken = std::span(is_taken).subspan(burst.samples.begin, burst.samples.size());
    const bool comes_back = std::abs(course.step_over(burst.samples)) < burst.off_rad / 2;
    if (std::ranges::count(taken, 1) == 0 && comes_back && is_even && burst.samples.size() <= longest + 2) {
      std::ranges::fill(taken, 1);
      bursts.push_back(burst);
    }
  }
  return bursts;
}

}  // namespace

std::optional<WrongReadings> wrong_for_a_moment(const Pass& pass) {
  const GyroReadings readings(pass);
  const int gyros = readings.gyros();
  if (gyros < 2 || pass.settings.gyro_period > kSlowestSamples) {
    return std::nullopt;
  }
  const double period_s = to_seconds(pass.settings.gyro_period);
  const auto told_rad = [&](int k) { return pass.settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad; };
  const std::vector<Span> spans = spans_without_gaps(pass.gyro.t, pass.settings.gyro_period);
  std::vector<PerGyro<int>> angles_off(pass.gyro.size());  // of each gyro, to others
  WrongReadings wrong{{}, std::vector<GyroMask>(pass.gyro.size())};
  for (int k = 0; k < gyros; ++k) {
    for (int j = k + 1; j < gyros; ++j) {
      const std::vector<double> angles_rad = angles_between(readings, k, j, period_s);
      for (const Span& span : spans) {
        const auto its = std::span(angles_rad).subspan(span.begin, span.size());
        for (const Burst& burst : bursts_in(its, period_s, std::hypot(told_rad(k), told_rad(j)))) {
          for (std::size_t i = span.begin + burst.samples.begin; i < span.begin + burst.samples.end; ++i) {
            ++angles_off[i][k];
            ++angles_off[i][j];
          }
          wrong.bursts.largest_rad = std::max(wrong.bursts.largest_rad, burst.off_rad);
        }
      }
    }
  }
  bool before = false;
  for (std::size_t i = 0; i < angles_off.size(); ++i) {
    for (int k = 0; k < gyros; ++k) {
      wrong.gyros[i][k] = angles_off[i][k] == gyros - 1;
    }
    const bool any = count(wrong.gyros[i]) > 0;
    wrong.bursts.samples += any ? 1 : 0;
    wrong.bursts.bursts += any && !before ? 1 : 0;
    before = any;
  }
  return wrong.bursts.samples > 0 ? std::optional(std::move(wrong)) : std::nullopt;
}

std::optional<Pass> without(const WrongReadings& wrong, const Pass& pass) {
  constexpr long kTooMany = 20;  // one in so many
  if (kTooMany * wrong.bursts.samples > std::ssize(pass.gyro.t)) {
    return std::nullopt;
  }
  Pass rest = pass;
  rest.gyro.t.clear();
  rest.gyro.h.clear();
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    if (pass.gyro.gyros - count(wrong.gyros[i]) < 2) {
      continue;
    }
    rest.gyro.t.push_back(pass.gyro.t[i]);
    for (int k = 0; k < pass.gyro.gyros; ++k) {
      const bool is_wrong = k < kMaxGyros && wrong.gyros[i][k];
      const Eigen::Vector3d h_b = is_wrong ? Eigen::Vector3d::Constant(kNaN).eval() : pass.gyro.direction(i, k);
      rest.gyro.h.insert(rest.gyro.h.end(), h_b.begin(), h_b.end());
    }
  }
  return rest;
}

}  // namespace trihedron::ground
