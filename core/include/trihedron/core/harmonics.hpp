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
      const S x = h.x();
      const S y = h.y();
      const S z = h.z();
      const auto degrees = static_cast<std::size_t>(table.max_degree_);
      re_[0] = S(1);
      im_[0] = S(0);
      for (std::size_t m = 1; m <= degrees; ++m) {
        re_[m] = x * re_[m - 1] - y * im_[m - 1];
        im_[m] = x * im_[m - 1] + y * re_[m - 1];
      }
      // By degree, because the orders of one degree do not wait for each other.
      q_[0] = S(table.diagonal_[0]);
      std::size_t two_below = 0;
      std::size_t below = 0;
      for (std::size_t l = 1; l <= degrees; ++l) {
        const std::size_t row = below + l;  // where its orders begin
        for (std::size_t m = 0; m + 1 < l; ++m) {
          q_[row + m] = S(table.up_[row + m]) * z * q_[below + m] - S(table.up_two_[row + m]) * q_[two_below + m];
        }
        q_[row + l - 1] = S(table.up_[row + l - 1]) * z * q_[below + l - 1];
        q_[row + l] = S(table.diagonal_[l]);
        two_below = below;
        below = row;
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

    /// One number for each order of a degree l, from −l on; 2l + 1 of them.
    using ByOrder = std::array<S, 2 * Max + 1>;

    /// The three components of polynomial_gradient() of all orders of a degree.
    [[nodiscard]] std::array<ByOrder, 3> polynomial_gradients_by_order(int degree) const {
      std::array<ByOrder, 3> its;
      for (int m = 0; m <= degree; ++m) {
        const auto [cosine, sine] = polynomial_gradients(degree, m);
        const std::size_t last = static_cast<std::size_t>(degree) + static_cast<std::size_t>(m);
        const std::size_t first = static_cast<std::size_t>(degree) - static_cast<std::size_t>(m);
        for (std::size_t i = 0; i < 3; ++i) {
          its[i][first] = sine(static_cast<Eigen::Index>(i));
          its[i][last] = cosine(static_cast<Eigen::Index>(i));  // after the sine: order 0 has a cosine alone
        }
      }
      return its;
    }

    /// What all polynomials of a degree are made of: Q_l|m|(z) and its derivative.
    struct Degree {
      int degree;
      ByOrder q, slope;
    };
    [[nodiscard]] Degree of_degree(int degree) const {
      Degree its;
      its.degree = degree;
      for (int m = 0; m <= degree; ++m) {
        const std::size_t last = static_cast<std::size_t>(degree) + static_cast<std::size_t>(m);
        const std::size_t first = static_cast<std::size_t>(degree) - static_cast<std::size_t>(m);
        its.q[first] = its.q[last] = q_[index(degree, m)];
        its.slope[first] = its.slope[last] = slope(degree, m);
      }
      return its;
    }

    /// A sum of multiples of the polynomials. Its gradient takes a fraction of the work of all of theirs.
    class Sum {
     public:
      /// Refers to it.
      explicit Sum(const At& at) : at_(at) {}

      /// factors: of its orders from −degree on.
      void add(const Degree& its, const S* factors) {
        S* const q = q_.data() + (Max - its.degree);
        S* const slope = slope_.data() + (Max - its.degree);
        for (int i = 0; i < 2 * its.degree + 1; ++i) {
          const auto k = static_cast<std::size_t>(i);
          q[k] += factors[k] * its.q[k];
          slope[k] += factors[k] * its.slope[k];
        }
      }

      /// As polynomial_gradient().
      [[nodiscard]] Vector3<S> gradient() const {
        Vector3<S> sum(S(0), S(0), slope_[Max]);
        for (int order = 1; order <= at_.table_.max_degree_; ++order) {
          const auto m = static_cast<std::size_t>(order);
          const S cosine = S(order) * q_[Max + m];
          const S sine = S(order) * q_[Max - m];
          sum.x() += cosine * at_.re_[m - 1] + sine * at_.im_[m - 1];
          sum.y() += sine * at_.re_[m - 1] - cosine * at_.im_[m - 1];
          sum.z() += slope_[Max + m] * at_.re_[m] + slope_[Max - m] * at_.im_[m];
        }
        return sum;
      }

     private:
      const At& at_;
      ByOrder q_{};  ///< of orders from −Max on
      ByOrder slope_{};
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
