#pragma once

#include "pass_problem.hpp"

namespace trihedron::ground {

/// The most likely course of a pass, and what is known of its errors.
struct BatchResult {
  PassSolution solution;
  SmootherResult errors;    ///< x is zero to convergence
  std::vector<double> nis;  ///< per fix, of what is left at the solution
  int iterations = 0;
  bool converged = false;
  double deviance = 0;  ///< −2 ln of the likelihood of the setup's noise and states, up to a constant of the pass
};

/// Iterates to the most likely solution from `first`: Gauss–Newton over parameters and momenta together, which with
/// process noise is the iterated fixed-interval smoother.
[[nodiscard]] BatchResult most_likely(const PassProblem& problem, PassSolution first);

}  // namespace trihedron::ground
