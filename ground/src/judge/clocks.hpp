#pragma once
/// Findings on the clocks of star tracker and gyros.

#include <vector>

#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// What was found of the clocks, and taken account of: offset, rate, gyros that are late. Or was not, by choice.
void judge_clocks(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings);
/// A navigation takes stamps as they come: what is wrong with them is in its attitude.
void judge_clocks(const Pass& pass, const NavigationRun& run, std::vector<Finding>& findings);

}  // namespace trihedron::ground
