#pragma once
/// Time as files write it: ISO 8601 for epochs, seconds since the epoch in columns.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "trihedron/core/time.hpp"

namespace trihedron::io {

/// `2009-05-20T00:00:00`, optionally with a fraction of up to nine digits; TAI, years 1958 to 2200. nullopt for
/// anything else, a time zone included.
[[nodiscard]] std::optional<Time> parse_epoch(std::string_view iso);
/// The text that parse_epoch() reads back to the same time.
[[nodiscard]] std::string format_epoch(Time epoch);

/// Three decimals where that is exact, else nine.
[[nodiscard]] std::string format_seconds(Duration duration);

}  // namespace trihedron::io
