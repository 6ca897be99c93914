#include "trihedron/core/square_root_information.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace trihedron {
namespace {

constexpr int kStates = 7;
constexpr int kDynamic = 3;
using Filter = SquareRootInformation<kStates, kDynamic>;
using Matrix = Filter::Matrix;

template <int R, int K>
Eigen::Matrix<double, R, K> random_matrix(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Eigen::Matrix<double, R, K>::NullaryExpr([&] { return uniform(random); });
}

/// The textbook Kalman filter with a full covariance, beside the filter under test.
struct Dense {
  Matrix P = Matrix::Zero();

  void propagate(const Filter::DynamicMatrix& A, const Filter::DynamicByConstants& B,
                 const Filter::DynamicVector& noise) {
    Matrix F = Matrix::Identity();
    F.topLeftCorner<kDynamic, kDynamic>() = A;
    F.topRightCorner<kDynamic, kStates - kDynamic>() = B;
    P = F * P * F.transpose();
    P.topLeftCorner<kDynamic, kDynamic>() += noise.cwiseAbs2().asDiagonal();
  }
  Filter::Vector update(const Eigen::Matrix<double, 2, kStates>& H, const Eigen::Vector2d& y) {
    const Eigen::Matrix2d S = H * P * H.transpose() + Eigen::Matrix2d::Identity();
    const Eigen::Matrix<double, kStates, 2> K = P * H.transpose() * S.inverse();
    const Filter::Vector x = K * y;
    P = (Matrix::Identity() - K * H) * P;
    return x;
  }
};

Matrix covariance(const Filter& filter) { return filter.inverse_root() * filter.inverse_root().transpose(); }

TEST(SquareRootInformation, AgreesWithTheTextbookFilterOverManySteps) {
  std::mt19937 random(1);
  Filter filter;
  filter.add_prior_of_constants(Eigen::Matrix4d::Identity() * 0.5);
  const Eigen::Matrix<double, kDynamic, kStates> all = Eigen::Matrix<double, kDynamic, kStates>::Identity();
  static_cast<void>(filter.update<kDynamic>(all, Eigen::Vector3d::Zero()));
  Dense dense;
  dense.P.diagonal() << 1, 1, 1, 4, 4, 4, 4;
  EXPECT_LT((covariance(filter) - dense.P).norm(), 1e-14);
  for (int step = 0; step < 200; ++step) {
    const Filter::DynamicMatrix A = Filter::DynamicMatrix::Identity() + 0.1 * random_matrix<kDynamic, kDynamic>(random);
    const Filter::DynamicByConstants B = random_matrix<kDynamic, kStates - kDynamic>(random);
    // Without process noise at every other step: a zero noise must not divide by anything.
    const Filter::DynamicVector noise = (step % 2) * 0.1 * random_matrix<kDynamic, 1>(random).cwiseAbs();
    filter.propagate(A.inverse(), B, noise);
    dense.propagate(A, B, noise);
    ASSERT_LT((covariance(filter) - dense.P).norm(), 1e-10 * dense.P.norm()) << step;
    const Eigen::Matrix<double, 2, kStates> H = random_matrix<2, kStates>(random);
    const Eigen::Matrix<double, 2, kStates> through = filter.through_uncertainty<2>(H);
    ASSERT_LT((through * through.transpose() - H * dense.P * H.transpose()).norm(), 1e-10 * dense.P.norm());
    const Eigen::Vector2d y = random_matrix<2, 1>(random);
    ASSERT_LT((filter.update<2>(H, y) - dense.update(H, y)).norm(), 1e-9) << step;
    ASSERT_LT((covariance(filter) - dense.P).norm(), 1e-10 * dense.P.norm()) << step;
  }
}

TEST(SquareRootInformation, UnobservedDirectionStaysUnobservedThroughManySteps) {
  std::mt19937 random(2);
  Filter filter;  // no prior at all
  Filter::Vector null = random_matrix<kStates, 1>(random).normalized();
  double scale = 0;
  for (int step = 0; step < 10'000; ++step) {
    // Measurements that do not see `null`, then dynamics that carry it along.
    Eigen::Matrix<double, 2, kStates> H = random_matrix<2, kStates>(random);
    H -= H * null * null.transpose() / null.squaredNorm();
    static_cast<void>(filter.update<2>(H, Eigen::Vector2d::Zero()));
    if (step > kStates) {
      const Filter::DynamicByConstants B = 0.01 * random_matrix<kDynamic, kStates - kDynamic>(random);
      filter.propagate(Filter::DynamicMatrix::Identity(), B, Filter::DynamicVector::Zero());
      null.head<kDynamic>() += B * null.tail<kStates - kDynamic>();
    }
    scale = filter.root().norm();
  }
  // 10⁴ orthogonal steps, each with its rounding: far below one rounding per step in sum.
  EXPECT_LT((filter.root() * null).norm(), 1e-13 * scale * null.norm());
}

TEST(SquareRootInformation, IsRegularOnlyOnceEveryStateIsKnown) {
  Filter filter;
  EXPECT_FALSE(filter.regular());
  filter.add_prior_of_constants(Eigen::Matrix4d::Identity());
  EXPECT_FALSE(filter.regular());
  static_cast<void>(
      filter.update<kDynamic>(Eigen::Matrix<double, kDynamic, kStates>::Identity(), Eigen::Vector3d::Zero()));
  EXPECT_TRUE(filter.regular());
}

TEST(SquareRootInformation, SurvivesFirstFixesThatBreakAFullCovariance) {
  // Direction and alignment fully correlated, leverage of 1e7: a full covariance turns indefinite, this one cannot.
  SquareRootInformation<2, 1> filter;
  filter.add_prior_of_constants(Eigen::Matrix<double, 1, 1>(1e-4));
  for (int step = 0; step < 1000; ++step) {
    Eigen::Matrix<double, 1, 2, Eigen::RowMajor> H(1e8, -1e8 * (1 + 1e-9 * step));
    const Eigen::Vector2d x = filter.update<1>(H, Eigen::Matrix<double, 1, 1>(0.5));
    ASSERT_TRUE(x.allFinite());
    const Eigen::Matrix2d root = filter.inverse_root();
    ASSERT_TRUE(root.allFinite());
    ASSERT_GT((root * root.transpose()).diagonal().minCoeff(), 0);
  }
}

}  // namespace
}  // namespace trihedron
