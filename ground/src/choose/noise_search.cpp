#include "choose/noise_search.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "choose/decide.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"

namespace trihedron::ground {
namespace {

/// Search for the largest likelihood over a grid of process noise, two integers per point.
class Search {
 public:
  using Point = std::pair<int, int>;
  using At = std::function<ProcessNoise(double, int)>;

  /// Goes from the best of `starts` to the best of its neighbours and so on, within the bounds.
  Search(const Trial& trial, At at, const std::vector<Point>& starts, const Point& lowest, const Point& highest)
      : trial_(trial), linear_(trial.found().linear), at_(std::move(at)) {
    gather_constants(linear_.prior, linear_.prior_y, linear_.stages);
    look_at(starts, true);
    for (std::optional<Point> last; last != best_;) {
      last = best_;
      const auto [i, j] = best_;
      const int less = std::max(i - 1, lowest.first);
      const int more = std::min(i + 1, highest.first);
      const int shorter = std::max(j - 1, lowest.second);
      const int longer = std::min(j + 1, highest.second);
      // Both together as well: what drift that wanders does within minutes is alike where both are more or both less.
      look_at({{less, j}, {more, j}, {i, shorter}, {i, longer}, {less, shorter}, {more, longer}});
    }
  }

  [[nodiscard]] const Point& best_point() const { return best_; }
  /// The best point, its first number by a parabola through its neighbours where it has two.
  [[nodiscard]] NoiseFit best() const {
    const auto [i, j] = best_;
    const double peak = tried_.at(best_);
    const auto below = tried_.find({i - 1, j});
    const auto above = tried_.find({i + 1, j});
    double offset = 0;
    if (below != tried_.end() && above != tried_.end()) {
      offset = (above->second - below->second) / (4 * peak - 2 * below->second - 2 * above->second);
    }
    const auto start = tried_.find({0, 0});
    const double gain = start == tried_.end() ? std::numeric_limits<double>::infinity() : peak - start->second;
    return {at_(i + offset, j), peak, gain};
  }

 private:
  /// `best_matters`: points are left out that are surely less likely than another by kLogOddsToAccept. With noise that
  /// is far too small no field fits, and the search for its spectrum is long.
  void look_at(const std::vector<Point>& points, bool best_matters = false) {
    std::vector<Point> untried;
    std::ranges::copy_if(points, std::back_inserter(untried),
                         [this](const Point& point) { return !tried_.contains(point); });
    const std::vector<Trial::ByNoise> by_noise = on_all_cores(untried.size(), [&](std::size_t i) {
      return trial_.by_noise(linear_, at_(untried[i].first, untried[i].second));
    });
    const auto first = std::ranges::max_element(by_noise, {}, &Trial::ByNoise::at_most);
    const double likely = best_matters ? trial_.log_likelihood(*first) : 0;
    const auto found = on_all_cores(untried.size(), [&](std::size_t i) -> std::optional<double> {
      const Trial::ByNoise& its = by_noise[i];
      if (best_matters && &its == &*first) {
        return likely;
      }
      return best_matters && its.field && its.at_most < likely - kLogOddsToAccept
                 ? std::nullopt
                 : std::optional(trial_.log_likelihood(its));
    });
    for (std::size_t i = 0; i < untried.size(); ++i) {
      if (found[i]) {
        tried_[untried[i]] = *found[i];
      }
    }
    best_ = std::ranges::max_element(tried_, [](const auto& a, const auto& b) { return a.second < b.second; })->first;
  }

