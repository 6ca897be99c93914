#include "judge/whiteness.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>

#include "model/scatter.hpp"

namespace trihedron::ground {
namespace {

struct Series {
  std::vector<double> t_s;
  std::vector<double> z;  ///< mean 0, unit variance, where the innovations are what the estimator expects
};

std::vector<Series> series_of(const std::vector<FixRecord>& fixes) {
  std::vector<Series> all;
  for (const FixRecord& fix : fixes) {
    if (fix.status != FixStatus::kUsed || fix.head != 0) {
      continue;
    }
    all.resize(std::max(all.size(), fix.innovation.size()));
    for (std::size_t i = 0; i < fix.innovation.size(); ++i) {
      if (fix.innovation_sigma[i] > 0) {
        all[i].t_s.push_back(to_seconds(fix.t.time_since_epoch()));
        all[i].z.push_back(fix.innovation[i] / fix.innovation_sigma[i]);
      }
    }
  }
  constexpr std::size_t kFew = 100;  // ten times the lags
  std::erase_if(all, [](const Series& series) { return series.z.size() <= kFew; });
  return all;
}

double correlation(const std::vector<double>& z, int lag) {
  double product = 0;
  double square = 0;
  for (std::size_t i = 0; i < z.size(); ++i) {
    square += z[i] * z[i];
    product += i < static_cast<std::size_t>(lag) ? 0 : z[i] * z[i - static_cast<std::size_t>(lag)];
  }
  return product / square;
}

/// By how much the variance of a mean is larger than that of white numbers: 1 + 2 Σ r, up to the first lag at which
/// nothing is left of the correlation. What follows is noise of the estimates.
double variance_of_mean(const std::vector<double>& z) {
  constexpr int kMostLags = 200;  // ten minutes, at the usual rate
  double factor = 1;
  for (int lag = 1; lag <= kMostLags; ++lag) {
    const double r = correlation(z, lag);
    if (r <= 0) {
      break;
    }
    factor += 2 * r;
  }
  return factor;
}

Whiteness::Line line_of(const std::vector<Series>& all, int multiple, double orbital_rate_rad_s) {
  Whiteness::Line line{multiple, 0, 2 * static_cast<int>(all.size()), 0};
  for (const Series& series : all) {
    std::complex<double> sum = 0;
    for (std::size_t i = 0; i < series.z.size(); ++i) {
      sum += std::polar(series.z[i], -multiple * orbital_rate_rad_s * series.t_s[i]);
    }
    const auto count = static_cast<double>(series.z.size());
    line.power += std::norm(sum) / count;
    line.amplitude = std::max(line.amplitude, 2 * std::abs(sum) / count);
  }
  return line;
}

/// Mean of the numbers with their signs changed by turns, where none is missing between them.
double alternation(const Series& series) {
  std::vector<double> steps_s(series.t_s.size());
  std::adjacent_difference(series.t_s.begin(), series.t_s.end(), steps_s.begin());
  std::vector<double> sorted_s = steps_s;
  const double step_s = median_of(sorted_s);
  double sum = 0;
  long number = 0;  // step by step: rounded stamps have a step that is not quite right
  for (std::size_t i = 0; i < series.z.size(); ++i) {
    number += i > 0 ? std::lround(steps_s[i] / step_s) : 0;
    const bool is_odd = number % 2 != 0;
    sum += is_odd ? -series.z[i] : series.z[i];
  }
  return std::abs(sum) / static_cast<double>(series.z.size());
}

}  // namespace

Whiteness whiteness(const std::vector<FixRecord>& fixes, double orbital_rate_rad_s) {
  const std::vector<Series> all = series_of(fixes);
  Whiteness result;
  for (const Series& series : all) {
    result.variance_of_mean = std::max(result.variance_of_mean, variance_of_mean(series.z));
    if (const double its = alternation(series); its > result.alternation) {
      result.alternation = its;
      result.alternation_sigma = 1 / std::sqrt(static_cast<double>(series.z.size()));
    }
    for (int lag = 1; lag <= Whiteness::kLags; ++lag) {
      const double r = correlation(series.z, lag);
      result.correlation_square += static_cast<double>(series.z.size()) * r * r;
      ++result.degrees_of_freedom;
      if (std::abs(r) > std::abs(result.largest_correlation)) {
        result.largest_correlation = r;
      }
    }
  }
  for (const int multiple : {1, 2}) {
    if (!all.empty()) {
      result.lines.push_back(line_of(all, multiple, orbital_rate_rad_s));
    }
  }
  return result;
}

}  // namespace trihedron::ground
