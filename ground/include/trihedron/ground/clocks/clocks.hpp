#pragma once
/// How far the clocks of star tracker and gyros are apart, before any calibration (docs/mathematics.md, section 7).

#include <optional>

#include "trihedron/records/clocks.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// From the turns between fixes half a minute apart, compared with what the gyros saw of them: up to ten minutes of
/// offset are searched. Nothing where the pass does not show it: the body turns evenly, or the telemetry is too short.
/// The sigmas come from the scatter from stretch to stretch of the pass.
[[nodiscard]] std::optional<Clocks> clocks_of(const Pass& pass);

/// What is corrected before the calibration: an offset of the star tracker beyond what is estimated as a state, with
/// the rate of its clock where that is significant, and each gyro that is late.
[[nodiscard]] ClockCorrection correction_by(const Clocks& clocks, const PassSettings& settings);

}  // namespace trihedron::ground
