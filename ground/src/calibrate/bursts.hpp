#pragma once
/// Readings that are wrong for a moment.

#include <optional>

#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

struct WithoutBursts {
  Pass pass;
  Bursts bursts;
};

/// The pass without readings by which the angle between two momenta leaves its course for four seconds at most and
/// comes back: no motion of the body and no drift does that. Of a pair of gyros nothing tells which one is wrong, and
/// the whole sample is left out; of more, the gyro whose angles to all others do. A single sample is left to whoever
/// uses it, readings that repeat themselves to the screening. Nothing where there are none, where they are more than a
/// twentieth of all (which is noise, or another fault), or of samples more than a second apart. Derived in
/// docs/mathematics.md, section 12.
[[nodiscard]] std::optional<WithoutBursts> without_bursts(const Pass& pass);

}  // namespace trihedron::ground
