#pragma once
/// The family that every drift field belongs to: ω = −∇W + h × ∇D on the unit sphere (Helmholtz–Hodge), W and D in real
/// spherical harmonics. Eq. (1) is seven members of it, up to a part along h that moves nothing.

#include <array>
#include <stdexcept>
#include <vector>

#include "trihedron/core/frames.hpp"
#include "trihedron/core/harmonics.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::sim {

/// A drift field as a sum of members of the family.
class HarmonicField {
 public:
  /// Throws std::invalid_argument for a degree outside 1 … 20 or an order outside ± degree.
  explicit HarmonicField(std::vector<DriftHarmonic> members);

  /// ω_b(h), rad/s, case axes, across h. h: unit.
  template <class S>
  [[nodiscard]] Vector3<S> rate(const Vector3<S>& h) const {
    // sum() is a function of its own, so that the usual case of no members costs nothing.
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

  /// The members of one degree and one |order| together, so that each polynomial is evaluated once.
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

}  // namespace trihedron::sim
