#include "calibrate/at_rest.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "model/scatter.hpp"

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

void AtRest::settle() {
  if (t_s_.size() <= kFewest) {
    return;
  }
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < t_s_.size(); ++i) {
    steps_s.push_back(t_s_[i] - t_s_[i - 1]);
  }
  step_s_ = median_of(steps_s);
  const auto rates = Eigen::Matrix3Xd::Map(rates_rad_s_.data(), 3, static_cast<Eigen::Index>(t_s_.size()));
  const Eigen::ArrayXd sizes_rad_s = rates.colwise().norm();
  std::vector<double> sorted_rad_s(sizes_rad_s.begin(), sizes_rad_s.end());
  const double usual_rad_s = median_of(sorted_rad_s);
  farthest_s_ = std::min(kFarthest_s, kFarthestTurn_rad / usual_rad_s);
  const double rest_rad_s = std::max(kSlowest_rad_s, kPartOfUsual * usual_rad_s);
  in_motion_ = {0};
  Eigen::Index begin = 0;
  while (begin < rates.cols()) {
    const double until_s = t_s_[static_cast<std::size_t>(begin)] + kStretch_s;
    Eigen::Index end = begin;
    while (end < rates.cols() && t_s_[static_cast<std::size_t>(end)] < until_s) {
      ++end;
    }
    end = std::max(end, begin + 1);
    const Eigen::Vector3d its_rad_s = medians_of(rates.middleCols(begin, end - begin));
    for (; begin < end; ++begin) {
      const bool rests = (rates.col(begin) - its_rad_s).norm() < rest_rad_s;
      in_motion_.push_back(in_motion_.back() + (rests ? 0 : 1));
    }
  }
}

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
