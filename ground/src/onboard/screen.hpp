#pragma once
/// Screening of a pass: its usable samples and fixes, by the on-board step with the smallest layout.

#include <optional>
#include <vector>

#include "onboard/screened_pass.hpp"
#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/ground/onboard/recorder.hpp"
#include "trihedron/records/options.hpp"

namespace trihedron::ground {

/// The on-board step after a pass, and what was recorded of it.
struct OnBoardRun {
  Pipeline pipeline;
  Recorder recorder;

  /// Whether the options and settings that decide() has made of those that it was flown with would fly the same.
  [[nodiscard]] bool is_of(const PassSettings& settings, const CalibrationOptions& options) const;
};

/// Samples and fixes that the on-board step accepted, and its estimates as starting values. Refers to the pass.
struct Screened {
  ScreenedPass pass;
  std::vector<GyroCalibration> first;
  std::optional<OnBoardRun> run;  ///< with a navigator; where it was to be kept
};

/// Runs the pass through the on-board step with the smallest layout that its prior allows. `keep_run`: where that
/// layout may be the one that is decided for. Throws SetupError.
[[nodiscard]] Screened screen(const Pass& pass, const CalibrationOptions& asked, bool keep_run = false);

/// Options of the smallest layout: eq. (1), no further states.
[[nodiscard]] CalibrationOptions without_further_states(CalibrationOptions options);

}  // namespace trihedron::ground
