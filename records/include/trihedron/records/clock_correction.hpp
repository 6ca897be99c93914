#pragma once
/// By how much the stamps of telemetry are off.

#include "trihedron/core/per_gyro.hpp"

namespace trihedron {

/// A fix stamped t gives the attitude at t + offset + rate (t − epoch); a reading of gyro k stamped t gives the
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

}  // namespace trihedron
