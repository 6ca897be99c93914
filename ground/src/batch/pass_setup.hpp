#pragma once
/// From settings and options to the least-squares problem of a pass.

#include "batch/pass_problem.hpp"
#include "onboard/screen.hpp"
#include "trihedron/records/options.hpp"

namespace trihedron::ground {

/// The set-up for options in which nothing is left to decide. Throws SetupError.
[[nodiscard]] PassSetup pass_setup(const PassSettings& settings, const CalibrationOptions& options);

/// The starting point of the iteration.
[[nodiscard]] PassSolution first_solution(const PassProblem& problem, const Screened& screened);

}  // namespace trihedron::ground
