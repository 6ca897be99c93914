#include "judge/angle_between_momenta.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "model/scatter.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/core/gyro_readout.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron::ground {
namespace {

constexpr double kStep_s = 1;  ///< over which drift is integrated, at least
/// Of the blocks over which medians of the angle are taken, the shortest; and how many there may be.
constexpr double kBlock_s = 60;
constexpr double kMostBlocks = 600;
constexpr Eigen::Index kFewestLeft = 30;  ///< blocks more than what is fitted
/// Fitted whatever the drift model of the calibration: at most eq. (1), whose coefficients come first, and all else of
/// the first two degrees.
constexpr DriftModelId kFitted = kEsg20;
constexpr int kFittedCoefficients = 2 * kFitted.size();
constexpr int kConstants = kFittedCoefficients + 6;

/// Medians and means over a block of time.
struct Block {
  Eigen::Index number = 0;  ///< of all blocks of the pass, of which some have no samples
  int stretch = 0;          ///< of samples without a gap as long as a block
  double angle_rad = 0;
  Eigen::RowVectorXd by_constants;                     ///< derivative of the angle by κ and δ of both gyros
  Eigen::Vector3d normal_c = Eigen::Vector3d::Zero();  ///< of the plane of the momenta
};

/// The angle along the pass, θ, with dθ/dt = (ω2 − ω1) · n, n = h1 × h2 / sin θ.
class Blocks {
 public:
  Blocks(const GyroTelemetry& telemetry, const std::vector<GyroCalibration>& gyros, const std::array<int, 2>& pair) {
    for (std::size_t k = 0; k < 2; ++k) {
      const GyroCalibration& record = gyros[static_cast<std::size_t>(pair[k])];
      readouts_[k].C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(record.alignment_rotation_vector_rad)).raw();
      readouts_[k].readout_bias = record.readout_bias;
    }
    block_s_ = std::max(kBlock_s, to_seconds(telemetry.t.back() - telemetry.t.front()) / kMostBlocks);
    for (std::size_t i = 0; i < telemetry.size(); ++i) {
      const double t_s = to_seconds(telemetry.t[i] - telemetry.t.front());
      const Eigen::Vector3d first = telemetry.direction(i, pair[0]);
      const Eigen::Vector3d second = telemetry.direction(i, pair[1]);
      if (nearly_unit(first.norm()) && nearly_unit(second.norm())) {
        add(t_s, {first.normalized(), second.normalized()});
      }
    }
    close_block();
  }

  [[nodiscard]] const std::vector<Block>& all() const { return blocks_; }
  [[nodiscard]] double block_s() const { return block_s_; }

 private:
  void add(double t_s, const std::array<Eigen::Vector3d, 2>& h_b) {
    const Eigen::Vector3d h_c[2] = {readouts_[0].in_c(h_b[0]), readouts_[1].in_c(h_b[1])};
    const Eigen::Vector3d across = h_c[0].cross(h_c[1]);
    if (rate_.size() == 0 || t_s - t_s_ >= kStep_s) {
      step(t_s, h_b, across.normalized());
    }
    angles_.push_back(std::atan2(across.norm(), h_c[0].dot(h_c[1])));
  }

  void step(double t_s, const std::array<Eigen::Vector3d, 2>& h_b, const Eigen::Vector3d& normal_c) {
    Eigen::RowVectorXd rate(kFittedCoefficients);
    for (std::size_t k = 0; k < 2; ++k) {
      Columns<kFitted.size()> columns;
      drift_.basis(readouts_[k].corrected(h_b[k]), {}, columns.view(kFitted.size()));
      rate.segment<kFitted.size()>(static_cast<Eigen::Index>(k) * kFitted.size()) =
          (k == 0 ? -normal_c : normal_c).transpose() * readouts_[k].C_c_b * columns.first(kFitted.size());
    }
    const auto number = static_cast<Eigen::Index>(t_s / block_s_);
    if (rate_.size() == 0) {
      integral_.setZero(kFittedCoefficients);
    } else {
      integral_ += (t_s - t_s_) / 2 * (rate_ + rate);
      if (number != current_.number) {
        close_block();
      }
      current_.stretch += t_s - t_s_ > block_s_ ? 1 : 0;
    }
    t_s_ = t_s;
    rate_ = rate;

    if (angles_.empty()) {
      steps_ = 0;
      current_.number = number;
      current_.by_constants.setZero(kConstants);
      current_.normal_c.setZero();
    }
    Eigen::RowVectorXd by_constants(kConstants);
    by_constants << integral_, -normal_c.transpose(), normal_c.transpose();
    current_.by_constants += by_constants;
    current_.normal_c += normal_c;
    ++steps_;
  }

