#pragma once
/// Readings that are wrong for a moment.

#include <optional>
#include <vector>

#include "trihedron/core/per_gyro.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

struct WrongReadings {
  Bursts bursts;
  std::vector<GyroMask> gyros;  ///< those that are wrong in each sample
};

/// Readings by which the angle between two momenta leaves its course for four seconds at most and comes back: no motion
/// of the body and no drift does that. Of a pair of gyros nothing tells which one is wrong, and both count; of more,
/// the gyro whose angles to all others do. A single sample is left to whoever uses it, readings that repeat themselves
/// to the screening. Nothing where there are none, or of samples more than a second apart. Derived in
/// docs/mathematics.md, section 12.
[[nodiscard]] std::optional<WrongReadings> wrong_for_a_moment(const Pass& pass);

/// The pass without them; nothing where they are more than a twentieth of all samples: too many for accidents.
[[nodiscard]] std::optional<Pass> without(const WrongReadings& wrong, const Pass& pass);

}  // namespace trihedron::ground
