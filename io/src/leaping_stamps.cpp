#include "leaping_stamps.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "trihedron/core/per_gyro.hpp"

namespace trihedron::io {
namespace {

constexpr Duration kLongestLeap = std::chrono::minutes(10);
/// Steps on either side of a leap by which the rate there is known.
constexpr std::size_t kMostAtRate = 8;
constexpr std::size_t kFewestAtRate = 3;
/// Of a period, by which a step may be longer or shorter and still be one of it.
constexpr double kRegular = 0.5;
/// How much further from what the rate says the readings are by a wrong time than by the right one, and than they
/// scatter.
constexpr double kSure = 8;

using Directions = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3 * kMaxGyros, 1>;

/// All directions of a row below each other, as they follow upon one another.
class Readings {
 public:
  Readings(const Series& series, const std::vector<std::size_t>& rows, const std::vector<Time>& t, double period_s)
      : series_(series), rows_(rows), t_(t), period_s_(period_s) {}

  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  [[nodiscard]] Time t(std::size_t i) const { return t_[rows_[i]]; }
  /// From the row before to row i.
  [[nodiscard]] double step_s(std::size_t i) const { return to_seconds(t(i) - t(i - 1)); }
  [[nodiscard]] bool is_regular(std::size_t i) const { return std::abs(step_s(i) - period_s_) < kRegular * period_s_; }
  [[nodiscard]] Directions change(std::size_t from, std::size_t to) const { return row(to) - row(from); }

  /// Whether by steps of `true_s` from the row before to row i, and by no step as it is stamped, the readings go on as
  /// they do on either side.
  [[nodiscard]] bool go_on_by(double true_s, std::size_t i) const {
    const std::size_t before = steps_up_to(i - 1);
    const std::size_t after = steps_from(i);
    if (std::min(before, after) < kFewestAtRate) {
      return false;
    }
    const Directions rate_before = change(i - 1 - before, i - 1) / to_seconds(t(i - 1) - t(i - 1 - before));
    const Directions rate_after = change(i, i + after) / to_seconds(t(i + after) - t(i));
    double scatter = 0;
    for (std::size_t j = i - before; j < i; ++j) {
      scatter += (change(j - 1, j) - rate_before * step_s(j)).squaredNorm();
    }
    for (std::size_t j = i + 1; j <= i + after; ++j) {
      scatter += (change(j - 1, j) - rate_after * step_s(j)).squaredNorm();
    }
    scatter /= static_cast<double>(before + after);
    const Directions rate = (rate_before + rate_after) / 2;
    const Directions its = change(i - 1, i);
    const double right = (its - rate * true_s).squaredNorm();
    return (its - rate * step_s(i)).squaredNorm() > kSure * kSure * (right + scatter);  // false where one is NaN
  }

 private:
  [[nodiscard]] Eigen::Map<const Eigen::VectorXd> row(std::size_t i) const {
    return {series_.row(rows_[i]), static_cast<Eigen::Index>(series_.columns.size())};
  }
  [[nodiscard]] std::size_t steps_up_to(std::size_t last) const {
    std::size_t steps = 0;
    while (steps < kMostAtRate && steps < last && is_regular(last - steps)) {
      ++steps;
    }
    return steps;
  }
  [[nodiscard]] std::size_t steps_from(std::size_t first) const {
    std::size_t steps = 0;
    while (steps < kMostAtRate && first + steps + 1 < size() && is_regular(first + steps + 1)) {
      ++steps;
    }
    return steps;
  }

  const Series& series_;
  const std::vector<std::size_t>& rows_;
  const std::vector<Time>& t_;
  double period_s_;
};

/// The step nearest to step i, from `first` on, at which the stamps leap back by `leap_s`.
std::optional<std::size_t> leap_back(const Readings& readings, std::size_t first, std::size_t i, double leap_s) {
  const auto is_it = [&](std::size_t j) { return readings.go_on_by(readings.step_s(j) + leap_s, j); };
  const auto is_near = [&](std::size_t a, std::size_t b) { return readings.t(b) - readings.t(a) <= kLongestLeap; };
  for (std::size_t far = 1;; ++far) {
    const bool has_before = first + far <= i && is_near(i - far, i - 1);
    const bool has_after = i + far < readings.size() && is_near(i, i + far - 1);
    if (has_after && is_it(i + far)) {
      return i + far;
    }
    if (has_before && is_it(i - far)) {
      return i - far;
    }
    if (!has_before && !has_after) {
      return std::nullopt;
    }
  }
}

}  // namespace

std::vector<std::size_t> rows_of_another_time(const Series& series, const std::vector<std::size_t>& rows,
                                              const std::vector<Time>& t, Duration period) {
  const double period_s = to_seconds(period);
  const Readings readings(series, rows, t, period_s);
  std::vector<std::size_t> found;
  std::size_t next = 1;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    if (readings.is_regular(i) || !readings.go_on_by(period_s, i)) {
      continue;
    }
    if (const auto back = leap_back(readings, next, i, readings.step_s(i) - period_s)) {
      const auto [first, last] = std::minmax(i, *back);
      found.insert(found.end(), rows.begin() + static_cast<std::ptrdiff_t>(first),
                   rows.begin() + static_cast<std::ptrdiff_t>(last));
      next = last + 1;
      i = last;
    }
  }
  return found;
}

}  // namespace trihedron::io
