#include "kernels.hpp"

namespace trihedron::lanes {

const Kernels& kernels() {
#ifdef __x86_64__
  if (static_cast<int>(__builtin_cpu_supports("avx512f")) != 0 &&
      static_cast<int>(__builtin_cpu_supports("avx512dq")) != 0 &&
      static_cast<int>(__builtin_cpu_supports("avx512vl")) != 0) {
    return avx512::kKernels;
  }
  if (static_cast<int>(__builtin_cpu_supports("avx2")) != 0) {
    return avx2::kKernels;
  }
#endif
  return any_processor::kKernels;
}

}  // namespace trihedron::lanes
