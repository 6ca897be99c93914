#pragma once
/// What the angle between two momenta says of drift that wanders.

#include <optional>

#include "trihedron/records/calibration.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// The gyros alone read the angle between their momenta: neither the fixes nor the attitude have a part in it. Drift of
/// two gyros that wanders moves it as it moves the momenta; an error of the star tracker that wanders, and that a
/// calibration takes for such drift, leaves it as it is.
struct WanderByAngle {
  /// The largest part of the process noise of the calibration, as a variance, for which the drift of the gyros is taken
  /// to be quiet: a third of what wanders.
  static constexpr double kQuiet = 0.1;

  double part = 0;  ///< of that noise which makes the angle likeliest; over 1 where drift wanders otherwise than told
  double log_odds = 0;      ///< ln of the largest likelihood up to kQuiet, less that of the largest beyond it
  double seen_rad = 0;      ///< root mean square of what constants leave of the angle
  double expected_rad = 0;  ///< the same, by the noise of the calibration
};

/// By the first two gyros. Their angle is fitted by drift of esg20 and alignments, any values of them, so that it does
/// not matter what the star tracker has made of those of the calibration. Nothing where there are not two gyros, no
/// noise was found, or the pass is too short for a fit to leave anything.
[[nodiscard]] std::optional<WanderByAngle> wander_by_angle(const GyroTelemetry& telemetry,
                                                           const Calibration& calibration);

}  // namespace trihedron::ground
