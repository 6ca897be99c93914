// Compiled once for each instruction set, with TRIHEDRON_KERNEL the name of a namespace. Eigen goes into one of that
// name too: functions of one name compiled for different processors must not meet in a program, in which the linker
// keeps any of them.
#include "linear/householder_kernel.hpp"

#include <cmath>

#define Eigen TRIHEDRON_KERNEL
#include <Eigen/QR>
#undef Eigen

namespace trihedron::ground::kernels::TRIHEDRON_KERNEL {

namespace eigen = ::TRIHEDRON_KERNEL;

void rotate_up(double* a, long rows, long all_columns, long columns) {
  eigen::Map<eigen::MatrixXd> all(a, rows, all_columns);
  eigen::Ref<eigen::MatrixXd> left = all.leftCols(columns);
  const eigen::HouseholderQR<eigen::Ref<eigen::MatrixXd>> qr(left);
  if (columns < all_columns) {
    all.rightCols(all_columns - columns).applyOnTheLeft(qr.householderQ().adjoint());
  }
}

void rotate_rows_up(double* a, long rows, long all_columns, long columns) {
  using Columns = eigen::Map<eigen::RowVectorXd>;
  const long reflections = columns < rows - 1 ? columns : rows - 1;
  // Vectors of the reflections, in the columns that they empty, and 2 / vᵀ v.
  eigen::MatrixXd v = eigen::MatrixXd::Zero(rows, reflections);
  eigen::VectorXd factor = eigen::VectorXd::Zero(reflections);
  eigen::RowVectorXd sum(kColumnsTogether);
  const auto reflect = [&](long j, long first, long count) {
    if (factor(j) == 0) {
      return;
    }
    Columns its(sum.data(), count);
    its.setZero();
    for (long row = j; row < rows; ++row) {
      if (v(row, j) != 0) {
        its += v(row, j) * Columns(a + row * all_columns + first, count);
      }
    }
    its *= factor(j);
    for (long row = j; row < rows; ++row) {
      if (v(row, j) != 0) {
        Columns(a + row * all_columns + first, count) -= v(row, j) * its;
      }
    }
  };
  const auto for_each_block = [](long first, long end, const auto& use) {
    for (; first < end; first += kColumnsTogether) {
      use(first, end - first < kColumnsTogether ? end - first : kColumnsTogether);
    }
  };
  for (long j = 0; j < reflections; ++j) {
    double below = 0;
    for (long row = j + 1; row < rows; ++row) {
      v(row, j) = a[row * all_columns + j];
      below += v(row, j) * v(row, j);
    }
    if (below > 0) {
      const double top = a[j * all_columns + j];
      const double length = std::sqrt(top * top + below);
      v(j, j) = top + (top < 0 ? -length : length);
      factor(j) = 2 / (v(j, j) * v(j, j) + below);
      for_each_block(j, columns, [&](long first, long count) { reflect(j, first, count); });
      for (long row = j + 1; row < rows; ++row) {
        a[row * all_columns + j] = 0;
      }
    }
  }
  // Block by block, so that all reflections find it near.
  for_each_block(columns, all_columns, [&](long first, long count) {
    for (long j = 0; j < reflections; ++j) {
      reflect(j, first, count);
    }
  });
}

}  // namespace trihedron::ground::kernels::TRIHEDRON_KERNEL
