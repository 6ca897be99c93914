#pragma once
/// Which drift model is meant, as a value.

#include <cstdint>

namespace trihedron {

/// A drift model: eq. (1); eq. (1) and thirteen members more; or eq. (1) and all members up to a degree of the vector
/// spherical harmonics −∇W + h × ∇D that it does not contain.
struct DriftModelId {
  enum class Family : std::uint8_t { kEsg7, kEsg20, kVsh };
  Family family = Family::kEsg7;
  std::uint8_t degree = 0;  ///< the greatest, of kVsh; 0 for the others

  friend constexpr bool operator==(const DriftModelId& a, const DriftModelId& b) = default;

  /// Number of coefficients.
  [[nodiscard]] constexpr int size() const {
    constexpr int kEq1 = 7;
    switch (family) {
      case Family::kEsg7:
        return kEq1;
      case Family::kEsg20:
        return kEq1 + 13;
      case Family::kVsh:
        break;
    }
    // W and D of degree l have 2l + 1 members each. Eq. (1) has four of degree 2, two of degree 3 and one of degree 4.
    const int all = 2 * degree * (degree + 2);
    return kEq1 + all - (degree >= 2 ? 4 : 0) - (degree >= 3 ? 2 : 0) - (degree >= 4 ? 1 : 0);
  }
};

}  // namespace trihedron
