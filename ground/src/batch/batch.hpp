#pragma once

#include "batch/pass_problem.hpp"

namespace trihedron::ground {

/// The most likely solution of a pass, and the covariance of its errors.
struct BatchResult {
  PassSolution solution;
  PassSolution before;         ///< the last step
  PassProblem::Linear linear;  ///< there
  SmootherResult errors;       ///< of that; x is the last step
  int iterations = 0;
  double step = 0;  ///< of the constants, the last one: root mean square in their sigmas
  bool converged = false;
};

/// Iterates to the most likely solution from `first`: Gauss–Newton over parameters and momenta together, which with
/// process noise is the iterated fixed-interval smoother. Converged is when the constants step by less than `converged`
/// of their sigmas; the steps go on where alignments that the pass does not determine still move by more than the
/// linear model holds. Throws SetupError where they are not determined.
[[nodiscard]] BatchResult most_likely(const PassProblem& problem, PassSolution first, double converged = 0.02);

/// One step of it from `before`, by the problem linearised there. Throws as most_likely().
[[nodiscard]] BatchResult step_from(const PassProblem& problem, PassSolution before, PassProblem::Linear linear);

/// ln of the likelihood of the process noise, all states integrated over (Laplace); `linear`: the problem linearised
/// near the solution. Up to a constant of the pass. Throws SetupError as most_likely().
[[nodiscard]] double log_likelihood(const PassProblem& problem, const PassSolution& solution,
                                    const PassProblem::Linear& linear, const ProcessNoise& noise);

}  // namespace trihedron::ground
