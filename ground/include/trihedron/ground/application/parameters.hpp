#pragma once
/// What the on-board application is loaded with for a pass.

#include "trihedron/core/tables.hpp"
#include "trihedron/core/time.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// What the application is to achieve, and how; the defaults are those of the table of parameters.
struct Required {
  double error_rad = 0;  ///< of the attitude, 99.7 %
  Duration interval{};   ///< without the star tracker
  Duration window{};     ///< of the forecast: an orbit
  int spread_over = 0;   ///< samples over which the work of a fix is spread; 0: at once

  [[nodiscard]] static Required usual();
};

/// The table of parameters that settings and options ask for: two or three gyros with eq. (1), the first star tracker.
/// Nothing in it depends on the telemetry. Throws SetupError for what the table has no room for.
[[nodiscard]] Parameters parameters_of(const PassSettings& settings, const CalibrationOptions& options,
                                       const Required& required);

}  // namespace trihedron::ground
