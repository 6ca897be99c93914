#include "trihedron/ground/clocks/clocks.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Offsets are searched up to here.
constexpr double kFarthest_s = 600;
/// Turns over this time are compared: a slew begins or ends in it.
constexpr double kLag_s = 30;
/// Readings to both sides of a fix that a polynomial is fitted to.
constexpr double kReach_s = 1;
/// A residual beyond this many sigmas is not used: an outlier of the star tracker, a spike of a gyro.
constexpr double kGate = 5;
/// The fewest stretches of the pass from which a scatter, and the fewest pairs of fixes from which anything is told.
constexpr std::size_t kLeastStretches = 8;
constexpr std::size_t kLeastPairs = 50;

/// Gyro readings in c axes by the alignments known before the pass.
class GyroReadings {
 public:
  explicit GyroReadings(const Pass& pass)
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

  [[nodiscard]] int gyros() const { return gyros_; }
  [[nodiscard]] std::size_t size() const { return pass_.gyro.size(); }
  [[nodiscard]] Time t(std::size_t i) const { return pass_.gyro.t[i]; }

  /// Variance of the rates of at() over that of a single reading, 1/s²: that of the slope of a parabola.
  [[nodiscard]] double rate_variance() const {
    const double reach_s = to_seconds(reach_);
    return 3 / ((2 * reach_s / to_seconds(pass_.settings.gyro_period) + 1) * reach_s * reach_s);
  }

  /// B(h) of eq. (1), c axes.
  [[nodiscard]] Esg7::Basis<double> drift_basis(int gyro, const Vector3d& h_c) const {
    return C_c_b_[gyro] * Esg7::basis<double>(C_c_b_[gyro].transpose() * h_c);
  }

  /// One sample; nothing where a reading is none.
  [[nodiscard]] std::optional<Directions> sample(std::size_t i) const {
    Directions h_c;
    for (int k = 0; k < gyros_; ++k) {
      const Vector3d h_b = pass_.gyro.direction(i, k);
      const double norm = h_b.norm();
      if (!(std::abs(norm - 1) < 0.1)) {
        return std::nullopt;
      }
      h_c[k] = C_c_b_[k] * (h_b / norm);
    }
    return h_c;
  }

  /// By a parabola through the samples around `t`, with rates. Asked for with times that mostly increase: `from` is
  /// where the samples were the last time.
  [[nodiscard]] std::optional<FittedDirections> at(Time t, std::size_t& from) const {
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

 private:
  const Pass& pass_;
  int gyros_;
  PerGyro<Matrix3d> C_c_b_;
  Duration reach_{};
  int least_samples_ = 0;
};

/// Two fixes some time apart, and the turn of the body between them in c: C(first)ᵀ C(second).
struct Turn {
  Time first{};
  Time second{};
  std::size_t first_fix = 0;
  std::size_t second_fix = 0;
  Matrix3d C_first_second;
  double angle_rad = 0;
};

/// Of each fix with the one about `lag_s` later.
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

/// Axes that two directions span, as columns.
Matrix3d triad(const Vector3d& h1, const Vector3d& h2) {
  const Vector3d across = h1.cross(h2).normalized();
  Matrix3d axes;
  axes << across, h1, across.cross(h1);
  return axes;
}

// ---- Roughly: turns over one period of the fixes, compared at each lag

/// Rates of the body in c, on a grid of times; NaN where not known.
struct RateGrid {
  Time begin{};
  double step_s = 0;
  std::array<std::vector<double>, 3> rate_c;  ///< of each axis

