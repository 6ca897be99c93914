#pragma once
/// Attitude parameter messages (APM) on the way in; format_apm() is in attitude_message.hpp.

#include <filesystem>
#include <string_view>

#include "trihedron/io/attitude_message.hpp"

namespace trihedron::io {

/// One epoch, with its rate where the message has one. Throws InputRefused.
[[nodiscard]] AttitudeMessage parse_apm(std::string_view text, const std::filesystem::path& file);

}  // namespace trihedron::io
