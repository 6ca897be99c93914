#define TRIHEDRON_LANES_PROCESSOR avx512
#include "kernels_impl.hpp"
