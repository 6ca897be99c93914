#include "calibrate/at_rest.hpp"

#include <Eigen/Cholesky>

namespace trihedron::ground {
namespace {

Eigen::ArrayXd sigmas_of(const Eigen::VectorXd& differences, Eigen::Index axes) {
  const auto columns = differences.reshaped(axes, differences.size() / axes);
  Eigen::ArrayXd sigmas(axes);
  for (Eigen::Index axis = 0; axis < axes; ++axis) {
    const Eigen::RowVectorXd its = columns.row(axis).cwiseAbs();
    std::vector<double> sizes(its.begin(), its.end());
    sigmas(axis) = sigma_without_outliers(sizes);
  }
  return sigmas;
}

}  // namespace

Eigen::ArrayXd sigmas_less_alignments(Eigen::VectorXd differences, Eigen::MatrixXd by_alignments, Eigen::Index axes) {
  constexpr double kAlignment_rad = 0.02;
  constexpr double kOutlier = 6;  // sigmas
  const Eigen::ArrayXd sigmas = sigmas_of(differences, axes);
  if (!(sigmas > 0).all()) {
    return sigmas;
  }
  const Eigen::VectorXd weights = sigmas.inverse().replicate(differences.size() / axes, 1);
  differences = weights.cwiseProduct(differences);
  by_alignments = weights.asDiagonal() * by_alignments;
  const Eigen::VectorXd used = (differences.array().abs() < kOutlier).cast<double>();
  Eigen::MatrixXd information = by_alignments.transpose() * used.asDiagonal() * by_alignments;
  information.diagonal().array() += 1 / (kAlignment_rad * kAlignment_rad);
  const Eigen::VectorXd by_all = by_alignments.transpose() * used.cwiseProduct(differences);
  return sigmas * sigmas_of(differences - by_alignments * information.ldlt().solve(by_all), axes);
}

}  // namespace trihedron::ground
