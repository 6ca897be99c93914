#include "linear/householder.hpp"

#include "linear/householder_kernel.hpp"
#include "linear/vector_instructions.hpp"

namespace trihedron::ground {
namespace {

struct Rotations {
  decltype(&kernels::for_baseline::rotate_up) rotate_up;
  decltype(&kernels::for_baseline::rotate_rows_up) rotate_rows_up;
};

const Rotations& rotations() {
  static constexpr Rotations kBaseline{kernels::for_baseline::rotate_up, kernels::for_baseline::rotate_rows_up};
#ifdef TRIHEDRON_HAS_AVX2
  static constexpr Rotations kAvx2{kernels::for_avx2::rotate_up, kernels::for_avx2::rotate_rows_up};
  static const Rotations chosen = of_this_processor(kBaseline, kAvx2);
  return chosen;
#else
  return kBaseline;
#endif
}

}  // namespace

void rotate_up(double* a, long rows, long all_columns, long columns) {
  rotations().rotate_up(a, rows, all_columns, columns);
}

void rotate_rows_up(double* a, long rows, long all_columns, long columns) {
  rotations().rotate_rows_up(a, rows, all_columns, columns);
}

}  // namespace trihedron::ground
