#pragma once
/// Prediction of the momenta: dh_in/dt = ω_in × h_in, ω_in = C_in_b ω_b(h_b), and its linearised sensitivities.

#include "trihedron/core/frames.hpp"

namespace trihedron {

/// A reading, unit, without what is known of its bias; unit to the first order.
template <class S>
[[nodiscard]] Vector3<S> without_bias(const Vector3<S>& h_b, const Vector3<S>& bias) {
  return h_b - (bias - h_b * h_b.dot(bias));
}

/// What the on-board computer believes of one gyro; inside of the estimators, plain numbers with frames in the names.
template <class Model, class S = double>
struct GyroModel {
  Vector3<S> h_in = Vector3<S>::UnitX();  ///< direction of the momentum
  typename Model::template Coefficients<S> drift_rad_s = Model::template Coefficients<S>::Zero();  ///< κ
  Matrix3<S> C_c_b = Matrix3<S>::Identity();     ///< alignment, exp([Λ×])
  Vector3<S> readout_bias = Vector3<S>::Zero();  ///< of the direction cosines: h_b is read as h_b + bias

  [[nodiscard]] Vector3<S> unbiased(const Vector3<S>& h_b) const { return without_bias<S>(h_b, readout_bias); }
  /// The same, seen in c.
  [[nodiscard]] Vector3<S> in_c(const Vector3<S>& h_b) const { return C_c_b * unbiased(h_b); }
};

/// Linearised effect of three causes on one momentum since a reference epoch:
/// φ(t) = by_start φ(t0) + by_drift Δκ + by_alignment δ, with h(true) = exp([φ×]) h(est), φ in `in`;
/// κ(true) = κ(est) + Δκ; C_c_b(true) = exp([δ×]) C_c_b(est), δ in c.
template <class Model, class S = double>
struct Sensitivity {
  Matrix3<S> by_start = Matrix3<S>::Identity();
  Eigen::Matrix<S, 3, Model::kSize> by_drift = Eigen::Matrix<S, 3, Model::kSize>::Zero();  ///< s
  Matrix3<S> by_alignment = Matrix3<S>::Zero();

  /// The same over this stretch followed by `next`.
  [[nodiscard]] Sensitivity then(const Sensitivity& next) const {
    Sensitivity both;
    both.by_start = next.by_start * by_start;
    both.by_drift = next.by_start * by_drift + next.by_drift;
    both.by_alignment = next.by_start * by_alignment + next.by_alignment;
    return both;
  }
};

/// Turns one momentum by its drift over `dt_s`, with attitude and reading of the middle of the step (midpoint rule;
/// exact for constant ω_in). C_in_c: attitude; h_b: reading, unit. Returns ω_in, rad/s.
template <class Model, class S>
Vector3<S> precess(GyroModel<Model, S>& gyro, const Matrix3<S>& C_in_c, const Vector3<S>& h_b, S dt_s) {
  const Vector3<S> omega_in = C_in_c * (gyro.C_c_b * Model::template rate<S>(gyro.unbiased(h_b), gyro.drift_rad_s));
  gyro.h_in = rotated<S>(gyro.h_in, omega_in * dt_s).normalized();
  return omega_in;
}

/// precess(), and the sensitivities beside it: dφ/dt = ω × φ + C_in_b B Δκ + (C_in_c δ) × ω.
template <class Model, class S>
Vector3<S> precess(GyroModel<Model, S>& gyro, Sensitivity<Model, S>& sensitivity, const Matrix3<S>& C_in_c,
                   const Vector3<S>& h_b, S dt_s) {
  const Eigen::Matrix<S, 3, Model::kSize> basis_in =
      (C_in_c * gyro.C_c_b) * Model::template basis<S>(gyro.unbiased(h_b));
  const Vector3<S> turn = dt_s * (basis_in * gyro.drift_rad_s);
  gyro.h_in = rotated<S>(gyro.h_in, turn).normalized();
  const Matrix3<S> cross = skew<S>(turn);
  sensitivity.by_start += cross * sensitivity.by_start;
  sensitivity.by_drift += cross * sensitivity.by_drift + dt_s * basis_in;
  sensitivity.by_alignment += cross * (sensitivity.by_alignment - C_in_c);
  return turn / dt_s;
}

}  // namespace trihedron
