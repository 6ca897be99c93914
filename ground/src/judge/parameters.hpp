#pragma once
/// Findings on the parameters: whether the pass determines them, and agrees with what was known before.

#include <vector>

#include "trihedron/records/finding.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// The first half of the pass against the whole; after what is found to change.
void judge_halves(const CalibrationRun& run, std::vector<Finding>& findings);
void judge_determination(const CalibrationRun& run, std::vector<Finding>& findings);
/// The result against the priors: one by one, and where that finds nothing, as a whole.
void judge_priors(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings);
/// Whether an axis stood still in body and space.
void judge_steadiness(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings);

}  // namespace trihedron::ground
