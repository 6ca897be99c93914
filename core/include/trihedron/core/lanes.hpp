#pragma once
/// Two doubles side by side, such as the same component of two gyros: where the processor has instructions for that,
/// one works on both. Each is rounded as a double alone, so that the bits are those of two scalars.

#include <cmath>

namespace trihedron {

using Lanes = double __attribute__((vector_size(16)));

/// Two vectors side by side.
struct Lanes3 {
  Lanes x;
  Lanes y;
  Lanes z;
};

/// The same number in both.
[[nodiscard]] inline Lanes both_lanes(double value) { return Lanes{value, value}; }
/// The numbers at two places.
[[nodiscard]] inline Lanes load(const double* first, const double* second) { return Lanes{*first, *second}; }
/// Two that lie one after the other.
[[nodiscard]] inline Lanes load2(const double* at) { return Lanes{at[0], at[1]}; }
/// Writes the two one after the other.
inline void store2(Lanes lanes, double* at) {
  at[0] = lanes[0];
  at[1] = lanes[1];
}
/// Three that lie one after the other, each with its counterpart.
[[nodiscard]] inline Lanes3 load3(const double* first, const double* second) {
  return {load(first, second), load(first + 1, second + 1), load(first + 2, second + 2)};
}
/// Writes each to its place.
inline void store(Lanes lanes, double* first, double* second) {
  *first = lanes[0];
  *second = lanes[1];
}
/// Writes each vector to its place.
inline void store3(const Lanes3& v, double* first, double* second) {
  store(v.x, first, second);
  store(v.y, first + 1, second + 1);
  store(v.z, first + 2, second + 2);
}

/// Of each pair of vectors.
[[nodiscard]] inline Lanes3 operator+(const Lanes3& a, const Lanes3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
/// Of each pair of vectors.
[[nodiscard]] inline Lanes3 operator-(const Lanes3& a, const Lanes3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
/// Each vector times its factor.
[[nodiscard]] inline Lanes3 operator*(Lanes s, const Lanes3& a) { return {s * a.x, s * a.y, s * a.z}; }
/// The sum in the order of Eigen's products of three.
[[nodiscard]] inline Lanes dot(const Lanes3& a, const Lanes3& b) { return a.x * b.x + (a.y * b.y + a.z * b.z); }
/// The cross product of each pair of vectors.
[[nodiscard]] inline Lanes3 cross(const Lanes3& a, const Lanes3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// The square root of each.
[[nodiscard]] inline Lanes root(Lanes a) { return Lanes{std::sqrt(a[0]), std::sqrt(a[1])}; }
/// To unit length; what has none stays, as Eigen's normalized().
[[nodiscard]] inline Lanes3 normalized(const Lanes3& a) {
  const Lanes square = dot(a, a);
  const Lanes length{square[0] > 0 ? std::sqrt(square[0]) : 1, square[1] > 0 ? std::sqrt(square[1]) : 1};
  return {a.x / length, a.y / length, a.z / length};
}

}  // namespace trihedron
