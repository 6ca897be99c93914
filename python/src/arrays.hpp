#pragma once
/// NumPy arrays of what lives in C++, without copies: each keeps its owner alive, and cannot be written to.

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "trihedron/core/time.hpp"

namespace trihedron::python {

using Doubles = nanobind::ndarray<nanobind::numpy, const double>;
using Nanoseconds = nanobind::ndarray<nanobind::numpy, const std::int64_t, nanobind::ndim<1>>;
/// As Python gives them: the package has checked shape and type, and made them contiguous.
using GivenVector = nanobind::ndarray<const double, nanobind::ndim<1>, nanobind::c_contig, nanobind::device::cpu>;
using GivenMatrix = nanobind::ndarray<const double, nanobind::ndim<2>, nanobind::c_contig, nanobind::device::cpu>;

[[nodiscard]] inline Doubles view(std::span<const double> values, nanobind::handle owner) {
  return {values.data(), {values.size()}, owner};
}

/// Row by row.
[[nodiscard]] inline Doubles view(std::span<const double> values, std::size_t columns, nanobind::handle owner) {
  return {values.data(), {columns == 0 ? 0 : values.size() / columns, columns}, owner};
}

/// Rows and columns.
[[nodiscard]] inline Doubles view(const Eigen::MatrixXd& matrix, nanobind::handle owner) {
  return {matrix.data(),
          {static_cast<std::size_t>(matrix.rows()), static_cast<std::size_t>(matrix.cols())},
          owner,
          {1, matrix.rows()}};
}

[[nodiscard]] inline Doubles view(const Eigen::VectorXd& vector, nanobind::handle owner) {
  return {vector.data(), {static_cast<std::size_t>(vector.size())}, owner};
}

/// x, y, z.
[[nodiscard]] inline Doubles view(const std::vector<Eigen::Vector3d>& vectors, nanobind::handle owner) {
  static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
  return {vectors.empty() ? nullptr : vectors.front().data(), {vectors.size(), 3}, owner};
}

/// x, y, z, w.
[[nodiscard]] inline Doubles view(const std::vector<Eigen::Quaterniond>& quaternions, nanobind::handle owner) {
  static_assert(sizeof(Eigen::Quaterniond) == 4 * sizeof(double));
  return {quaternions.empty() ? nullptr : quaternions.front().coeffs().data(), {quaternions.size(), 4}, owner};
}

/// Nanoseconds TAI since 1958.
[[nodiscard]] inline Nanoseconds view(const std::vector<Time>& t, nanobind::handle owner) {
  static_assert(sizeof(Time) == sizeof(std::int64_t));
  return {reinterpret_cast<const std::int64_t*>(t.data()), {t.size()}, owner};
}

/// Owned by the array itself.
template <class Values>
[[nodiscard]] auto owned(Values values) {
  auto* const kept = new Values(std::move(values));
  const nanobind::capsule owner(kept, [](void* its) noexcept { delete static_cast<Values*>(its); });
  return view(*kept, owner);
}

}  // namespace trihedron::python
