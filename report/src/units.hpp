#pragma once
/// Units of the report: what a reader of gyro data expects, from the SI of the records.

#include <numbers>

#include "trihedron/core/time.hpp"

namespace trihedron::report {

inline constexpr double kDegree_rad = std::numbers::pi / 180;
inline constexpr double kArcminute_rad = kDegree_rad / 60;
inline constexpr double kArcsecond_rad = kDegree_rad / 3600;
inline constexpr double kMicroradian = 1e-6;
inline constexpr double kDegreePerHour_rad_s = kDegree_rad / 3600;

[[nodiscard]] constexpr double to_minutes(Duration d) { return to_seconds(d) / 60; }

}  // namespace trihedron::report
