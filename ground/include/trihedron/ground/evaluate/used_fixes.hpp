#pragma once

#include <vector>

#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// The fixes of the first star tracker that the calibration or navigation used.
[[nodiscard]] StarTrackerTelemetry used_fixes(const Pass& pass, const std::vector<FixRecord>& fixes);

}  // namespace trihedron::ground
