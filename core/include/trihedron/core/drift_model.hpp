#pragma once
/// Identity of a drift model and of each coefficient.

#include <compare>
#include <cstdint>

namespace trihedron {

/// A linear drift family, ω_b(h) = B(h) κ (docs/mathematics.md, section 3).
struct DriftModelId {
  enum class Family : std::uint8_t {
    kEsg7,   ///< eq. (1)
    kEsg20,  ///< eq. (1), the members of degrees 1 and 2 that it lacks, and D of Σh⁴/4, whose W is k0
    kVsh,    ///< eq. (1) and all vector spherical harmonics up to `degree` that it does not contain
  };
  static constexpr int kMaxDegree = 8;
  static constexpr int kMaxDegreeOnBoard = 6;  ///< an estimator on board has room for no more

  Family family = Family::kEsg7;
  std::uint8_t degree = 0;  ///< of kVsh, 1 … kMaxDegree; 0 otherwise

  friend constexpr bool operator==(const DriftModelId&, const DriftModelId&) = default;

  /// Coefficients of one gyro.
  [[nodiscard]] constexpr int size() const {
    constexpr int kEq1 = 7;
    if (family == Family::kVsh) {
      // W and D of each degree; eq. (1) has 4 of degree 2, 2 of degree 3 and 1 of degree 4.
      const int contained = (degree >= 2 ? 4 : 0) + (degree >= 3 ? 2 : 0) + (degree >= 4 ? 1 : 0);
      return kEq1 + 2 * degree * (degree + 2) - contained;
    }
    return family == Family::kEsg20 ? 20 : kEq1;
  }
};

inline constexpr DriftModelId kEsg7{};
inline constexpr DriftModelId kEsg20{DriftModelId::Family::kEsg20, 0};
/// 1 ≤ degree ≤ DriftModelId::kMaxDegree.
[[nodiscard]] constexpr DriftModelId vsh(int degree) {
  return {DriftModelId::Family::kVsh, static_cast<std::uint8_t>(degree)};
}

/// The amplitude of one member of the drift family, rad/s.
struct DriftCoefficient {
  enum class Member : std::uint8_t {
    kEq1,    ///< a member of eq. (1); `degree` says which: the index of Esg7
    kCubeD,  ///< h × ∇D with D = Σh⁴/4, of which eq. (1) has the W as k0
    kW,      ///< −∇W, W a real spherical harmonic of `degree` and `order`
    kD,      ///< h × ∇D, likewise
  };
  Member member = Member::kEq1;
  std::int8_t degree = 0;
  std::int8_t order = 0;

  friend constexpr auto operator<=>(const DriftCoefficient& a, const DriftCoefficient& b) = default;

  [[nodiscard]] constexpr bool is_in_eq1() const { return member == Member::kEq1; }
  /// By its place in eq. (1), 0 … 6.
  [[nodiscard]] static constexpr DriftCoefficient of_eq1(int index) {
    return {Member::kEq1, static_cast<std::int8_t>(index), 0};
  }
};

}  // namespace trihedron
