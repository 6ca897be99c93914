#include "choose/stretch.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <utility>

#include "linear/gram.hpp"

namespace trihedron::ground {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void Stretch::measure(const MatrixXd& rows) {
  if (rows.rows() == 0) {
    return;
  }
  MatrixXd its = MatrixXd::Zero(rows.rows(), 2 * d_ + rest_);
  its.middleCols(stages_.empty() ? d_ : 0, d_) = rows.leftCols(d_);
  its.rightCols(rest_) = rows.middleCols(d_, rest_);
  if (stages_.empty()) {
    add_to_prior(its, rows.rightCols(1));
  } else {
    stages_.back().H = std::move(its);
    stages_.back().y = rows.rightCols(1);
  }
}

void Stretch::move(const SmootherStage& its, const MatrixXd& by_shapes) {
  constexpr double kLeastNoise_rad = 1e-9;  // 0.2 mas: no reading shows it
  LongRows B = LongRows::Zero(d_, d_ + rest_);
  B.middleCols(d_, its.B.cols()) = its.B;
  B.rightCols(by_shapes.cols()) = by_shapes;
  if (stages_.empty()) {  // w = (d' − A d − B c − m) / noise
    MatrixXd rows(d_, 2 * d_ + rest_);
    rows << MatrixXd::Identity(d_, d_), -its.A_inverse.inverse(), -B.rightCols(rest_);
    const VectorXd weight = its.noise.cwiseMax(kLeastNoise_rad).cwiseInverse();
    add_to_prior(weight.asDiagonal() * rows, weight.cwiseProduct(its.m));
  } else {
    SmootherStage& stage = stages_.back();
    stage.A_inverse = its.A_inverse;
    stage.B = std::move(B);
    stage.m = its.m;
    stage.noise = its.noise;
  }
  SmootherStage& next = stages_.emplace_back();
  next.H.setZero(0, 2 * d_ + rest_);
  next.m.setZero(d_);
}

MatrixXd Stretch::form(bool is_last) {
  const ConstantsInformation found =
      eliminate_moving(prior_, prior_y_, stages_.size(), [this](std::size_t i) { return std::move(stages_[i]); });
  MatrixXd form = MatrixXd::Zero(2 * d_ + rest_ + 1, 2 * d_ + rest_ + 1);
  const MatrixXd squares = found.squares.selfadjointView<Eigen::Lower>();
  form.topLeftCorner(d_, d_) = squares.topLeftCorner(d_, d_);
  form.topRightCorner(d_, rest_ + 1) = squares.topRightCorner(d_, rest_ + 1);
  form.bottomLeftCorner(rest_ + 1, d_) = squares.bottomLeftCorner(rest_ + 1, d_);
  form.bottomRightCorner(rest_ + 1, rest_ + 1) = squares.bottomRightCorner(rest_ + 1, rest_ + 1);
  if (!is_last) {
    MatrixXd rows(d_, form.cols());
    rows << found.moving.middleCols(d_, d_), found.moving.leftCols(d_), found.moving.rightCols(rest_ + 1);
    form.noalias() += rows.transpose() * rows;
  }
  form.rightCols(1) *= -1;
  form.bottomRows(1) *= -1;
  return form;
}

void Stretch::add_to_prior(const MatrixXd& rows, const VectorXd& y) {
  const Index before = prior_.rows();
  prior_.conservativeResize(before + rows.rows(), rows.cols());
  prior_.bottomRows(rows.rows()) = rows;
  prior_y_.conservativeResize(prior_.rows());
  prior_y_.tail(rows.rows()) = y;
}

MatrixXd without_first(const MatrixXd& form, Index size, MatrixXd* follow) {
  const Index rest = form.rows() - size;
  MatrixXd root = form.topLeftCorner(size, size);
  static_cast<void>(to_root(root));  // positive definite, since the pass has a solution
  MatrixXd half = form.topRightCorner(size, rest);
  solve_lower(root, half);
  if (follow != nullptr) {
    *follow = root.triangularView<Eigen::Lower>().transpose().solve(half);
  }
  MatrixXd left = form.bottomRightCorner(rest, rest);
  add_gram(half.transpose(), -1, left);
  left.triangularView<Eigen::StrictlyUpper>() = left.transpose();
  return left;
}

MatrixXd without_states_at_end(const MatrixXd& form, Index states) {
  std::vector<Index> others;
  for (Index i = 0; i < form.rows(); ++i) {
    if (i < states || i >= 2 * states) {
      others.push_back(i);
    }
  }
  return form(others, others);
}

MatrixXd prior_rows(const PassProblem::Linear& linear, Index shapes) {
  MatrixXd rows(linear.prior.rows(), linear.prior.cols() + shapes + 1);
  rows << linear.prior, MatrixXd::Zero(linear.prior.rows(), shapes), linear.prior_y;
  return rows;
}

}  // namespace trihedron::ground
