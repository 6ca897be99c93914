#pragma once
/// Real spherical harmonics and their gradients.

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "trihedron/core/assert.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron {

/// A spherical harmonic and its gradient along the sphere.
template <class S>
struct HarmonicValue {
  S value;
  Vector3<S> gradient;
};

/// Real spherical harmonics, orthonormal over the unit sphere, without the Condon–Shortley phase:
/// Y(l, m) = Q_lm(z) Re (x + iy)^m for m ≥ 0, Q_l|m|(z) Im (x + iy)^|m| for m < 0.
/// As polynomials in x, y, z they and their gradients have no singularity at the poles.
/// There is room for those up to degree Max.
template <int Max>
class HarmonicTableOf {
 public:
  static constexpr int kMaxDegree = Max;
  static constexpr std::size_t kOrders = Max + 1;
  static constexpr std::size_t kSize = kOrders * (kOrders + 1) / 2;

  /// Needs 0 ≤ max_degree ≤ kMaxDegree.
  explicit HarmonicTableOf(int max_degree) : max_degree_(max_degree) {
    TRIHEDRON_ASSERT(max_degree >= 0 && max_degree <= kMaxDegree);
    diagonal_[0] = std::sqrt(0.25 / std::numbers::pi);
    for (int m = 1; m <= max_degree; ++m) {
      // The factor √2 of the sines and cosines against the zonal harmonics comes in once, at m = 1.
      const double ratio = m == 1 ? 3.0 : (2.0 * m + 1) / (2.0 * m);
      diagonal_[static_cast<std::size_t>(m)] = std::sqrt(ratio) * diagonal_[static_cast<std::size_t>(m) - 1];
    }
    for (int l = 1; l <= max_degree; ++l) {
      for (int m = 0; m < l; ++m) {
        const double ll = l;
        const double mm = m;
        const std::size_t i = index(l, m);
        up_[i] = std::sqrt((4 * ll * ll - 1) / (ll * ll - mm * mm));
        if (l > m + 1) {
          const double k = ll - 1;
          up_two_[i] = up_[i] * std::sqrt((k * k - mm * mm) / (4 * k * k - 1));
        }
        slope_[i] = m == 0 ? std::sqrt(ll * (ll + 1) / 2) : std::sqrt((ll - mm) * (ll + mm + 1));
      }
    }
  }

  /// All harmonics at one direction h, unit.
  template <class S>
  class At {
   public:
    At(const HarmonicTableOf& table, const Vector3<S>& h) : table_(table), h_(h) {
      const int degree = table.max_degree_;
      re_[0] = S(1);
      im_[0] = S(0);
      for (std::size_t m = 1; m <= static_cast<std::size_t>(degree); ++m) {
        re_[m] = h.x() * re_[m - 1] - h.y() * im_[m - 1];
        im_[m] = h.x() * im_[m - 1] + h.y() * re_[m - 1];
      }
      // By degree, because the orders of one degree do not wait for each other.
      for (int l = 0; l <= degree; ++l) {
        for (int m = 0; m < l - 1; ++m) {
          const std::size_t i = index(l, m);
          q_[i] = S(table.up_[i]) * h.z() * q_[index(l - 1, m)] - S(table.up_two_[i]) * q_[index(l - 2, m)];
        }
        if (l > 0) {
          q_[index(l, l - 1)] = S(table.up_[index(l, l - 1)]) * h.z() * q_[index(l - 1, l - 1)];
        }
        q_[index(l, l)] = S(table.diagonal_[static_cast<std::size_t>(l)]);
      }
    }

    [[nodiscard]] HarmonicValue<S> operator()(int degree, int order) const {
      const auto m = static_cast<std::size_t>(order < 0 ? -order : order);
      const Vector3<S> slope = polynomial_gradient(degree, order);
      return {q_[index(degree, static_cast<int>(m))] * (order < 0 ? im_[m] : re_[m]), slope - h_ * h_.dot(slope)};
    }

    /// Gradient of the polynomial in space; its part along h depends on how the polynomial is written and means
    /// nothing.
    [[nodiscard]] Vector3<S> polynomial_gradient(int degree, int order) const {
      return polynomial_gradients(degree, order < 0 ? -order : order)[order < 0 ? 1 : 0];
    }
    /// Those of an order m ≥ 0 and of −m.
    [[nodiscard]] std::array<Vector3<S>, 2> polynomial_gradients(int degree, int m) const {
      const auto mu = static_cast<std::size_t>(m);
      const S dq = slope(degree, m);
      const S mq = S(m) * q_[index(degree, m)];
      const S re_below = m > 0 ? re_[mu - 1] : S(0);
      const S im_below = m > 0 ? im_[mu - 1] : S(0);
      return {Vector3<S>(mq * re_below, -mq * im_below, dq * re_[mu]),
              Vector3<S>(mq * im_below, mq * re_below, dq * im_[mu])};
    }

    /// A sum of multiples of the polynomials. Its gradient takes a fraction of the work of all of theirs.
    class Sum {
     public:
      /// Refers to it.
      explicit Sum(const At& at) : at_(at) {}

      void add(int degree, int order, S factor) {
        const int m = order < 0 ? -order : order;
        OfOrder& its = (order < 0 ? sines_ : cosines_)[static_cast<std::size_t>(m)];
        its.q += factor * at_.q_[index(degree, m)];
        its.slope += factor * at_.slope(degree, m);
      }

      /// As polynomial_gradient().
      [[nodiscard]] Vector3<S> gradient() const {
        Vector3<S> sum(S(0), S(0), cosines_[0].slope);
        for (int order = 1; order <= at_.table_.max_degree_; ++order) {
          const auto m = static_cast<std::size_t>(order);
          const S cosine = S(order) * cosines_[m].q;
          const S sine = S(order) * sines_[m].q;
          sum.x() += cosine * at_.re_[m - 1] + sine * at_.im_[m - 1];
          sum.y() += sine * at_.re_[m - 1] - cosine * at_.im_[m - 1];
          sum.z() += cosines_[m].slope * at_.re_[m] + sines_[m].slope * at_.im_[m];
        }
        return sum;
      }

     private:
      struct OfOrder {
        S q{};
        S slope{};
      };
      const At& at_;
      std::array<OfOrder, kOrders> cosines_{};  ///< m ≥ 0
      std::array<OfOrder, kOrders> sines_{};    ///< m < 0
    };

   private:
    /// Derivative of Q_lm by z.
    [[nodiscard]] S slope(int degree, int m) const {
      return m < degree ? S(table_.slope_[index(degree, m)]) * q_[index(degree, m + 1)] : S(0);
    }

    const HarmonicTableOf& table_;
    Vector3<S> h_;
    std::array<S, kOrders> re_;  ///< Re (x + iy)^m
    std::array<S, kOrders> im_;
    std::array<S, kSize> q_;
  };

  template <class S>
  [[nodiscard]] At<S> at(const Vector3<S>& h) const {
    return At<S>(*this, h);
  }

 private:
  [[nodiscard]] static constexpr std::size_t index(int degree, int order) {
    const int number = degree * (degree + 1) / 2 + order;
    return static_cast<std::size_t>(number);
  }

  int max_degree_;
  std::array<double, kOrders> diagonal_{};  ///< Q_mm, a constant
  std::array<double, kSize> up_{};          ///< Q_lm = up z Q_(l−1)m − up_two Q_(l−2)m
  std::array<double, kSize> up_two_{};
  std::array<double, kSize> slope_{};  ///< dQ_lm/dz = slope Q_l(m+1)
};

using HarmonicTable = HarmonicTableOf<20>;

}  // namespace trihedron
