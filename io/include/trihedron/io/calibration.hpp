#pragma once
/// calibration.json: what a calibration found, its covariance and its verdict. Format "trihedron-calibration",
/// version 1.

#include <filesystem>
#include <string>
#include <string_view>

#include "trihedron/records/calibration.hpp"

namespace trihedron::io {

/// Throws InputRefused for a file that is not a whole, consistent calibration, naming the value at fault.
[[nodiscard]] Calibration read_calibration(const std::filesystem::path& path);
/// Same, from the text; `file` is named in refusals.
[[nodiscard]] Calibration parse_calibration(std::string_view text, const std::filesystem::path& file);

/// Every number comes back bit for bit; a statistic that is not finite becomes null and comes back as NaN.
[[nodiscard]] std::string format_calibration(const Calibration& calibration);
/// Throws MachineFailed when the file cannot be written; then nothing stays.
void write_calibration(const std::filesystem::path& path, const Calibration& calibration);

}  // namespace trihedron::io
