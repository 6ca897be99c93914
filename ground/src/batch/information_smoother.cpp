#include "batch/information_smoother.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "linear/gram.hpp"
#include "linear/householder.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Upper;
using Eigen::VectorXd;

double log_determinant(const MatrixXd& triangle) { return triangle.diagonal().array().abs().log().sum(); }

/// Rotates rows so that in the first `columns` columns only an upper triangle remains.
void rotate_up(LongRows& rows, Index columns) { rotate_rows_up(rows.data(), rows.rows(), rows.cols(), columns); }

/// Rows about the constants alone, with right side; compressed to a triangle whenever the buffer is full.
class ConstantRows {
 public:
  explicit ConstantRows(Index columns) : rows_(MatrixXd::Zero(kBufferedRows + columns, columns)) {}

  template <class Rows>
  void add(const Rows& rows) {
    if (size_ + rows.rows() > rows_.rows()) {
      rows_.topRows(rows_.cols()) = triangle();
      size_ = rows_.cols();
      if (size_ + rows.rows() > rows_.rows()) {
        rows_.conservativeResize(size_ + rows.rows(), Eigen::NoChange);
      }
    }
    rows_.middleRows(size_, rows.rows()) = rows;
    size_ += rows.rows();
  }

  [[nodiscard]] MatrixXd triangle() const { return triangle_of(rows_.topRows(size_)); }

 private:
  static constexpr Index kBufferedRows = 1000;
  MatrixXd rows_;
  Index size_ = 0;
};

}  // namespace

ConstantSquares::ConstantSquares(Index columns)
    : rows_(columns, kBufferedRows), squares_(MatrixXd::Zero(columns, columns)) {}

void ConstantSquares::make_room(Index rows) {
  if (size_ + rows > rows_.cols()) {
    put_into_squares();
    rows_.resize(Eigen::NoChange, std::max(rows, rows_.cols()));
  }
}

void ConstantSquares::put_into_squares() {
  if (size_ > 0) {
    rows_.rightCols(rows_.cols() - size_).setZero();
    add_gram(rows_, 1, squares_);
    size_ = 0;
  }
}

MatrixXd ConstantSquares::take() {
  put_into_squares();
  return std::exchange(squares_, MatrixXd::Zero(squares_.rows(), squares_.cols()));
}

MatrixXd lower_root(const MatrixXd& squares) {
  // Of columns of length one, so that no rounding of the largest hides the smallest.
  const VectorXd length = squares.diagonal().cwiseMax(0).cwiseSqrt();
  const VectorXd scale = (length.array() > 0).select(length.cwiseInverse(), 0);
  const MatrixXd scaled = scale.asDiagonal() * squares * scale.asDiagonal();
  // Where a combination of columns is zero to rounding, the least that makes its root real.
  double rounding = 0;
  for (;;) {
    MatrixXd root = scaled;
    root.diagonal().array() += rounding;
    root.diagonal() = (length.array() > 0).select(root.diagonal(), 1);
    if (to_root(root)) {
      root.triangularView<Eigen::StrictlyUpper>().setZero();
      return length.asDiagonal() * root;
    }
    if (!(rounding < 1)) {  // not a number
      return MatrixXd::Constant(squares.rows(), squares.cols(), std::nan(""));
    }
    rounding = rounding > 0 ? 10 * rounding : static_cast<double>(squares.rows()) * 1e-16;
  }
}

namespace {

/// Forward pass. The rows about d are kept as a triangle; the rest are about c alone, which is constant, and go into
/// `constants`: ConstantRows or ConstantSquares.
template <class Constants>
class Forward {
 public:
  Forward(const MatrixXd& prior, const VectorXd& prior_y, Index d)
      : n_(prior.cols()), d_(d), constants_(n_ - d + 1), moving_(prior.rows(), n_ + 1) {
    moving_ << prior, prior_y;
  }

