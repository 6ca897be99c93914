#pragma once
/// From settings and options to what an estimator is set up with: the same for the on-board step and the batch.

#include <vector>

#include "model/gyro.hpp"
#include "trihedron/core/measurement.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/core/step_report.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/parameter_id.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// The layout for decided options and the gyros and star trackers of a spacecraft. Throws SetupError where the options
/// leave something open, or the estimator cannot have it.
[[nodiscard]] Layout layout_of(const PassSettings& settings, const CalibrationOptions& options);

/// Noise, priors of the further states, gates; the layout is layout_of().
[[nodiscard]] CalibrationSetup setup_of(const PassSettings& settings, const CalibrationOptions& options);

/// The rate of the orbit before the pass tells it: that of an earlier calibration, else that of a low orbit.
[[nodiscard]] double first_orbital_rate_rad_s(const PassSettings& settings);

[[nodiscard]] CorrectionPolicy policy_of(const CorrectionOptions& options);

/// The components of the further states that a layout has and calibration.json lists, in its order.
[[nodiscard]] std::vector<ParameterId> further_parameters(const Layout& layout);
/// Position in the layout and value of a component of a further state, which the layout must have.
[[nodiscard]] int state_of(const Layout& layout, const ParameterId& parameter);
[[nodiscard]] double value_of(const Layout& layout, const Gyros& gyros, const SharedStates& shared,
                              const ParameterId& parameter);

}  // namespace trihedron::ground
