// Another project's flight software: sets up the on-board step and feeds it one sample and one fix.
#include <trihedron/core/on_board.hpp>

int main() {
  using namespace trihedron;
  CalibrationSetup setup;
  setup.star_trackers[0].noise_rad.setConstant(1e-5);
  setup.readout_noise_rad[0] = setup.readout_noise_rad[1] = 1e-5;
  const PairOnBoard::Gyros prior;
  const int parameters = setup.layout.parameters();
  PairOnBoard on_board;
  if (on_board.set_up(setup, prior, 1e-6 * Eigen::MatrixXd::Identity(parameters, parameters), {})) {
    return 1;
  }
  GyroSample sample;
  sample.h_b[0] = Eigen::Vector3d::UnitX();
  sample.h_b[1] = Eigen::Vector3d::UnitY();
  on_board.on_gyro(sample);
  on_board.on_fix({sample.t, Eigen::Quaterniond::Identity()});
  return on_board.flush().fix.status == FixStatus::kStarted ? 0 : 2;
}
