#pragma once
/// A gyro that was started anew within the pass.

#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Throws SetupError, with what to do, where the momentum of one gyro has another direction from one fix to the next,
/// by more than a degree and more than drift makes of the time between them, and keeps it for an hour or to the end of
/// the pass, while that of another stays and the angle between the two has changed: its coefficients are others as
/// well. Each pair of gyros is looked at that has readings. `pass`: with its stamps corrected.
void refuse_restarted_gyro(const Pass& pass);

}  // namespace trihedron::ground