  void measure(const SmootherStage& stage) {
    check_stop();
    const Index c = n_ - d_;
    rows_.resize(std::max(moving_.rows() + stage.H.rows(), d_), n_ + 1);
    rows_.topRows(moving_.rows()) = moving_;
    rows_.block(moving_.rows(), 0, stage.H.rows(), n_) = stage.H;
    rows_.block(moving_.rows(), n_, stage.H.rows(), 1) = stage.y;
    rows_.bottomRows(rows_.rows() - moving_.rows() - stage.H.rows()).setZero();
    rotate_up(rows_, d_);
    constants_.add(rows_.bottomRightCorner(rows_.rows() - d_, c + 1));
    moving_ = rows_.topRows(d_);
  }

  /// Time update to the next stage; the rows about w are then those of noise_rows().
  void move(const SmootherStage& stage) {
    const Index d = d_;
    const Index c = n_ - d;
    // With d = A⁻¹ (d' − B c − m − noise w) put in: columns w, d', c, right side; w has unit rows of its own.
    const MatrixXd R_d = moving_.leftCols(d) * stage.A_inverse;
    moved_.setZero(2 * d, d + n_ + 1);
    moved_.topLeftCorner(d, d).setIdentity();
    moved_.block(d, 0, d, d) = -R_d * stage.noise.asDiagonal();
    moved_.block(d, d, d, d) = R_d;
    moved_.block(d, 2 * d, d, c) = moving_.middleCols(d, c);
    subtract_product(R_d, stage.B, moved_.data() + d * moved_.cols() + 2 * d, moved_.cols());
    moved_.bottomRightCorner(d, 1) = moving_.rightCols(1) + R_d * stage.m;
    rotate_up(moved_, d);
    moving_ = moved_.bottomRightCorner(d, n_ + 1);
  }

  [[nodiscard]] SmootherResult::NoiseRows noise_rows() const {
    return {moved_.topLeftCorner(d_, d_), moved_.block(0, d_, d_, n_), moved_.topRightCorner(d_, 1)};
  }
  /// ln |det| of the rows about w by w.
  [[nodiscard]] double log_determinant_of_noise() const { return moved_.diagonal().head(d_).array().abs().log().sum(); }

  /// The rows about d, right side last.
  [[nodiscard]] const LongRows& moving() const { return moving_; }
  [[nodiscard]] Constants& constants() { return constants_; }

  /// Triangle about (d, c), right side last; its rows about c hold whatever d is.
  [[nodiscard]] MatrixXd triangle() const {
    MatrixXd triangle = MatrixXd::Zero(n_ + 1, n_ + 1);
    triangle.topRows(d_) = moving_;
    triangle.bottomRightCorner(n_ - d_ + 1, n_ - d_ + 1) = constants_.triangle();
    return triangle;
  }

 private:
  Index n_;
  Index d_;
  Constants constants_;
  LongRows moving_;
  LongRows rows_;
  LongRows moved_;
};

}  // namespace

MatrixXd triangle_of(const MatrixXd& rows) {
  const Index size = rows.cols();
  MatrixXd rotated = rows;
  ground::rotate_up(rotated.data(), rotated.rows(), size, size);
  MatrixXd triangle = MatrixXd::Zero(size, size);
  const Index there = std::min(rows.rows(), size);
  triangle.topRows(there) = rotated.topRows(there).triangularView<Upper>();
  return triangle;
}

