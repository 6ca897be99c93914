#pragma once
/// Screening of a pass: its usable samples and fixes, by the on-board step with the smallest layout.

#include <vector>

#include "onboard/screened_pass.hpp"
#include "trihedron/records/options.hpp"

namespace trihedron::ground {

/// Samples and fixes that the on-board step accepted, and its estimates as starting values. Refers to the pass.
struct Screened {
  ScreenedPass pass;
  std::vector<GyroCalibration> first;
};

/// Runs the pass through the on-board step with the smallest layout that its prior allows. Throws SetupError.
[[nodiscard]] Screened screen(const Pass& pass, const CalibrationOptions& asked);

/// Options of the smallest layout: eq. (1), no further states.
[[nodiscard]] CalibrationOptions without_further_states(CalibrationOptions options);

}  // namespace trihedron::ground
