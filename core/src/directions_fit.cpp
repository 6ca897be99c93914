#include "trihedron/core/directions_fit.hpp"

#include <algorithm>
#include <cmath>

#include "trihedron/core/cholesky.hpp"

namespace trihedron {

bool FittedDirections::explains(const GyroMask& used, const PerGyro<double>& readout_noise_rad) const {
  const double bound = freedom + 5 * std::sqrt(2.0 * freedom);
  for (int k = 0; k < kMaxGyros; ++k) {
    if (used[k] && !(residual_square[k] <= bound * readout_noise_rad[k] * readout_noise_rad[k])) {
      return false;
    }
  }
  return true;
}

DirectionsFit::DirectionsFit(Time t, Time first, Time last, int samples, int max_degree, int gyros)
    : t_(t),
      // Time in units of the reach of the samples, so that the normal equations are well conditioned.
      reach_s_(std::max({std::abs(to_seconds(first - t)), std::abs(to_seconds(last - t)), 1e-9})),
      terms_(std::clamp((samples + 2) / 3, 1, std::min(max_degree + 1, kTerms))),
      gyros_(gyros) {
  normal_.diagonal().tail(kTerms - terms_).setOnes();  // what is not fitted stays zero
}

void DirectionsFit::add(Time t, const Directions& h_b) {
  if (samples_++ == 0) {
    first_ = h_b;
  }
  const double x = to_seconds(t - t_) / reach_s_;
  const Eigen::Vector4d powers(1, terms_ > 1 ? x : 0, terms_ > 2 ? x * x : 0, terms_ > 3 ? x * x * x : 0);
  normal_ += powers * powers.transpose();
  for (int k = 0; k < gyros_; ++k) {
    // Differences from the first sample: the sums keep their digits.
    const Eigen::Vector3d apart = h_b[k] - first_[k];
    for (int axis = 0; axis < 3; ++axis) {
      right_.col(3 * k + axis) += powers * apart(axis);
      squares_(3 * k + axis) += apart(axis) * apart(axis);
    }
  }
}

FittedDirections DirectionsFit::solve() const {
  const Eigen::Matrix<double, kTerms, kTerms> L = cholesky_root<kTerms>(normal_);
  Right coefficients = right_;
  solve_factorized(matrix_of(L), coefficients.leftCols(3L * gyros_));
  FittedDirections result;
  result.freedom = 2 * (samples_ - terms_);
  for (int k = 0; k < gyros_; ++k) {
    const auto its = coefficients.middleCols<3>(3L * k);
    const Eigen::Vector3d h = first_[k] + its.row(0).transpose();
    const double norm = h.norm();
    const double square = squares_.segment<3>(3L * k).sum() - its.cwiseProduct(right_.middleCols<3>(3L * k)).sum();
    result.residual_square[k] = std::max(square, 0.0);
    result.h_b[k] = h / norm;
    result.h_b_rate[k].setZero();
    if (terms_ > 1) {
      const Eigen::Vector3d rate = its.row(1).transpose() / (reach_s_ * norm);
      result.h_b_rate[k] = rate - result.h_b[k] * result.h_b[k].dot(rate);
    }
  }
  Eigen::Vector4d at_zero = Eigen::Vector4d::UnitX();
  solve_lower(matrix_of(L), at_zero);
  result.noise_factor = at_zero.norm();
  return result;
}

}  // namespace trihedron
