#include "information_smoother.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Upper;
using Eigen::VectorXd;

/// The triangle of the rows that `rows` can be rotated into, without those below it. The last column is the right side.
MatrixXd triangle_of(const MatrixXd& rows, Index wanted) {
  const Eigen::HouseholderQR<MatrixXd> qr(rows);
  const Index there = std::min(rows.rows(), rows.cols());
  MatrixXd triangle = MatrixXd::Zero(wanted, rows.cols());
  triangle.topRows(std::min(there, wanted)) = qr.matrixQR().topRows(std::min(there, wanted)).triangularView<Upper>();
  return triangle;
}

MatrixXd stacked(const MatrixXd& above, const MatrixXd& below) {
  MatrixXd rows(above.rows() + below.rows(), above.cols());
  rows << above, below;
  return rows;
}

/// w of one step by the states after it: R w + S x' = z with unit noise.
struct NoiseRows {
  MatrixXd R;
  MatrixXd S;
  VectorXd z;
};

double log_determinant(const MatrixXd& triangle) { return triangle.diagonal().array().abs().log().sum(); }

}  // namespace

SmootherResult smooth(const MatrixXd& prior, const VectorXd& prior_y, const std::vector<SmootherStage>& stages) {
  const Index n = prior.cols();
  SmootherResult result;
  // Forward. [R z] holds R x = z + unit noise of the present stage.
  MatrixXd root(prior.rows(), n + 1);
  root << prior, prior_y;
  std::vector<NoiseRows> steps;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const SmootherStage& stage = stages[i];
    MatrixXd measured(stage.H.rows(), n + 1);
    measured << stage.H, stage.y;
    // One row more than there are states: what is left over on the right side is the residual.
    root = triangle_of(stacked(root, measured), n + 1);
    result.residual_square += root(n, n) * root(n, n);
    root.conservativeResize(n, n + 1);
    if (i + 1 == stages.size()) {
      break;
    }
    // With d = A⁻¹ (d' − B c − m − noise w) put in: columns w, d', c, right side; w has unit rows of its own.
    const Index d = stage.m.size();
    const MatrixXd R_d = root.leftCols(d) * stage.A_inverse;
    MatrixXd moved = MatrixXd::Zero(d + n, d + n + 1);
    moved.topLeftCorner(d, d).setIdentity();
    moved.block(d, 0, n, d) = -R_d * stage.noise.asDiagonal();
    moved.block(d, d, n, d) = R_d;
    moved.block(d, 2 * d, n, n - d) = root.middleCols(d, n - d) - R_d * stage.B;
    moved.bottomRightCorner(n, 1) = root.rightCols(1) + R_d * stage.m;
    const MatrixXd triangle = triangle_of(moved, d + n);
    steps.push_back({triangle.topLeftCorner(d, d), triangle.block(0, d, d, n), triangle.topRightCorner(d, 1)});
    // That of (d, c, w): by those of (w, d', c), of which they are a linear function with the determinant of A⁻¹.
    result.log_root_determinant += log_determinant(steps.back().R) - std::log(std::abs(stage.A_inverse.determinant()));
    root = triangle.bottomRightCorner(n, n + 1);
  }
  if (!((root.diagonal().array().abs() > 0).all() && root.allFinite())) {
    throw std::invalid_argument("smoother: a state without any information");
  }
  result.log_root_determinant += log_determinant(root);

  // Backward.
  const auto R = root.leftCols(n).triangularView<Upper>();
  result.stages.resize(stages.size());
  result.stages.back() = {R.solve(root.col(n)), R.solve(MatrixXd::Identity(n, n))};
  for (std::size_t i = steps.size(); i-- > 0;) {
    const SmootherStage& stage = stages[i];
    const NoiseRows& step = steps[i];
    const SmoothedStage& next = result.stages[i + 1];
    const Index d = stage.m.size();
    const auto R_w = step.R.triangularView<Upper>();
    const VectorXd w = R_w.solve(step.z - step.S * next.x);
    SmoothedStage& now = result.stages[i];
    now.x = next.x;
    now.x.head(d) =
        stage.A_inverse * (next.x.head(d) - stage.B * next.x.tail(n - d) - stage.m - stage.noise.cwiseProduct(w));
    // Of the errors of x' and of w, which is that of its rows.
    const MatrixXd w_by_next = -R_w.solve(step.S * next.root);
    const MatrixXd w_own = R_w.solve(MatrixXd::Identity(d, d));
    MatrixXd wide(n, n + d);
    wide.leftCols(n) = next.root;
    wide.rightCols(d).setZero();
    wide.topLeftCorner(d, n) = stage.A_inverse * (next.root.topRows(d) - stage.B * next.root.bottomRows(n - d) -
                                                  stage.noise.asDiagonal() * w_by_next);
    wide.topRightCorner(d, d) = -stage.A_inverse * stage.noise.asDiagonal() * w_own;
    now.root = triangle_of(wide.transpose(), n).transpose();
  }
  return result;
}

}  // namespace trihedron::ground
