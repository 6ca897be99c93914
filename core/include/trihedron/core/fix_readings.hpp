#pragma once

#include <Eigen/Core>

#include "trihedron/core/jitter.hpp"
#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// Readings of the gyros at the time of a fix, by one sample or by several.
struct FixReadings {
  Directions h_b;                   ///< unit, each in its case axes
  double noise_factor = 1;          ///< 1-sigma of h_b over that of a single reading
  GyroMask used{};                  ///< the readings of the others have no meaning
  float jitter_rad2 = 0;            ///< mean square about each axis of motion that h_b does not follow
  Eigen::Vector3d rate_c{0, 0, 0};  ///< of the body relative to `in`, rad/s; zero where there is only one sample
};

/// Readings by the samples around a time, and what the body does beside them.
struct FittedReadings : FixReadings {
  UnfollowedMotion unfollowed;  ///< nothing is known of it where there is only one sample
};

/// A fix, and the gyros at its time.
struct ComparedFix {
  StarFix fix;
  FixReadings readings;
};

}  // namespace trihedron
