#pragma once
/// Which of the functions compiled for different processors are taken.

namespace trihedron::ground {

/// The first are for what all processors of a kind have; the others there are for x86-64 alone.
template <class Functions>
[[nodiscard]] Functions of_this_processor(const Functions& baseline, [[maybe_unused]] const Functions& avx2) {
#ifdef TRIHEDRON_HAS_AVX2
  if (static_cast<int>(__builtin_cpu_supports("avx2")) != 0 && static_cast<int>(__builtin_cpu_supports("fma")) != 0) {
    return avx2;
  }
#endif
  return baseline;
}

}  // namespace trihedron::ground