  [[nodiscard]] long size() const { return static_cast<long>(rate_c[0].size()); }
};

/// Mean rates over `span_s` from each time of the grid on, by the trihedron of the first two momenta.
RateGrid rates_by_gyros(const GyroReadings& readings, double step_s, double span_s) {
  RateGrid grid{readings.t(0), step_s, {}};
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const double length_s = to_seconds(readings.t(readings.size() - 1) - grid.begin);
  const auto steps = static_cast<std::size_t>(length_s / step_s) + 1;
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

/// The offset at which the turns between consecutive fixes are most like those of the gyros, to a step of the grid; 0
/// where no offset is clearly better than any other.
double rough_offset_s(const Pass& pass, const GyroReadings& readings) {
  constexpr double kFinest_s = 1;
  constexpr std::size_t kMostTurns = 4000;
  const double period_s = std::max(to_seconds(pass.settings.star_tracker_period), kFinest_s);
  const double step_s =
      std::max(period_s / std::ceil(period_s / (2 * kFinest_s)), to_seconds(pass.settings.gyro_period));
  const std::vector<Turn> turns = turns_of(pass.star_tracker, period_s);
  if (turns.size() < kLeastPairs) {
    return 0;
  }
  const RateGrid grid = rates_by_gyros(readings, step_s, period_s);
  const long farthest = std::lround(kFarthest_s / step_s);
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
  // The quartiles of lags that are all wrong are apart by chance alone; the right one lies far below them.
  constexpr double kClear = 8;
  const bool is_clear = std::isfinite(usual) && usual - *best > kClear * spread;
  return is_clear ? static_cast<double>(best - costs.begin() - farthest) * step_s : 0;
}

// ---- Finely: least squares over turns of half a minute

/// What is fitted: offset and rate of the star tracker's clock about the middle of the pass, how late each gyro is
/// against the first, and of each gyro what would pass for it: alignment and coefficients of eq. (1).
struct Unknowns {
  int gyros;
  [[nodiscard]] static constexpr int offset() { return 0; }
  [[nodiscard]] static constexpr int rate() { return 1; }
  [[nodiscard]] static constexpr int late(int gyro) { return 1 + gyro; }  ///< of gyro 2 on
  [[nodiscard]] constexpr int alignment(int gyro) const { return 1 + gyros + kOwn * gyro; }
  [[nodiscard]] constexpr int drift(int gyro) const { return alignment(gyro) + 3; }
  [[nodiscard]] constexpr int size() const { return alignment(gyros); }
  static constexpr int kOwn = 3 + Esg7::kSize;
};

class TurnFit {
  static constexpr std::size_t kThinned = 4;  ///< of the turns one in so many, at first
  static constexpr int kMostRows = 2 * kMaxGyros;
  using Rows =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMostRows, Unknowns{kMaxGyros}.size() + 1>;

 public:
  TurnFit(const Pass& pass, const GyroReadings& readings, double offset_s)
      : pass_(pass),
        readings_(readings),
        unknowns_{readings.gyros()},
        turns_(turns_of(pass.star_tracker, std::max(kLag_s, to_seconds(pass.settings.star_tracker_period)))),
        x_(VectorXd::Zero(unknowns_.size())),
        prior_sigma_(unknowns_.size()) {
    x_(Unknowns::offset()) = offset_s;
    // Wide enough to hold nothing back; the rate in s/s.
    prior_sigma_.setConstant(1);
    prior_sigma_(Unknowns::offset()) = 10;
    prior_sigma_(Unknowns::rate()) = 1e-2;
    for (int k = 0; k < unknowns_.gyros; ++k) {
      prior_sigma_.segment<3>(unknowns_.alignment(k)).setConstant(3 * largest_alignment_sigma(pass.settings));
      prior_sigma_.segment<Esg7::kSize>(unknowns_.drift(k)).setConstant(1e-4);
    }
    // No more than a pass of 18 h has at the usual rate: the others would tell little more.
    constexpr std::size_t kMostTurns = 20000;
    const std::size_t every = turns_.size() / kMostTurns + 1;
    for (std::size_t i = 0; i * every < turns_.size(); ++i) {
      turns_[i] = turns_[i * every];
    }
    turns_.resize((turns_.size() + every - 1) / every);
    at_fix_.resize(pass.star_tracker.size());
    fitted_.resize(pass.star_tracker.size());
    if (!turns_.empty()) {
      begin_ = pass.star_tracker.t.front();
      middle_ = begin_ + (pass.star_tracker.t.back() - begin_) / 2;
    }
  }

  [[nodiscard]] std::optional<Clocks> solve() {
    if (turns_.size() < kLeastPairs) {
      return std::nullopt;
    }
    constexpr int kMostRounds = 10;
    constexpr int kRough = 2;
    constexpr double kFastest = 0.1;  // s/s: such a clock is none
    constexpr double kNear_s = 1e-5;
    constexpr double kNearSigmas = 0.1;
    for (int round = 0; round < kMostRounds; ++round) {
      read(round < kRough);
      const VectorXd before = x_;
      if (!step(round < kRough) || std::abs(x_(Unknowns::offset())) > 2 * kFarthest_s ||
          std::abs(x_(Unknowns::rate())) > kFastest) {
        return std::nullopt;
      }
      const double sigma_s = std::sqrt(normal_.solve(VectorXd(VectorXd::Unit(unknowns_.size(), 0)))(0));
      if (round > kRough && std::abs(x_(0) - before(0)) < std::max(kNear_s, kNearSigmas * sigma_s)) {
        break;
      }
    }
    return result();
  }

 private:
  /// What the gyros read at each fix that step() asks for, by the clocks as they are now.
  void read(bool roughly) {
    const StarTrackerTelemetry& fixes = pass_.star_tracker;
    std::vector<bool> needed(fixes.size());
    for (std::size_t i = 0; i < turns_.size(); i += roughly ? kThinned : 1) {
      needed[turns_[i].first_fix] = needed[turns_[i].second_fix] = true;
    }
    PerGyro<Matrix3d> align;
    for (int k = 0; k < unknowns_.gyros; ++k) {
      align[k] = Rot<C, C>::exp(Vec<C>::assume(x_.segment<3>(unknowns_.alignment(k)))).raw();
    }
    std::size_t from = 0;
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      if (!needed[i]) {
        continue;
      }
      const double clock_s = x_(Unknowns::offset()) + x_(Unknowns::rate()) * to_seconds(fixes.t[i] - middle_);
      // Over a millisecond even a slew that begins bends by 1e-9 rad.
      constexpr double kNear_s = 1e-3;
      std::optional<Fitted>& its = fitted_[i];
      if (!its || std::abs(clock_s - its->clock_s) > kNear_s) {
        its = Fitted{clock_s, readings_.at(fixes.t[i] + from_seconds(clock_s), from)};
      }
      AtFix& at = at_fix_[i];
      at.is_there = its->directions.has_value();
      if (!at.is_there) {
        continue;
      }
      for (int k = 0; k < unknowns_.gyros; ++k) {
        const Vector3d& rate = its->directions->h_b_rate[k];
        const double late_s = k == 0 ? 0 : x_(Unknowns::late(k));
        at.h[k] = (its->directions->h_b[k] + (clock_s - its->clock_s) * rate).normalized();
        at.aligned[k] = align[k] * (at.h[k] + late_s * rate);
        at.aligned_rate[k] = align[k] * rate;
      }
      at.trihedron = triad(align[0] * at.h[0], align[1] * at.h[1]);
    }
  }

  /// Rows of one turn about the unknowns and right of them the residual, white; and how large the square of those about
  /// the offset would be in a flight that does not show it. False where a reading is missing.
  bool rows_of(const Turn& turn, bool roughly, Rows& rows, double& noise_square) const {
    const AtFix& first = at_fix_[turn.first_fix];
    const AtFix& second = at_fix_[turn.second_fix];
    if (!first.is_there || !second.is_there) {
      return false;
    }
    const double span_s = to_seconds(turn.second - turn.first);
    const double ages_s[] = {to_seconds(turn.first - middle_), to_seconds(turn.second - middle_)};
    const Matrix3d back = turn.C_first_second.transpose();
    // Derivatives at the turn by the gyros: the noise of that by the fixes is in the residual as well, and their
    // product would not average out.
    const Matrix3d smooth = second.trihedron * first.trihedron.transpose();
    const int n = unknowns_.size();
    rows.setZero(2L * unknowns_.gyros, n + 1);
    Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMostRows, 3> by_fix(rows.rows(), 3);
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostRows, 1> white(rows.rows());
    for (int k = 0; k < unknowns_.gyros; ++k) {
      const Vector3d& h1 = first.aligned[k];
      const Vector3d& h2 = second.aligned[k];
      const Vector3d& rate1 = first.aligned_rate[k];
      const Vector3d& rate2 = second.aligned_rate[k];
      // Two directions across h.
      Eigen::Matrix<double, 2, 3> across;
      across.row(0) = h2.unitOrthogonal().transpose();
      across.row(1) = h2.cross(across.row(0).transpose()).transpose();
      const Esg7::Basis<double> by_drift =
          span_s / 2 * (smooth * readings_.drift_basis(k, first.h[k]) + readings_.drift_basis(k, second.h[k]));
      const Vector3d drift = by_drift * x_.segment<Esg7::kSize>(unknowns_.drift(k));
      const Vector3d off = h2 - back * h1 - drift.cross(h2);
      auto its = rows.middleRows<2>(2L * k);
      its.col(n) = -across * off;
      const Vector3d by_offset = rate2 - smooth * rate1;
      its.col(Unknowns::offset()) = across * by_offset;
      its.col(Unknowns::rate()) = across * (ages_s[1] * rate2 - ages_s[0] * (smooth * rate1));
      if (k > 0) {
        its.col(Unknowns::late(k)) = its.col(Unknowns::offset());
      }
      its.middleCols<3>(unknowns_.alignment(k)) = across * (smooth * skew<double>(h1) - skew<double>(h2));
      its.middleCols<Esg7::kSize>(unknowns_.drift(k)) = across * skew<double>(h2) * by_drift;
      by_fix.middleRows<2>(2L * k) = across * skew<double>(h2);
      const double readout_rad = pass_.settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad;
      const double unknown_rad = roughly ? largest_alignment_sigma(pass_.settings) * turn.angle_rad : 0;
      white.segment<2>(2L * k).setConstant(readout_rad * readout_rad + unknown_rad * unknown_rad);
    }
    const Eigen::Vector3d noise = 2 * pass_.settings.star_tracker_noise_rad.cwiseAbs2();
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostRows, kMostRows> R =
        by_fix * noise.asDiagonal() * by_fix.transpose();
    R.diagonal() += white;
    const auto root = R.llt();
    const auto whiten = [&](auto& its) {
      for (Eigen::Index row = 0; row < its.rows(); ++row) {
        for (Eigen::Index above = 0; above < row; ++above) {
          its.row(row) -= root.matrixLLT()(row, above) * its.row(above);
        }
        its.row(row) *= 1 / root.matrixLLT()(row, row);
      }
    };
    whiten(rows);
    // What the noise of the rates alone would make of the derivative by the offset.
    const double readout_rad = pass_.settings.gyros.front().readout_noise_rad;
    decltype(R) unit = decltype(R)::Identity(rows.rows(), rows.rows());
    whiten(unit);
    noise_square = 2 * readings_.rate_variance() * readout_rad * readout_rad * unit.squaredNorm();
    return rows.allFinite();
  }

  /// One step of Gauss and Newton. `roughly`: before the alignments are known.
  bool step(bool roughly) {
    // For the scale of the residuals: noise figures may be wrong.
    std::vector<double> squares;
    Rows rows;
    const int n = unknowns_.size();
    const double scale = roughly ? 1 : scale_;
    const double gate = kGate * kGate * 2 * unknowns_.gyros * std::max(scale, 1e-3);
    MatrixXd normal = prior_sigma_.cwiseAbs2().cwiseInverse().asDiagonal();
    const double stretch_s = std::max(2 * kLag_s, to_seconds(pass_.star_tracker.t.back() - begin_) / 60);
    scores_.clear();
    shown_ = shown_by_noise_ = 0;
    VectorXd score = VectorXd::Zero(n);
    VectorXd of_turn(n);
    VectorXd sum = VectorXd::Zero(n);
    long stretch = 0;
    long used = 0;
    // Rows of several turns, until there are enough of them that a product is worth its beginning.
    constexpr Eigen::Index kTogether = 64;
    MatrixXd gathered(n, kTogether + kMostRows);
    Eigen::Index count = 0;
    const auto put_into_normal = [&] {
      if (count > 0) {
        normal.selfadjointView<Eigen::Lower>().rankUpdate(gathered.leftCols(count));
        count = 0;
      }
    };
    const auto close = [&] {
      if (used > 0) {
        scores_.push_back(score);
        sum += score;
      }
      score.setZero();
      used = 0;
    };
    for (std::size_t i = 0; i < turns_.size(); i += roughly ? kThinned : 1) {
      const Turn& turn = turns_[i];
      if (const long now = std::lround(std::floor(to_seconds(turn.first - begin_) / stretch_s)); now != stretch) {
        close();
        stretch = now;
      }
      double noise_square = 0;
      if (!rows_of(turn, roughly, rows, noise_square)) {
        continue;
      }
      const double square = rows.col(n).squaredNorm();
      squares.push_back(square);
      if (square > gate) {
        continue;
      }
      shown_ += rows.col(Unknowns::offset()).squaredNorm();
      shown_by_noise_ += noise_square;
      gathered.middleCols(count, rows.rows()) = rows.leftCols(n).transpose();
      count += rows.rows();
      if (count >= kTogether) {
        put_into_normal();
      }
      of_turn = rows(0, n) * rows.row(0).head(n).transpose();
      for (Eigen::Index row = 1; row < rows.rows(); ++row) {
        of_turn += rows(row, n) * rows.row(row).head(n).transpose();
      }
      score += of_turn;
      ++used;
    }
    close();
    put_into_normal();
    if (squares.size() < kLeastPairs / kThinned) {
      return false;
    }
    const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    scale_ = *middle / (2 * unknowns_.gyros);
    normal_.compute(normal.selfadjointView<Eigen::Lower>());
    x_ += normal_.solve(sum);
    return x_.allFinite();
  }

  [[nodiscard]] std::optional<Clocks> result() const {
    // In steady flight the rate of the body stays as it is, and noise takes the place of what would tell the offset.
    constexpr double kShown = 100;
    if (scores_.size() < kLeastStretches || !(shown_ > kShown * shown_by_noise_)) {
      return std::nullopt;
    }
    // Of each function a of the unknowns: Σ (aᵀ N⁻¹ g)² over the scores g of the stretches.
    const auto count = static_cast<double>(scores_.size());
    const auto measured = [&](const VectorXd& a) {
      const VectorXd by_score = normal_.solve(a);
      double variance = 0;
      for (const VectorXd& score : scores_) {
        variance += std::pow(by_score.dot(score), 2);
      }
      return Measured{a.dot(x_), std::sqrt(variance * count / (count - 1))};
    };
    const auto unit = [&](int i) { return VectorXd(VectorXd::Unit(unknowns_.size(), i)); };
    const auto offset_of = [&](int gyro) {
      return gyro == 0 ? unit(0) : VectorXd(unit(0) + unit(Unknowns::late(gyro)));
    };
    Clocks clocks;
    // The star tracker is a witness as well: where it agrees with one gyro, the others are late. Of three gyros and
    // more, the one in the middle.
    std::vector<int> order;
    for (int k = 0; k < unknowns_.gyros; ++k) {
      order.push_back(k);
    }
    const auto of_gyro = [&](int k) { return offset_of(k).dot(x_); };
    if (unknowns_.gyros > 2) {
      std::ranges::sort(order, {}, of_gyro);
      clocks.reference = order[(order.size() - 1) / 2];
    } else {
      clocks.reference = *std::ranges::min_element(order, {}, [&](int k) { return std::abs(of_gyro(k)); });
    }
    const VectorXd middle = offset_of(clocks.reference);
    clocks.mid_offset_s = measured(middle);
    clocks.rate_s_s = measured(unit(Unknowns::rate()));
    clocks.offset_s = measured(middle + to_seconds(pass_.settings.epoch - middle_) * unit(Unknowns::rate()));
    for (int k = 0; k < unknowns_.gyros; ++k) {
      clocks.late_s[k] = k == clocks.reference ? Measured{} : measured(offset_of(k) - middle);
    }
    return clocks;
  }

  const Pass& pass_;
  const GyroReadings& readings_;
  Unknowns unknowns_;
  std::vector<Turn> turns_;
  VectorXd x_;
  VectorXd prior_sigma_;
  Time begin_{};
  Time middle_{};
  /// What the gyros read at each fix, and by which clock the samples around it were fitted.
  struct Fitted {
    double clock_s = 0;
    std::optional<FittedDirections> directions;
  };
  std::vector<std::optional<Fitted>> fitted_;
  /// The readings at a fix by the clocks as they are now, with their rates; c axes by the alignments known before, and
  /// by those that are fitted.
  struct AtFix {
    bool is_there = false;
    Directions h;
    Directions aligned;  ///< and by how late each gyro is
    Directions aligned_rate;
    Matrix3d trihedron;
  };
  std::vector<AtFix> at_fix_;
  double scale_ = 1;
  double shown_ = 0;  ///< square sum of the derivatives by the offset; and what noise alone would make of it
  double shown_by_noise_ = 0;
  Eigen::LLT<MatrixXd> normal_;
  std::vector<VectorXd> scores_;
};

}  // namespace

