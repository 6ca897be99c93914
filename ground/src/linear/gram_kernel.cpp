// Compiled once for each instruction set, with TRIHEDRON_KERNEL the name of a namespace; as householder_kernel.cpp.
#include "linear/gram_kernel.hpp"

#define Eigen TRIHEDRON_KERNEL
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#undef Eigen

namespace trihedron::ground::kernels::TRIHEDRON_KERNEL {

namespace eigen = ::TRIHEDRON_KERNEL;

void add_gram(const double* a, long rows, long columns, double weight, double* gram) {
  const eigen::Map<const eigen::MatrixXd> its(a, rows, columns);
  eigen::Map<eigen::MatrixXd>(gram, rows, rows).selfadjointView<eigen::Lower>().rankUpdate(its, weight);
}

void solve_lower(const double* L, long rows, double* a, long columns) {
  const eigen::Map<const eigen::MatrixXd> root(L, rows, rows);
  eigen::Map<eigen::MatrixXd> its(a, rows, columns);
  root.triangularView<eigen::Lower>().solveInPlace(its);
}

bool to_root(double* a, long rows) {
  eigen::Map<eigen::MatrixXd> its(a, rows, rows);
  eigen::Ref<eigen::MatrixXd> in_place = its;
  return eigen::LLT<eigen::Ref<eigen::MatrixXd>>(in_place).info() == eigen::Success;
}

void to_axes(double* a, long rows, double* values) {
  eigen::Map<eigen::MatrixXd> its(a, rows, rows);
  const eigen::SelfAdjointEigenSolver<eigen::MatrixXd> found(its);
  its = found.eigenvectors();
  eigen::Map<eigen::VectorXd>(values, rows) = found.eigenvalues();
}

void multiply(const double* a, long rows, long inner, const double* b, long columns, double* product) {
  eigen::Map<eigen::MatrixXd>(product, rows, columns).noalias() =
      eigen::Map<const eigen::MatrixXd>(a, rows, inner) * eigen::Map<const eigen::MatrixXd>(b, inner, columns);
}

void subtract_product(const double* a, long rows, long inner, const double* b, long columns, double* from,
                      long stride) {
  for (long i = 0; i < rows; ++i) {
    eigen::Map<eigen::RowVectorXd> its(from + i * stride, columns);
    for (long j = 0; j < inner; ++j) {
      its -= a[i + j * rows] * eigen::Map<const eigen::RowVectorXd>(b + j * columns, columns);
    }
  }
}

}  // namespace trihedron::ground::kernels::TRIHEDRON_KERNEL
