// Another project's flight software: sets up the on-board step and feeds it one sample and one fix, with the objects of
// the library and with one of its own.
#include <trihedron/core/on_board.hpp>

#include "own_capacity.hpp"

using namespace trihedron;

template <class Step>
bool starts(const Layout& layout) {
  CalibrationSetup setup;
  setup.layout = layout;
  for (StarTrackerSetup& star_tracker : setup.star_trackers) {
    star_tracker.noise_rad = {1.45e-5, 1.45e-5, 9.7e-5};  // about the axes of c
  }
  for (int k = 0; k < layout.gyros; ++k) {
    setup.readout_noise_rad[k] = 9.7e-6;
  }
  const typename Step::Gyros prior;  // no drift, case axes along c
  const int parameters = layout.parameters();
  static Step on_board;
  if (on_board.set_up(setup, prior, 1e-6 * Eigen::MatrixXd::Identity(parameters, parameters), {})) {
    return false;
  }
  GyroSample sample;
  sample.h_b[0] = Eigen::Vector3d::UnitX();
  sample.h_b[1] = Eigen::Vector3d::UnitY();
  on_board.on_gyro(sample);
  on_board.on_fix({sample.t, Eigen::Quaterniond::Identity()});
  return on_board.flush().fix.status == FixStatus::kStarted && on_board.navigation_attitude();
}

int main() { return starts<PairOnBoard>({}) && starts<OwnOnBoard>(kOwnLayout) ? 0 : 1; }
