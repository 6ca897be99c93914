#include "application_impl.hpp"

namespace trihedron {
template class Application<InvariantEstimator<kTrioCapacity>>;
}  // namespace trihedron
