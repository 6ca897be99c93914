#pragma once
/// Words in messages: quoting what a file holds, suggesting the name that was meant.

#include <span>
#include <string>
#include <string_view>

#include "trihedron/records/limits.hpp"

namespace trihedron::io {

/// Without the blanks (space, tab, CR) at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);

/// Whether a text can be a JSON object: its first character but for blanks and ends of lines is {.
[[nodiscard]] bool begins_as_json(std::string_view text);

/// The cure where something else was given than a pass.
inline constexpr const char* kGiveAPass =
    "give a pass: a directory with pass.toml, gyro.csv and star_tracker.csv, a NetCDF-4 file, or a telemetry.toml";

/// In quotation marks, printable and of bounded length, whatever the text is.
[[nodiscard]] std::string in_quotes(std::string_view text);

/// `did you mean "period_s"?`, or the list of the known names when none is near. A name that the unknown one begins
/// (its unit suffix is missing) is nearest.
[[nodiscard]] std::string suggestion(std::string_view unknown, std::span<const std::string_view> known);

/// "outside 1e-09 to 0.1 rad"
[[nodiscard]] std::string outside(const Range& range);
/// "is 2 rad, outside 1e-09 to 0.1 rad"
[[nodiscard]] std::string is_outside(double value, const Range& range);

/// "invariant, paper, batch"
[[nodiscard]] std::string estimator_choices();

}  // namespace trihedron::io
