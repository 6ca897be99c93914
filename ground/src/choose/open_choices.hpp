#pragma once
/// What is settled before a pass is looked at.

#include "trihedron/records/options.hpp"

namespace trihedron::ground {

/// Estimator paper has nothing to choose; the change of the coefficients is searched for by a whole pass only.
void settle_by_estimator(CalibrationOptions& asked);

/// There are no usable fixes to decide by: what is open is off.
void leave_out_what_is_open(CalibrationOptions& options);

}  // namespace trihedron::ground
