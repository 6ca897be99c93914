#include "trihedron/core/cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

namespace trihedron {
namespace {

Eigen::Matrix3d some_covariance() {
  const Eigen::Matrix3d root = (Eigen::Matrix3d() << 2, 0, 0, -1, 0.5, 0, 3, 1e-3, 4).finished();
  return root * root.transpose();
}

TEST(Cholesky, RootIsLowerTriangularAndMakesTheMatrix) {
  const Eigen::Matrix3d a = some_covariance();
  const Eigen::Matrix3d L = cholesky_root<3>(a);
  EXPECT_TRUE(L.isLowerTriangular(0));
  EXPECT_LT((L * L.transpose() - a).norm(), 1e-14 * a.norm());
}

TEST(Cholesky, SolvesAsTheInverseDoes) {
  const Eigen::Matrix3d a = some_covariance();
  const Eigen::Matrix3d L = cholesky_root<3>(a);
  const Eigen::Matrix<double, 3, 5> b = Eigen::Matrix<double, 3, 5>::Random();
  Eigen::Matrix<double, 3, 5> x = b;
  solve_lower(matrix_of(L), x);
  EXPECT_LT((L * x - b).norm(), 1e-13);
  x = b;
  solve_factorized(matrix_of(L), x);
  EXPECT_LT((x - a.inverse() * b).norm(), 1e-12 * x.norm());
  Eigen::Vector3d column = b.col(2);
  solve_factorized(matrix_of(L), column);
  EXPECT_LT((column - x.col(2)).norm(), 1e-14 * column.norm());
}

TEST(Cholesky, TellsWhatIsNotPositiveDefinite) {
  Eigen::Matrix3d a = some_covariance();
  EXPECT_TRUE(factorize(a));
  a = -some_covariance();
  EXPECT_FALSE(factorize(a));
  a.setZero();
  EXPECT_FALSE(factorize(a));
}

}  // namespace
}  // namespace trihedron
