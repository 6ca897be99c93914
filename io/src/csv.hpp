#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <span>
#include <string>

#include "series.hpp"
#include "text_file.hpp"

namespace trihedron::io {

/// Reads numbers under a header line. Blanks round fields, CRLF, a missing last newline, `nan` and empty fields (NaN)
/// are fine; a last line cut short is left out and noted. Throws InputRefused with line and column for everything else.
[[nodiscard]] Series read_csv(const std::filesystem::path& file, ChooseRules choose);
/// Same, of what the file holds.
[[nodiscard]] Series parse_csv(const TextFile& content, const std::filesystem::path& file, ChooseRules choose);

/// The header line for these columns after t_s.
void append_header(fmt::memory_buffer& out, std::span<const std::string> columns);

}  // namespace trihedron::io
