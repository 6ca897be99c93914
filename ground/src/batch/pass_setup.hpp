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

/// What one choice of states has found, from which the iteration of another is shorter.
struct Nearby {
  Layout layout;  ///< of the set-up on board
  PassSolution solution;
};
/// The same from there. What the other layout does not have begins at zero.
[[nodiscard]] PassSolution first_solution(const PassProblem& problem, const Nearby& nearby);

}  // namespace trihedron::ground
