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

// With noises of the variances a and b, and n residuals of a component, half of what the mean
// squares of the residuals are more has the variance (2 (a + b)² − a² − b²) / 4n.
UnfollowedMotion FittedDirections::unfollowed(int one, int other, double cosine,
                                              const PerGyro<double>& readout_noise_rad) const {
  constexpr double kLeastSineSquare = 0.1;
  const double sine_square = 1 - cosine * cosine;
  if (!(sine_square > kLeastSineSquare)) {
    return {};
  }
  const double n = freedom / 2.0;
  const double by_readings_rad2 = (residual_square[one] + residual_square[other]) / (2 * n);
  const double a = readout_noise_rad[one] * readout_noise_rad[one];
  const double b = readout_noise_rad[other] * readout_noise_rad[other];
  return {(by_readings_rad2 - square_beside / (n * sine_square)) / 2,
          std::sqrt((2 * (a + b) * (a + b) - a * a - b * b) / (4 * n))};
}

void DirectionsFit::add(Time t, const Directions& h_b, double beside) {
  if (samples_++ == 0) {
    first_ = h_b;
    first_beside_ = beside;
  }
  const double x = to_seconds(t - t_) / reach_s_;
  const Eigen::Vector4d powers(1, terms_ > 1 ? x : 0, terms_ > 2 ? x * x : 0, terms_ > 3 ? x * x * x : 0);
  for (int j = 0; j < kTerms; ++j) {
    for (int i = j; i < kTerms; ++i) {
      normal_(i, j) += powers(i) * powers(j);  // of the lower triangle, which is all that the factor is made of
    }
  }
  for (int k = 0; k < gyros_; ++k) {
    // Differences from the first sample: the sums keep their digits.
    const Eigen::Vector3d apart = h_b[k] - first_[k];
    for (int axis = 0; axis < 3; ++axis) {
      right_.col(3 * k + axis) += powers * apart(axis);
      squares_(3 * k + axis) += apart(axis) * apart(axis);
    }
  }
  const double apart = beside - first_beside_;
  right_.col(3L * gyros_) += powers * apart;
  square_beside_ += apart * apart;
}

FittedDirections DirectionsFit::solve() const {
  const Eigen::Matrix<double, kTerms, kTerms> L = cholesky_root<kTerms>(normal_);
  Right coefficients = right_;
  solve_factorized(matrix_of(L), coefficients.leftCols(3L * gyros_ + 1));
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
  const auto beside = coefficients.col(3L * gyros_);
  result.square_beside = std::max(square_beside_ - beside.dot(right_.col(3L * gyros_)), 0.0);
  Eigen::Vector4d at_zero = Eigen::Vector4d::UnitX();
  solve_lower(matrix_of(L), at_zero);
  result.noise_factor = at_zero.norm();
  return result;
}

}  // namespace trihedron
