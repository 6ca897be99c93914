#include "clocks/turns.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Readings to both sides of a fix that a polynomial is fitted to.
constexpr double kReach_s = 1;

/// Rates of the body in c, on a grid of times; NaN where not known.
struct RateGrid {
  Time begin{};
  double step_s = 0;
  std::array<std::vector<double>, 3> rate_c;  ///< of each axis

  [[nodiscard]] long size() const { return static_cast<long>(rate_c[0].size()); }
};

/// Mean rates over `span_s` from each time of the grid on, by the trihedron of the first two momenta. Empty where the
/// telemetry spans more than some weeks.
RateGrid rates_by_gyros(const GyroReadings& readings, double step_s, double span_s) {
  RateGrid grid{readings.t(0), step_s, {}};
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const double length_s = to_seconds(readings.t(readings.size() - 1) - grid.begin);
  const auto steps = static_cast<std::size_t>(length_s / step_s) + 1;
  constexpr std::size_t kMostSteps = 2'000'000;  // three weeks: no clock keeps its offset for so long
  if (steps > kMostSteps) {
    return grid;
  }
  std::vector<Matrix3d> C_c_g(steps, Matrix3d::Constant(kUnknown));
  std::vector<double> at_s(steps, kUnknown);
  std::size_t i = 0;
  for (std::size_t n = 0; n < steps; ++n) {
    const Time t = grid.begin + from_seconds(static_cast<double>(n) * step_s);
    while (i < readings.size() && readings.t(i) < t) {
      ++i;
    }
    const auto h_c =
        i < readings.size() && readings.t(i) - t < from_seconds(step_s) ? readings.sample(i) : std::nullopt;
    if (h_c) {
      C_c_g[n] = triad((*h_c)[0], (*h_c)[1]);
      at_s[n] = to_seconds(readings.t(i) - grid.begin);
    }
  }
  const auto apart = std::max<std::size_t>(static_cast<std::size_t>(std::lround(span_s / step_s)), 1);
  grid.rate_c.fill(std::vector<double>(steps, kUnknown));
  for (std::size_t n = 0; n + apart < steps; ++n) {
    const Matrix3d turn = C_c_g[n] * C_c_g[n + apart].transpose();
    if (turn.allFinite()) {
      const Vector3d rate_c = Rot<C, C>::assume(turn).log().raw() / (at_s[n + apart] - at_s[n]);
      for (int axis = 0; axis < 3; ++axis) {
        grid.rate_c[static_cast<std::size_t>(axis)][n] = rate_c(axis);
      }
    }
  }
  return grid;
}

}  // namespace

GyroReadings::GyroReadings(const Pass& pass)
    : pass_(pass), gyros_(std::min({pass.gyro.gyros, static_cast<int>(pass.settings.gyros.size()), kMaxGyros})) {
  for (int k = 0; k < gyros_; ++k) {
    const GyroPrior& prior = pass.settings.gyros[static_cast<std::size_t>(k)];
    const Vector3d& rotation =
        pass.settings.prior ? pass.settings.prior->gyros[static_cast<std::size_t>(k)].alignment_rotation_vector_rad
                            : prior.alignment_rotation_vector_rad;
    C_c_b_[k] = Rot<C, B<1>>::exp(Vec<C>::assume(rotation)).raw();
  }
  const double period_s = to_seconds(pass.settings.gyro_period);
  reach_ = from_seconds(std::max(kReach_s, 4 * period_s));
  least_samples_ = std::max(4, static_cast<int>(to_seconds(reach_) / period_s));
}

std::optional<Vector3d> GyroReadings::reading(std::size_t i, int gyro) const {
  const Vector3d h_b = pass_.gyro.direction(i, gyro);
  const double norm = h_b.norm();
  return std::abs(norm - 1) < 0.1 ? std::optional<Vector3d>(C_c_b_[gyro] * (h_b / norm)) : std::nullopt;
}

