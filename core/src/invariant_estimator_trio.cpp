#include "invariant_estimator_impl.hpp"

namespace trihedron {
template class InvariantEstimator<kTrioCapacity>;
}  // namespace trihedron
