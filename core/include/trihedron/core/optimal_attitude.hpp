#pragma once
/// Attitude from N directions that count alike: Wahba's problem. The trihedron, of two, trusts the first.

#include <Eigen/LU>

#include "trihedron/core/attitude.hpp"
#include "trihedron/core/per_gyro.hpp"

namespace trihedron {

/// Attitude, and its error by those of the directions: with h_in(true) = exp([φ_k×]) h_in and h_c(true) = exp([ρ_k×])
/// h_c, C_in_c(true) = C_in_c exp([ε×]) has ε = by_directions · (C_c_in φ_k − ρ_k), c axes.
template <int N>
struct AttitudeByDirections {
  Rot<In, C> C_in_c;
  Eigen::Matrix<double, 3, 3 * N> by_directions = Eigen::Matrix<double, 3, 3 * N>::Zero();
};

/// The trihedron on the first two directions, and errors by theirs. Eq. of section 5, paper Fig. 4.
[[nodiscard]] inline Result<AttitudeByDirections<2>, DirectionsFault> trihedron_attitude(
    const PerGyro<Eigen::Vector3d, 2>& h_in, const PerGyro<Eigen::Vector3d, 2>& h_c) {
  const auto in = make_trihedron(Vec<In>::assume(h_in[0]), Vec<In>::assume(h_in[1]));
  if (!in) {
    return in.fault();
  }
  const auto c = make_trihedron(Vec<C>::assume(h_c[0]), Vec<C>::assume(h_c[1]));
  if (!c) {
    return c.fault();
  }
  return AttitudeByDirections<2>{attitude(in.value(), c.value()), attitude_by_directions(c.value())};
}

/// Readings h_b of gyros, seen in c.
template <class Gyros, int N>
[[nodiscard]] PerGyro<Eigen::Vector3d, N> in_c(const Gyros& gyros, const PerGyro<Eigen::Vector3d, N>& h_b) {
  PerGyro<Eigen::Vector3d, N> h_c;
  for (int k = 0; k < N; ++k) {
    h_c[k] = gyros[k].in_c(h_b[k]);
  }
  return h_c;
}

/// Momenta of gyros in `in`.
template <class Gyros, int N = Gyros::size()>
[[nodiscard]] PerGyro<Eigen::Vector3d, N> momenta(const Gyros& gyros) {
  PerGyro<Eigen::Vector3d, N> h_in;
  for (int k = 0; k < N; ++k) {
    h_in[k] = gyros[k].h_in;
  }
  return h_in;
}

/// Axes on two directions that treat both alike: their normal, the middle between them, and across it.
template <class F>
[[nodiscard]] Result<Rot<F, G>, DirectionsFault> bisecting_axes(const Vec<F>& h1, const Vec<F>& h2) {
  const auto trihedron = make_trihedron(h1, h2);
  if (!trihedron) {
    return trihedron.fault();
  }
  Eigen::Matrix3d axes;
  axes.col(0) = trihedron.value().q1();
  axes.col(1) = (h1 + h2).raw().normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return Rot<F, G>::assume(axes);
}

/// The normal equations of the attitude by directions h_c: Σ (1 − h_c h_cᵀ) over those used, and its terms; zero where
/// one is not used.
template <int N>
struct WahbaNormal {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 3 * N> terms = Eigen::Matrix<double, 3, 3 * N>::Zero();

  WahbaNormal(const PerGyro<Eigen::Vector3d, N>& h_c, const GyroMask<N>& used) {
    for (int k = 0; k < N; ++k) {
      if (used[k]) {
        const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - h_c[k] * h_c[k].transpose();
        sum += across;
        terms.template middleCols<3>(3 * k) = across;
      }
    }
  }
};

/// C_in_c by least squares over the directions used, Σ |h_in,k − C h_c,k|². At least two of them must stand further
/// than asin(kMinSine) from one line.
template <int N>
[[nodiscard]] Result<Rot<In, C>, DirectionsFault> optimal_rotation(const PerGyro<Eigen::Vector3d, N>& h_in,
                                                                   const PerGyro<Eigen::Vector3d, N>& h_c,
                                                                   const GyroMask<N>& used) {
  // From the best placed pair …
  double best = 0;
  int first = 0;
  int second = 1;
  for (int j = 0; j < N; ++j) {
    for (int k = j + 1; k < N; ++k) {
      const double sine = used[j] && used[k] ? h_in[j].cross(h_in[k]).norm() : 0;
      if (sine > best) {
        best = sine;
        first = j;
        second = k;
      }
    }
  }
  if (!(best >= kMinSine)) {
    return count(used) < 2 ? DirectionsFault::kTooFew : DirectionsFault::kMomentaNearlyParallel;
  }
  const auto in = bisecting_axes(Vec<In>::assume(h_in[first]), Vec<In>::assume(h_in[second]));
  if (!in) {
    return in.fault();
  }
  const auto c = bisecting_axes(Vec<C>::assume(h_c[first]), Vec<C>::assume(h_c[second]));
  if (!c) {
    return c.fault();
  }
  Rot<In, C> C_in_c = in.value() * c.value().inverse();
  if constexpr (N > 2) {
    // … which of two that count alike is the solution, by Gauss–Newton: each step leaves as much of what was left
    // before as the directions disagree.
    const Eigen::Matrix3d inverse = WahbaNormal<N>(h_c, used).sum.inverse();
    constexpr double kRounding = 1e-15;
    for (int step = 0; step < 3; ++step) {
      Eigen::Vector3d misfit = Eigen::Vector3d::Zero();
      for (int k = 0; k < N; ++k) {
        if (used[k]) {
          misfit += h_c[k].cross(C_in_c.raw().transpose() * h_in[k]);
        }
      }
      const Eigen::Vector3d towards = inverse * misfit;
      if (towards.squaredNorm() < kRounding * kRounding) {
        break;
      }
      C_in_c = C_in_c * Rot<C, C>::exp(Vec<C>::assume(towards));
    }
  }
  return C_in_c;
}

/// optimal_rotation(), and how errors of the directions move it.
template <int N>
[[nodiscard]] Result<AttitudeByDirections<N>, DirectionsFault> optimal_attitude(const PerGyro<Eigen::Vector3d, N>& h_in,
                                                                                const PerGyro<Eigen::Vector3d, N>& h_c,
                                                                                const GyroMask<N>& used) {
  const auto C_in_c = optimal_rotation<N>(h_in, h_c, used);
  if (!C_in_c) {
    return C_in_c.fault();
  }
  const WahbaNormal<N> normal(h_c, used);
  return AttitudeByDirections<N>{C_in_c.value(), normal.sum.inverse() * normal.terms};
}

}  // namespace trihedron
