#include "observe/angle_row.hpp"

#include <array>

namespace trihedron::ground {

AngleRow angle_row(const PassLayout& layout, const PassSolution& solution, const PassProblem::Moment& moment,
                   const GyroDirections& h_b) {
  const std::array<Eigen::Vector3d, 2> h_c = {seen_in_c(solution.gyros[0], h_b[0]),
                                              seen_in_c(solution.gyros[1], h_b[1])};
  const Eigen::Vector3d normal_in = moment.h_in[0].cross(moment.h_in[1]);
  const Eigen::Vector3d normal_c = h_c[0].cross(h_c[1]);
  AngleRow row;
  row.z1 = moment.h_in[0].dot(moment.h_in[1]) - h_c[0].dot(h_c[1]);
  row.by_states.setZero(layout.size());
  for (int k = 0; k < 2; ++k) {
    const auto index = static_cast<std::size_t>(k);
    const MomentumBy& by = moment.by[index];
    const double sign = k == 0 ? 1 : -1;
    const Eigen::RowVector3d by_phi = sign * normal_in.transpose();
    row.by_states.segment<2>(PassLayout::direction(k)) = by_phi * by.direction;
    row.by_states.segment(layout.drift(k), layout.drift_size) = by_phi * by.drift;
    row.by_states.segment<3>(layout.alignment(k)) = by_phi * by.alignment - sign * normal_c.transpose();
    if (layout.wandering_drift) {
      row.by_states.segment<3>(layout.wandering(k)) = by_phi * by.wandering;
    }
    if (layout.readout_bias) {
      const Eigen::Vector3d& other = h_c[1 - index];
      row.by_states.segment<3>(layout.bias(k)) =
          (other - h_c[index] * h_c[index].dot(other)).transpose() * solution.gyros[index].C_c_b;
    }
  }
  row.noise_factor = normal_c.norm();
  return row;
}

}  // namespace trihedron::ground
