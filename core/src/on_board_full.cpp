#include "on_board_impl.hpp"

namespace trihedron {
template class OnBoard<InvariantEstimator<kFullCapacity>>;
}  // namespace trihedron
