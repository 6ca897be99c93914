#pragma once
/// Large products and their roots by the vector instructions of the processor that runs, as householder.hpp has
/// the triangles.

#include <Eigen/Core>

namespace trihedron::ground {

/// Adds weight · a aᵀ to the lower triangle of `gram`; what is above it is left as it is. gram: of the rows of a.
void add_gram(const Eigen::MatrixXd& a, double weight, Eigen::MatrixXd& gram);

/// a aᵀ.
[[nodiscard]] Eigen::MatrixXd square(const Eigen::MatrixXd& a);

/// a becomes L⁻¹ a; only the lower triangle of L is used.
void solve_lower(const Eigen::MatrixXd& L, Eigen::MatrixXd& a);

/// The lower triangle of a becomes that of L, a = L Lᵀ; what is above it is left as it is. Returns whether a is
/// positive definite; where it is not, the triangle is left without meaning.
[[nodiscard]] bool to_root(Eigen::MatrixXd& a);

/// A symmetric matrix becomes its axes, a column for each; returns their eigenvalues, increasing. Only the lower
/// triangle is used.
[[nodiscard]] Eigen::VectorXd to_axes(Eigen::MatrixXd& a);

/// a b.
[[nodiscard]] Eigen::MatrixXd multiply(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Few and long.
using LongRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Subtracts a b from rows that begin `stride` apart, as many as a has and as long as those of b.
void subtract_product(const Eigen::MatrixXd& a, const LongRows& b, double* from, Eigen::Index stride);

}  // namespace trihedron::ground
