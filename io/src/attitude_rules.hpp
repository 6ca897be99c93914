#pragma once
/// What readers and writers of attitude have in common.

#include <Eigen/Geometry>
#include <cmath>
#include <string_view>

namespace trihedron::io {

/// To 1e-3: files round to few decimals. False for what is not finite.
[[nodiscard]] inline bool is_unit(const Eigen::Quaterniond& q) { return std::abs(q.norm() - 1) <= 1e-3; }

/// The comment of a message that names the epoch of the attitude file, TAI.
inline constexpr std::string_view kEpochComment = "t_s of the attitude file counts from ";

}  // namespace trihedron::io
