#pragma once
/// What moves during the pass that the estimators take to stand still.

#include <vector>

#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Names the likeliest of the changes that the pass gives evidence of (docs/mathematics.md, section 12): what moved,
/// when, by how much, and what cures it; nothing where none is likely. The result must not be used where it moves a
/// parameter by more than two of its claimed sigmas. Of coefficients that change that is so for the alignments alone:
/// what they are off themselves is put into the covariance.
void judge_changes(const CalibrationRun& run, std::vector<Finding>& findings);

/// Adds what the estimates are off by the likeliest of the changes to the covariance, of all parameters together, by
/// the probability that it is there; nothing where that goes to and fro at the orbital rate. To be called once, after
/// the verdict, which compares with the claimed sigmas.
void put_changes_into_covariance(CalibrationRun& run);
/// The same of the errors that an open loop begins with (CalibrationRun::errors). To be called once, before they are
/// predicted, while the calibration has the parameters of their layout.
void put_changes_into_errors(CalibrationRun& run);

}  // namespace trihedron::ground