std::optional<Clocks> clocks_of(const Pass& pass) {
  const GyroReadings readings(pass);
  constexpr Duration kSlowest = std::chrono::seconds(1);  // a slew bends within a few samples
  if (pass.settings.gyro_period > kSlowest || readings.gyros() < 2 || readings.size() < 2 ||
      pass.star_tracker.size() < kLeastPairs) {
    return std::nullopt;
  }
  TurnFit fit(pass, readings, rough_offset_s(pass, readings));
  return fit.solve();
}

ClockCorrection correction_by(const Clocks& clocks, const PassSettings& settings) {
  // What is estimated as a state is linear in the offset: a tenth of a second bends a slew by 0.4″ at 0.02°/s².
  constexpr double kLeftToTheState_s = 0.1;
  constexpr double kLeastLate_s = 1e-3;
  constexpr double kSure = 6;
  ClockCorrection correction;
  const double change_s = clocks.rate_s_s.is_sure(kSure) ? clocks.rate_s_s.value * to_seconds(settings.duration) : 0;
  const double farthest_s =
      std::max(std::abs(clocks.mid_offset_s.value - change_s / 2), std::abs(clocks.mid_offset_s.value + change_s / 2));
  if (farthest_s > kLeftToTheState_s && (change_s != 0 || clocks.mid_offset_s.is_sure(kSure))) {
    correction.rate_s_s = change_s == 0 ? 0 : clocks.rate_s_s.value;
    // To a millisecond: what is less is for the state, and stamps that were on a grid mostly stay there.
    const double offset_s = change_s == 0 ? clocks.mid_offset_s.value : clocks.offset_s.value;
    correction.offset_s = std::round(1e3 * offset_s) / 1e3;
  }
  for (int k = 0; k < static_cast<int>(settings.gyros.size()); ++k) {
    const Measured& late = clocks.late_s[k];
    correction.late_s[k] = late.is_sure(kSure) && std::abs(late.value) > kLeastLate_s ? late.value : 0;
  }
  return correction;
}

}  // namespace trihedron::ground
