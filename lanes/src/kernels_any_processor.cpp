#define TRIHEDRON_LANES_PROCESSOR any_processor
#include "kernels_impl.hpp"
