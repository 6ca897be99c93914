#pragma once
/// What may be meant by a table of which not one row is a unit vector.

#include <cstddef>
#include <span>
#include <string>

#include "series.hpp"

namespace trihedron::io {

/// How to mend the directions of a gyro (from 0) that all have a wrong norm: counts, angles instead of cosines, a
/// column exchanged with another gyro. `otherwise` where none of these makes unit vectors of them.
[[nodiscard]] std::string cure_of_directions(const Series& series, std::span<const std::size_t> rows, std::size_t gyro,
                                             std::string otherwise);

/// The same of quaternions: counts.
[[nodiscard]] std::string cure_of_quaternions(const Series& series, std::span<const std::size_t> rows,
                                              std::string otherwise);

}  // namespace trihedron::io
