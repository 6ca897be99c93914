#pragma once

#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// The rate of the orbit, from the attitude history. That of a low orbit where the attitude is fixed in space.
[[nodiscard]] double orbital_rate_rad_s(const StarTrackerTelemetry& tracker);

}  // namespace trihedron::ground
