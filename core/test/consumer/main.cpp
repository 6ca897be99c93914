// Another project's flight software: sets up the cycle and feeds it one sample and one fix.
#include <trihedron/core/cycles.hpp>
#include <trihedron/core/paper_estimator.hpp>

int main() {
  using namespace trihedron;
  using OnBoard = Cycle<PaperEstimator<Esg7>>;
  OnBoard::Setup setup;
  setup.prior_covariance.diagonal().setConstant(1e-6);
  setup.star_tracker_noise_rad.setConstant(1e-5);
  for (double& noise : setup.readout_noise_rad) {
    noise = 1e-5;
  }
  auto cycle = OnBoard::create(setup, {});
  if (!cycle) {
    return 1;
  }
  OnBoard on_board = cycle.value();
  GyroSample<2> sample;
  sample.h_b[0] = Eigen::Vector3d::UnitX();
  sample.h_b[1] = Eigen::Vector3d::UnitY();
  on_board.on_gyro(sample);
  return on_board.on_fix({sample.t, Eigen::Quaterniond::Identity()}).fix.status == FixStatus::kStarted ? 0 : 2;
}
