// An on-board step with room for two gyros with eq. (1), a clock offset, and two star trackers.
#include "own_capacity.hpp"

#include <trihedron/core/impl/invariant_estimator_impl.hpp>
#include <trihedron/core/impl/on_board_impl.hpp>

template class trihedron::InvariantEstimator<kOwnCapacity>;
template class trihedron::OnBoard<trihedron::InvariantEstimator<kOwnCapacity>>;
