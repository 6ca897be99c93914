#pragma once
/// Readings of several samples taken together: the body moves smoothly, the readout noise is white.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "trihedron/core/cholesky.hpp"
#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// The latest samples, screened and of unit length; the oldest falls out.
template <int N, int Capacity>
class SampleBuffer {
 public:
  [[nodiscard]] int size() const { return size_; }
  /// i = 0 is the oldest.
  [[nodiscard]] const GyroSample<N>& operator[](int i) const {
    return samples_[static_cast<std::size_t>((first_ + i) % Capacity)];
  }
  [[nodiscard]] const GyroSample<N>& latest() const { return (*this)[size_ - 1]; }

  void push(const GyroSample<N>& sample) {
    if (size_ == Capacity) {
      first_ = (first_ + 1) % Capacity;
      --size_;
    }
    samples_[static_cast<std::size_t>((first_ + size_) % Capacity)] = sample;
    ++size_;
  }

 private:
  std::array<GyroSample<N>, static_cast<std::size_t>(Capacity)> samples_{};
  int first_ = 0;
  int size_ = 0;
};

/// Directions at one time, c or case axes as the samples, and how they change.
template <int N>
struct FittedDirections {
  PerGyro<Eigen::Vector3d, N> h_b;       ///< unit
  PerGyro<Eigen::Vector3d, N> h_b_rate;  ///< 1/s, across h_b
  double noise_factor = 1;               ///< 1-sigma of h_b over that of a single reading
  PerGyro<double, N> residual_square;    ///< sum of the squared residuals
  int freedom = 0;                       ///< of the residuals of one gyro, two components each
};

/// Least-squares polynomial in time through the samples begin … end − 1, at time t: a cubic where there are enough of
/// them, less where not. With weights equal, the noise at the middle of 49 samples falls to 0.21 of a single one. Needs
/// begin < end. `samples`: anything whose [i] has `t` and `h_b`.
template <int N, class Samples>
[[nodiscard]] FittedDirections<N> fit_directions(const Samples& samples, int begin, int end, Time t, int max_degree) {
  constexpr int kTerms = 4;
  const int terms = std::clamp((end - begin + 2) / 3, 1, std::min(max_degree + 1, kTerms));
  // Time in units of the reach of the samples, so that the normal equations are well conditioned.
  const double reach_s =
      std::max({std::abs(to_seconds(samples[begin].t - t)), std::abs(to_seconds(samples[end - 1].t - t)), 1e-9});
  Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  normal.diagonal().tail(kTerms - terms).setOnes();  // what is not fitted stays zero
  Eigen::Matrix<double, kTerms, 3 * N> right = Eigen::Matrix<double, kTerms, 3 * N>::Zero();
  Eigen::Matrix<double, 1, 3 * N> squares = Eigen::Matrix<double, 1, 3 * N>::Zero();
  Eigen::Matrix<double, 1, 3 * N> first;
  for (int i = begin; i < end; ++i) {
    const double x = to_seconds(samples[i].t - t) / reach_s;
    const Eigen::Vector4d powers(1, terms > 1 ? x : 0, terms > 2 ? x * x : 0, terms > 3 ? x * x * x : 0);
    Eigen::Matrix<double, 1, 3 * N> h;
    for (int k = 0; k < N; ++k) {
      h.template segment<3>(3 * k) = samples[i].h_b[k].transpose();
    }
    if (i == begin) {
      first = h;
    }
    normal += powers * powers.transpose();
    // Differences from the first sample: the sums keep their digits.
    const Eigen::Matrix<double, 1, 3 * N> apart = h - first;
    right += powers * apart;
    squares += apart.cwiseAbs2();
  }
  const Eigen::Matrix<double, kTerms, kTerms> L = cholesky_root<kTerms>(normal);
  Eigen::Matrix<double, kTerms, 3 * N> coefficients = right;
  solve_factorized(L, coefficients);
  squares -= coefficients.cwiseProduct(right).colwise().sum();
  FittedDirections<N> result;
  result.freedom = 2 * (end - begin - terms);
  for (int k = 0; k < N; ++k) {
    const Eigen::Vector3d h =
        first.template segment<3>(3 * k).transpose() + coefficients.row(0).template segment<3>(3 * k).transpose();
    const double norm = h.norm();
    result.residual_square[k] = std::max(squares.template segment<3>(3 * k).sum(), 0.0);
    result.h_b[k] = h / norm;
    result.h_b_rate[k].setZero();
    if (terms > 1) {
      const Eigen::Vector3d rate = coefficients.row(1).template segment<3>(3 * k).transpose() / (reach_s * norm);
      result.h_b_rate[k] = rate - result.h_b[k] * result.h_b[k].dot(rate);
    }
  }
  Eigen::Vector4d at_zero = Eigen::Vector4d::UnitX();
  solve_lower(L, at_zero);
  result.noise_factor = at_zero.norm();
  return result;
}

}  // namespace trihedron
