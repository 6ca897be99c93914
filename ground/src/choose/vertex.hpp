#pragma once
/// A search along one parameter.

#include <algorithm>

namespace trihedron::ground {

/// From the middle of three places a step apart to the largest value, by a parabola; two steps at most.
[[nodiscard]] inline double towards_vertex(double before, double here, double after) {
  const double bend = 2 * here - before - after;
  return bend > 0 ? std::clamp((after - before) / (2 * bend), -2.0, 2.0) : after > before ? 1 : -1;
}

}  // namespace trihedron::ground
