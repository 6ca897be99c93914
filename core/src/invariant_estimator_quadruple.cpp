#include "invariant_estimator_impl.hpp"

namespace trihedron {
template class InvariantEstimator<Esg7, 4>;
}  // namespace trihedron
