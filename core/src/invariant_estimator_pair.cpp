#include "invariant_estimator_impl.hpp"
#include "trihedron/core/cycle.hpp"

namespace trihedron {
template class InvariantEstimator<Esg7, 2>;
template class Cycle<InvariantEstimator<Esg7, 2>>;
}  // namespace trihedron
