#include "linear/gram.hpp"

#include "linear/gram_kernel.hpp"
#include "linear/vector_instructions.hpp"

namespace trihedron::ground {
namespace {

using Eigen::MatrixXd;

struct GramKernels {
  decltype(&kernels::for_baseline::add_gram) add_gram;
  decltype(&kernels::for_baseline::solve_lower) solve_lower;
  decltype(&kernels::for_baseline::to_root) to_root;
  decltype(&kernels::for_baseline::to_axes) to_axes;
  decltype(&kernels::for_baseline::multiply) multiply;
  decltype(&kernels::for_baseline::subtract_product) subtract_product;
};

const GramKernels& gram_kernels() {
  static constexpr GramKernels kBaseline{kernels::for_baseline::add_gram, kernels::for_baseline::solve_lower,
                                         kernels::for_baseline::to_root,  kernels::for_baseline::to_axes,
                                         kernels::for_baseline::multiply, kernels::for_baseline::subtract_product};
#ifdef TRIHEDRON_HAS_AVX2
  static constexpr GramKernels kAvx2{kernels::for_avx2::add_gram, kernels::for_avx2::solve_lower,
                                     kernels::for_avx2::to_root,  kernels::for_avx2::to_axes,
                                     kernels::for_avx2::multiply, kernels::for_avx2::subtract_product};
  static const GramKernels chosen = of_this_processor(kBaseline, kAvx2);
  return chosen;
#else
  return kBaseline;
#endif
}

}  // namespace

void add_gram(const MatrixXd& a, double weight, MatrixXd& gram) {
  gram_kernels().add_gram(a.data(), a.rows(), a.cols(), weight, gram.data());
}

MatrixXd square(const MatrixXd& a) {
  MatrixXd square = MatrixXd::Zero(a.rows(), a.rows());
  add_gram(a, 1, square);
  return square.selfadjointView<Eigen::Lower>();
}

void solve_lower(const MatrixXd& L, MatrixXd& a) { gram_kernels().solve_lower(L.data(), L.rows(), a.data(), a.cols()); }

bool to_root(MatrixXd& a) { return gram_kernels().to_root(a.data(), a.rows()); }

Eigen::VectorXd to_axes(MatrixXd& a) {
  Eigen::VectorXd values(a.rows());
  gram_kernels().to_axes(a.data(), a.rows(), values.data());
  return values;
}

MatrixXd multiply(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd product(a.rows(), b.cols());
  gram_kernels().multiply(a.data(), a.rows(), a.cols(), b.data(), b.cols(), product.data());
  return product;
}

void subtract_product(const MatrixXd& a, const LongRows& b, double* from, Eigen::Index stride) {
  gram_kernels().subtract_product(a.data(), a.rows(), a.cols(), b.data(), b.cols(), from, stride);
}

}  // namespace trihedron::ground
