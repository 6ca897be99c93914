#pragma once
/// What counts as a slew, by the rate of the body and its median over the pass, both rad/s.

#include <algorithm>

#include "trihedron/records/units.hpp"

namespace trihedron::ground {

/// A slower turn is none, whatever the body does for the rest of the pass.
inline constexpr double kSlowestSlew_rad_s = 0.02 * kDegree;

[[nodiscard]] inline bool is_in_slew(double rate_rad_s, double usual_rad_s) {
  constexpr double kSlewOverUsual = 3;
  return rate_rad_s > std::max(kSlewOverUsual * usual_rad_s, kSlowestSlew_rad_s);
}

/// Neither in a slew nor at its begin or end.
[[nodiscard]] inline bool is_at_rest(double rate_rad_s, double usual_rad_s) {
  constexpr double kRestOverUsual = 1.5;
  return rate_rad_s < kRestOverUsual * usual_rad_s;
}

}  // namespace trihedron::ground
