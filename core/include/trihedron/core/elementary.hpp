#pragma once
/// The few elementary functions that core needs, made of + − × ÷ and √ alone, which IEEE 754 determines to the last
/// bit. Those of C libraries differ in the last digit from library to library and from processor to processor; with
/// these a pass flown again on the ground gives the bits that it gave in flight (docs/flight.md).

#include <cmath>

namespace trihedron::elementary {

/// Relative error below 4e-16, absolute below 2e-16 near the zeros; |x| ≤ 1e6, beyond which and for NaN it is NaN.
[[nodiscard]] double sin(double x);
/// As sin().
[[nodiscard]] double cos(double x);
/// The angle of (x, y), rad, in [−π, π]; relative error below 4e-16. 0 for (0, 0), NaN where one is NaN or both are
/// infinite.
[[nodiscard]] double atan2(double y, double x);
/// Relative error below 4e-16; 0 below −700, and infinite above 700.
[[nodiscard]] double exp(double x);
/// Relative error below 4e-16; x itself where it is not above zero and finite.
[[nodiscard]] double cube_root(double x);
/// √(a² + b²) of sigmas: nothing is done against squares that are too large or too small for a double.
[[nodiscard]] inline double root_of_squares(double a, double b) { return std::sqrt(a * a + b * b); }

}  // namespace trihedron::elementary
