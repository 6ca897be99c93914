#pragma once
/// Quantities with their unit, as users write them in options and configuration: `90min`, `5arcmin`, `0.1deg/h`.
///
/// A parse_ function throws UsageError for a bare number, an unknown unit, garbage, NaN, infinity or overflow; its text
/// lists the accepted units. A format_ function gives the shortest text that parses back to the same value, bit for
/// bit.

#include <string>
#include <string_view>

#include "trihedron/core/time.hpp"
#include "trihedron/records/limits.hpp"
#include "trihedron/records/open_loop_forecast.hpp"

namespace trihedron::io {

/// `90min`, `3s`, `2h`, `10ms`: ns, us, ms, s, min, h, d; not negative, rounded to whole nanoseconds.
[[nodiscard]] Duration parse_duration(std::string_view text);
/// Same, of either sign: `-10ms`.
[[nodiscard]] Duration parse_signed_duration(std::string_view text);
/// `5arcmin`, `2arcsec`, `0.5deg`, `1e-5rad`; gives rad.
[[nodiscard]] double parse_angle_rad(std::string_view text);
/// `0.1deg/h`, `1e-6rad/s` and the like; gives rad/s.
[[nodiscard]] double parse_rate_rad_s(std::string_view text);
/// Within a range; the UsageOutsideRange tells the range in the unit that was given, and the reason for it.
[[nodiscard]] Duration parse_duration(std::string_view text, const Range& range_s);
[[nodiscard]] Duration parse_signed_duration(std::string_view text, const Range& range_s);  ///< Same.
[[nodiscard]] double parse_angle_rad(std::string_view text, const Range& range);            ///< Same.
[[nodiscard]] double parse_rate_rad_s(std::string_view text, const Range& range);           ///< Same.
/// Angle random walk, `0.001deg/h^0.5`, `1e-8rad/s^0.5`; gives rad/s^0.5.
[[nodiscard]] double parse_random_walk_rad_sqrt_s(std::string_view text);
/// `5arcmin for 270min`: an attitude error and how long it must not be exceeded.
[[nodiscard]] Need parse_need(std::string_view text);
/// A pure number, finite.
[[nodiscard]] double parse_number(std::string_view text);
/// Within a range; throws UsageOutsideRange.
[[nodiscard]] double parse_number(std::string_view text, const Range& range);

/// As `5arcmin for 270min`.
[[nodiscard]] std::string format_need(const Need& need);
/// In the largest unit of which it is a whole multiple, as `90min`.
[[nodiscard]] std::string format_duration(Duration duration);
/// As `5arcmin`.
[[nodiscard]] std::string format_angle(double rad);
/// As `0.1deg/h`.
[[nodiscard]] std::string format_rate(double rad_s);
/// As `1e-8rad/s^0.5`.
[[nodiscard]] std::string format_random_walk(double rad_sqrt_s);

}  // namespace trihedron::io
