#pragma once
/// The products of gram.hpp as compiled for each instruction set; matrices column by column.

namespace trihedron::ground::kernels {

namespace gram_baseline {
void add_gram(const double* a, long rows, long columns, double weight, double* gram);
void solve_lower(const double* L, long rows, double* a, long columns);
}  // namespace gram_baseline

namespace gram_avx2 {
void add_gram(const double* a, long rows, long columns, double weight, double* gram);
void solve_lower(const double* L, long rows, double* a, long columns);
}  // namespace gram_avx2

}  // namespace trihedron::ground::kernels
