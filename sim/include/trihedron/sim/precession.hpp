#pragma once
/// Integration of dh/dt = ω(t, h) × h on the unit sphere.

#include <cmath>

#include "trihedron/core/frames.hpp"

namespace trihedron::sim {

/// exp([θ×]) v by Rodrigues' formula, without a matrix.
template <class S>
[[nodiscard]] Vector3<S> rotated(const Vector3<S>& theta_rad, const Vector3<S>& v) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const S angle2 = theta_rad.squaredNorm();
  // sin(x)/x and (1 − cos x)/x², by series where the quotients would lose digits; next term < 1e-17.
  S a = S(1) + angle2 * (S(-1.0 / 6) + S(1.0 / 120) * angle2);
  S b = S(0.5) + angle2 * (S(-1.0 / 24) + S(1.0 / 720) * angle2);
  if (angle2 >= S(1e-6)) {
    const S angle = sqrt(angle2);
    const S half = sin(angle / S(2));
    a = sin(angle) / angle;
    b = S(2) * half * half / angle2;
  }
  const Vector3<S> once = theta_rad.cross(v);
  return v + a * once + b * theta_rad.cross(once);
}

/// One step of order 4 that moves h by a rotation, so that |h| stays: the classical Runge–Kutta rule in the Lie algebra
/// (Munthe-Kaas 1999; Hairer, Lubich, Wanner, Geometric Numerical Integration, IV.8, with two commutators).
/// omega(stage, h): ω in rad/s at the beginning (stage 0), middle (1) and end (2) of the step, axes those of h.
template <class S, class Omega>
[[nodiscard]] Vector3<S> precess(const Vector3<S>& h, S step_s, const Omega& omega) {
  const Vector3<S> k1 = step_s * omega(0, h);
  const Vector3<S> k2 = step_s * omega(1, rotated<S>(S(0.5) * k1, h));
  const Vector3<S> k3 = step_s * omega(1, rotated<S>(S(0.5) * k2 - S(0.125) * k1.cross(k2), h));
  const Vector3<S> k4 = step_s * omega(2, rotated<S>(k3, h));
  const Vector3<S> theta = (k1 + S(2) * (k2 + k3) + k4 - S(0.5) * k1.cross(k4)) / S(6);
  return rotated<S>(theta, h);
}

}  // namespace trihedron::sim
