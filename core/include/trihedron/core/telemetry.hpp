#pragma once
/// What enters the on-board step: raw telemetry, in time order.

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron {

/// A direction or quaternion whose length differs from 1 by more than this is rejected. Readout noise moves a norm by a
/// tenth of it at most.
inline constexpr double kNormTolerance = 1e-3;

/// Direction cosines of the momenta, each in its own case axes; as telemetered, not normalised.
struct GyroSample {
  Time t{};
  Directions h_b;
};

/// Star-tracker fix q_in_c, Hamilton; as telemetered, of either sign.
struct StarFix {
  Time t{};
  Eigen::Quaterniond q_in_c = Eigen::Quaterniond::Identity();  ///< of a further head: by its mounting as designed
  int head = 0;                                                ///< which star tracker; the axes of the first are c
};

/// Whether the length is within kNormTolerance of one; false for NaN.
[[nodiscard]] inline bool nearly_unit(double norm) { return norm >= 1 - kNormTolerance && norm <= 1 + kNormTolerance; }

}  // namespace trihedron