  void close_block() {
    constexpr std::size_t kFewSamples = 10;
    if (angles_.size() >= kFewSamples) {
      blocks_.push_back(current_);
      Block& block = blocks_.back();
      block.angle_rad = median_of(angles_);
      block.by_constants /= steps_;
      block.normal_c.normalize();
    }
    angles_.clear();
  }

  double block_s_ = kBlock_s;
  std::array<GyroReadout, 2> readouts_;
  DriftModel drift_{kFitted, {}};
  std::vector<Block> blocks_;
  Block current_;
  std::vector<double> angles_;  ///< of the block that is being filled, at all its samples
  int steps_ = 0;               ///< in it
  double t_s_ = 0;
  Eigen::RowVectorXd rate_, integral_;  ///< of the angle by κ, at t_s_; rad/s and rad per rad/s
};

/// What is fitted: κ of this model, δ, and a constant for each stretch of samples. Columns of unit length.
Eigen::MatrixXd fitted_columns(const std::vector<Block>& blocks, const DriftModelId& model) {
  const auto n = static_cast<Eigen::Index>(blocks.size());
  const Eigen::Index kappa = model.size();
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(n, 2 * kappa + 6 + blocks.back().stretch + 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Block& block = blocks[static_cast<std::size_t>(i)];
    columns.row(i).head(kappa) = block.by_constants.head(kappa);
    columns.row(i).segment(kappa, kappa) = block.by_constants.segment(kFitted.size(), kappa);
    columns.row(i).segment<6>(2 * kappa) = block.by_constants.tail<6>();
    columns(i, 2 * kappa + 6 + block.stretch) = 1;
  }
  return columns.array().rowwise() / columns.colwise().norm().array().max(std::numeric_limits<double>::min());
}

}  // namespace

std::optional<AngleBetweenMomenta> AngleBetweenMomenta::of(const GyroTelemetry& telemetry,
                                                           const std::vector<GyroCalibration>& gyros, int first,
                                                           int second) {
  if (gyros.size() < 2 || telemetry.size() == 0) {
    return std::nullopt;
  }
  const Blocks found(telemetry, gyros, {first, second});
  const std::vector<Block>& blocks = found.all();
  const auto n = static_cast<Eigen::Index>(blocks.size());
  if (n == 0 || n < kConstants + blocks.back().stretch + 1 + kFewestLeft) {
    return std::nullopt;
  }
  AngleBetweenMomenta angle;
  angle.block_s_ = found.block_s();
  angle.normal_c_.resize(3, blocks.back().number + 1);
  Eigen::VectorXd seen_rad(n);
  for (Eigen::Index i = 0; const Block& block : blocks) {
    for (Eigen::Index number = i == 0 ? 0 : angle.blocks_.back() + 1; number <= block.number; ++number) {
      angle.normal_c_.col(number) = block.normal_c;
    }
    angle.blocks_.push_back(block.number);
    seen_rad(i++) = block.angle_rad;
  }
  const auto left_by = [&](const DriftModelId& model) {
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> fit(fitted_columns(blocks, model));
    const Eigen::MatrixXd outside = Eigen::MatrixXd(fit.householderQ()).rightCols(n - fit.rank());
    return Left{outside, outside.transpose() * (seen_rad.array() - seen_rad.mean()).matrix()};
  };
  angle.by_all_ = left_by(kFitted);
  angle.by_eq1_ = left_by(kEsg7);
  return angle;
}

double AngleBetweenMomenta::left_rad() const { return std::sqrt(by_all_.left_rad.array().square().mean()); }

