#pragma once
/// Frames in types: vectors and rotations that compose only where their frames cancel.
/// Conventions: docs/notation.md. `C_in_c` maps c-components to in-components: `v_in = C_in_c * v_c`.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "trihedron/core/elementary.hpp"

namespace trihedron {

/// Absolute inertial frame, ICRF axes.
struct In {};
/// Quasi-inertial frame: inertially fixed copy of the gyro trihedron taken at the last correction.
struct Qi {};
/// Gyro trihedron, built on the two (drifting) angular momenta.
struct G {};
/// Star-tracker axes, which are the spacecraft body axes: x roll, y pitch, z heading (boresight).
struct C {};
/// Case (measuring) axes of gyro K = 1, 2, …
template <int K>
struct B {};

template <class S>
using Vector3 = Eigen::Matrix<S, 3, 1>;
template <class S>
using Matrix3 = Eigen::Matrix<S, 3, 3>;

/// Matrix of the cross product: `skew(a) * b == a × b`.
template <class S>
[[nodiscard]] Matrix3<S> skew(const Vector3<S>& a) {
  Matrix3<S> m;
  m << S(0), -a.z(), a.y(), a.z(), S(0), -a.x(), -a.y(), a.x(), S(0);
  return m;
}

/// Angle between two vectors, rad, in [0, π]; accurate at both ends, where acos of the dot product is not.
template <class S>
[[nodiscard]] S angle_between(const Vector3<S>& a, const Vector3<S>& b) {
  return elementary::atan2(a.cross(b).norm(), a.dot(b));
}

namespace detail {

template <class S>
struct RodriguesCoefficients {
  S a;  ///< sin x / x
  S b;  ///< (1 − cos x) / x²
};

/// exp([v×]) = I + a [v×] + b [v×]² for |v|² = angle2.
template <class S>
[[nodiscard]] RodriguesCoefficients<S> rodrigues_coefficients(S angle2) {
  using std::sqrt;
  if (angle2 < S(1e-6)) {  // the quotients would lose digits; the next terms of the series are below 1e-17
    return {S(1) - angle2 * S(1.0 / 6) * (S(1) - angle2 * S(1.0 / 20)),
            S(0.5) - angle2 * S(1.0 / 24) * (S(1) - angle2 * S(1.0 / 30))};
  }
  const S angle = sqrt(angle2);
  const S half = elementary::sin(angle / S(2));
  return {elementary::sin(angle) / angle, S(2) * half * half / angle2};
}

}  // namespace detail

/// exp([v×]) u: u turned by the rotation vector v, rad.
template <class S>
[[nodiscard]] Vector3<S> rotated(const Vector3<S>& u, const Vector3<S>& v) {
  const auto [a, b] = detail::rodrigues_coefficients(v.squaredNorm());
  const Vector3<S> c = v.cross(u);
  return u + a * c + b * v.cross(c);
}

/// A free vector given by its components in frame F.
template <class F, class S = double>
class Vec {
 public:
  using Raw = Vector3<S>;

  Vec() : raw_(Raw::Zero()) {}
  /// The one door from raw numbers: the caller vouches that they are components in F.
  [[nodiscard]] static Vec assume(const Raw& components) { return Vec(components); }
  [[nodiscard]] static Vec assume(S x, S y, S z) { return Vec(Raw(x, y, z)); }
  [[nodiscard]] const Raw& raw() const { return raw_; }

  [[nodiscard]] S dot(const Vec& other) const { return raw_.dot(other.raw_); }
  [[nodiscard]] Vec cross(const Vec& other) const { return Vec(raw_.cross(other.raw_)); }
  [[nodiscard]] S norm() const { return raw_.norm(); }
  /// The direction; the caller guards against a zero vector.
  [[nodiscard]] Vec normalized() const { return Vec(raw_ / raw_.norm()); }

  friend Vec operator+(const Vec& a, const Vec& b) { return Vec(a.raw_ + b.raw_); }
  friend Vec operator-(const Vec& a, const Vec& b) { return Vec(a.raw_ - b.raw_); }
  friend Vec operator-(const Vec& a) { return Vec(-a.raw_); }
  friend Vec operator*(const Vec& a, S s) { return Vec(a.raw_ * s); }
  friend Vec operator*(S s, const Vec& a) { return a * s; }

 private:
  explicit Vec(const Raw& components) : raw_(components) {}
  Raw raw_;
};

/// Rotation that maps From-components to To-components: `v_to = C_to_from * v_from`.
template <class To, class From, class S = double>
class Rot {
 public:
  using Raw = Matrix3<S>;
  using Quaternion = Eigen::Quaternion<S>;

  /// Identity: the two frames coincide.
  Rot() : raw_(Raw::Identity()) {}
  /// The one door from raw numbers: the caller vouches for the frames and for orthonormality.
  [[nodiscard]] static Rot assume(const Raw& matrix) { return Rot(matrix); }
  /// Same, from a unit quaternion (Hamilton, `v_to = q ⊗ v_from ⊗ q*`).
  [[nodiscard]] static Rot assume(const Quaternion& q_to_from) { return Rot(q_to_from.toRotationMatrix()); }

  /// exp([v×]) for a rotation vector v in rad; valid for any length. Its components are the same in both frames.
  [[nodiscard]] static Rot exp(const Vec<To, S>& v) {
    const auto [a, b] = detail::rodrigues_coefficients(v.raw().squaredNorm());
    const Raw k = skew(v.raw());
    return Rot(Raw::Identity() + a * k + b * k * k);
  }

  /// The rotation vector v in rad, |v| ≤ π, with exp(v) equal to this rotation.
  [[nodiscard]] Vec<To, S> log() const {
    Quaternion q = quaternion();
    if (q.w() < S(0)) {
      q.coeffs() = -q.coeffs();
    }
    const S s = q.vec().norm();
    const S factor = s > S(1e-12) ? S(2) * elementary::atan2(s, q.w()) / s : S(2);
    return Vec<To, S>::assume(factor * q.vec());
  }

  [[nodiscard]] const Raw& raw() const { return raw_; }
  /// Unit quaternion q_to_from, Hamilton; its sign is arbitrary.
  [[nodiscard]] Quaternion quaternion() const { return Quaternion(raw_).normalized(); }
  [[nodiscard]] Rot<From, To, S> inverse() const { return Rot<From, To, S>::assume(Raw(raw_.transpose())); }

  friend Vec<To, S> operator*(const Rot& r, const Vec<From, S>& v) { return Vec<To, S>::assume(r.raw_ * v.raw()); }
  template <class Inner>
  friend Rot<To, Inner, S> operator*(const Rot& outer, const Rot<From, Inner, S>& inner) {
    return Rot<To, Inner, S>::assume(typename Rot<To, Inner, S>::Raw(outer.raw_ * inner.raw()));
  }

 private:
  explicit Rot(const Raw& matrix) : raw_(matrix) {}
  Raw raw_;
};

/// A unit reading with its estimated bias removed; of unit length to first order.
[[nodiscard]] inline Eigen::Vector3d without_bias(const Eigen::Vector3d& h_b, const Eigen::Vector3d& bias) {
  return h_b - (bias - h_b * h_b.dot(bias));
}

}  // namespace trihedron
