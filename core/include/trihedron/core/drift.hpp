#pragma once
/// Drift of an electrostatic gyro: angular velocity of the rotor's momentum as a function of its direction in the case.

#include <Eigen/Core>
#include <array>

#include "trihedron/core/frames.hpp"

namespace trihedron {

/// Eq. (1): seven members of the drift family, ω_b(h) = B(h) κ.
/// κ = (k0, μ12, μ23, μ31, ν12, ν23, ν31), rad/s. Only the part of ω across h moves the momentum.
/// A drift model is a type with this interface: a linear family with its Jacobians.
struct Esg7 {
  static constexpr int kSize = 7;
  enum Index : int { kK0, kMu12, kMu23, kMu31, kNu12, kNu23, kNu31 };
  static constexpr std::array<const char*, kSize> kNames = {"k0", "mu12", "mu23", "mu31", "nu12", "nu23", "nu31"};
  static constexpr const char* kModelName = "esg7";

  template <class S>
  using Coefficients = Eigen::Matrix<S, kSize, 1>;
  template <class S>
  using Basis = Eigen::Matrix<S, 3, kSize>;

  /// B(h), the Jacobian of ω by κ. h: direction cosines in case axes, unit; a reading with noise is fine. Eq. (1).
  template <class S>
  [[nodiscard]] static Basis<S> basis(const Vector3<S>& h) {
    const Vector3<S> s = h.cwiseProduct(h);
    const Vector3<S> q = s.cwiseProduct(s);
    const S zero(0);
    Basis<S> b;
    // clang-format off
    b << h(0) * (q(0) - s(0) + q(1) + q(2)),  h(0) * s(1), zero, -h(0) * s(2),  zero, h(1) * h(2), zero,
         h(1) * (q(1) - s(1) + q(2) + q(0)), -h(1) * s(0),  h(1) * s(2), zero,  zero, zero, h(2) * h(0),
         h(2) * (q(2) - s(2) + q(0) + q(1)),  zero, -h(2) * s(1),  h(2) * s(0),  h(0) * h(1), zero, zero;
    // clang-format on
    return b;
  }

  /// ω_b(h) = B(h) κ, rad/s, case axes, without the zeros of B. Eq. (1).
  template <class S>
  [[nodiscard]] static Vector3<S> rate(const Vector3<S>& h, const Coefficients<S>& kappa) {
    const Vector3<S> s = h.cwiseProduct(h);
    const S sum4 = s.squaredNorm();
    return {
        h(0) * (kappa(kK0) * (sum4 - s(0)) + kappa(kMu12) * s(1) - kappa(kMu31) * s(2)) + kappa(kNu23) * h(1) * h(2),
        h(1) * (kappa(kK0) * (sum4 - s(1)) + kappa(kMu23) * s(2) - kappa(kMu12) * s(0)) + kappa(kNu31) * h(2) * h(0),
        h(2) * (kappa(kK0) * (sum4 - s(2)) + kappa(kMu31) * s(0) - kappa(kMu23) * s(1)) + kappa(kNu12) * h(0) * h(1)};
  }

  /// ∂ω_b/∂h, rad/s, h taken as three free numbers. Eq. (1) differentiated.
  template <class S>
  [[nodiscard]] static Matrix3<S> rate_by_h(const Vector3<S>& h, const Coefficients<S>& kappa) {
    const Vector3<S> s = h.cwiseProduct(h);
    const Vector3<S> cube = s.cwiseProduct(h);
    const S sum4 = s.squaredNorm();
    const S k0 = kappa(kK0);
    const S mu12 = kappa(kMu12);
    const S mu23 = kappa(kMu23);
    const S mu31 = kappa(kMu31);
    const S nu12 = kappa(kNu12);
    const S nu23 = kappa(kNu23);
    const S nu31 = kappa(kNu31);
    const S two(2);
    Matrix3<S> d;
    // clang-format off
    d << mu12 * s(1) - mu31 * s(2), two * mu12 * h(0) * h(1) + nu23 * h(2), -two * mu31 * h(0) * h(2) + nu23 * h(1),
         -two * mu12 * h(0) * h(1) + nu31 * h(2), mu23 * s(2) - mu12 * s(0), two * mu23 * h(1) * h(2) + nu31 * h(0),
         two * mu31 * h(0) * h(2) + nu12 * h(1), -two * mu23 * h(1) * h(2) + nu12 * h(0), mu31 * s(0) - mu23 * s(1);
    // clang-format on
    // k0 row i: h_i (Σh⁴ − h_i²), differentiated by h_j.
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        d(i, j) += k0 * h(i) * S(4) * cube(j);
      }
      d(i, i) += k0 * (sum4 - S(3) * s(i));
    }
    return d;
  }
};

