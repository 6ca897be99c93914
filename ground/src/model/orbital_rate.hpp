#pragma once

#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Of a low orbit.
inline constexpr double kLowOrbit_rad_s = 1.1e-3;

/// The rate of the orbit, from the attitude history of a pass. That of a low orbit where the attitude is fixed in
/// space.
[[nodiscard]] double orbital_rate_rad_s(const StarTrackerTelemetry& tracker);

/// The same of the beginning of a pass, where a slew that is not yet taken back would be in a mean: in steady flight
/// the body turns with the orbit.
[[nodiscard]] double orbital_rate_so_far_rad_s(const StarTrackerTelemetry& tracker);

}  // namespace trihedron::ground
