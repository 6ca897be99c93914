#pragma once
/// The rotations of householder.hpp as compiled for each instruction set.

namespace trihedron::ground::kernels {

inline constexpr long kColumnsTogether = 64;

namespace for_baseline {
void rotate_up(double* a, long rows, long all_columns, long columns);
void rotate_rows_up(double* a, long rows, long all_columns, long columns);
}  // namespace for_baseline

namespace for_avx2 {
void rotate_up(double* a, long rows, long all_columns, long columns);
void rotate_rows_up(double* a, long rows, long all_columns, long columns);
}  // namespace for_avx2

}  // namespace trihedron::ground::kernels
