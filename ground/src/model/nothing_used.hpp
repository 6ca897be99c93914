#pragma once

#include <vector>

#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// The error that no fix started the filter; says what became of the fixes.
[[nodiscard]] SetupError nothing_used(const std::vector<FixRecord>& fixes);

}  // namespace trihedron::ground
