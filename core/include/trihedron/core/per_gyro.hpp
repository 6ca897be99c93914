#pragma once

#include <array>
#include <cstddef>

namespace trihedron {

/// One T for each of N gyros, indexed by int as Eigen's blocks are; gyro 1 has index 0.
template <class T, int N>
class PerGyro {
 public:
  [[nodiscard]] static constexpr int size() { return N; }
  [[nodiscard]] constexpr T& operator[](int gyro) { return items_[static_cast<std::size_t>(gyro)]; }
  [[nodiscard]] constexpr const T& operator[](int gyro) const { return items_[static_cast<std::size_t>(gyro)]; }
  [[nodiscard]] constexpr auto begin() { return items_.begin(); }
  [[nodiscard]] constexpr auto end() { return items_.end(); }
  [[nodiscard]] constexpr auto begin() const { return items_.begin(); }
  [[nodiscard]] constexpr auto end() const { return items_.end(); }

 private:
  std::array<T, static_cast<std::size_t>(N)> items_{};
};

/// Which of N gyros are used.
template <int N>
using GyroMask = PerGyro<bool, N>;

/// Where the number of a gyro stands, none.
inline constexpr int kNoGyro = -1;

template <int N>
[[nodiscard]] constexpr GyroMask<N> all_gyros() {
  GyroMask<N> mask;
  for (bool& used : mask) {
    used = true;
  }
  return mask;
}

template <int N>
[[nodiscard]] constexpr int count(const GyroMask<N>& mask) {
  int used = 0;
  for (const bool it : mask) {
    used += it ? 1 : 0;
  }
  return used;
}

}  // namespace trihedron
