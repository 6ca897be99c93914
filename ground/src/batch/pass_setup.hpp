#pragma once
/// From settings and options to the problem that the whole pass poses.

#include "batch/pass_problem.hpp"
#include "onboard/screen.hpp"
#include "trihedron/records/options.hpp"

namespace trihedron::ground {

/// The problem that these options pose; nothing is left to decide in them. Throws SetupError.
[[nodiscard]] PassSetup pass_setup(const PassSettings& settings, const CalibrationOptions& options);

/// Where the iteration to the most likely solution begins.
[[nodiscard]] PassSolution first_solution(const PassProblem& problem, const Screened& screened);

}  // namespace trihedron::ground
