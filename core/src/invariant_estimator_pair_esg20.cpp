#include "invariant_estimator_impl.hpp"

namespace trihedron {
template class InvariantEstimator<Esg20, 2, kAllFurtherStates>;
}  // namespace trihedron
