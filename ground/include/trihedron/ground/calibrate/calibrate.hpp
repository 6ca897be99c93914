#pragma once
/// Calibration and navigation of a pass.

#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/progress.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Estimates drift coefficients and alignments of all gyros from a pass, decides what the options leave open (drift
/// model, further states, noise), and judges the result (docs/mathematics.md, sections 8, 9 and 12). `progress` is
/// called with the part that is done. Throws SetupError where options and pass contradict each other.
[[nodiscard]] CalibrationRun calibrate(const Pass& pass, const CalibrationOptions& options,
                                       const Progress& progress = {});

/// Attitude in the c frame against `in` at each gyro sample, by the navigator, corrected as `options.corrections` says,
/// while the calibration goes on from the prior of the pass. Throws as calibrate().
[[nodiscard]] NavigationRun navigate(const Pass& pass, const CalibrationOptions& options,
                                     const Progress& progress = {});

}  // namespace trihedron::ground
