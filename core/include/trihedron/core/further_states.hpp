#pragma once
/// What a calibration may estimate beside drift coefficients and alignments; chosen at compile time.

#include <Eigen/Core>

#include "trihedron/core/drift.hpp"

namespace trihedron {

/// Which further states an estimator has.
struct FurtherStates {
  bool clock_offset = false;     ///< τ of the star trackers: a fix stamped t holds the attitude at t + τ
  bool orbital_error = false;    ///< of the first star tracker: exp([(p_s sin nt + p_c cos nt)×]) in c
  bool wandering_drift = false;  ///< first-order Gauss–Markov drift about the case axes of each gyro
  bool readout_bias = false;     ///< of the direction cosines of each gyro
  int further_heads = 0;         ///< star trackers beside the first, each with its alignment to it

  [[nodiscard]] constexpr int shared() const {
    return (clock_offset ? 1 : 0) + (orbital_error ? 6 : 0) + 3 * further_heads;
  }
};

/// Everything, of two star trackers. What is not wanted is held by a prior sigma near zero.
inline constexpr FurtherStates kAllFurtherStates{
    .clock_offset = true, .orbital_error = true, .wandering_drift = true, .readout_bias = true, .further_heads = 1};

/// A drift model with three more coefficients: a drift about the case axes, the same wherever the momentum points.
template <class Base>
struct WithCaseDrift {
  static constexpr int kSize = Base::kSize + 3;
  static constexpr const char* kModelName = Base::kModelName;
  template <class S>
  using Coefficients = Eigen::Matrix<S, kSize, 1>;
  template <class S>
  using Basis = Eigen::Matrix<S, 3, kSize>;

  template <class S>
  [[nodiscard]] static Basis<S> basis(const Vector3<S>& h) {
    Basis<S> b;
    b << Base::template basis<S>(h), Matrix3<S>::Identity();
    return b;
  }
  template <class S>
  [[nodiscard]] static Vector3<S> rate(const Vector3<S>& h, const Coefficients<S>& kappa) {
    return Base::template rate<S>(h, kappa.template head<Base::kSize>()) + kappa.template tail<3>();
  }
};

}  // namespace trihedron
