#pragma once
/// Units of angles in radians.

#include <numbers>

namespace trihedron {

inline constexpr double kDegree = std::numbers::pi / 180;  ///< rad
inline constexpr double kArcminute = kDegree / 60;         ///< rad
inline constexpr double kArcsecond = kDegree / 3600;       ///< rad

}  // namespace trihedron
