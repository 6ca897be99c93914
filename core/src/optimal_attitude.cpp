#include "trihedron/core/optimal_attitude.hpp"

#include <Eigen/LU>

namespace trihedron {
namespace {

/// Axes on two directions in which both have equal weight: their normal, the bisector, and the third.
template <class F>
Result<Rot<F, G>, DirectionsFault> bisecting_axes(const Vec<F>& h1, const Vec<F>& h2) {
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

/// 1 − h hᵀ.
Eigen::Matrix3d across(const Eigen::Vector3d& h) { return Eigen::Matrix3d::Identity() - h * h.transpose(); }

/// Of the normal equations of the attitude by directions.
Eigen::Matrix3d sum_across(const Directions& h_c, const GyroMask& used) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int k = 0; k < kMaxGyros; ++k) {
    if (used[k]) {
      sum += across(h_c[k]);
    }
  }
  return sum;
}

/// From the solution for two of the directions to that for all by Gauss–Newton. Each step multiplies the remaining
/// error by about the size of the disagreement of the directions.
Rot<In, C> refined(Rot<In, C> C_in_c, const Directions& h_in, const Directions& h_c, const GyroMask& used) {
  const Eigen::Matrix3d inverse = sum_across(h_c, used).inverse();
  constexpr double kRounding = 1e-15;
  for (int step = 0; step < 3; ++step) {
    Eigen::Vector3d misfit = Eigen::Vector3d::Zero();
    for (int k = 0; k < kMaxGyros; ++k) {
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
  return C_in_c;
}

}  // namespace

Result<AttitudeByDirections, DirectionsFault> trihedron_attitude(const Directions& h_in, const Directions& h_c) {
  const auto in = make_trihedron(Vec<In>::assume(h_in[0]), Vec<In>::assume(h_in[1]));
  if (!in) {
    return in.fault();
  }
  const auto c = make_trihedron(Vec<C>::assume(h_c[0]), Vec<C>::assume(h_c[1]));
  if (!c) {
    return c.fault();
  }
  AttitudeByDirections by_directions{attitude(in.value(), c.value())};
  by_directions.by_directions.leftCols<6>() = attitude_by_directions(c.value());
  return by_directions;
}

Result<Rot<In, C>, DirectionsFault> optimal_rotation(const Directions& h_in, const Directions& h_c,
                                                     const GyroMask& used) {
  // Starts from the pair nearest to a right angle; with two gyros that is the solution.
  double best = 0;
  int first = 0;
  int second = 1;
  for (int j = 0; j < kMaxGyros; ++j) {
    for (int k = j + 1; used[j] && k < kMaxGyros; ++k) {
      const double sine = used[k] ? h_in[j].cross(h_in[k]).norm() : 0;
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
  const Rot<In, C> by_pair = in.value() * c.value().inverse();
  return count(used) > 2 ? refined(by_pair, h_in, h_c, used) : by_pair;
}

Result<AttitudeByDirections, DirectionsFault> optimal_attitude(const Directions& h_in, const Directions& h_c,
                                                               const GyroMask& used) {
  const auto C_in_c = optimal_rotation(h_in, h_c, used);
  if (!C_in_c) {
    return C_in_c.fault();
  }
  AttitudeByDirections attitude{C_in_c.value()};
  const Eigen::Matrix3d inverse = sum_across(h_c, used).inverse();
  for (int k = 0; k < kMaxGyros; ++k) {
    if (used[k]) {
      attitude.by_directions.middleCols<3>(3 * k) = inverse * across(h_c[k]);
    }
  }
  return attitude;
}

Eigen::Vector3d rate_by_directions(const Directions& h_c, const Directions& h_c_rate, const GyroMask& used) {
  Eigen::Vector3d seen = Eigen::Vector3d::Zero();
  for (int k = 0; k < kMaxGyros; ++k) {
    if (used[k]) {
      seen += h_c_rate[k].cross(h_c[k]);
    }
  }
  return sum_across(h_c, used).inverse() * seen;
}

}  // namespace trihedron
