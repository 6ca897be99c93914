#pragma once

#include <optional>

#include "trihedron/ground/calibrate/calibrate.hpp"

namespace trihedron::ground {

/// As calibrate(), of the last of several passes; `known_before`: what was known before the first of them, by which
/// all of them together are judged.
[[nodiscard]] CalibrationRun calibrate_after(const Pass& as_given, const CalibrationOptions& options,
                                             const Progress& progress, std::optional<Calibration> known_before);

}  // namespace trihedron::ground
