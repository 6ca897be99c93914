#pragma once
/// What readers and writers of attitude have in common.

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <string_view>

#include "trihedron/io/time_text.hpp"
#include "wording.hpp"

namespace trihedron::io {

/// To 1e-3: files round to few decimals. False for what is not finite.
[[nodiscard]] inline bool is_unit(const Eigen::Quaterniond& q) { return std::abs(q.norm() - 1) <= 1e-3; }

/// The comment of a message that names the epoch of the attitude file, TAI.
inline constexpr std::string_view kEpochComment = "t_s of the attitude file counts from ";

/// The epoch of such a comment.
[[nodiscard]] inline std::optional<Time> epoch_in_comment(std::string_view text) {
  if (!text.starts_with(kEpochComment)) {
    return std::nullopt;
  }
  std::string_view epoch = trimmed(text.substr(kEpochComment.size()));
  epoch.remove_suffix(epoch.ends_with(" TAI") ? 4 : 0);
  return parse_epoch(epoch);
}

}  // namespace trihedron::io
