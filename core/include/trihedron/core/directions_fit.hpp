#pragma once
/// Polynomials through the readings of several samples: the body moves smoothly, the readout noise is white.

#include <Eigen/Core>

#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron {

/// Fitted directions and their rates at one time, in the axes of the samples.
struct FittedDirections {
  Directions h_b;                   ///< unit
  Directions h_b_rate;              ///< 1/s, across h_b
  double noise_factor = 1;          ///< 1-sigma of h_b over that of a single reading
  PerGyro<double> residual_square;  ///< sum of the squared residuals
  int freedom = 0;                  ///< of the residuals of one gyro, two components each

  /// Whether a polynomial is what the body did: its residuals are those of the readout, within five sigmas.
  [[nodiscard]] bool explains(const GyroMask& used, const PerGyro<double>& readout_noise_rad) const;
};

/// Least-squares polynomial in time through samples, evaluated at time t: a cubic where there are enough of them, less
/// where not. With weights equal, the noise at the middle of 49 samples falls to 0.21 of a single one.
class DirectionsFit {
 public:
  /// The smallest number of samples that a polynomial of this degree is fitted to.
  [[nodiscard]] static constexpr int least_samples(int degree) { return 2 * (degree + 1); }

  /// Of `samples` samples, the first and the last of them at these times; of the first `gyros` gyros.
  DirectionsFit(Time t, Time first, Time last, int samples, int max_degree, int gyros);

  void add(Time t, const Directions& h_b);

  /// Needs all samples.
  [[nodiscard]] FittedDirections solve() const;

 private:
  static constexpr int kTerms = 4;
  using Right = Eigen::Matrix<double, kTerms, 3 * kMaxGyros>;

  Time t_;
  double reach_s_;
  int terms_;
  int gyros_;
  int samples_ = 0;
  Eigen::Matrix<double, kTerms, kTerms> normal_ = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  Right right_ = Right::Zero();
  Eigen::Matrix<double, 1, 3 * kMaxGyros> squares_ = Eigen::Matrix<double, 1, 3 * kMaxGyros>::Zero();
  Directions first_;
};

}  // namespace trihedron
