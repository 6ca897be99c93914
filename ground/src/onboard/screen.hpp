#pragma once
/// What of a pass can be used, as the smallest cycle finds it.

#include <vector>

#include "onboard/screened_pass.hpp"
#include "trihedron/records/options.hpp"

namespace trihedron::ground {

/// What the smallest cycle makes of a pass, with values to start from.
struct Screened {
  ScreenedPass pass;
  std::vector<GyroCalibration> first;
};

/// Runs the pass through the smallest cycle that knows its prior. Throws SetupError.
[[nodiscard]] Screened screen(const Pass& pass, const CalibrationOptions& asked);

/// Options of the smallest cycle, no further states.
[[nodiscard]] CalibrationOptions without_further_states(CalibrationOptions options);

}  // namespace trihedron::ground
