#pragma once
/// The gyro trihedron and how the attitude that it gives depends on the directions (docs/mathematics.md, section 5;
/// paper Fig. 4).

#include "trihedron/core/frames.hpp"
#include "trihedron/core/result.hpp"

namespace trihedron {

/// Why directions give no attitude.
enum class DirectionsFault { kNotFinite, kMomentaNearlyParallel, kTooFew };

/// Pairs of momenta within asin(kMinSine) = 2.9° of being parallel or antiparallel give no attitude: errors about them
/// would be amplified 20 times.
inline constexpr double kMinSine = 0.05;

/// The trihedron q1 q2 q3 on two momenta, seen from frame F: q2 = h1 (reference gyro), q1 = h1×h2 / |h1×h2|, q3 =
/// q1×q2, so that h2 = cosθ q2 + sinθ q3.
template <class F, class S = double>
struct Trihedron {
  Rot<F, G, S> C_f_g;  ///< columns q1 q2 q3
  S cosine{};          ///< of θ, the angle between the momenta
  S sine{};

  [[nodiscard]] Vector3<S> q1() const { return C_f_g.raw().col(0); }
  [[nodiscard]] Vector3<S> q2() const { return C_f_g.raw().col(1); }
  [[nodiscard]] Vector3<S> q3() const { return C_f_g.raw().col(2); }
};

/// Trihedron on two directions, which need not be exactly unit. Paper Fig. 4.
template <class F, class S>
[[nodiscard]] Result<Trihedron<F, S>, DirectionsFault> make_trihedron(const Vec<F, S>& h1, const Vec<F, S>& h2) {
  using std::sqrt;
  const Vector3<S> normal = h1.raw().cross(h2.raw());
  const S length1 = h1.raw().norm();
  const S length2 = h2.raw().norm();
  if (!(length1 * length2 > S(0)) || !(normal.array() - normal.array() == S(0)).all()) {
    return DirectionsFault::kNotFinite;
  }
  const S area = normal.norm();
  const S sine = area / (length1 * length2);
  if (!(sine >= S(kMinSine))) {
    return DirectionsFault::kMomentaNearlyParallel;
  }
  Matrix3<S> axes;
  axes.col(0) = normal / area;
  axes.col(1) = h1.raw() / length1;
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return Trihedron<F, S>{Rot<F, G, S>::assume(axes), h1.dot(h2) / (length1 * length2), sine};
}

/// Error of the attitude, true C_in_c = exp([ε×]) est with ε in the axes of F, by the errors of the two directions: ε =
/// J (ρ1, ρ2), ρ_k: small rotation from the estimated to the true direction k in the frame F, minus that in the other
/// frame. 3 × 6. Columns along each direction are zero. Its size grows with 1/sinθ.
template <class F, class S>
[[nodiscard]] Eigen::Matrix<S, 3, 6> attitude_by_directions(const Trihedron<F, S>& t) {
  const Vector3<S> q1 = t.q1();
  const Vector3<S> q2 = t.q2();
  const Vector3<S> q3 = t.q3();
  const S cotangent = t.cosine / t.sine;
  Eigen::Matrix<S, 3, 6> j;
  j.template leftCols<3>() = q1 * q1.transpose() + (q3 + cotangent * q2) * q3.transpose();
  j.template rightCols<3>() = q2 * (q2 - cotangent * q3).transpose();
  return j;
}

}  // namespace trihedron
