#include "application_flight.hpp"

namespace trihedron::test {

Parameters nominal_parameters(int gyros) {
  const Layout layout{.gyros = gyros};
  const CalibrationSetup setup = nominal_setup(layout);
  const Eigen::MatrixXd covariance = nominal_covariance(layout);
  Parameters table{};
  table.version = TRIHEDRON_TABLES_VERSION;
  table.gyros = static_cast<std::uint32_t>(gyros);
  table.gyro_period_ns = setup.gyro_period.count();
  table.angles_after_ns = setup.angles_after.count();
  table.required_error_rad = 300 * kArcsecond;
  table.required_interval_ns = Duration(std::chrono::minutes(20)).count();
  table.window_ns = Duration(std::chrono::minutes(20)).count();
  table.star_tracker_timeout_ns = Duration(std::chrono::minutes(1)).count();
  table.failed_after_ns = Duration(std::chrono::minutes(1)).count();
  table.gate_nis = setup.gate_nis;
  table.reopen_after_rejections = static_cast<std::uint32_t>(setup.reopen_after_rejections);
  table.reopen_after_jump_rejections = static_cast<std::uint32_t>(setup.reopen_after_jump_rejections);
  table.restart_within_fixes = static_cast<std::uint32_t>(setup.restart_within_fixes);
  table.aligned_after_fixes = 20;
  table.spread_over = 20;
  for (int k = 0; k < gyros; ++k) {
    table.readout_noise_rad[k] = setup.readout_noise_rad[k];
  }
  for (int i = 0; i < 3; ++i) {
    table.star_tracker_noise_rad[i] = Flight::kTracker_rad(i);
  }
  for (int i = 0; i < layout.parameters(); ++i) {
    table.covariance[covariance_index(i, i)] = covariance(i, i);
  }
  return table;
}

}  // namespace trihedron::test
