#pragma once
/// What enters the on-board step: raw telemetry, in time order.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

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

/// Covariance of the error e of a fix, c axes: as given = true · exp([e×]).
struct FixCovariance {
  std::array<double, 6> rad2{};  ///< xx, yy, zz, xy, xz, yz; all zero where the fix comes without one

  [[nodiscard]] bool is_told() const { return rad2[0] > 0; }
  [[nodiscard]] Eigen::Matrix3d matrix() const {
    Eigen::Matrix3d its;
    its << rad2[0], rad2[3], rad2[4], rad2[3], rad2[1], rad2[5], rad2[4], rad2[5], rad2[2];
    return its;
  }
};

/// Star-tracker fix q_in_c, Hamilton; as telemetered, of either sign.
struct StarFix {
  Time t{};
  Eigen::Quaterniond q_in_c = Eigen::Quaterniond::Identity();  ///< of a further head: by its mounting as designed
  int head = 0;                                                ///< which star tracker; the axes of the first are c
  FixCovariance covariance{};                                  ///< positive definite; not told: noise of the set-up
};

/// Whether the length is within kNormTolerance of one; false for NaN.
[[nodiscard]] inline bool nearly_unit(double norm) { return norm >= 1 - kNormTolerance && norm <= 1 + kNormTolerance; }

}  // namespace trihedron