/// Eq. (1) and thirteen more members of −∇W + h × ∇D (mathematics, Helmholtz–Hodge): what it lacks of degree 1 and 2,
/// and D of Σh⁴/4, of which it has W alone (k0), while it has both of its other shapes of higher degree. Named by
/// degree and order of the real spherical harmonic, unit mean square over 4π. Degree 1 of W stands still in the case.
struct Esg20 {
  static constexpr int kQuadratic = 6;  ///< members of degree 1 and 2, of W and of D each
  static constexpr int kMembers = 2 * kQuadratic + 1;
  static constexpr int kSize = Esg7::kSize + kMembers;
  static constexpr std::array<const char*, kSize> kNames = {
      "k0",      "mu12",    "mu23",   "mu31",    "nu12",   "nu23",   "nu31",    "W(1,-1)", "W(1,0)", "W(1,1)",
      "W(2,-2)", "W(2,-1)", "W(2,1)", "D(1,-1)", "D(1,0)", "D(1,1)", "D(2,-2)", "D(2,-1)", "D(2,1)", "D(k0)"};
  static constexpr const char* kModelName = "esg20";

  template <class S>
  using Coefficients = Eigen::Matrix<S, kSize, 1>;
  template <class S>
  using Basis = Eigen::Matrix<S, 3, kSize>;

  /// B(h) as of Esg7. What points along h is left in, since it moves nothing.
  template <class S>
  [[nodiscard]] static Basis<S> basis(const Vector3<S>& h) {
    const Eigen::Matrix<S, 3, kQuadratic> slopes = gradients<S>(h);
    const Matrix3<S> cross = skew<S>(h);
    Basis<S> b;
    b << Esg7::basis<S>(h), -slopes, cross * slopes, cross * cube<S>(h);
    return b;
  }

  /// ω_b(h) = B(h) κ, rad/s, case axes.
  template <class S>
  [[nodiscard]] static Vector3<S> rate(const Vector3<S>& h, const Coefficients<S>& kappa) {
    const Eigen::Matrix<S, 3, kQuadratic> slopes = gradients<S>(h);
    return Esg7::rate<S>(h, kappa.template head<Esg7::kSize>()) -
           slopes * kappa.template segment<kQuadratic>(Esg7::kSize) +
           h.cross(slopes * kappa.template segment<kQuadratic>(Esg7::kSize + kQuadratic) +
                   cube<S>(h) * kappa(kSize - 1));
  }

 private:
  /// ∇Σh⁴/4
  template <class S>
  [[nodiscard]] static Vector3<S> cube(const Vector3<S>& h) {
    return h.cwiseProduct(h).cwiseProduct(h);
  }

  /// Of the harmonics (1, −1), (1, 0), (1, 1), (2, −2), (2, −1), (2, 1).
  template <class S>
  [[nodiscard]] static Eigen::Matrix<S, 3, kQuadratic> gradients(const Vector3<S>& h) {
    const S one(0.48860251190291992);  // √(3/4π)
    const S two(1.0925484305920792);   // √(15/4π)
    const S zero(0);
    Eigen::Matrix<S, 3, kQuadratic> g;
    // clang-format off
    g << zero, zero, one,  two * h(1), zero,       two * h(2),
         one,  zero, zero, two * h(0), two * h(2), zero,
         zero, one,  zero, zero,       two * h(1), two * h(0);
    // clang-format on
    return g;
  }
};

}  // namespace trihedron
