#pragma once
/// What the simulator did to the telemetry on purpose.

#include "trihedron/core/time.hpp"

namespace trihedron::sim {

/// Kinds of missing or wrong telemetry; a scenario switches them on.
enum class Fault {
  kGyroGap,          ///< no sample of any gyro
  kReadoutDropout,   ///< the reading of one gyro is NaN
  kReadoutSpike,     ///< one direction cosine is far off
  kReadoutStuck,     ///< the reading of one gyro repeats the last one
  kFixOutage,        ///< no fix: an outage that the scenario names
  kFixDropout,       ///< no fix: at random
  kFixSunBlinded,    ///< no fix: the boresight too near to the Sun
  kFixEarthBlinded,  ///< no fix: the boresight too near to the Earth's limb
  kFixTooFast,       ///< no fix: the body turns too fast
  kFixOutlier,       ///< a fix that is far off
  kFixWrongSign,     ///< −q in place of q, which is the same attitude
};

/// One sample or fix that is missing or wrong.
struct Event {
  Time t{};
  Fault fault{};
  int gyro = -1;  ///< from 0; −1 where it concerns no single gyro
  int head = -1;  ///< of the star tracker, from 0; −1 where it concerns none
};

}  // namespace trihedron::sim