std::optional<Directions> GyroReadings::sample(std::size_t i) const {
  Directions h_c;
  for (int k = 0; k < gyros_; ++k) {
    const std::optional<Vector3d> its = reading(i, k);
    if (!its) {
      return std::nullopt;
    }
    h_c[k] = *its;
  }
  return h_c;
}

std::optional<Directions> GyroReadings::near(Time t) const {
  const auto& stamps = pass_.gyro.t;
  const auto found = std::ranges::lower_bound(stamps, t);
  const bool is_near = found != stamps.end() && std::chrono::abs(*found - t) <= reach_;
  return is_near ? sample(static_cast<std::size_t>(found - stamps.begin())) : std::nullopt;
}

std::optional<FittedDirections> GyroReadings::at(Time t, std::size_t& from) const {
  const auto& stamps = pass_.gyro.t;
  while (from > 0 && stamps[from - 1] >= t - reach_) {
    --from;
  }
  while (from < stamps.size() && stamps[from] < t - reach_) {
    ++from;
  }
  std::size_t end = from;
  while (end < stamps.size() && stamps[end] <= t + reach_) {
    ++end;
  }
  const int count = static_cast<int>(end - from);
  if (count < least_samples_ || stamps[from] > t - reach_ / 2 || stamps[end - 1] < t + reach_ / 2) {
    return std::nullopt;
  }
  constexpr int kQuadratic = 2;  // a cubic has five times the noise in its rate
  DirectionsFit fit(t, stamps[from], stamps[end - 1], count, kQuadratic, gyros_);
  for (std::size_t i = from; i < end; ++i) {
    const auto h_c = sample(i);
    if (!h_c) {
      return std::nullopt;
    }
    fit.add(stamps[i], *h_c);
  }
  return fit.solve();
}

std::vector<Turn> turns_of(const StarTrackerTelemetry& fixes, double lag_s) {
  std::vector<Turn> turns;
  std::size_t j = 0;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const Time wanted = fixes.t[i] + from_seconds(lag_s);
    j = std::max(j, i + 1);
    while (j < fixes.size() && fixes.t[j] < wanted - from_seconds(0.1 * lag_s)) {
      ++j;
    }
    if (j == fixes.size()) {
      break;
    }
    const double norms[] = {fixes.q_in_c[i].norm(), fixes.q_in_c[j].norm()};
    if (fixes.t[j] > wanted + from_seconds(0.1 * lag_s) || !nearly_unit(norms[0]) || !nearly_unit(norms[1])) {
      continue;
    }
    const auto turn =
        Rot<C, In>::assume(fixes.q_in_c[i].normalized().conjugate()) * Rot<In, C>::assume(fixes.q_in_c[j].normalized());
    turns.push_back({fixes.t[i], fixes.t[j], i, j, turn.raw(), turn.log().raw().norm()});
  }
  return turns;
}

double largest_alignment_sigma(const PassSettings& settings) {
  double sigma = 0;
  for (const GyroPrior& gyro : settings.gyros) {
    sigma = std::max(sigma, gyro.alignment_sigma_rad.maxCoeff());
  }
  return std::min(sigma, 0.1);
}

Matrix3d triad(const Vector3d& h1, const Vector3d& h2) {
  const Vector3d across = h1.cross(h2).normalized();
  Matrix3d axes;
  axes << across, h1, across.cross(h1);
  return axes;
}

