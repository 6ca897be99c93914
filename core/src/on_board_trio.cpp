#include "on_board_impl.hpp"

namespace trihedron {
template class OnBoard<InvariantEstimator<kTrioCapacity>>;
}  // namespace trihedron
