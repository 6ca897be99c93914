#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace trihedron {

/// Gyros that a spacecraft may have.
inline constexpr int kMaxGyros = 4;

/// One T for each gyro, indexed by int as Eigen's blocks are; gyro 1 has index 0. The number of gyros is in the Layout;
/// N is the room for them.
template <class T, int N = kMaxGyros>
class PerGyro {
 public:
  [[nodiscard]] static constexpr int capacity() { return N; }
  [[nodiscard]] constexpr T& operator[](int gyro) { return items_[static_cast<std::size_t>(gyro)]; }
  [[nodiscard]] constexpr const T& operator[](int gyro) const { return items_[static_cast<std::size_t>(gyro)]; }
  [[nodiscard]] constexpr auto begin() { return items_.begin(); }
  [[nodiscard]] constexpr auto end() { return items_.end(); }
  [[nodiscard]] constexpr auto begin() const { return items_.begin(); }
  [[nodiscard]] constexpr auto end() const { return items_.end(); }

 private:
  std::array<T, static_cast<std::size_t>(N)> items_{};
};

/// One direction for each gyro; elements beyond the number of gyros have no meaning.
using Directions = PerGyro<Eigen::Vector3d>;

/// Which gyros are used.
using GyroMask = PerGyro<bool>;

/// Index that means "no gyro".
inline constexpr int kNoGyro = -1;

/// The first `gyros` of them.
[[nodiscard]] constexpr GyroMask all_gyros(int gyros) {
  GyroMask mask;
  for (int k = 0; k < gyros; ++k) {
    mask[k] = true;
  }
  return mask;
}
/// How many are in it.
[[nodiscard]] constexpr int count(const GyroMask& mask) {
  int used = 0;
  for (const bool it : mask) {
    used += it ? 1 : 0;
  }
  return used;
}
/// The first two that are in it, of which there are as many at least.
[[nodiscard]] constexpr std::array<int, 2> first_two(const GyroMask& mask) {
  std::array<int, 2> found{kNoGyro, kNoGyro};
  for (int k = kMaxGyros - 1; k >= 0; --k) {
    if (mask[k]) {
      found = {k, found[0]};
    }
  }
  return found;
}
/// Those that are in both.
[[nodiscard]] constexpr GyroMask both(const GyroMask& a, const GyroMask& b) {
  GyroMask mask;
  for (int k = 0; k < kMaxGyros; ++k) {
    mask[k] = a[k] && b[k];
  }
  return mask;
}

}  // namespace trihedron
