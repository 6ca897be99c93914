#pragma once
/// The family that every drift field belongs to: ω = −∇W + h × ∇D on the unit sphere (Helmholtz–Hodge), W and D in real
/// spherical harmonics. Eq. (1) is seven members of it, up to a part along h that moves nothing.

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "trihedron/core/frames.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::sim {

/// A spherical harmonic and its gradient along the sphere.
template <class S>
struct HarmonicValue {
  S value;
  Vector3<S> gradient;
};

/// Real spherical harmonics, orthonormal over the unit sphere, without the Condon–Shortley phase:
/// Y(l, m) = Q_lm(z) Re (x + iy)^m for m ≥ 0, Q_l|m|(z) Im (x + iy)^|m| for m < 0.
/// As polynomials in x, y, z they and their gradients have no singularity at the poles.
class HarmonicTable {
 public:
  static constexpr int kMaxDegree = 20;

  /// Throws std::invalid_argument unless 0 ≤ max_degree ≤ 20.
  explicit HarmonicTable(int max_degree);

  /// All harmonics at one direction h, unit.
  template <class S>
  class At {
   public:
    At(const HarmonicTable& table, const Vector3<S>& h) : table_(table), h_(h) {
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
      const int m = order < 0 ? -order : order;
      const auto mu = static_cast<std::size_t>(m);
      const S dq = m < degree ? S(table_.slope_[index(degree, m)]) * q_[index(degree, m + 1)] : S(0);
      const S mq = S(m) * q_[index(degree, m)];
      const S re_below = m > 0 ? re_[mu - 1] : S(0);
      const S im_below = m > 0 ? im_[mu - 1] : S(0);
      return order >= 0 ? Vector3<S>(mq * re_below, -mq * im_below, dq * re_[mu])
                        : Vector3<S>(mq * im_below, mq * re_below, dq * im_[mu]);
    }

   private:
    const HarmonicTable& table_;
    Vector3<S> h_;
    std::array<S, kMaxDegree + 1> re_;  ///< Re (x + iy)^m
    std::array<S, kMaxDegree + 1> im_;
    std::array<S, (kMaxDegree + 1) * (kMaxDegree + 2) / 2> q_;
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

  static constexpr std::size_t kSize = (kMaxDegree + 1) * (kMaxDegree + 2) / 2;
  int max_degree_;
  std::array<double, kMaxDegree + 1> diagonal_{};  ///< Q_mm, a constant
  std::array<double, kSize> up_{};                 ///< Q_lm = up z Q_(l−1)m − up_two Q_(l−2)m
  std::array<double, kSize> up_two_{};
  std::array<double, kSize> slope_{};  ///< dQ_lm/dz = slope Q_l(m+1)
};

/// A drift field as a sum of members of the family.
class HarmonicField {
 public:
  /// Throws std::invalid_argument for a degree outside 1 … 20 or an order outside ± degree.
  explicit HarmonicField(std::vector<DriftHarmonic> members);

  /// ω_b(h), rad/s, case axes, across h. h: unit.
  template <class S>
  [[nodiscard]] Vector3<S> rate(const Vector3<S>& h) const {
    // Apart, so that the usual case of no members costs nothing.
    return members_.empty() ? Vector3<S>(Vector3<S>::Zero()) : sum(h);
  }

  [[nodiscard]] const std::vector<DriftHarmonic>& members() const { return members_; }

 private:
  template <class S>
  [[nodiscard]] Vector3<S> sum(const Vector3<S>& h) const {
    const HarmonicTable::At<S> y = table_.at(h);
    Vector3<S> w = Vector3<S>::Zero();
    Vector3<S> d = Vector3<S>::Zero();
    for (const Term& term : terms_) {
      const Vector3<S> cosine = y.polynomial_gradient(term.degree, term.order);
      const Vector3<S> sine = y.polynomial_gradient(term.degree, -term.order);
      w += S(term.w[0]) * cosine + S(term.w[1]) * sine;
      d += S(term.d[0]) * cosine + S(term.d[1]) * sine;
    }
    return h * h.dot(w) - w + h.cross(d);
  }

  /// What the members of one degree and one |order| add up to, so that each polynomial is taken once.
  struct Term {
    int degree;
    int order;                  ///< not negative
    std::array<double, 2> w{};  ///< amplitudes of cosine and sine, rad/s
    std::array<double, 2> d{};
  };

  std::vector<DriftHarmonic> members_;
  std::vector<Term> terms_;
  HarmonicTable table_;
};

/// The members of degree 1 and 2 that eq. (1) does not contain: W and D of (1, −1 … 1) and (2, −2), (2, −1), (2, 1).
/// Amplitudes 0.
[[nodiscard]] std::vector<DriftHarmonic> members_outside_eq1();

/// "W(2,-1)".
[[nodiscard]] std::string name(const DriftHarmonic& member);

}  // namespace trihedron::sim
