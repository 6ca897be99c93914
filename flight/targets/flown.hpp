#pragma once
/// What is flown away from the desktop: the only place that names it. All else here knows on_gyro(), on_fix(),
/// carry_on(), flush(), navigation_attitude() and estimator() alone.

#include "trihedron/core/on_board.hpp"

namespace trihedron::targets {

using Flown = PairOnBoard;

}  // namespace trihedron::targets
