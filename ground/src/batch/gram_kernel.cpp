// Compiled once for each instruction set, with TRIHEDRON_KERNEL the name of a namespace; as householder_kernel.cpp.
#include "batch/gram_kernel.hpp"

#define Eigen TRIHEDRON_KERNEL
#include <Eigen/Core>
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

}  // namespace trihedron::ground::kernels::TRIHEDRON_KERNEL
