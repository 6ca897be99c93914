#pragma once

#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// The rate of the orbit, as the attitude shows it. An attitude that stands still in space does not show it; then that
/// of a low orbit.
[[nodiscard]] double orbital_rate_rad_s(const StarTrackerTelemetry& tracker);

}  // namespace trihedron::ground
