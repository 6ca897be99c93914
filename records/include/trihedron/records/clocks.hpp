#pragma once
/// How far the clocks of a pass are apart, and the telemetry with its stamps corrected.

#include <cmath>

#include "trihedron/core/per_gyro.hpp"
#include "trihedron/records/clock_correction.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron {

/// Gives fixes the stamps that they should have, and readings those of the first gyro that is not late: what the others
/// read then is interpolated between neighbouring samples, and missing where one of these is.
void correct(Pass& pass, const ClockCorrection& correction);

/// A number with its 1-sigma.
struct Measured {
  double value = 0;
  double sigma = 0;

  [[nodiscard]] bool is_sure(double sigmas) const { return std::abs(value) > sigmas * sigma; }
};

/// What a pass shows of its clocks, before any calibration.
struct Clocks {
  Measured offset_s;  ///< of the star trackers, at the epoch; as in ClockCorrection
  Measured rate_s_s;
  Measured mid_offset_s;       ///< in the middle of the pass, where it is best known
  PerGyro<Measured> late_s{};  ///< against the reference
  int reference = 0;           ///< index of the gyro whose clock the others are compared with
};

}  // namespace trihedron
