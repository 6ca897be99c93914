#pragma once
/// Polynomials through the readings of several samples: the body moves smoothly, the readout noise is white.

#include <Eigen/Core>

#include "trihedron/core/jitter.hpp"
#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron {

/// Fitted directions and their rates at one time, in the axes of the samples.
struct FittedDirections {
  Directions h_b;                   ///< unit
  Directions h_b_rate;              ///< 1/s, across h_b
  double noise_factor = 1;          ///< 1-sigma of h_b over that of a single reading
  PerGyro<double> residual_square;  ///< sum of the squared residuals
  double square_beside = 0;         ///< sum of the squared residuals of what was given beside the directions
  int freedom = 0;                  ///< of the residuals of one gyro, two components each

  /// Whether a polynomial is what the body did: its residuals are those of the readout, within five sigmas.
  [[nodiscard]] bool explains(const GyroMask& used, const PerGyro<double>& readout_noise_rad) const;
  /// Motion of the body in the residuals of gyros `one` and `other`, with the cosine of the angle between whose momenta
  /// given beside the directions: no motion changes it (docs/mathematics.md, section 2). `cosine`: here. Nothing where
  /// the momenta are within 18° of each other.
  [[nodiscard]] UnfollowedMotion unfollowed(int one, int other, double cosine,
                                            const PerGyro<double>& readout_noise_rad) const;
};

/// Least-squares polynomial in time through samples, evaluated at time t: a cubic where there are enough of them, less
/// where not. With weights equal, the noise at the middle of 49 samples falls to 0.21 of a single one.
class DirectionsFit {
 public:
  /// The smallest number of samples that a polynomial of this degree is fitted to.
  [[nodiscard]] static constexpr int least_samples(int degree) { return 2 * (degree + 1); }

  /// Of `samples` samples, the first and the last of them at these times; of the first `gyros` gyros.
  DirectionsFit(Time t, Time first, Time last, int samples, int max_degree, int gyros);

  /// `beside`: another quantity of the same sample.
  void add(Time t, const Directions& h_b, double beside = 0);

  /// Needs all samples.
  [[nodiscard]] FittedDirections solve() const;

 private:
  static constexpr int kTerms = 4;
  using Right = Eigen::Matrix<double, kTerms, 3 * kMaxGyros + 1>;  // behind the gyros what is beside them

  Time t_;
  double reach_s_;
  int terms_;
  int gyros_;
  int samples_ = 0;
  Eigen::Matrix<double, kTerms, kTerms> normal_ = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  Right right_ = Right::Zero();
  Eigen::Matrix<double, 1, 3 * kMaxGyros> squares_ = Eigen::Matrix<double, 1, 3 * kMaxGyros>::Zero();
  double square_beside_ = 0;
  Directions first_;
  double first_beside_ = 0;
};

}  // namespace trihedron
