#pragma once
/// From a pass to the problem of least squares that it poses.

#include <vector>

#include "pass_problem.hpp"
#include "screened_pass.hpp"
#include "trihedron/ground/calibrate.hpp"

namespace trihedron::ground {

/// What the smallest cycle makes of a pass, with values to start from.
struct Screened {
  ScreenedPass pass;
  std::vector<GyroCalibration> first;
};

/// Runs the pass through the smallest cycle that knows its prior. Throws SetupError.
[[nodiscard]] Screened screen(const Pass& pass, const CalibrationOptions& asked);

/// The problem that these options pose; nothing is left to decide in them. Throws SetupError.
[[nodiscard]] PassSetup setup_of(const Pass& pass, const CalibrationOptions& options);

/// Where the iteration to the most likely solution begins.
[[nodiscard]] PassSolution first_solution(const PassProblem& problem, const Screened& screened);

/// Options of the smallest cycle, no further states.
[[nodiscard]] CalibrationOptions without_further_states(CalibrationOptions options);

}  // namespace trihedron::ground
