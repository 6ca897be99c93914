#pragma once

#include "batch/pass_problem.hpp"
#include "trihedron/ground/observe/observe.hpp"

namespace trihedron::ground {

/// Observability::attitude_metric, constants by constants. `linear`: the problem linearised at the solution.
[[nodiscard]] Eigen::MatrixXd attitude_metric(const PassProblem& problem, const PassSolution& solution,
                                              const PassProblem::Linear& linear, const Mission& mission);

}  // namespace trihedron::ground
