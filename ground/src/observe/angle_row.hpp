#pragma once

#include "batch/pass_problem.hpp"

namespace trihedron::ground {

/// z1 of eq. (3) between samples of the first two gyros: cos θ of the momenta less that of the readings h_b (unit), and
/// its derivative by the states of the moment's arc, one row of PassLayout.
struct AngleRow {
  double z1 = 0;
  Eigen::RowVectorXd by_states;
  double noise_factor = 0;  ///< 1-sigma of z1 over that of a direction cosine of both together
};
[[nodiscard]] AngleRow angle_row(const PassLayout& layout, const PassSolution& solution,
                                 const PassProblem::Moment& moment, const GyroDirections& h_b);

}  // namespace trihedron::ground
