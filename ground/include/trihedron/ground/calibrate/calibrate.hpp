#pragma once
/// Calibration and navigation of a pass.

#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/progress.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Calibrates. Throws SetupError.
[[nodiscard]] CalibrationRun calibrate(const Pass& pass, const CalibrationOptions& options,
                                       const Progress& progress = {});

/// Attitude by the navigator, corrected as `options.corrections` says, with the calibration running along from the
/// pass's prior. Throws SetupError.
[[nodiscard]] NavigationRun navigate(const Pass& pass, const CalibrationOptions& options,
                                     const Progress& progress = {});

}  // namespace trihedron::ground
