#pragma once
/// Errors of a star tracker before it loses the stars, or after it has found them again.

#include <optional>

#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Sides of an outage.
struct BesideOutages {
  bool before = true;
  bool after = true;
};

/// The pass without the fixes up to ten minutes from an outage of five minutes and more. Nothing where there are fewer
/// than three outages, more star trackers than one, or less than half of the fixes left.
[[nodiscard]] std::optional<Pass> without_fixes_beside_outages(const Pass& pass, BesideOutages sides = {});

/// What these fixes are off the definitive attitude of `run`, a calibration without them: of all outages alike, more
/// than chance and the uncertainty of the attitude make of it, and on one side far more than on the other. Drift
/// that the gyros have and their model has not would take the attitude away from both sides of an outage. How many are
/// to be left out is not counted.
[[nodiscard]] std::optional<ErrorsBesideOutages> errors_beside_outages(const Pass& pass, const CalibrationRun& run);

}  // namespace trihedron::ground
