#pragma once
/// The numbers of one flight among those of eight.

#include <Eigen/Core>
#include <cstddef>

#include "state.hpp"

namespace trihedron::lanes {

/// Not through the whole vector, as to[lane] would be.
inline void put(double from, std::size_t lane, V& to) { reinterpret_cast<double*>(&to)[lane] = from; }

inline void put(const Eigen::Vector3d& from, std::size_t lane, V3& to) {
  put(from.x(), lane, to.x);
  put(from.y(), lane, to.y);
  put(from.z(), lane, to.z);
}

inline void put(const Eigen::Matrix3d& from, std::size_t lane, M3& to) {
  for (int j = 0; j < 3; ++j) {
    put(from.col(j), lane, to.column[j]);
  }
}

[[nodiscard]] inline Eigen::Vector3d vector_of(const V3& from, std::size_t lane) {
  return {from.x[lane], from.y[lane], from.z[lane]};
}

[[nodiscard]] inline Eigen::Matrix3d matrix_of(const M3& from, std::size_t lane) {
  Eigen::Matrix3d m;
  for (int j = 0; j < 3; ++j) {
    m.col(j) = vector_of(from.column[j], lane);
  }
  return m;
}
}  // namespace trihedron::lanes
