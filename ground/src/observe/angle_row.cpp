#include "observe/angle_row.hpp"

namespace trihedron::ground {

AngleRow angle_row(const PassProblem& problem, const PassProblem::Moment& moment, const Directions& h_b) {
  const Layout& layout = problem.setup().on_board.layout;
  const auto& gyros = moment.gyros;
  const Directions h_c = in_c(gyros, 2, h_b);
  const Eigen::Vector3d normal_in = gyros[0].h_in.cross(gyros[1].h_in);
  const Eigen::Vector3d normal_c = h_c[0].cross(h_c[1]);
  PassProblem::Rows row = PassProblem::Rows::Zero(1, layout.size());
  for (int k = 0; k < 2; ++k) {
    const double sign = k == 0 ? 1 : -1;
    row.middleCols<3>(layout.direction(k)) = sign * normal_in.transpose();
    row.middleCols<3>(layout.alignment(k)) = -sign * normal_c.transpose();
    const Eigen::Vector3d& other = h_c[1 - k];
    const Eigen::RowVector3d by_reading = (other - h_c[k] * h_c[k].dot(other)).transpose();
    row.middleCols(layout.readout(k), layout.readout_size()) = by_readout_errors(layout, by_reading, gyros[k], h_b[k]);
  }
  return {gyros[0].h_in.dot(gyros[1].h_in) - h_c[0].dot(h_c[1]), problem.by_states_of_arc(moment, row),
          normal_c.norm()};
}

}  // namespace trihedron::ground