double AngleBetweenMomenta::largest_line_rad(double period_s) const {
  Eigen::MatrixX2d line(static_cast<Eigen::Index>(blocks_.size()), 2);
  for (Eigen::Index i = 0; i < line.rows(); ++i) {
    const double phase =
        2 * std::numbers::pi * block_s_ * static_cast<double>(blocks_[static_cast<std::size_t>(i)]) / period_s;
    line.row(i) << std::cos(phase), std::sin(phase);
  }
  const auto by = [&](const Left& left) {
    return std::sqrt(left.left_rad.array().square().mean() / (left.outside.transpose() * line).array().square().mean());
  };
  return std::min(by(by_all_), by(by_eq1_));
}

/// Of the angle at the blocks by the drift that wanders and the random walk of both momenta, from zero on.
Eigen::MatrixXd AngleBetweenMomenta::covariance(const CalibrationNoise& noise) const {
  const Eigen::Index all = normal_c_.cols();
  const double walk = noise.direction_random_walk_rad_sqrt_s;
  Eigen::MatrixXd rates(all, all);
  for (Eigen::Index i = 0; i < all; ++i) {
    for (Eigen::Index j = 0; j < all; ++j) {
      const double apart_s = block_s_ * static_cast<double>(i > j ? i - j : j - i);
      const double kept = noise.wandering_time_s > 0 ? std::exp(-apart_s / noise.wandering_time_s) : 0;
      const double wandering = std::pow(noise.wandering_drift_rad_s, 2) * kept * normal_c_.col(i).dot(normal_c_.col(j));
      rates(i, j) = 2 * (wandering + (i == j ? walk * walk / block_s_ : 0));  // of two gyros
    }
  }
  const auto integrate_columns = [&] {
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(all);
    for (Eigen::Index i = 0; i < all; ++i) {
      const Eigen::RowVectorXd half = block_s_ / 2 * rates.row(i);
      rates.row(i) = sum + half;
      sum += 2 * half;
    }
  };
  integrate_columns();
  rates.transposeInPlace();
  integrate_columns();
  return rates(blocks_, blocks_);
}

auto AngleBetweenMomenta::wander(const CalibrationNoise& noise) const -> Wander {
  const Eigen::MatrixXd by_noise = covariance(noise);
  return std::max(wander(by_all_, by_noise), wander(by_eq1_, by_noise),
                  [](const Wander& a, const Wander& b) { return a.log_odds < b.log_odds; });
}

auto AngleBetweenMomenta::wander(const Left& left, const Eigen::MatrixXd& by_noise) -> Wander {
  // Along the axes of its covariance by the noise.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(left.outside.transpose() * by_noise * left.outside);
  const Eigen::ArrayXd variances = axes.eigenvalues().array().max(0);
  const Eigen::ArrayXd squares = (axes.eigenvectors().transpose() * left.left_rad).array().square();
  // ln of the likelihood with the best white noise of the readings.
  const double readout = std::log(squares.mean() + std::numeric_limits<double>::min());
  const auto likelihood = [&](double part) {
    const auto cost = [&](double log_variance) {
      const Eigen::ArrayXd variance = part * variances + std::exp(log_variance);
      return (variance.log() + squares / variance).sum() / 2;
    };
    constexpr double kDown = 14;  // a thousandth of the angle's scatter
    return -boost::math::tools::brent_find_minima(cost, readout - kDown, readout + 1, 16).second;
  };
  constexpr int kLeast = -12;  // powers of 2
  constexpr int kMost = 6;
  Wander found{0, 0, std::sqrt(variances.mean())};
  double quiet = likelihood(0);
  double moving = likelihood(Wander::kQuiet);
  for (int power = kLeast; power <= kMost; ++power) {
    const double part = std::ldexp(1.0, power);
    const double its = likelihood(part);
    found.part = its > std::max(quiet, moving) ? part : found.part;
    double& best = part <= Wander::kQuiet ? quiet : moving;
    best = std::max(best, its);
  }
  found.log_odds = quiet - moving;
  return found;
}

}  // namespace trihedron::ground
