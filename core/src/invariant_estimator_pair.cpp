#include "invariant_estimator_impl.hpp"

namespace trihedron {
template class InvariantEstimator<kPairCapacity>;
}  // namespace trihedron
