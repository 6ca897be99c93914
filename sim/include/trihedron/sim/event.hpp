#pragma once
/// What the simulator did to the telemetry on purpose.

#include "trihedron/core/time.hpp"

namespace trihedron::sim {

enum class Fault {
  kGyroGap,
  kReadoutDropout,
  kReadoutSpike,
  kReadoutStuck,
  kFixOutage,
  kFixDropout,
  kFixSunBlinded,
  kFixEarthBlinded,
  kFixTooFast,
  kFixOutlier,
  kFixWrongSign,
};

/// One sample or fix that is missing or wrong.
struct Event {
  Time t{};
  Fault fault{};
  int gyro = -1;  ///< from 0; −1 where it concerns no single gyro
  int head = -1;  ///< of the star tracker, from 0; −1 where it concerns none
};

}  // namespace trihedron::sim
