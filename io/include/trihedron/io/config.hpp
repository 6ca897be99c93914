#pragma once
/// Settings of a calibration as TOML. Every value carries its unit; effective-config.toml of any run is a complete
/// example.

#include <filesystem>
#include <string>
#include <string_view>

#include "trihedron/records/options.hpp"

namespace trihedron::io {

/// What the file leaves out keeps its default. Throws InputRefused for unknown keys, bare numbers and values out of
/// range.
[[nodiscard]] CalibrationOptions read_config(const std::filesystem::path& path);
/// Same, from the text; `file` is named in refusals.
[[nodiscard]] CalibrationOptions parse_config(std::string_view text, const std::filesystem::path& file);
/// Complete, with a comment per value; reads back to the same options.
[[nodiscard]] std::string format_config(const CalibrationOptions& options);

/// `90min`, `none` or `continuous`. Throws UsageError.
[[nodiscard]] CorrectionOptions parse_correction_interval(std::string_view text);
/// The text that parse_correction_interval() reads back to the same.
[[nodiscard]] std::string format_correction_interval(const CorrectionOptions& corrections);

}  // namespace trihedron::io
