#pragma once
/// Binary C-kernels of SPICE (DAF/CK, types 1 and 3) with the text kernel of their clock.

#include <filesystem>
#include <string_view>

#include "trihedron/io/attitude_message.hpp"

namespace trihedron::io {

/// Whether bytes are those of a DAF of pointing.
[[nodiscard]] bool is_c_kernel(std::string_view bytes);

/// `clock`: the text of an SCLK kernel of type 1; `clock_file` is named in messages. Throws InputRefused.
[[nodiscard]] AttitudeMessage parse_c_kernel(std::string_view bytes, const std::filesystem::path& file,
                                             std::string_view clock, const std::filesystem::path& clock_file);

/// The same; the clock is in the file of the same name with the ending .tsc.
[[nodiscard]] AttitudeMessage read_c_kernel(std::string_view bytes, const std::filesystem::path& file);

}  // namespace trihedron::io
