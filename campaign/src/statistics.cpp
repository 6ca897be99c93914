#include "trihedron/campaign/statistics.hpp"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <set>

namespace trihedron::campaign {
namespace {

/// Ranks from 1, equal values with the mean of theirs.
std::vector<double> ranks_of(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return values[i]; });
  std::vector<double> ranks(values.size());
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin + 1;
    while (end < order.size() && values[order[end]] == values[order[begin]]) {
      ++end;
    }
    for (std::size_t i = begin; i < end; ++i) {
      ranks[order[i]] = static_cast<double>(begin + end + 1) / 2;
    }
    begin = end;
  }
  return ranks;
}

}  // namespace

QuantileBounds quantile_bounds(std::span<const double> values, double p, double confidence) {
  const auto n = static_cast<double>(values.size());
  const boost::math::binomial below(n, p);
  QuantileBounds bounds{.p = p, .estimate = 0, .lower = {}, .upper = {}};
  const auto rank = static_cast<std::size_t>(std::ceil(p * n));
  bounds.estimate = values[std::clamp<std::size_t>(rank, 1, values.size()) - 1];
  // The r-th value is not below the quantile where fewer than r of all are below it.
  const auto is_upper = [&](std::size_t r) {
    return boost::math::cdf(below, static_cast<double>(r) - 1) >= confidence;
  };
  // And not above it where r or more are.
  const auto is_lower = [&](std::size_t r) {
    return boost::math::cdf(boost::math::complement(below, static_cast<double>(r) - 1)) >= confidence;
  };
  std::size_t first = 1;  // of those that are upper bounds
  std::size_t end = values.size() + 1;
  for (std::size_t last = end; first < last;) {
    const std::size_t middle = first + (last - first) / 2;
    is_upper(middle) ? last = middle : first = middle + 1;
  }
  if (first < end) {
    bounds.upper = values[first - 1];
  }
  std::size_t last = 0;  // of those that are lower bounds
  for (std::size_t most = values.size(); last < most;) {
    const std::size_t middle = most - (most - last) / 2;
    is_lower(middle) ? last = middle : most = middle - 1;
  }
  if (last > 0) {
    bounds.lower = values[last - 1];
  }
  return bounds;
}

std::size_t runs_needed(double p, double confidence) {
  return static_cast<std::size_t>(std::ceil(std::log1p(-confidence) / std::log(p)));
}

double quantile_supported(std::size_t runs, double confidence) {
  return std::pow(1 - confidence, 1 / static_cast<double>(runs));
}

bool is_share_above(std::size_t count, std::size_t of, double share, double confidence) {
  return count > 0 && boost::math::cdf(boost::math::complement(boost::math::binomial(static_cast<double>(of), share),
                                                               static_cast<double>(count) - 1)) < 1 - confidence;
}

std::vector<double> order_scores(std::span<const double> values, std::span<const char> is_lower_bound) {
  std::vector<double> known;
  std::vector<double> bounds;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isnan(values[i])) {
      (is_lower_bound[i] != 0 ? bounds : known).push_back(values[i]);
    }
  }
  std::ranges::sort(known);
  std::ranges::sort(bounds);
  const auto from = [](const std::vector<double>& sorted, auto first) { return sorted.end() - first; };
  std::vector<double> scores(values.begin(), values.end());  // NaN stays
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double value = values[i];
    if (std::isnan(value)) {
      continue;
    }
    if (is_lower_bound[i] != 0) {
      scores[i] = static_cast<double>(std::ranges::upper_bound(known, value) - known.begin());
      continue;
    }
    const std::ptrdiff_t below = std::ranges::lower_bound(known, value) - known.begin();
    const std::ptrdiff_t above =
        from(known, std::ranges::upper_bound(known, value)) + from(bounds, std::ranges::lower_bound(bounds, value));
    scores[i] = static_cast<double>(below - above);
  }
  return scores;
}

std::optional<RankCorrelation> rank_correlation(std::span<const double> x, std::span<const double> y) {
  std::vector<double> first;
  std::vector<double> second;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isnan(x[i]) && !std::isnan(y[i])) {
      first.push_back(x[i]);
      second.push_back(y[i]);
    }
  }
  constexpr std::size_t kFewest = 10;
  constexpr std::size_t kFewestOfTwoValues = 40;
  const bool has_two_values = std::set(first.begin(), first.end()).size() == 2;
  if (first.size() < (has_two_values ? kFewestOfTwoValues : kFewest)) {
    return std::nullopt;
  }
  first = ranks_of(first);
  second = ranks_of(second);
  const auto n = static_cast<double>(first.size());
  const double mean = (n + 1) / 2;
  double xx = 0;
  double yy = 0;
  double xy = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    xx += (first[i] - mean) * (first[i] - mean);
    yy += (second[i] - mean) * (second[i] - mean);
    xy += (first[i] - mean) * (second[i] - mean);
  }
  if (!(xx > 0 && yy > 0)) {
    return std::nullopt;
  }
  RankCorrelation result{.rho = std::clamp(xy / std::sqrt(xx * yy), -1.0, 1.0), .p_value = 0, .count = first.size()};
  const double rest = 1 - result.rho * result.rho;
  if (rest > 0) {
    const double t = std::abs(result.rho) * std::sqrt((n - 2) / rest);
    result.p_value = 2 * boost::math::cdf(boost::math::complement(boost::math::students_t(n - 2), t));
  }
  return result;
}

ChiSquareBounds chi_square_bounds(double freedom, double share) {
  const boost::math::chi_squared distribution(freedom);
  const double tail = (1 - share) / 2;
  return {boost::math::quantile(distribution, tail) / freedom,
          boost::math::quantile(boost::math::complement(distribution, tail)) / freedom};
}

double chi_square_share(double value, double freedom) {
  return boost::math::cdf(boost::math::chi_squared(freedom), value);
}

double chi_square_quantile(double share, double freedom) {
  return boost::math::quantile(boost::math::chi_squared(freedom), share);
}

}  // namespace trihedron::campaign
