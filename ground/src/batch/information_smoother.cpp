#include "batch/information_smoother.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "batch/householder.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Upper;
using Eigen::VectorXd;

double log_determinant(const MatrixXd& triangle) { return triangle.diagonal().array().abs().log().sum(); }

/// Rotates rows so that in the first `columns` columns only an upper triangle remains.
void rotate_up(MatrixXd& rows, Index columns) {
  ground::rotate_up(rows.data(), rows.rows(), rows.cols(), columns);
  for (Index column = 0; column < columns; ++column) {
    rows.col(column).tail(rows.rows() - std::min(column + 1, rows.rows())).setZero();
  }
}

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

/// Forward pass. The rows about d are kept as a triangle; the rest are about c alone, which is constant, and are kept
/// until the end.
class Forward {
 public:
  Forward(const MatrixXd& prior, const VectorXd& prior_y, Index d)
      : n_(prior.cols()), d_(d), constant_rows_(n_ - d + 1), moving_(prior.rows(), n_ + 1) {
    moving_ << prior, prior_y;
  }

  void measure(const SmootherStage& stage) {
    check_stop();
    const Index c = n_ - d_;
    MatrixXd rows = MatrixXd::Zero(std::max(moving_.rows() + stage.H.rows(), d_), n_ + 1);
    rows.topRows(moving_.rows()) = moving_;
    rows.block(moving_.rows(), 0, stage.H.rows(), n_) = stage.H;
    rows.block(moving_.rows(), n_, stage.H.rows(), 1) = stage.y;
    rotate_up(rows, d_);
    constant_rows_.add(rows.bottomRightCorner(rows.rows() - d_, c + 1));
    moving_ = rows.topRows(d_);
  }

  /// Time update to the next stage; returns the rows about w.
  SmootherResult::NoiseRows move(const SmootherStage& stage) {
    const Index d = d_;
    const Index c = n_ - d;
    // With d = A⁻¹ (d' − B c − m − noise w) put in: columns w, d', c, right side; w has unit rows of its own.
    const MatrixXd R_d = moving_.leftCols(d) * stage.A_inverse;
    MatrixXd moved = MatrixXd::Zero(2 * d, d + n_ + 1);
    moved.topLeftCorner(d, d).setIdentity();
    moved.block(d, 0, d, d) = -R_d * stage.noise.asDiagonal();
    moved.block(d, d, d, d) = R_d;
    moved.block(d, 2 * d, d, c) = moving_.middleCols(d, c) - R_d * stage.B;
    moved.bottomRightCorner(d, 1) = moving_.rightCols(1) + R_d * stage.m;
    rotate_up(moved, d);
    moving_ = moved.bottomRightCorner(d, n_ + 1);
    return {moved.topLeftCorner(d, d), moved.block(0, d, d, n_), moved.topRightCorner(d, 1)};
  }

  /// Triangle about (d, c), right side last; its rows about c hold whatever d is.
  [[nodiscard]] MatrixXd triangle() const {
    MatrixXd triangle = MatrixXd::Zero(n_ + 1, n_ + 1);
    triangle.topRows(d_) = moving_;
    triangle.bottomRightCorner(n_ - d_ + 1, n_ - d_ + 1) = constant_rows_.triangle();
    return triangle;
  }

 private:
  Index n_;
  Index d_;
  ConstantRows constant_rows_;
  MatrixXd moving_;
};

}  // namespace

MatrixXd triangle_of(const MatrixXd& rows) {
  const Index size = rows.cols();
  MatrixXd rotated = rows;
  rotate_up(rotated, size);
  MatrixXd triangle = MatrixXd::Zero(size, size);
  const Index there = std::min(rows.rows(), size);
  triangle.topRows(there) = rotated.topRows(there);
  return triangle;
}

