#pragma once

#include "batch/pass_problem.hpp"

namespace trihedron::ground {

/// z1 of eq. (3) between samples of the first two gyros: cos θ of the momenta less that of the readings h_b (unit), and
/// its derivative by the states of the moment's arc.
struct AngleRow {
  double z1 = 0;
  Eigen::RowVectorXd by_states;
  double noise_factor = 0;  ///< 1-sigma of z1 over the root sum square of the direction-cosine sigmas of the two gyros
};
[[nodiscard]] AngleRow angle_row(const PassProblem& problem, const PassProblem::Moment& moment, const Directions& h_b);

}  // namespace trihedron::ground