double rough_offset_s(const Pass& pass, const GyroReadings& readings, double finest_s) {
  constexpr std::size_t kMostTurns = 4000;
  constexpr double kClear = 8;
  constexpr double kNoOther = 0.7;  // of the cost; where the body turns evenly every lag is nearly as good
  constexpr double kApart_s = 30;
  const double period_s = std::max(to_seconds(pass.settings.star_tracker_period), finest_s);
  const double step_s =
      std::max(period_s / std::ceil(period_s / (2 * finest_s)), to_seconds(pass.settings.gyro_period));
  const std::vector<Turn> turns = turns_of(pass.star_tracker, period_s);
  if (turns.size() < kLeastPairs) {
    return 0;
  }
  const RateGrid grid = rates_by_gyros(readings, step_s, period_s);
  if (grid.size() == 0) {
    return 0;
  }
  const long farthest = std::lround(kFarthestOffset_s / step_s);
  const long lags = 2 * farthest + 1;
  std::vector<double> costs(static_cast<std::size_t>(lags));
  std::vector<double> counts(costs.size());
  const double alignment_rad = largest_alignment_sigma(pass.settings);
  const double readout_rad = pass.settings.gyros.front().readout_noise_rad;
  const std::size_t every = turns.size() / kMostTurns + 1;
  double seen = 0;
  for (std::size_t i = 0; i < turns.size(); i += every) {
    const Turn& turn = turns[i];
    const double span_s = to_seconds(turn.second - turn.first);
    const Eigen::Array3d variance = 2 * pass.settings.star_tracker_noise_rad.array().square() +
                                    4 * readout_rad * readout_rad + std::pow(alignment_rad * turn.angle_rad, 2);
    const Vector3d rate_c = Rot<C, C>::assume(turn.C_first_second).log().raw() / span_s;
    const Vector3d weight = span_s * span_s / variance;
    ++seen;
    // All lags at once, from the first to the last that the grid has a place for.
    const long first_place = std::lround(to_seconds(turn.first - grid.begin) / step_s) - farthest;
    const long first_lag = std::clamp(-first_place, 0L, lags);
    const long count = std::min(lags, grid.size() - first_place) - first_lag;
    if (count <= 0) {
      continue;
    }
    const double* x = &grid.rate_c[0][static_cast<std::size_t>(first_place + first_lag)];
    const double* y = &grid.rate_c[1][static_cast<std::size_t>(first_place + first_lag)];
    const double* z = &grid.rate_c[2][static_cast<std::size_t>(first_place + first_lag)];
    double* cost = &costs[static_cast<std::size_t>(first_lag)];
    double* known = &counts[static_cast<std::size_t>(first_lag)];
    const double rate[] = {rate_c.x(), rate_c.y(), rate_c.z()};
    const double w[] = {weight.x(), weight.y(), weight.z()};
    for (long lag = 0; lag < count; ++lag) {
      const double off[] = {rate[0] - x[lag], rate[1] - y[lag], rate[2] - z[lag]};
      const double square = off[0] * off[0] * w[0] + (off[1] * off[1] * w[1] + off[2] * off[2] * w[2]);
      const bool are_known = square >= 0;
      cost[lag] += are_known ? std::min(square, kGate * kGate) : 0;
      known[lag] += are_known ? 1 : 0;
    }
  }
  for (std::size_t lag = 0; lag < costs.size(); ++lag) {
    costs[lag] = 2 * counts[lag] >= seen ? costs[lag] / counts[lag] : std::numeric_limits<double>::infinity();
  }
  const auto best = std::ranges::min_element(costs);
  std::vector<double> sorted = costs;
  std::ranges::sort(sorted);
  const double usual = sorted[sorted.size() / 2];
  const double spread = usual - sorted[sorted.size() / 4];
  double elsewhere = std::numeric_limits<double>::infinity();  // where no slew of half a minute is the same one
  for (auto cost = costs.begin(); cost != costs.end(); ++cost) {
    if (std::abs(static_cast<double>(cost - best)) * step_s > kApart_s) {
      elsewhere = std::min(elsewhere, *cost);
    }
  }
  // The quartiles of lags that are all wrong are apart by chance alone; the right one lies far below them. Where slews
  // take much of the time or come in a rhythm, these are far apart, but no other lag is nearly as good.
  const bool is_clear = std::isfinite(usual) && (usual - *best > kClear * spread || *best < kNoOther * elsewhere);
  return is_clear ? static_cast<double>(best - costs.begin() - farthest) * step_s : 0;
}

}  // namespace trihedron::ground
