#include "clocks/turn_fit.hpp"

#include <algorithm>
#include <cmath>

#include "linear/gram.hpp"
#include "model/scatter.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Turns over this time are compared: a slew begins or ends in it.
constexpr double kLag_s = 30;
/// A turn counts for no more than this many sigmas where a step is looked for.
constexpr double kBound = 2;
/// The fewest stretches of the pass from which a scatter is told.
constexpr long kLeastStretches = 8;

/// Rows of several turns, until there are enough of them that a product is worth its beginning.
class Gathered {
 public:
  explicit Gathered(Eigen::Index unknowns) : columns_(unknowns, kTogether) {}

  /// Where there is no room for them, those before go into `normal`, lower triangle.
  template <class Rows>
  void add(const Rows& rows, MatrixXd& normal) {
    if (count_ + rows.rows() > kTogether) {
      put_into(normal);
    }
    columns_.middleCols(count_, rows.rows()) = rows.transpose();
    count_ += rows.rows();
  }
  void put_into(MatrixXd& normal) {
    if (count_ > 0) {
      columns_.rightCols(kTogether - count_).setZero();
      add_gram(columns_, 1, normal);
      count_ = 0;
    }
  }

 private:
  static constexpr Eigen::Index kTogether = 64;
  MatrixXd columns_;
  Eigen::Index count_ = 0;
};

}  // namespace

