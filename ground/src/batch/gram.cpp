#include "batch/gram.hpp"

#include "batch/gram_kernel.hpp"

namespace trihedron::ground {
namespace {

#ifdef TRIHEDRON_HAS_AVX2
bool has_avx2() {
  static const bool found =
      static_cast<int>(__builtin_cpu_supports("avx2")) != 0 && static_cast<int>(__builtin_cpu_supports("fma")) != 0;
  return found;
}
#endif

}  // namespace

void add_gram(const Eigen::MatrixXd& a, double weight, Eigen::MatrixXd& gram) {
#ifdef TRIHEDRON_HAS_AVX2
  if (has_avx2()) {
    kernels::gram_avx2::add_gram(a.data(), a.rows(), a.cols(), weight, gram.data());
    return;
  }
#endif
  kernels::gram_baseline::add_gram(a.data(), a.rows(), a.cols(), weight, gram.data());
}

void solve_lower(const Eigen::MatrixXd& L, Eigen::MatrixXd& a) {
#ifdef TRIHEDRON_HAS_AVX2
  if (has_avx2()) {
    kernels::gram_avx2::solve_lower(L.data(), L.rows(), a.data(), a.cols());
    return;
  }
#endif
  kernels::gram_baseline::solve_lower(L.data(), L.rows(), a.data(), a.cols());
}

}  // namespace trihedron::ground
