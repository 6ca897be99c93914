#pragma once
/// The readiness of the on-board application as a number and in words.

#include <string>

#include "trihedron/core/tables.hpp"

namespace trihedron {

/// Time from now, s, for which the application keeps the required error without the star tracker, 99.7 %: its readiness
/// less the time since the last astro-correction, and 0 where there is no attitude or nothing has been predicted yet.
[[nodiscard]] double readiness_s(const Housekeeping& record);

/// The same as a sentence: "attitude within 5′ for the next 270 min (99.7 %)".
[[nodiscard]] std::string readiness_in_words(const Housekeeping& record);

}  // namespace trihedron