TurnFit::TurnFit(const Pass& pass, const GyroReadings& readings, double offset_s)
    : pass_(pass),
      readings_(readings),
      unknowns_{readings.gyros()},
      lag_s_(std::max(kLag_s, to_seconds(pass.settings.star_tracker_period))),
      turns_(turns_of(pass.star_tracker, lag_s_)),
      x_(VectorXd::Zero(unknowns_.size())),
      prior_sigma_(unknowns_.size()) {
  x_(Unknowns::offset()) = offset_s;
  // Wide enough to hold nothing back; the rate in s/s.
  prior_sigma_.setConstant(1);
  prior_sigma_(Unknowns::offset()) = 10;
  prior_sigma_(Unknowns::rate()) = 1e-2;
  for (int k = 0; k < unknowns_.gyros; ++k) {
    if (k > 0) {
      prior_sigma_(unknowns_.late_rate(k)) = prior_sigma_(Unknowns::rate());
    }
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
  if (pass.star_tracker.size() > 0) {
    begin_ = pass.star_tracker.t.front();
    middle_ = begin_ + (pass.star_tracker.t.back() - begin_) / 2;
  }
}

TurnFit::TurnFit(const Pass& pass, const GyroReadings& readings, double offset_s, const Stepping& stepping,
                 double change_s)
    : TurnFit(pass, readings, offset_s) {
  stepping_ = stepping;
  x_.conservativeResize(place_of_step() + 1);
  x_(place_of_step()) = change_s;
  prior_sigma_.conservativeResize(x_.size());
  prior_sigma_(place_of_step()) = prior_sigma_(Unknowns::offset());
}

void TurnFit::hold_rates() {
  constexpr double kNone_s_s = 1e-10;  // a hundredth of what nine hours show
  prior_sigma_(Unknowns::rate()) = kNone_s_s;
  for (int k = 1; k < unknowns_.gyros; ++k) {
    prior_sigma_(unknowns_.late_rate(k)) = kNone_s_s;
  }
}

bool TurnFit::converge() {
  if (turns_.size() < kLeastPairs) {
    return false;
  }
  constexpr int kMostRounds = 10;
  constexpr int kRough = 2;
  constexpr double kFastest = 0.1;  // s/s: such a clock is none
  constexpr double kNear_s = 1e-5;
  constexpr double kNearSigmas = 0.1;
  for (int round = 0; round < kMostRounds; ++round) {
    check_stop();
    read(round < kRough);
    const VectorXd before = x_;
    if (!step(round < kRough) || std::abs(x_(Unknowns::offset())) > 2 * kFarthestOffset_s ||
        std::abs(x_(Unknowns::rate())) > kFastest) {
      return false;
    }
    const double sigma_s = std::sqrt(normal_.solve(unit(Unknowns::offset()))(0));
    if (round > kRough && std::abs(x_(0) - before(0)) < std::max(kNear_s, kNearSigmas * sigma_s)) {
      break;
    }
  }
  // In steady flight, or of a body that spins or tumbles evenly, alignments and momenta explain what an offset does,
  // and what is left to tell it is the noise of the rates.
  constexpr double kShown = 100;
  const double shown = 1 / normal_.solve(unit(Unknowns::offset()))(Unknowns::offset());
  return used_stretches() >= kLeastStretches && shown > kShown * shown_by_noise_;
}

void TurnFit::add_drift(Time t, const Directions& h, const Matrix3d& trihedron, DriftSum& sum) const {
  for (int k = 0; k < unknowns_.gyros; ++k) {
    const Esg7::Basis<double> rate = trihedron.transpose() * readings_.drift_basis(k, h[k]);
    if (sum.t) {
      sum.turned[k] += to_seconds(t - *sum.t) / 2 * (sum.rate[k] + rate);
    } else {
      sum.turned[k].setZero();
    }
    sum.rate[k] = rate;
  }
  sum.t = t;
}

void TurnFit::add_drift_until(Time t, double clock_s, const PerGyro<Matrix3d>& align, DriftSum& sum) const {
  constexpr double kStep_s = 5;  // a slew of a degree a second turns by 5°: the rule of the trapezoid is off by 0.3 %
  const double span_s = sum.t ? to_seconds(t - *sum.t) : 0;
  const Time begin = t - from_seconds(span_s);
  const int steps =
      span_s < 2 * lag_s_ ? static_cast<int>(std::ceil(span_s / kStep_s)) : 0;  // there is no turn over more
  for (int i = 1; i < steps; ++i) {
    const Time on_the_way = begin + from_seconds(span_s * i / steps);
    if (const auto h = readings_.near(on_the_way + from_seconds(clock_s))) {
      add_drift(on_the_way, *h, triad(align[0] * (*h)[0], align[1] * (*h)[1]), sum);
    }
  }
}

/// What the gyros read at each fix that step() asks for, by the clocks as they are now.
void TurnFit::read(bool roughly) {
  const StarTrackerTelemetry& fixes = pass_.star_tracker;
  std::vector<bool> needed(fixes.size());
  for (std::size_t i = 0; i < turns_.size(); i += roughly ? kThinned : 1) {
    needed[turns_[i].first_fix] = needed[turns_[i].second_fix] = true;
  }
  PerGyro<Matrix3d> align;
  for (int k = 0; k < unknowns_.gyros; ++k) {
    align[k] = Rot<C, C>::exp(Vec<C>::assume(x_.segment<3>(unknowns_.alignment(k)))).raw();
  }
  DriftSum drift;
  std::size_t from = 0;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!needed[i]) {
      continue;
    }
    const double more_s = steps(fixes.t[i]) ? x_(place_of_step()) : 0;
    const bool of_star_tracker = stepping_ && stepping_->gyro < 0;
    const double age_s = to_seconds(fixes.t[i] - middle_);
    const double clock_s = x_(Unknowns::offset()) + x_(Unknowns::rate()) * age_s + (of_star_tracker ? more_s : 0);
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
      const double late_more_s = stepping_ && stepping_->gyro == k ? more_s : 0;
      const double late_s = (k == 0 ? 0 : x_(Unknowns::late(k)) + x_(unknowns_.late_rate(k)) * age_s) + late_more_s;
      at.h[k] = (its->directions->h_b[k] + (clock_s - its->clock_s) * rate).normalized();
      at.aligned[k] = align[k] * (at.h[k] + late_s * rate);
      at.aligned_rate[k] = align[k] * rate;
    }
    at.trihedron = triad(align[0] * at.h[0], align[1] * at.h[1]);
    add_drift_until(fixes.t[i], clock_s, align, drift);
    add_drift(fixes.t[i], at.h, at.trihedron, drift);
    at.turned = drift.turned;
  }
}

