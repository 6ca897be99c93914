#include "batch/batch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trihedron::ground {
namespace {

constexpr int kMostIterations = 12;

/// Root mean square of the step of the constants, in their sigmas.
double step_of_constants(const Layout& layout, const SmootherResult& found) {
  const Eigen::VectorXd sigma = found.last_root.bottomRows(layout.constants()).rowwise().norm();
  const Eigen::VectorXd step = found.x.back().tail(layout.constants()).cwiseQuotient(sigma);
  return step.norm() / std::sqrt(static_cast<double>(layout.constants()));
}

/// What the linear model leaves out of the alignments, rad: of their step, and of what is not known of them where they
/// then stand. It may be much where a step is little of its sigma: about an axis that the pass does not show.
double second_order_rad(const Layout& layout, const SmootherResult& found) {
  double largest_rad = 0;
  for (int k = 0; k < layout.gyros; ++k) {
    const double step_rad = found.x.back().segment<3>(layout.alignment(k)).norm();
    const double sigma_rad = found.last_root.middleRows<3>(layout.alignment(k)).norm();
    largest_rad = std::max(largest_rad, step_rad * (step_rad + sigma_rad));
  }
  return largest_rad;
}

}  // namespace

BatchResult step_from(const PassProblem& problem, PassSolution before, PassProblem::Linear linear) {
  BatchResult result;
  result.before = std::move(before);
  result.linear = std::move(linear);
  result.errors = smooth(result.linear.prior, result.linear.prior_y, result.linear.stages);
  result.solution = result.before;
  problem.correct(result.errors, result.solution);
  result.iterations = 1;
  result.step = step_of_constants(problem.layout(), result.errors);
  return result;
}

BatchResult most_likely(const PassProblem& problem, PassSolution first, double converged) {
  constexpr double kSmall_rad = 2e-7;  // 0.04″: less than the mean of many fixes tells
  BatchResult result;
  result.solution = std::move(first);
  bool is_straight = false;
  while (result.iterations < kMostIterations && !(result.converged && is_straight)) {
    const int before = result.iterations;
    PassSolution from = std::move(result.solution);
    result = {};  // long: one at a time
    PassProblem::Linear linear = problem.linearise_by_parts(from);
    result = step_from(problem, std::move(from), std::move(linear));
    result.iterations += before;
    result.converged = result.step < converged;
    is_straight = second_order_rad(problem.layout(), result.errors) < kSmall_rad;
  }
  return result;
}

double log_likelihood(const PassProblem& problem, const PassSolution& solution, const PassProblem::Linear& linear,
                      const ProcessNoise& noise) {
  const Layout& layout = problem.layout();
  Eigen::MatrixXd prior = linear.prior;
  Eigen::VectorXd prior_y = linear.prior_y;
  problem.put_noise(solution, noise, prior, prior_y);
  const SmootherLikelihood found = likelihood(prior, prior_y, linear.stages.size(), [&](std::size_t arc) {
    return problem.stage(solution, linear, arc, noise);
  });
  // Of the directions at the start nothing is known before; the rest of the prior is triangular. Rows that
  // gather_constants() has added stand below that triangle.
  const Eigen::Index directions = 2L * layout.gyros;
  const Eigen::Index rest = layout.size() - directions;
  const double log_prior_root = prior.block(directions, directions, rest, rest).diagonal().array().abs().log().sum();
  return log_prior_root - found.log_root_determinant - (found.residual_square + linear.cost_outside_rows) / 2;
}

}  // namespace trihedron::ground
