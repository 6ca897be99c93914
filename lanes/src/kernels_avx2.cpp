#define TRIHEDRON_LANES_PROCESSOR avx2
#include "kernels_impl.hpp"
