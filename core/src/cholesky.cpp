#include "trihedron/core/cholesky.hpp"

#include <Eigen/Cholesky>

namespace trihedron {

bool factorize(Eigen::Ref<Eigen::MatrixXd> a) {
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(a);
  a.triangularView<Eigen::StrictlyUpper>().setZero();
  return factor.info() == Eigen::Success;
}

void solve_lower(const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Ref<Eigen::MatrixXd> b) {
  L.triangularView<Eigen::Lower>().solveInPlace(b);
}

void solve_factorized(const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Ref<Eigen::MatrixXd> b) {
  solve_lower(L, b);
  L.transpose().triangularView<Eigen::Upper>().solveInPlace(b);
}

}  // namespace trihedron