/// Rows of one turn about the unknowns and right of them the residual, white; and how large the square of those about
/// the offset would be in a flight that does not show it. False where a reading is missing.
bool TurnFit::rows_of(const Turn& turn, bool roughly, Rows& rows, double& noise_square) const {
  const AtFix& first = at_fix_[turn.first_fix];
  const AtFix& second = at_fix_[turn.second_fix];
  if (!first.is_there || !second.is_there) {
    return false;
  }
  const double ages_s[] = {to_seconds(turn.first - middle_), to_seconds(turn.second - middle_)};
  const Matrix3d back = turn.C_first_second.transpose();
  // Derivatives at the turn by the gyros: the noise of that by the fixes is in the residual as well, and their
  // product would not average out.
  const Matrix3d smooth = second.trihedron * first.trihedron.transpose();
  const int n = size();
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
    const Esg7::Basis<double> by_drift = second.trihedron * (second.turned[k] - first.turned[k]);
    const Vector3d drift = by_drift * x_.segment<Esg7::kSize>(unknowns_.drift(k));
    const Vector3d off = h2 - back * h1 - drift.cross(h2);
    auto its = rows.middleRows<2>(2L * k);
    its.col(n) = -across * off;
    const Vector3d by_offset = rate2 - smooth * rate1;
    its.col(Unknowns::offset()) = across * by_offset;
    its.col(Unknowns::rate()) = across * (ages_s[1] * rate2 - ages_s[0] * (smooth * rate1));
    if (k > 0) {
      its.col(Unknowns::late(k)) = its.col(Unknowns::offset());
      its.col(unknowns_.late_rate(k)) = its.col(Unknowns::rate());
    }
    if (stepping_ && (stepping_->gyro < 0 || stepping_->gyro == k)) {
      const double at_second = steps(turn.second) ? 1 : 0;
      const double at_first = steps(turn.first) ? 1 : 0;
      its.col(place_of_step()) = across * (at_second * rate2 - at_first * (smooth * rate1));
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
bool TurnFit::step(bool roughly) {
  // For the scale of the residuals: noise figures may be wrong.
  std::vector<double> squares;
  Rows rows;
  const int n = size();
  const double usual = 2 * unknowns_.gyros * std::max(roughly ? 1 : scale_, 1e-3);
  MatrixXd normal = prior_sigma_.cwiseAbs2().cwiseInverse().asDiagonal();
  const double stretch_s = std::max(2 * kLag_s, to_seconds(pass_.star_tracker.t.back() - begin_) / 60);
  stretches_.clear();
  shown_by_noise_ = 0;
  Stretch stretch(n);
  VectorXd of_turn(n);
  VectorXd sum = VectorXd::Zero(n);
  long number = 0;
  Gathered used(n);
  Gathered rejected(n);
  const auto close = [&] {
    used.put_into(stretch.normal);
    rejected.put_into(stretch.rejected_normal);
    if (stretch.turns > 0) {
      sum += stretch.score;
      normal += stretch.normal;
      stretches_.push_back(stretch);
      stretch = Stretch(n);
    }
  };
  for (std::size_t i = 0; i < turns_.size(); i += roughly ? kThinned : 1) {
    const Turn& turn = turns_[i];
    if (const long now = std::lround(std::floor(to_seconds(turn.first - begin_) / stretch_s)); now != number) {
      close();
      number = now;
    }
    double noise_square = 0;
    if (!rows_of(turn, roughly, rows, noise_square)) {
      continue;
    }
    const double square = rows.col(n).squaredNorm();
    squares.push_back(square);
    of_turn = rows(0, n) * rows.row(0).head(n).transpose();
    for (Eigen::Index row = 1; row < rows.rows(); ++row) {
      of_turn += rows(row, n) * rows.row(row).head(n).transpose();
    }
    if (stretch.turns++ == 0) {
      stretch.interval.from = turn.first;
    }
    stretch.interval.until = turn.second;
    stretch.bounded_score += std::min(1.0, kBound * std::sqrt(usual / square)) * of_turn;
    if (square > kGate * kGate * usual) {
      rejected.add(rows.leftCols(n), stretch.rejected_normal);
      continue;
    }
    shown_by_noise_ += noise_square;
    used.add(rows.leftCols(n), stretch.normal);
    stretch.score += of_turn;
    stretch.is_used = true;
  }
  close();
  if (squares.size() < kLeastPairs / kThinned) {
    return false;
  }
  scale_ = median_of(squares) / (2 * unknowns_.gyros);
  normal_.compute(normal.selfadjointView<Eigen::Lower>());
  x_ += normal_.solve(sum);
  return x_.allFinite();
}

TurnFit::Stretch::Stretch(int n)
    : score(VectorXd::Zero(n)),
      normal(MatrixXd::Zero(n, n)),
      bounded_score(VectorXd::Zero(n)),
      rejected_normal(MatrixXd::Zero(n, n)) {}

long TurnFit::used_stretches() const { return std::ranges::count_if(stretches_, &Stretch::is_used); }

/// Of each function a of the unknowns: Σ (aᵀ N⁻¹ g)² over the scores g of the stretches.
Measured TurnFit::measured(const VectorXd& a) const {
  const auto count = static_cast<double>(used_stretches());
  const VectorXd by_score = normal_.solve(a);
  double variance = 0;
  for (const Stretch& stretch : stretches_) {
    variance += std::pow(by_score.dot(stretch.score), 2);
  }
  return {a.dot(x_), std::sqrt(variance * count / (count - 1))};
}

/// The function of the unknowns that is the offset against a gyro.
VectorXd TurnFit::offset_of(int gyro) const {
  return gyro == 0 ? unit(Unknowns::offset()) : VectorXd(unit(Unknowns::offset()) + unit(Unknowns::late(gyro)));
}

/// The function of the unknowns by which that offset grows.
VectorXd TurnFit::rate_of(int gyro) const {
  return gyro == 0 ? unit(Unknowns::rate()) : VectorXd(unit(Unknowns::rate()) + unit(unknowns_.late_rate(gyro)));
}

/// How the unknowns change where the stamps of a gyro are later by a unit, or fixes were taken so much later
/// (−1).
VectorXd TurnFit::by_stepping(int gyro) const {
  if (gyro > 0) {
    return unit(Unknowns::late(gyro));
  }
  VectorXd change = unit(Unknowns::offset());
  for (int k = 1; gyro == 0 && k < unknowns_.gyros; ++k) {
    change -= unit(Unknowns::late(k));
  }
  return change;
}

Clocks TurnFit::clocks() const {
  Clocks clocks;
  // The star tracker is a witness as well: where it agrees with one gyro, the others are late. Of three gyros and
  // more, the one that is nearest to the middle of them over the whole pass: clocks that agree at one time may run
  // apart.
  const double half_s = to_seconds(pass_.star_tracker.t.back() - middle_);
  const auto of_gyro = [&](int k, double age_s) { return (offset_of(k) + age_s * rate_of(k)).dot(x_); };
  PerGyro<double> farthest_s{};
  for (const double age_s : {-half_s, half_s}) {
    std::vector<double> all_s;
    for (int k = 0; k < unknowns_.gyros; ++k) {
      all_s.push_back(of_gyro(k, age_s));
    }
    const double middle_s = unknowns_.gyros > 2 ? median_of(all_s) : 0;
    for (int k = 0; k < unknowns_.gyros; ++k) {
      farthest_s[k] = std::max(farthest_s[k], std::abs(of_gyro(k, age_s) - middle_s));
    }
  }
  for (int k = 1; k < unknowns_.gyros; ++k) {
    clocks.reference = farthest_s[k] < farthest_s[clocks.reference] ? k : clocks.reference;
  }
  const VectorXd middle = offset_of(clocks.reference);
  const VectorXd rate = rate_of(clocks.reference);
  clocks.mid_offset_s = measured(middle);
  clocks.rate_s_s = measured(rate);
  clocks.offset_s = measured(middle + to_seconds(pass_.settings.epoch - middle_) * rate);
  for (int k = 0; k < unknowns_.gyros; ++k) {
    if (k != clocks.reference) {
      clocks.late_s[k] = measured(offset_of(k) - middle);
      clocks.late_rate_s_s[k] = measured(rate_of(k) - rate);
    }
  }
  return clocks;
}

std::optional<Stepping> TurnFit::suspected_step() const {
  // By the scores g_s and the normal matrices N_s of the stretches, a change d over a part P of the pass has the score
  // u = dᵀ (g_P − N_P N⁻¹ g) with the variance v = dᵀ (N_P − N_P N⁻¹ N_P) d, where nothing else explains it.
  constexpr double kLeastShare = 1e-3;  // of what the pass tells of a clock, for a stretch that tells of it
  constexpr double kLeastPart = 1e-2;   // the same of a part
  constexpr double kUnlikely = 50;      // of u²/v: of some thousand parts noise has 20
  constexpr std::size_t kLeastTelling = 8;
  // N has all turns, as the scores have.
  const std::size_t count = stretches_.size();
  MatrixXd normal = prior_sigma_.cwiseAbs2().cwiseInverse().asDiagonal();
  VectorXd sum_of_scores = VectorXd::Zero(size());
  for (const Stretch& stretch : stretches_) {
    normal += stretch.normal + stretch.rejected_normal;
    sum_of_scores += stretch.bounded_score;
  }
  const Eigen::LLT<MatrixXd> root(normal.selfadjointView<Eigen::Lower>());
  const VectorXd moved = root.solve(sum_of_scores);
  std::optional<Stepping> suspected;
  double most = 0;
  for (int gyro = -1; gyro < unknowns_.gyros; ++gyro) {
    const VectorXd d = by_stepping(gyro);
    std::vector<VectorXd> by_d;  // N_s d
    std::vector<double> score;
    double whole = 0;
    for (const Stretch& stretch : stretches_) {
      by_d.emplace_back(stretch.normal.selfadjointView<Eigen::Lower>() * d +
                        stretch.rejected_normal.selfadjointView<Eigen::Lower>() * d);
      score.push_back(d.dot(stretch.bounded_score) - by_d.back().dot(moved));
      whole += d.dot(by_d.back());
    }
    const auto variance_of = [&](const VectorXd& sum) { return d.dot(sum) - sum.dot(root.solve(sum)); };
    // Noise that is larger or correlated shows from one stretch to the next that tells of the clock.
    std::vector<double> scatter;
    std::optional<double> before;
    for (std::size_t i = 0; i < count; ++i) {
      if (const double variance = variance_of(by_d[i]); variance > kLeastShare * whole) {
        const double now = score[i] / std::sqrt(variance);
        if (before) {
          scatter.push_back((now - *before) * (now - *before) / 2);
        }
        before = now;
      }
    }
    if (scatter.size() < kLeastTelling) {
      continue;
    }
    constexpr double kMedianOfSquare = 0.455;
    const double inflation = std::max(1.0, median_of(scatter) / kMedianOfSquare);
    for (std::size_t first = 0; first < count; ++first) {
      VectorXd sum = VectorXd::Zero(size());
      double u = 0;
      for (std::size_t last = first; last < count; ++last) {
        sum += by_d[last];
        u += score[last];
        const double variance = variance_of(sum);
        if (variance > kLeastPart * whole && u * u / variance > std::max(most, kUnlikely * inflation)) {
          most = u * u / variance;
          suspected = {gyro, {stretches_[first].interval.from, stretches_[last].interval.until}};
        }
      }
    }
  }
  return suspected;
}

Measured TurnFit::change() const {
  std::vector<double> squares;
  Rows rows;
  double noise_square = 0;
  for (const Turn& turn : turns_) {
    if (steps(turn.first) && steps(turn.second) && rows_of(turn, false, rows, noise_square)) {
      squares.push_back(rows.col(size()).squaredNorm());
    }
  }
  const VectorXd step = unit(place_of_step());
  Measured found = measured(step);
  // The scatter of a few slews says little; what the noise is over the part, more.
  const double scale = squares.empty() ? 1 : std::max(1.0, median_of(squares) / (2 * unknowns_.gyros));
  found.sigma = std::max(found.sigma, std::sqrt(scale * step.dot(normal_.solve(step))));
  return found;
}

TurnFit::Squares TurnFit::squares_by_ends() {
  const double most = kGate * kGate * 2 * unknowns_.gyros * std::max(scale_, 1e-3);
  const Interval fitted = stepping_->part;
  stepping_->part = {};
  read(false);
  const std::vector<AtFix> outside = at_fix_;
  stepping_->part = {begin_, pass_.star_tracker.t.back() + Duration(1)};
  read(false);
  const std::vector<AtFix> inside = at_fix_;
  stepping_->part = fitted;
  Squares squares;
  Rows rows;
  double noise_square = 0;
  for (const Turn& turn : turns_) {
    Eigen::Array4d its;
    for (int ends = 0; ends < 4; ++ends) {
      at_fix_[turn.first_fix] = (ends == kLeaves || ends == kInside ? inside : outside)[turn.first_fix];
      at_fix_[turn.second_fix] = (ends == kEnters || ends == kInside ? inside : outside)[turn.second_fix];
      its(ends) = rows_of(turn, false, rows, noise_square) ? std::min(most, rows.col(size()).squaredNorm()) : 0;
    }
    squares.push_back(its);
  }
  return squares;
}

/// The turns in a row, from one of them to before another, that gain the most by the step.
std::pair<std::size_t, std::size_t> TurnFit::turns_with_step(const Squares& squares) {
  std::size_t first = 0;
  std::pair<std::size_t, std::size_t> found{0, 0};
  double gain = 0;
  double most = 0;
  for (std::size_t i = 0; i < squares.size(); ++i) {
    if (gain <= 0) {
      gain = 0;
      first = i;
    }
    gain += squares[i](kOutside) - squares[i](kInside);
    if (gain > most) {
      most = gain;
      found = {first, i + 1};
    }
  }
  return found;
}

std::size_t TurnFit::edge(const Squares& squares, std::size_t from, std::size_t until, Ends before, Ends across,
                          Ends after) const {
  const std::size_t fixes = pass_.star_tracker.size();
  // The sum of squares for each place of the edge, by what it is more than for the place before.
  std::vector<double> more(fixes + 2, 0.0);
  for (std::size_t i = from; i < until; ++i) {
    more[turns_[i].first_fix + 1] += squares[i](across) - squares[i](after);
    more[turns_[i].second_fix + 1] += squares[i](before) - squares[i](across);
  }
  std::size_t best = 0;
  double sum = 0;
  double least = 0;
  for (std::size_t place = 1; place <= fixes; ++place) {
    sum += more[place];
    if (sum < least) {
      least = sum;
      best = place;
    }
  }
  constexpr double kNoSay = 20;  // of ln of the likelihood, twice
  const bool may_be_at_begin = -least < kNoSay;
  const bool may_be_at_end = sum - least < kNoSay;
  return may_be_at_begin ? 0 : may_be_at_end ? fixes : best;
}

Interval TurnFit::part_with_step() {
  const Squares squares = squares_by_ends();
  const auto [from, until] = turns_with_step(squares);
  if (until == 0) {
    return {};
  }
  const std::vector<Time>& t = pass_.star_tracker.t;
  const std::size_t first = edge(squares, 0, until, kOutside, kEnters, kInside);
  const std::size_t last = edge(squares, from, squares.size(), kInside, kLeaves, kOutside);
  return {first < t.size() ? t[first] : t.back(), last < t.size() ? t[last] : t.back() + Duration(1)};
}

}  // namespace trihedron::ground
