// Compiled once for each instruction set, with TRIHEDRON_KERNEL the name of the function. Eigen goes into a namespace
// of that name: functions of one name compiled for different processors must not meet in a program, in which the linker
// keeps any of them.
#define Eigen TRIHEDRON_KERNEL
#include <Eigen/QR>

namespace trihedron::ground::kernels {

void TRIHEDRON_KERNEL(double* a, long rows, long all_columns, long columns) {
  using Eigen::MatrixXd;
  Eigen::Map<MatrixXd> all(a, rows, all_columns);
  Eigen::Ref<MatrixXd> left = all.leftCols(columns);
  const Eigen::HouseholderQR<Eigen::Ref<MatrixXd>> qr(left);
  if (columns < all_columns) {
    all.rightCols(all_columns - columns).applyOnTheLeft(qr.householderQ().adjoint());
  }
}

}  // namespace trihedron::ground::kernels
