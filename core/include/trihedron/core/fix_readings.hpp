#pragma once

#include <Eigen/Core>

#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// Readings of the gyros at the time of a fix, by one sample or by several.
struct FixReadings {
  Directions h_b;                   ///< unit, each in its case axes
  double noise_factor = 1;          ///< 1-sigma of h_b over that of a single reading
  GyroMask used{};                  ///< the readings of the others have no meaning
  Eigen::Vector3d rate_c{0, 0, 0};  ///< of the body relative to `in`, rad/s; zero where there is only one sample
};

/// A fix, and the gyros at its time.
struct ComparedFix {
  StarFix fix;
  FixReadings readings;
};

}  // namespace trihedron
