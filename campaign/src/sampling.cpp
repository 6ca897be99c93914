#include "trihedron/campaign/sampling.hpp"

#include <algorithm>
#include <bit>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numeric>

#include "trihedron/records/fnv1a.hpp"
#include "trihedron/sim/random.hpp"

namespace trihedron::campaign {
namespace {

/// The largest number below it: by rounding, a number that is drawn may be 1.
constexpr double kBelowOne = 1 - 0x1p-53;

/// Each part is mixed before the next is added, so that neighbouring seeds and runs give unrelated numbers.
std::uint64_t mixed(std::uint64_t seed, std::uint64_t run, std::uint64_t what) {
  std::uint64_t state = seed;
  state = sim::splitmix64(state) ^ run;
  state = sim::splitmix64(state) ^ what;
  return sim::splitmix64(state);
}

/// Of a number that the distribution takes to the straight line of a standard normal.
double truncated_normal(double u, double from, double to) {
  const boost::math::normal standard;
  // The tail that is nearer to zero keeps its digits.
  if (from > 0) {
    return -truncated_normal(1 - u, -to, -from);
  }
  const double low = boost::math::cdf(standard, from);
  const double high = boost::math::cdf(standard, to);
  const double p = low + u * (high - low);
  return p > 0 && p < 1 ? std::clamp(boost::math::quantile(standard, p), from, to) : (p > 0 ? to : from);
}

/// Points of the grids over settings, or of those over values of the scenario.
std::uint64_t grid_points(const CampaignPlan& plan, bool of_settings) {
  std::uint64_t points = 1;
  for (const CampaignInput& input : plan.inputs) {
    if (input.distribution.kind == Distribution::Kind::kGrid && input.is_setting() == of_settings) {
      points *= input.distribution.options;
    }
  }
  return points;
}

/// A point of some grids, taken apart into the options of each: the last grid changes first.
struct GridPoint {
  std::uint64_t left = 0;   ///< number of the point among those that the grids before leave
  std::uint64_t below = 1;  ///< points that the grids before leave

  std::uint64_t option_of(const Distribution& grid) {
    below /= grid.options;
    const std::uint64_t option = left / below;
    left %= below;
    return option;
  }
};

}  // namespace

std::uint64_t flights_of(const CampaignPlan& plan) { return plan.runs / grid_points(plan, true); }

std::uint64_t flight_of_run(const CampaignPlan& plan, std::uint64_t run) { return run % flights_of(plan); }

std::uint64_t seed_of_run(const CampaignPlan& plan, std::uint64_t run) {
  return mixed(plan.seed, flight_of_run(plan, run), fnv1a("scenario.seed")) >> 1U;
}

double uniform_of(std::uint64_t seed, std::uint64_t flight, std::string_view key) {
  return std::min((static_cast<double>(mixed(seed, flight, fnv1a(key)) >> 11U) + 0.5) * 0x1p-53, kBelowOne);
}

double quantile_of(const Distribution& distribution, double u) {
  const auto& [kind, a, b, least, most, weights, options] = distribution;
  switch (kind) {
    case Distribution::Kind::kUniform:
      return std::clamp(a + u * (b - a), least, most);
    case Distribution::Kind::kLoguniform:
      return std::clamp(a * std::pow(b / a, u), least, most);
    case Distribution::Kind::kNormal:
      return std::clamp(a + b * truncated_normal(u, (least - a) / b, (most - a) / b), least, most);
    case Distribution::Kind::kLognormal: {
      const double sigma = std::log(b);
      return std::clamp(
          a * std::exp(sigma * truncated_normal(u, std::log(least / a) / sigma, std::log(most / a) / sigma)), least,
          most);
    }
    case Distribution::Kind::kChoice: {
      double left = u * std::accumulate(weights.begin(), weights.end(), 0.0);
      std::size_t i = 0;
      while (i + 1 < weights.size() && left >= weights[i]) {
        left -= weights[i++];
      }
      return static_cast<double>(i);
    }
    case Distribution::Kind::kGrid:
    case Distribution::Kind::kFollows:
      break;
  }
  return 0;
}

std::uint64_t permuted(std::uint64_t i, std::uint64_t count, std::uint64_t key) {
  constexpr unsigned kRounds = 8;
  const unsigned half = std::max((static_cast<unsigned>(std::bit_width(count - 1)) + 1) / 2, 1U);
  const std::uint64_t mask = (std::uint64_t{1} << half) - 1;
  do {
    std::uint64_t left = i >> half;
    std::uint64_t right = i & mask;
    for (unsigned round = 0; round < kRounds; ++round) {
      const std::uint64_t next = left ^ (mixed(key, round, right) & mask);
      left = right;
      right = next;
    }
    i = (left << half) | right;
  } while (i >= count);
  return i;
}

std::vector<double> draws_of_run(const CampaignPlan& plan, std::uint64_t run) {
  using Kind = Distribution::Kind;
  const std::uint64_t flights = flights_of(plan);
  const std::uint64_t flight = flight_of_run(plan, run);
  GridPoint of_scenario{flight / plan.repeats, grid_points(plan, false)};
  GridPoint of_settings{run / flights, grid_points(plan, true)};
  std::vector<double> draws;
  for (const CampaignInput& input : plan.inputs) {
    if (input.distribution.kind == Kind::kGrid) {
      GridPoint& point = input.is_setting() ? of_settings : of_scenario;
      draws.push_back(static_cast<double>(point.option_of(input.distribution)));
      continue;
    }
    double u = uniform_of(plan.seed, flight, input.key);
    if (plan.latin_hypercube) {
      const std::uint64_t stratum = permuted(flight, flights, mixed(plan.seed, 0, fnv1a("order of " + input.key)));
      u = std::min((static_cast<double>(stratum) + u) / static_cast<double>(flights), kBelowOne);
    }
    draws.push_back(quantile_of(input.distribution, u));
  }
  for (std::size_t i = 0; i < draws.size(); ++i) {
    const CampaignInput& input = plan.inputs[i];
    if (input.distribution.kind == Kind::kFollows) {
      draws[i] = input.distribution.a * plan.inputs[input.followed].shown(draws[input.followed]);
    }
  }
  return draws;
}

}  // namespace trihedron::campaign
