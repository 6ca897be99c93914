#pragma once
/// How far the clocks of a pass are apart, and the telemetry with its stamps corrected.

#include <cmath>
#include <optional>
#include <vector>

#include "trihedron/core/per_gyro.hpp"
#include "trihedron/records/clock_correction.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron {

/// A number with its 1-sigma.
struct Measured {
  double value = 0;
  double sigma = 0;

  [[nodiscard]] bool is_sure(double sigmas) const { return std::abs(value) > sigmas * sigma; }
};

/// A clock that is off by more over a part of the pass than over the rest, which holds the end of the pass.
struct ClockStep {
  int gyro = -1;  ///< whose stamps are later; −1: fixes were taken later after their stamps
  Time from{};    ///< fixes with stamps from here on …
  Time until{};   ///< … and before
  Measured change_s;
};

/// What a pass shows of its clocks, before any calibration. Of a clock that steps that of the rest of the pass.
struct Clocks {
  Measured offset_s;  ///< of the star trackers, at the epoch; as in ClockCorrection
  Measured rate_s_s;
  Measured mid_offset_s;              ///< in the middle of the pass, where it is best known
  PerGyro<Measured> late_s{};         ///< against the reference, in the middle of the pass
  PerGyro<Measured> late_rate_s_s{};  ///< by which that grows
  int reference = 0;                  ///< index of the gyro whose clock the others are compared with
  std::optional<ClockStep> step{};
  /// mid_offset_s of each less that of the first; zeros where the pass does not show it, empty where nobody looked.
  std::vector<Measured> further_star_trackers_s{};
};

/// Gives fixes the stamps that they should have, and readings those of the first gyro that is not late: what the others
/// read then is interpolated between neighbouring samples, and missing where one of these is.
void correct(Pass& pass, const ClockCorrection& correction);

/// The same of a part of the pass; a fix that then does not follow the one before it is left out.
void correct(Pass& pass, const ClockStep& step);

}  // namespace trihedron
