#include "batch.hpp"

#include <cmath>
#include <utility>

namespace trihedron::ground {
namespace {

constexpr int kMostIterations = 12;
/// Steps below this part of the sigmas change nothing that anyone could see.
constexpr double kConverged = 0.02;

/// Root mean square of the step of the constants, in their sigmas.
double step_of_constants(const PassLayout& layout, const SmoothedStage& last) {
  const Eigen::VectorXd sigma = last.root.bottomRows(layout.constants()).rowwise().norm();
  const Eigen::VectorXd step = last.x.tail(layout.constants()).cwiseQuotient(sigma);
  return step.norm() / std::sqrt(static_cast<double>(layout.constants()));
}

}  // namespace

BatchResult most_likely(const PassProblem& problem, PassSolution first) {
  const PassLayout& layout = problem.setup().layout;
  BatchResult result;
  result.solution = std::move(first);
  while (result.iterations < kMostIterations) {
    ++result.iterations;
    PassProblem::Linear linear = problem.linearise(result.solution);
    result.errors = smooth(linear.prior, linear.prior_y, linear.stages);
    result.nis = std::move(linear.nis);
    // Of the prior only its own states count; the rows of the directions are empty.
    const Eigen::Index directions = 2 * layout.gyros;
    const Eigen::Index rest = layout.size() - directions;
    const double log_prior_root = linear.prior.bottomRightCorner(rest, rest).diagonal().array().abs().log().sum();
    result.deviance = result.errors.residual_square + 2 * (result.errors.log_root_determinant - log_prior_root);
    problem.correct(result.errors, result.solution);
    result.converged = step_of_constants(layout, result.errors.stages.back()) < kConverged;
    if (result.converged) {
      break;
    }
  }
  return result;
}

}  // namespace trihedron::ground
