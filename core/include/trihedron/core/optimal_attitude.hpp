#pragma once
/// Attitude from N equally weighted directions (Wahba's problem), and the trihedron, which takes the first of two as
/// reference.

#include <optional>

#include "trihedron/core/attitude.hpp"
#include "trihedron/core/per_gyro.hpp"

namespace trihedron {

/// Attitude, and its error by those of the directions: with h_in(true) = exp([φ_k×]) h_in and h_c(true) = exp([ρ_k×])
/// h_c, C_in_c(true) = C_in_c exp([ε×]) has ε = by_directions · (C_c_in φ_k − ρ_k), c axes. Zero for those not used.
struct AttitudeByDirections {
  Rot<In, C> C_in_c;
  Eigen::Matrix<double, 3, 3 * kMaxGyros> by_directions = Eigen::Matrix<double, 3, 3 * kMaxGyros>::Zero();

  [[nodiscard]] auto by_direction(int gyro) const { return by_directions.middleCols<3>(3L * gyro); }
};

/// An attitude with the covariance of its error ε in c axes, rad²: true C_in_c = est · exp([ε×]).
struct AttitudeSolution {
  Rot<In, C> C_in_c;
  Eigen::Matrix3d covariance_rad2 = Eigen::Matrix3d::Zero();
};

/// The trihedron on the first two directions, and errors by theirs. docs/mathematics.md, section 5; paper Fig. 4.
[[nodiscard]] Result<AttitudeByDirections, DirectionsFault> trihedron_attitude(const Directions& h_in,
                                                                               const Directions& h_c);
/// The same, only the attitude itself.
[[nodiscard]] Result<Rot<In, C>, DirectionsFault> trihedron_rotation(const Directions& h_in, const Directions& h_c);

/// Readings h_b of the first `count` gyros, seen in c.
template <class Gyros>
[[nodiscard]] Directions in_c(const Gyros& gyros, int count, const Directions& h_b) {
  Directions h_c;
  for (int k = 0; k < count; ++k) {
    h_c[k] = gyros[k].in_c(h_b[k]);
  }
  return h_c;
}

/// Momenta of the first `count` gyros in `in`.
template <class Gyros>
[[nodiscard]] Directions momenta(const Gyros& gyros, int count) {
  Directions h_in;
  for (int k = 0; k < count; ++k) {
    h_in[k] = gyros[k].h_in;
  }
  return h_in;
}

/// C_in_c by least squares over the directions used, Σ |h_in,k − C h_c,k|². At least two of them must stand further
/// than asin(kMinSine) from one line.
[[nodiscard]] Result<Rot<In, C>, DirectionsFault> optimal_rotation(const Directions& h_in, const Directions& h_c,
                                                                   const GyroMask& used);

/// Why these directions give no optimal_rotation(), if they do not.
[[nodiscard]] std::optional<DirectionsFault> fault_of_directions(const Directions& h_in, const Directions& h_c,
                                                                 const GyroMask& used);

/// optimal_rotation(), and how errors of the directions move it.
[[nodiscard]] Result<AttitudeByDirections, DirectionsFault> optimal_attitude(const Directions& h_in,
                                                                             const Directions& h_c,
                                                                             const GyroMask& used);

/// Rate of the body relative to `in`, rad/s, by directions h_c that stand still in `in` and their rates: ḣ_c = −ω ×
/// h_c, each sees ω across itself. Of those used, at least two.
[[nodiscard]] Eigen::Vector3d rate_by_directions(const Directions& h_c, const Directions& h_c_rate,
                                                 const GyroMask& used);

}  // namespace trihedron