namespace {

/// The whole forward pass. `stage(i)`: of the i-th of the `stages`; `moved(forward)` is called after each step. Adds
/// ln |det R| of all w.
template <class Constants, class StageAt, class Moved>
Forward<Constants> go_forward(const MatrixXd& prior, const VectorXd& prior_y, std::size_t stages, StageAt&& stage_at,
                              Moved&& moved, double& log_root_determinant) {
  std::optional<Forward<Constants>> forward;
  for (std::size_t i = 0; i < stages; ++i) {
    const SmootherStage& stage = stage_at(i);
    if (!forward) {
      forward.emplace(prior, prior_y, stage.m.size());
    }
    forward->measure(stage);
    if (i + 1 < stages) {
      forward->move(stage);
      // The determinant for (d, c, w) is that for (w, d', c) over |det A⁻¹|, the determinant of the change of
      // variables.
      log_root_determinant += forward->log_determinant_of_noise() - std::log(std::abs(stage.A_inverse.determinant()));
      moved(*forward);
    }
  }
  return *std::move(forward);
}

/// Throws SetupError where a state has no information.
void refuse_singular(const Eigen::Ref<const MatrixXd>& root) {
  if (!((root.diagonal().array().abs() > 0).all() && root.allFinite())) {
    throw SetupError("the fixes and samples that can be used do not determine the momenta of all gyros",
                     "look at the telemetry with `trihedron inspect`: axes, signs, which gyro is which; calibrate a "
                     "part of the pass in which all gyros work, or use estimator invariant with noise = \"told\" and "
                     "all further states on or off");
  }
}

/// That of all states, by their triangle at the end and what go_forward() has added.
SmootherLikelihood likelihood_by(const MatrixXd& triangle, double log_root_determinant) {
  const Index n = triangle.cols() - 1;
  refuse_singular(triangle.topLeftCorner(n, n));
  return {triangle(n, n) * triangle(n, n), log_root_determinant + log_determinant(triangle.topLeftCorner(n, n))};
}

/// Adds rows about the constants, which stand after `d` others, with their right side: those of a triangle.
void append_constants(ConstantSquares& constants, Index d, MatrixXd& rows, VectorXd& y) {
  const MatrixXd triangle = lower_root(constants.take()).transpose();
  const Index c = triangle.cols() - 1;
  rows.conservativeResize(rows.rows() + triangle.rows(), d + c);
  rows.bottomRows(triangle.rows()) << MatrixXd::Zero(triangle.rows(), d), triangle.leftCols(c);
  y.conservativeResize(rows.rows());
  y.tail(triangle.rows()) = triangle.rightCols(1);
}

}  // namespace

SmootherLikelihood likelihood(const MatrixXd& prior, const VectorXd& prior_y, std::size_t stages,
                              const std::function<SmootherStage(std::size_t)>& stage) {
  double log_root_determinant = 0;
  const auto forward = go_forward<ConstantRows>(
      prior, prior_y, stages, stage, [](const auto&) {}, log_root_determinant);
  return likelihood_by(forward.triangle(), log_root_determinant);
}

ConstantsInformation eliminate_moving(const MatrixXd& prior, const VectorXd& prior_y, std::size_t stages,
                                      const std::function<SmootherStage(std::size_t)>& stage) {
  ConstantsInformation found;
  auto forward = go_forward<ConstantSquares>(
      prior, prior_y, stages, stage, [](const auto&) {}, found.log_root_determinant);
  const MatrixXd moving = forward.moving().leftCols(forward.moving().rows());
  refuse_singular(moving);
  found.log_root_determinant += log_determinant(moving);
  found.squares = forward.constants().take();
  found.moving = forward.moving();
  return found;
}

SmootherResult smooth(const MatrixXd& prior, const VectorXd& prior_y, const std::vector<SmootherStage>& stages) {
  const Index n = prior.cols();
  const Index d = stages.front().m.size();
  const Index c = n - d;
  SmootherResult result;
  double log_root_determinant = 0;
  const MatrixXd triangle =
      go_forward<ConstantRows>(
          prior, prior_y, stages.size(), [&](std::size_t i) -> const SmootherStage& { return stages[i]; },
          [&](const auto& forward) { result.steps.push_back(forward.noise_rows()); }, log_root_determinant)
          .triangle();
  result.likelihood = likelihood_by(triangle, log_root_determinant);
  const auto root = triangle.topRows(n);
  const auto R = root.leftCols(n);
  MatrixXd inverse = MatrixXd::Identity(n, n);
  solve_lower(R.transpose(), inverse);
  result.last_root = inverse.transpose();
  result.x.resize(stages.size());
  result.x.back() = R.triangularView<Upper>().solve(root.col(n));

  // Backward.
  for (std::size_t i = result.steps.size(); i-- > 0;) {
    const SmootherStage& stage = stages[i];
    const SmootherResult::NoiseRows& step = result.steps[i];
    const VectorXd& next = result.x[i + 1];
    const VectorXd w = step.R.triangularView<Upper>().solve(step.z - step.S * next);
    result.x[i] = next;
    result.x[i].head(d) =
        stage.A_inverse * (next.head(d) - stage.B * next.tail(c) - stage.m - stage.noise.cwiseProduct(w));
  }
  return result;
}

