#include "batch/householder.hpp"

namespace trihedron::ground {
namespace kernels {

void rotate_up_baseline(double* a, long rows, long all_columns, long columns);
void rotate_up_avx2(double* a, long rows, long all_columns, long columns);

}  // namespace kernels

void rotate_up(double* a, long rows, long all_columns, long columns) {
#ifdef TRIHEDRON_HAS_AVX2
  static const bool has_avx2 =
      static_cast<int>(__builtin_cpu_supports("avx2")) != 0 && static_cast<int>(__builtin_cpu_supports("fma")) != 0;
  if (has_avx2) {
    kernels::rotate_up_avx2(a, rows, all_columns, columns);
    return;
  }
#endif
  kernels::rotate_up_baseline(a, rows, all_columns, columns);
}

}  // namespace trihedron::ground
