#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "trihedron/records/pass.hpp"

namespace trihedron::io {

/// The settings in the text of a pass.toml, for a pass with this many gyros. `file` is named in refusals; a relative
/// `prior` is looked up in `directory`. Throws InputRefused.
[[nodiscard]] PassSettings parse_pass_toml(std::string_view text, const std::filesystem::path& file,
                                           const std::filesystem::path& directory, int gyros);

/// Only the epoch. Throws InputRefused.
[[nodiscard]] Time parse_pass_epoch(std::string_view text, const std::filesystem::path& file);

/// Only the file that `prior` names; empty where it names none. Throws InputRefused.
[[nodiscard]] std::filesystem::path parse_prior_file(std::string_view text, const std::filesystem::path& file,
                                                     const std::filesystem::path& directory);

/// The text that parses back to the same settings. `prior_file` is the name for `prior`, empty for none.
[[nodiscard]] std::string format_pass_toml(const PassSettings& settings, std::string_view prior_file);

/// Throws InputRefused when a prior calibration is not for this many gyros.
void check_prior(const Calibration& prior, const std::filesystem::path& prior_file, int gyros);

}  // namespace trihedron::io
