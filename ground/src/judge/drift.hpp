#pragma once
/// Findings on drift: whether the drift model holds it, and what else was found to be there.

#include <vector>

#include "trihedron/records/finding.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Drift models against each other, and eq. (1) against a field.
void judge_drift_model(const CalibrationRun& run, std::vector<Finding>& findings);
/// Coefficients that are followed as they change.
void judge_change(const CalibrationRun& run, std::vector<Finding>& findings);
/// An error of the star tracker or drift that come back with the orbit.
void judge_at_orbital_period(const CalibrationRun& run, std::vector<Finding>& findings);
/// A drift field that may be an error of the star tracker.
void judge_field_or_error(const CalibrationRun& run, std::vector<Finding>& findings);
void judge_polhodes(const CalibrationRun& run, std::vector<Finding>& findings);

}  // namespace trihedron::ground
