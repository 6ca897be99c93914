#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "toml_fields.hpp"
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

/// What a telemetry.toml says beside where its columns are.
struct SettingsOfTelemetry {
  PassSettings settings;
  std::filesystem::path prior_file;  ///< empty where there is none
};

/// The same keys as in pass.toml, in a document that has the table `telemetry` as well. Epoch, duration, periods and
/// the noise of the star tracker may be left out: they are zero then. Throws InputRefused.
[[nodiscard]] SettingsOfTelemetry read_telemetry_settings(const toml::table& document,
                                                          const std::filesystem::path& file,
                                                          const std::filesystem::path& directory, int gyros,
                                                          const Field& telemetry);
/// Those keys.
[[nodiscard]] Fields telemetry_settings_fields(PassSettings& settings, std::optional<std::string>& prior_name,
                                               const std::filesystem::path& file);

/// Whether the stamps of the telemetry beside the settings are corrected already by what these say of clocks.
enum class TelemetryStamps { kCorrected, kAsReceived };

/// The text that parses back to the same settings; clock corrections are in it only where the stamps still need them.
/// `prior_file` is the name for `prior`, empty for none.
[[nodiscard]] std::string format_pass_toml(const PassSettings& settings, std::string_view prior_file,
                                           TelemetryStamps stamps = TelemetryStamps::kCorrected);

/// As a string of TOML.
[[nodiscard]] std::string format_text(const std::string& text);

/// Throws InputRefused when a prior calibration is not for this many gyros.
void check_prior(const Calibration& prior, const std::filesystem::path& prior_file, int gyros);

}  // namespace trihedron::io
