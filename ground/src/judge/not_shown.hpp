#pragma once
/// Errors of the star tracker that a flight does not show.

#include <vector>

#include "trihedron/records/finding.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Finds a clock offset, or an error at orbital period, that is taken as zero though the pass does not tell: what there
/// is of it turns the attitude by more than its sigmas say. `run`: with its attitude and its evidence.
void judge_what_is_not_shown(const CalibrationRun& run, std::vector<Finding>& findings);

}  // namespace trihedron::ground
