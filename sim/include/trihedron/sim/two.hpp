#pragma once
/// A scalar for Eigen and for what is written for any scalar: the same quantity of two gyros, in core/lanes.hpp. Each
/// is rounded as a double alone.

#include <Eigen/Core>
#include <cmath>

#include "trihedron/core/lanes.hpp"

namespace trihedron::sim {

/// The same quantity of two gyros.
class Two {
 public:
  Two() = default;
  explicit Two(double of_both) : lanes_(both_lanes(of_both)) {}
  Two(double first, double second) : lanes_{first, second} {}

  [[nodiscard]] double operator[](int gyro) const { return lanes_[gyro]; }

  friend Two operator+(Two a, Two b) { return Two(a.lanes_ + b.lanes_); }
  friend Two operator-(Two a, Two b) { return Two(a.lanes_ - b.lanes_); }
  friend Two operator*(Two a, Two b) { return Two(a.lanes_ * b.lanes_); }
  friend Two operator/(Two a, Two b) { return Two(a.lanes_ / b.lanes_); }
  friend Two operator-(Two a) { return Two(-a.lanes_); }
  Two& operator+=(Two b) { return *this = *this + b; }
  Two& operator-=(Two b) { return *this = *this - b; }
  Two& operator*=(Two b) { return *this = *this * b; }
  Two& operator/=(Two b) { return *this = *this / b; }

  /// Of one of them at least.
  friend bool operator>=(Two a, Two b) { return a[0] >= b[0] || a[1] >= b[1]; }

  friend Two sqrt(Two a) { return Two(root(a.lanes_)); }
  friend Two sin(Two a) { return {std::sin(a[0]), std::sin(a[1])}; }

 private:
  explicit Two(Lanes lanes) : lanes_(lanes) {}
  Lanes lanes_;
};

}  // namespace trihedron::sim

namespace Eigen {

/// What Eigen asks of a scalar.
template <>
struct NumTraits<trihedron::sim::Two> : NumTraits<double> {
  using Real = trihedron::sim::Two;
  using NonInteger = trihedron::sim::Two;
  using Nested = trihedron::sim::Two;
  using Literal = double;
};

}  // namespace Eigen
