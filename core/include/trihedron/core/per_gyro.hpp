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

}  // namespace trihedron
