#include "invariant_estimator_impl.hpp"
#include "trihedron/core/cycle.hpp"

namespace trihedron {
template class InvariantEstimator<Esg20, 2, kAllFurtherStates>;
template class Cycle<InvariantEstimator<Esg20, 2, kAllFurtherStates>>;
}  // namespace trihedron
