#include "batch/householder.hpp"

#include "batch/householder_kernel.hpp"

namespace trihedron::ground {
namespace {

#ifdef TRIHEDRON_HAS_AVX2
bool rotates_by_avx2() {
  static const bool found =
      static_cast<int>(__builtin_cpu_supports("avx2")) != 0 && static_cast<int>(__builtin_cpu_supports("fma")) != 0;
  return found;
}
#endif

}  // namespace

void rotate_up(double* a, long rows, long all_columns, long columns) {
#ifdef TRIHEDRON_HAS_AVX2
  if (rotates_by_avx2()) {
    kernels::householder_avx2::rotate_up(a, rows, all_columns, columns);
    return;
  }
#endif
  kernels::householder_baseline::rotate_up(a, rows, all_columns, columns);
}

void rotate_rows_up(double* a, long rows, long all_columns, long columns) {
#ifdef TRIHEDRON_HAS_AVX2
  if (rotates_by_avx2()) {
    kernels::householder_avx2::rotate_rows_up(a, rows, all_columns, columns);
    return;
  }
#endif
  kernels::householder_baseline::rotate_rows_up(a, rows, all_columns, columns);
}

}  // namespace trihedron::ground
