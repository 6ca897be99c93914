#pragma once
/// What moves during the pass that the estimators take to stand still.

#include <vector>

#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Names the likeliest of the changes that the pass gives evidence of (docs/mathematics.md, section 12): what moved,
/// when, by how much, and what cures it; nothing where none is likely. The result must not be used where it moves a
/// parameter by more than its claimed sigma allows.
void judge_changes(const CalibrationRun& run, std::vector<Finding>& findings);

}  // namespace trihedron::ground