namespace {

/// The whole forward pass. `stage(i)`: of the i-th of the `stages`; `moved(step)` gets the rows about w of each step.
/// Returns the triangle at the end; adds ln |det R| of all w.
template <class StageAt, class Moved>
MatrixXd go_forward(const MatrixXd& prior, const VectorXd& prior_y, std::size_t stages, StageAt&& stage_at,
                    Moved&& moved, double& log_root_determinant) {
  std::optional<Forward> forward;
  for (std::size_t i = 0; i < stages; ++i) {
    const SmootherStage& stage = stage_at(i);
    if (!forward) {
      forward.emplace(prior, prior_y, stage.m.size());
    }
    forward->measure(stage);
    if (i + 1 < stages) {
      SmootherResult::NoiseRows step = forward->move(stage);
      // The determinant for (d, c, w) is that for (w, d', c) over |det A⁻¹|, the determinant of the change of
      // variables.
      log_root_determinant += log_determinant(step.R) - std::log(std::abs(stage.A_inverse.determinant()));
      moved(std::move(step));
    }
  }
  return forward->triangle();
}

/// Throws std::invalid_argument where a state has no information.
void refuse_singular(const Eigen::Ref<const MatrixXd>& root) {
  if (!((root.diagonal().array().abs() > 0).all() && root.allFinite())) {
    throw std::invalid_argument("smoother: a state without any information");
  }
}

/// That of all states, by their triangle at the end and what go_forward() has added.
SmootherLikelihood likelihood_by(const MatrixXd& triangle, double log_root_determinant) {
  const Index n = triangle.cols() - 1;
  refuse_singular(triangle.topLeftCorner(n, n));
  return {triangle(n, n) * triangle(n, n), log_root_determinant + log_determinant(triangle.topLeftCorner(n, n))};
}

}  // namespace

SmootherLikelihood likelihood(const MatrixXd& prior, const VectorXd& prior_y, std::size_t stages,
                              const std::function<SmootherStage(std::size_t)>& stage) {
  double log_root_determinant = 0;
  const MatrixXd triangle = go_forward(
      prior, prior_y, stages, stage, [](SmootherResult::NoiseRows&&) {}, log_root_determinant);
  return likelihood_by(triangle, log_root_determinant);
}

ConstantsInformation eliminate_moving(const MatrixXd& prior, const VectorXd& prior_y, std::size_t stages,
                                      const std::function<SmootherStage(std::size_t)>& stage) {
  ConstantsInformation found;
  const MatrixXd triangle = go_forward(
      prior, prior_y, stages, stage, [](SmootherResult::NoiseRows&&) {}, found.log_root_determinant);
  const Index d = stage(0).m.size();
  const auto moving = triangle.topLeftCorner(d, d);
  refuse_singular(moving);
  found.log_root_determinant += log_determinant(moving);
  found.triangle = triangle.bottomRightCorner(triangle.rows() - d, triangle.cols() - d);
  return found;
}

SmootherResult smooth(const MatrixXd& prior, const VectorXd& prior_y, const std::vector<SmootherStage>& stages) {
  const Index n = prior.cols();
  const Index d = stages.front().m.size();
  const Index c = n - d;
  SmootherResult result;
  double log_root_determinant = 0;
  const MatrixXd triangle = go_forward(
      prior, prior_y, stages.size(), [&](std::size_t i) -> const SmootherStage& { return stages[i]; },
      [&](SmootherResult::NoiseRows&& step) { result.steps.push_back(std::move(step)); }, log_root_determinant);
  result.likelihood = likelihood_by(triangle, log_root_determinant);
  const auto root = triangle.topRows(n);
  const auto R = root.leftCols(n).triangularView<Upper>();
  result.last_root = R.solve(MatrixXd::Identity(n, n));

  // Backward.
  result.x.resize(stages.size());
  result.x.back() = R.solve(root.col(n));
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
  const Index n = prior.cols();
  const Index d = stages.front().m.size();
  ConstantRows constant_rows(n - d + 1);
  for (SmootherStage& stage : stages) {
    check_stop();
    if (stage.H.rows() > d) {
      MatrixXd rows(stage.H.rows(), n + 1);
      rows << stage.H, stage.y;
      rotate_up(rows, d);
      constant_rows.add(rows.bottomRightCorner(rows.rows() - d, n - d + 1));
      stage.H = rows.topLeftCorner(d, n);
      stage.y = rows.topRightCorner(d, 1);
    }
  }
  const MatrixXd constants = constant_rows.triangle();
  const Index before = prior.rows();
  prior.conservativeResize(before + constants.rows(), n);
  prior.bottomRows(constants.rows()) << MatrixXd::Zero(constants.rows(), d), constants.leftCols(n - d);
  prior_y.conservativeResize(prior.rows());
  prior_y.tail(constants.rows()) = constants.rightCols(1);
}

std::vector<MatrixXd> triangles_after(const MatrixXd& prior, const VectorXd& prior_y,
                                      const std::vector<SmootherStage>& stages, const std::vector<std::size_t>& after) {
  Forward forward(prior, prior_y, stages.front().m.size());
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
  MatrixXd spread = rows.leftCols(rows.cols() - c) * dynamic_[stage];
  spread.rightCols(c) += rows.rightCols(c) * constants_;
  return spread;
}

}  // namespace trihedron::ground
