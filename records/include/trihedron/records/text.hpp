#pragma once
/// Text for people: whatever a name from a file holds can be shown, the name that was meant is suggested, angles are in
/// the unit that suits their size.

#include <span>
#include <string>
#include <string_view>

#include "trihedron/core/time.hpp"

namespace trihedron {

/// `text` as valid UTF-8 on one line, fit for a terminal, for JSON and for HTML: bytes that are no UTF-8 as \\xff,
/// control characters (those of a terminal begin with one), line ends and marks of writing direction as \\x1b or
/// \\u{202e}. Everything else stays.
[[nodiscard]] std::string printable(std::string_view text);

/// The same of several lines: '\n' stays.
[[nodiscard]] std::string printable_lines(std::string_view text);

/// As a word of a command, which a POSIX shell gives to a program as it is here.
[[nodiscard]] std::string shell_word(std::string_view text);

/// The name that was probably meant, or nothing when none is near. A name that the unknown one begins (its unit suffix
/// is missing) is nearest.
[[nodiscard]] std::string_view nearest(std::string_view unknown, std::span<const std::string_view> known);

/// What stands in a sentence in place of a number that is infinite or none.
inline constexpr std::string_view kNoNumber = "not determined";

/// `2009-05-20T00:00:00`, TAI; with nine decimals where it is no whole second.
[[nodiscard]] std::string iso_time(Time t);

/// A unit in which angles are shown.
struct AngleUnit {
  double rad;          ///< its size
  const char* symbol;  ///< "″", "′", "°"
};

/// ″ below 100″, ′ below 100′, else °; of what is no number ″.
[[nodiscard]] AngleUnit unit_of_angle(double rad);

/// One unit for all of them, as of a column: that of their median, zeros and what is no number left out.
[[nodiscard]] AngleUnit unit_of_angles(std::span<const double> rad);

/// Of a finite value to three significant digits and at least so many decimals that 100 has none: "2.94", "0.00031",
/// "1813".
[[nodiscard]] std::string three_digits(double value);

/// "2.94″", "10.2′", or kNoNumber.
[[nodiscard]] std::string angle_text(double rad);

/// What stands in a table in place of a number that is infinite or none.
inline constexpr std::string_view kNoEntry = "—";

/// In this unit, or kNoEntry.
[[nodiscard]] std::string angle_text(double rad, AngleUnit unit);

}  // namespace trihedron
