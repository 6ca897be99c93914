#pragma once

#include <vector>

#include "trihedron/records/finding.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Judges fixes of one star tracker that were rejected 20 and more in a row, which are in no fit: whether gyros were
/// wrong rather than the star tracker, and whether the filter gave in to them in the end. `findings`: those of before,
/// of which `reopened` may forbid use afterwards.
void judge_contradictions(std::vector<FixRecord> fixes, const std::vector<GyroEvent>& events, Time epoch,
                          std::vector<Finding>& findings);

}  // namespace trihedron::ground
