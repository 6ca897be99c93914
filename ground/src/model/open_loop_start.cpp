#include "model/open_loop_start.hpp"

#include <utility>

#include "trihedron/core/measurement.hpp"

namespace trihedron::ground {

OpenLoopStart open_loop_start(const CalibrationSetup& setup, const Layout& layout, const Gyros& gyros,
                              Eigen::MatrixXd covariance) {
  OpenLoopStart start;
  start.layout = layout;
  start.covariance = std::move(covariance);
  start.readout_noise_rad = setup.readout_noise_rad;
  start.direction_random_walk_rad_sqrt_s = setup.direction_random_walk_rad_sqrt_s;
  start.wandering_drift = setup.wandering_drift;
  start.change = setup.change;
  for (int k = 0; k < layout.gyros; ++k) {
    if (layout.further.wandering_drift) {
      // What was estimated of it is part of the error of a loop that begins without it.
      start.covariance.block<3, 3>(layout.wandering(k), layout.wandering(k)) =
          setup.wandering_drift.sigma * setup.wandering_drift.sigma * Eigen::Matrix3d::Identity();
    }
    if (layout.further.coefficient_change) {
      const Eigen::VectorXd change = gyros[k].drift_rad_s.segment(layout.change_column(), Layout::kEq1);
      start.covariance.block(layout.change(k), layout.change(k), Layout::kEq1, Layout::kEq1) +=
          change * change.transpose();
    }
  }
  return start;
}

OpenLoopStart start_with_held_parameters(const CalibrationSetup& setup, const Gyros& gyros,
                                         const Eigen::MatrixXd& parameters, const Eigen::Matrix3d& C_in_c,
                                         const Eigen::Matrix3d& attitude_rad2) {
  const Layout& layout = setup.layout;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(layout.shared(), layout.shared());
  const auto known = static_cast<int>(parameters.rows());
  covariance.block(layout.drift(0), layout.drift(0), known, known) = parameters;
  for (int state = layout.drift(0) + known; state < layout.shared(); ++state) {
    const double sigma = prior_sigma_of_further_state(setup, state);
    covariance(state, state) = sigma * sigma;
  }
  // φ = C_in_c (δ + ε − h_c × C_c_b Δb), as the navigator has it.
  Eigen::MatrixXd follow = Eigen::MatrixXd::Identity(layout.shared(), layout.shared());
  Eigen::MatrixXd by_attitude = Eigen::MatrixXd::Zero(layout.shared(), 3);
  for (int k = 0; k < layout.gyros; ++k) {
    auto phi = follow.middleRows<3>(layout.direction(k));
    phi.setZero();
    phi.middleCols<3>(layout.alignment(k)) = C_in_c;
    const Eigen::Vector3d h_b = gyros[k].reading_of(C_in_c.transpose() * gyros[k].h_in);
    phi.middleCols(layout.readout(k), layout.readout_size()) =
        -by_readout_errors(layout, C_in_c * skew<double>(gyros[k].in_c(h_b)), gyros[k], h_b);
    by_attitude.middleRows<3>(layout.direction(k)) = C_in_c;
  }
  covariance = follow * covariance * follow.transpose() + by_attitude * attitude_rad2 * by_attitude.transpose();
  return open_loop_start(setup, layout, gyros, std::move(covariance));
}

}  // namespace trihedron::ground
