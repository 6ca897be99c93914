#pragma once
/// How far the clocks of a pass are apart, and the telemetry with its stamps corrected.

#include <cmath>

#include "trihedron/core/per_gyro.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron {

/// A fix stamped t holds the attitude at t + offset + rate (t − epoch); a reading of gyro k stamped t holds the
/// direction at t − late[k].
struct ClockCorrection {
  double offset_s = 0;
  double rate_s_s = 0;
  PerGyro<double> late_s{};

  [[nodiscard]] bool of_star_tracker() const { return offset_s != 0 || rate_s_s != 0; }
  [[nodiscard]] bool of_gyros() const;
  /// The stamps that the fixes should have, `since_epoch_s` those that they have.
  [[nodiscard]] double true_s(double since_epoch_s) const { return since_epoch_s * (1 + rate_s_s) + offset_s; }
};

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
