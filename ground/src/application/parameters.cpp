#include "trihedron/ground/application/parameters.hpp"

#include <fmt/format.h>

#include "choose/decide.hpp"
#include "model/prior.hpp"
#include "model/setup.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

/// Eq. (1) without further states where the options leave it open. Throws SetupError where they ask for more.
CalibrationOptions options_on_board(CalibrationOptions options) {
  if (options.estimator != Estimator::kInvariant) {
    throw SetupError("the on-board application has estimator invariant", "leave out the other one");
  }
  options.drift_model = options.drift_model.value_or(kEsg7);
  if (options.drift_model != kEsg7) {
    throw SetupError("the on-board application has eq. (1) alone", "use drift model esg7 or auto");
  }
  for (const FurtherStateRow& row : kFurtherStates) {
    if (options.further_states.is_on(row.state)) {
      throw SetupError(fmt::format("the on-board application does not estimate {}", row.key), "set it to off or auto");
    }
    options.further_states[row.state] = FurtherStateOptions::Choice::kOff;
  }
  if (options.student_t_freedom != 0) {
    throw SetupError("the on-board application knows no Student's t", "set student_t_freedom to 0");
  }
  return options;
}

void refuse_what_has_no_room(const PassSettings& settings) {
  if (settings.gyros.size() > TRIHEDRON_MAX_GYROS) {
    throw SetupError(
        fmt::format("the pass has {} gyros; the on-board application takes two or three", settings.gyros.size()),
        "give telemetry of a pair or of three");
  }
  for (std::size_t k = 0; settings.prior && k < settings.prior->gyros.size(); ++k) {
    if (!settings.prior->gyros[k].readout_bias.isZero(0)) {
      throw SetupError("the prior has a bias of the readouts, which the on-board application has not",
                       "use an earlier calibration with readout_bias off");
    }
    if (settings.prior->gyros[k].orbital_drift || settings.prior->gyros[k].polhode) {
      throw SetupError("the prior has drift that comes back, which the on-board application has not",
                       "use an earlier calibration with orbital_drift and polhode off");
    }
  }
}

}  // namespace

Required Required::usual() {
  const Parameters usual = TRIHEDRON_PARAMETERS_DEFAULT;
  return {usual.required_error_rad, Duration(usual.required_interval_ns), Duration(usual.window_ns),
          static_cast<int>(usual.spread_over)};
}

Parameters parameters_of(const PassSettings& settings, const CalibrationOptions& options, const Required& required) {
  refuse_what_has_no_room(settings);
  PassSettings first_head = settings;
  first_head.further_star_trackers.clear();
  const CalibrationOptions settled = settled_before(first_head, options_on_board(options));
  const CalibrationSetup setup = setup_of(first_head, settled);
  const Prior prior = prior_of(first_head, setup.layout);

  Parameters table = TRIHEDRON_PARAMETERS_DEFAULT;
  table.gyros = static_cast<std::uint32_t>(setup.layout.gyros);
  table.gyro_period_ns = setup.gyro_period.count();
  table.correction_interval_ns = policy_of(settled.corrections).interval.count();
  table.angles_after_ns = setup.angles_after.count();
  table.required_error_rad = required.error_rad;
  table.required_interval_ns = required.interval.count();
  table.window_ns = required.window.count();
  table.spread_over = static_cast<std::uint32_t>(required.spread_over);
  Eigen::Map<Eigen::Vector3d>(table.star_tracker_noise_rad) = setup.star_trackers[0].noise_rad;
  table.direction_random_walk_rad_sqrt_s = setup.direction_random_walk_rad_sqrt_s;
  table.gate_nis = setup.gate_nis;
  table.reopen_after_rejections = static_cast<std::uint32_t>(setup.reopen_after_rejections);
  table.reopen_after_jump_rejections = static_cast<std::uint32_t>(setup.reopen_after_jump_rejections);
  table.restart_within_fixes = static_cast<std::uint32_t>(setup.restart_within_fixes);
  for (int k = 0; k < setup.layout.gyros; ++k) {
    const auto i = static_cast<std::size_t>(k);
    table.readout_noise_rad[k] = setup.readout_noise_rad[k];
    Eigen::Map<Eigen::Matrix<double, Layout::kEq1, 1>>(table.drift_rad_s[k]) = prior.gyros[k].drift_rad_s;
    // Not by way of its rotation matrix, which would cost the last digit.
    Eigen::Map<Eigen::Vector3d>(table.alignment_rad[k]) = settings.prior
                                                              ? settings.prior->gyros[i].alignment_rotation_vector_rad
                                                              : settings.gyros[i].alignment_rotation_vector_rad;
  }
  double* element = table.covariance;
  for (Eigen::Index row = 0; row < prior.covariance.rows(); ++row) {
    for (Eigen::Index column = 0; column <= row; ++column) {
      *element++ = prior.covariance(row, column);
    }
  }
  return table;
}

}  // namespace trihedron::ground
