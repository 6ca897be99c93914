#pragma once

#include <chrono>
#include <optional>

#include "trihedron/core/time.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Of a low orbit.
inline constexpr double kLowOrbit_rad_s = 1.1e-3;

/// A mean over half of a longer time is told.
inline constexpr Duration kLongForOrbitalRate = std::chrono::hours(2);

/// The rate of the orbit, from the attitude history of a pass. Nothing where it does not show it: the attitude is fixed
/// in space, or the body turns faster than any orbit of the Earth.
[[nodiscard]] std::optional<double> shown_orbital_rate_rad_s(const StarTrackerTelemetry& tracker);

/// The same; that of a low orbit where the pass does not show it.
[[nodiscard]] double orbital_rate_rad_s(const StarTrackerTelemetry& tracker);

/// The rate of the orbit from the beginning of a pass, where a slew that is not yet taken back would be in a mean: in
/// steady flight the body turns with the orbit. Nothing where slews do not let it be told to some hundredths.
[[nodiscard]] std::optional<double> orbital_rate_so_far_rad_s(const StarTrackerTelemetry& tracker);

}  // namespace trihedron::ground
