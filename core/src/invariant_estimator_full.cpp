#include "invariant_estimator_impl.hpp"

namespace trihedron {
template class InvariantEstimator<kFullCapacity>;
}  // namespace trihedron
