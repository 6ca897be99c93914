#include "trihedron/core/optimal_attitude.hpp"

#include <Eigen/LU>
#include <cmath>
#include <optional>

#include "trihedron/core/lanes.hpp"

namespace trihedron {
namespace {

/// Two of the directions in `in` and, in the second lane, in c.
struct TwoDirections {
  Lanes3 first;
  Lanes3 second;
  Lanes3 normal;
  Lanes area_square;

  TwoDirections(const Directions& h_in, const Directions& h_c, int j, int k)
      : first(load3(h_in[j].data(), h_c[j].data())),
        second(load3(h_in[k].data(), h_c[k].data())),
        normal(cross(first, second)),
        area_square(dot(normal, normal)) {}

  [[nodiscard]] std::optional<DirectionsFault> fault() const {
    const Lanes lengths_square = dot(first, first) * dot(second, second);
    const Lanes least_square = kMinSine * kMinSine * lengths_square;
    for (int i = 0; i < 2; ++i) {
      if (!(area_square[i] >= least_square[i])) {
        return std::isfinite(area_square[i]) ? DirectionsFault::kMomentaNearlyParallel : DirectionsFault::kNotFinite;
      }
      if (!(lengths_square[i] > 0)) {
        return DirectionsFault::kNotFinite;
      }
    }
    return std::nullopt;
  }

  /// By the axes on them in which both have equal weight: their normal, the bisector, and the third. Only where
  /// fault() finds none.
  [[nodiscard]] Rot<In, C> rotation() const { return by_axes(normalized(first + second)); }
  /// By their trihedra (paper Fig. 4), whose second axis is the first direction. Only where fault() finds none.
  [[nodiscard]] Rot<In, C> by_trihedra() const { return by_axes(normalized(first)); }

  /// By the normal, y, which is across it, and the third.
  [[nodiscard]] Rot<In, C> by_axes(const Lanes3& y) const {
    const Lanes area = root(area_square);
    const Lanes3 x{normal.x / area, normal.y / area, normal.z / area};
    const Lanes3 z = cross(x, y);
    const auto row = [](Lanes i, Lanes j, Lanes k, const Lanes3& a, const Lanes3& b, const Lanes3& c) {
      const auto column = [&](Lanes p, Lanes q, Lanes r) { return i[0] * p[1] + (j[0] * q[1] + k[0] * r[1]); };
      return Eigen::RowVector3d(column(a.x, b.x, c.x), column(a.y, b.y, c.y), column(a.z, b.z, c.z));
    };
    Eigen::Matrix3d C_in_c;
    C_in_c.row(0) = row(x.x, y.x, z.x, x, y, z);
    C_in_c.row(1) = row(x.y, y.y, z.y, x, y, z);
    C_in_c.row(2) = row(x.z, y.z, z.z, x, y, z);
    return Rot<In, C>::assume(C_in_c);
  }
};

/// Two of the directions; the solution for two is exact.
struct Pair {
  int first = 0;
  int second = 1;
};
/// Of those used, the two nearest to a right angle.
Pair best_pair(const Directions& h_in, const GyroMask& used) {
  Pair best;
  double largest = -1;
  for (int j = 0; j < kMaxGyros; ++j) {
    for (int k = j + 1; used[j] && k < kMaxGyros; ++k) {
      const double area_square = used[k] ? h_in[j].cross(h_in[k]).squaredNorm() : -1;
      if (area_square > largest) {
        largest = area_square;
        best = {j, k};
      }
    }
  }
  return best;
}
/// The first two of those used.
Pair the_two(const GyroMask& used) {
  Pair two{kMaxGyros, kMaxGyros};
  for (int k = kMaxGyros - 1; k >= 0; --k) {
    if (used[k]) {
      two = {k, two.first};
    }
  }
  return two;
}

/// By which two of those used the attitude is found; at least two are.
[[gnu::always_inline]] inline TwoDirections two_of(const Directions& h_in, const Directions& h_c,
                                                   const GyroMask& used) {
  const auto [first, second] = count(used) == 2 ? the_two(used) : best_pair(h_in, used);
  return {h_in, h_c, first, second};
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
  const auto rotation = trihedron_rotation(h_in, h_c);
  if (!rotation) {
    return rotation.fault();
  }
  AttitudeByDirections by_directions{rotation.value()};
  const auto c = make_trihedron(Vec<C>::assume(h_c[0]), Vec<C>::assume(h_c[1]));
  if (!c) {  // at the limit, by rounding
    return c.fault();
  }
  by_directions.by_directions.leftCols<6>() = attitude_by_directions(c.value());
  return by_directions;
}

Result<Rot<In, C>, DirectionsFault> trihedron_rotation(const Directions& h_in, const Directions& h_c) {
  const TwoDirections two(h_in, h_c, 0, 1);
  if (const auto fault = two.fault()) {
    return *fault;
  }
  return two.by_trihedra();
}

Result<Rot<In, C>, DirectionsFault> optimal_rotation(const Directions& h_in, const Directions& h_c,
                                                     const GyroMask& used) {
  const int directions = count(used);
  if (directions < 2) {
    return DirectionsFault::kTooFew;
  }
  const TwoDirections two = two_of(h_in, h_c, used);
  if (const auto fault = two.fault()) {
    return *fault;
  }
  const Rot<In, C> by_pair = two.rotation();
  return directions > 2 ? refined(by_pair, h_in, h_c, used) : by_pair;
}

std::optional<DirectionsFault> fault_of_directions(const Directions& h_in, const Directions& h_c,
                                                   const GyroMask& used) {
  return count(used) < 2 ? DirectionsFault::kTooFew : two_of(h_in, h_c, used).fault();
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
      attitude.by_directions.middleCols<3>(3L * k) = inverse * across(h_c[k]);
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
