#include "trihedron/core/readings.hpp"

namespace trihedron {

Directions between(const Directions& a, const Directions& b, double fraction, int gyros) {
  Directions h_b;
  for (int k = 0; k < gyros; ++k) {
    h_b[k] = ((1 - fraction) * a[k] + fraction * b[k]).normalized();
  }
  return h_b;
}

}  // namespace trihedron
