#pragma once
/// The products of gram.hpp as compiled for each instruction set; matrices column by column, but rows that are few and
/// long.

namespace trihedron::ground::kernels {

namespace for_baseline {
void add_gram(const double* a, long rows, long columns, double weight, double* gram);
void solve_lower(const double* L, long rows, double* a, long columns);
bool to_root(double* a, long rows);
void to_axes(double* a, long rows, double* values);
void multiply(const double* a, long rows, long inner, const double* b, long columns, double* product);
void subtract_product(const double* a, long rows, long inner, const double* b, long columns, double* from, long stride);
}  // namespace for_baseline

namespace for_avx2 {
void add_gram(const double* a, long rows, long columns, double weight, double* gram);
void solve_lower(const double* L, long rows, double* a, long columns);
bool to_root(double* a, long rows);
void to_axes(double* a, long rows, double* values);
void multiply(const double* a, long rows, long inner, const double* b, long columns, double* product);
void subtract_product(const double* a, long rows, long inner, const double* b, long columns, double* from, long stride);
}  // namespace for_avx2

}  // namespace trihedron::ground::kernels