  const Trial& trial_;
  PassProblem::Linear linear_;
  At at_;
  std::map<Point, double> tried_;
  Point best_;
};

GaussMarkov wandering_of(const CalibrationOptions& options) {
  return {options.further_states.wandering_drift_rad_s, to_seconds(options.further_states.wandering_time)};
}

/// Starting levels; several, because with an incomplete model the likelihood has more than one maximum.
const std::vector<Search::Point> kAllLevels = {{0, 0}, {3, 0}, {6, 0}, {9, 0}};
constexpr int kMostLevel = 9;

/// Alternates the search for the noise and a refit with it, because the noise decides which fixes are outliers, until a
/// search finds that of the last fit again. Which of several maxima is the largest the first search tells.
NoiseFit converge(Trial& trial, const Search::At& at, std::vector<Search::Point> starts, const Search::Point& lowest,
                  const Search::Point& highest) {
  constexpr int kRounds = 3;
  NoiseFit likely;
  for (int round = 0; round < kRounds; ++round) {
    const ProcessNoise before = trial.problem().setup().noise();
    const Search search(trial, at, starts, lowest, highest);
    std::erase_if(starts, [](const Search::Point& point) { return point != Search::Point(0, 0); });
    if (search.best_point() != Search::Point(0, 0) || starts.empty()) {
      starts.push_back(search.best_point());
    }
    likely = search.best();
    if (alike(before, likely.noise)) {
      trial.set_noise(likely.noise);
      break;
    }
    trial.refit(likely.noise);
  }
  return likely;
}

NoiseFit walk_from(std::vector<Search::Point> starts, Trial& trial, const ProcessNoise& least) {
  const auto at = [least](double level, int) {
    ProcessNoise noise = least;
    noise.direction_random_walk_rad_sqrt_s *= std::pow(2, level);
    return noise;
  };
  return converge(trial, at, std::move(starts), {0, 0}, {kMostLevel, 0});
}

ProcessNoise least_walk(const CalibrationOptions& options) {
  return {std::max(options.direction_random_walk_rad_sqrt_s, kLeastWalk_rad_sqrt_s), wandering_of(options)};
}

/// `levels` of drift that wanders to start from, at each time or at that of the options alone.
NoiseFit wandering_from(const std::vector<int>& levels, bool at_each_time, Trial& trial,
                        const CalibrationOptions& options) {
  constexpr double kShortest_s = 400;
  constexpr double kLongest_s = 3 * 3600;
  const ProcessNoise given{options.direction_random_walk_rad_sqrt_s, wandering_of(options)};
  const auto at = [given](double level, int time) {
    ProcessNoise noise = given;
    noise.wandering_drift.sigma *= std::pow(2, level);
    noise.wandering_drift.time_s *= std::pow(3, time);
    return noise;
  };
  const auto times_within = [&](double limit_s) {
    return static_cast<int>(
        std::floor(std::abs(std::log(given.wandering_drift.time_s / limit_s)) / std::log(3.0) + 1e-6));
  };
  const int shorter = given.wandering_drift.time_s > kShortest_s ? times_within(kShortest_s) : 0;
  const int longer = given.wandering_drift.time_s < kLongest_s ? times_within(kLongest_s) : 0;
  std::vector<Search::Point> starts;
  for (int time = at_each_time ? -shorter : 0; time <= (at_each_time ? longer : 0); ++time) {
    for (const int level : levels) {
      starts.emplace_back(level, time);
    }
  }
  return converge(trial, at, starts, {-5, -shorter}, {7, longer});
}

}  // namespace

NoiseFit with_most_likely_walk(Trial& trial, const CalibrationOptions& options) {
  return walk_from(kAllLevels, trial, least_walk(options));
}

NoiseFit with_most_likely_walk_near(Trial& trial, const CalibrationOptions& options) {
  const ProcessNoise least = least_walk(options);
  const double now_rad_sqrt_s = trial.problem().setup().noise().direction_random_walk_rad_sqrt_s;
  const double level = std::log2(now_rad_sqrt_s / least.direction_random_walk_rad_sqrt_s);
  return walk_from({{std::clamp(static_cast<int>(std::lround(level)), 0, kMostLevel), 0}}, trial, least);
}

NoiseFit with_most_likely_wandering(Trial& trial, const CalibrationOptions& options) {
  return wandering_from({-2, 0, 2, 4}, true, trial, options);
}

NoiseFit with_most_likely_wandering_near(Trial& trial, const CalibrationOptions& options) {
  return wandering_from({0}, false, trial, options);
}

void use_walk(const ProcessNoise& noise, CalibrationOptions& options) {
  options.direction_random_walk_rad_sqrt_s = noise.direction_random_walk_rad_sqrt_s;
}

}  // namespace trihedron::ground
