#include "trihedron/core/cholesky.hpp"

#include <Eigen/Cholesky>

namespace trihedron {

bool factorize(Eigen::Ref<Eigen::MatrixXd> a) {
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(a);
  a.triangularView<Eigen::StrictlyUpper>().setZero();
  return factor.info() == Eigen::Success;
}

void solve_lower(const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Ref<Eigen::MatrixXd> b) {
  b = L.triangularView<Eigen::Lower>().solve(b);
}

void solve_factorized(const Eigen::Ref<const Eigen::MatrixXd>& L, Eigen::Ref<Eigen::MatrixXd> b) {
  b = L.triangularView<Eigen::Lower>().solve(b);
  b = L.transpose().triangularView<Eigen::Upper>().solve(b);
}

}  // namespace trihedron
