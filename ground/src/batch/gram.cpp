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

Eigen::MatrixXd square(const Eigen::MatrixXd& a) {
  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(a.rows(), a.rows());
  add_gram(a, 1, square);
  return square.selfadjointView<Eigen::Lower>();
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

bool to_root(Eigen::MatrixXd& a) {
#ifdef TRIHEDRON_HAS_AVX2
  if (has_avx2()) {
    return kernels::gram_avx2::to_root(a.data(), a.rows());
  }
#endif
  return kernels::gram_baseline::to_root(a.data(), a.rows());
}

Eigen::VectorXd to_axes(Eigen::MatrixXd& a) {
  Eigen::VectorXd values(a.rows());
#ifdef TRIHEDRON_HAS_AVX2
  if (has_avx2()) {
    kernels::gram_avx2::to_axes(a.data(), a.rows(), values.data());
    return values;
  }
#endif
  kernels::gram_baseline::to_axes(a.data(), a.rows(), values.data());
  return values;
}

Eigen::MatrixXd multiply(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd product(a.rows(), b.cols());
#ifdef TRIHEDRON_HAS_AVX2
  if (has_avx2()) {
    kernels::gram_avx2::multiply(a.data(), a.rows(), a.cols(), b.data(), b.cols(), product.data());
    return product;
  }
#endif
  kernels::gram_baseline::multiply(a.data(), a.rows(), a.cols(), b.data(), b.cols(), product.data());
  return product;
}

void subtract_product(const Eigen::MatrixXd& a, const LongRows& b, double* from, Eigen::Index stride) {
#ifdef TRIHEDRON_HAS_AVX2
  if (has_avx2()) {
    kernels::gram_avx2::subtract_product(a.data(), a.rows(), a.cols(), b.data(), b.cols(), from, stride);
    return;
  }
#endif
  kernels::gram_baseline::subtract_product(a.data(), a.rows(), a.cols(), b.data(), b.cols(), from, stride);
}

}  // namespace trihedron::ground