void gather_constants(MatrixXd& prior, VectorXd& prior_y, std::vector<SmootherStage>& stages) {
  const Index d = stages.front().m.size();
  ConstantSquares constants(prior.cols() - d + 1);
  for (SmootherStage& stage : stages) {
    check_stop();
    take_constants(stage, d, constants);
  }
  append_constants(constants, d, prior, prior_y);
}

void take_constants(SmootherStage& stage, Index d, ConstantSquares& constants) {
  const Index n = stage.H.cols();
  if (stage.H.rows() <= d) {
    return;
  }
  LongRows rows(stage.H.rows(), n + 1);
  rows << stage.H, stage.y;
  rotate_up(rows, d);
  constants.add(rows.bottomRightCorner(rows.rows() - d, n - d + 1));
  stage.H = rows.topLeftCorner(d, n);
  stage.y = rows.topRightCorner(d, 1);
}

void put_back(ConstantSquares& constants, Index d, SmootherStage& stage) {
  append_constants(constants, d, stage.H, stage.y);
}

std::vector<MatrixXd> triangles_after(const MatrixXd& prior, const VectorXd& prior_y,
                                      const std::vector<SmootherStage>& stages, const std::vector<std::size_t>& after) {
  Forward<ConstantRows> forward(prior, prior_y, stages.front().m.size());
  std::vector<MatrixXd> triangles;
  std::size_t i = 0;
  for (const std::size_t last : after) {
    for (; i <= last; ++i) {
      if (i > 0) {
        forward.move(stages[i - 1]);
      }
      forward.measure(stages[i]);
    }
    triangles.push_back(forward.triangle());
  }
  return triangles;
}

std::vector<MatrixXd> information_on_constants(const MatrixXd& prior, const std::vector<SmootherStage>& stages,
                                               const std::vector<std::size_t>& after) {
  const Index d = stages.front().m.size();
  const Index c = prior.cols() - d;
  std::vector<MatrixXd> roots;
  for (const MatrixXd& triangle : triangles_after(prior, VectorXd::Zero(prior.rows()), stages, after)) {
    roots.emplace_back(triangle.block(d, d, c, c));
  }
  return roots;
}

CovarianceRoots::CovarianceRoots(const SmootherResult& result, const std::vector<SmootherStage>& stages)
    : dynamic_(stages.size()) {
  const Index d = stages.front().m.size();
  const Index c = result.last_root.rows() - d;
  constants_ = result.last_root.bottomRightCorner(c, c);
  dynamic_.back() = result.last_root.topRows(d);
  for (std::size_t i = result.steps.size(); i-- > 0;) {
    check_stop();
    const SmootherStage& stage = stages[i];
    const SmootherResult::NoiseRows& step = result.steps[i];
    const MatrixXd& next = dynamic_[i + 1];
    // d by the errors of d' and c, the columns of their root, and by those of w, which its rows have on their own. Only
    // d moves, and only its own columns and those of w have to be put together again.
    const auto R_w = step.R.triangularView<Upper>();
    const MatrixXd by_w = stage.A_inverse * stage.noise.asDiagonal();
    MatrixXd seen = step.S.leftCols(d) * next;
    seen.rightCols(c) += step.S.rightCols(c) * constants_;
    MatrixXd moved = next;
    moved.rightCols(c) -= stage.B * constants_;
    const MatrixXd by_next = stage.A_inverse * moved + by_w * R_w.solve(seen);
    MatrixXd own(d, 2 * d);
    own << by_next.leftCols(d), by_w * R_w.solve(MatrixXd::Identity(d, d));
    dynamic_[i] = by_next;
    dynamic_[i].leftCols(d) = triangle_of(own.transpose()).transpose();
  }
}

MatrixXd CovarianceRoots::spread(std::size_t stage, const MatrixXd& rows) const {
  const Index c = constants_.cols();
  MatrixXd spread = multiply(rows.leftCols(rows.cols() - c), dynamic_[stage]);
  spread.rightCols(c) += multiply(rows.rightCols(c), constants_);
  return spread;
}

}  // namespace trihedron::ground
