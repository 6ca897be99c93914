#pragma once
/// The large products of the drift field by the vector instructions of the processor that runs, as householder.hpp has
/// the triangles.

#include <Eigen/Core>

namespace trihedron::ground {

/// Adds weight · a aᵀ to the lower triangle of `gram`; what is above it is left as it is. gram: of the rows of a.
void add_gram(const Eigen::MatrixXd& a, double weight, Eigen::MatrixXd& gram);

/// a becomes L⁻¹ a; only the lower triangle of L is used.
void solve_lower(const Eigen::MatrixXd& L, Eigen::MatrixXd& a);

}  // namespace trihedron::ground
