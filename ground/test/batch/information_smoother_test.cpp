#include "batch/information_smoother.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kDynamic = 2;
constexpr Index kConstants = 3;
constexpr Index kStates = kDynamic + kConstants;

/// Some linear system, with and without process noise in its two moving states.
struct System {
  MatrixXd prior = MatrixXd::Identity(kStates, kStates);
  VectorXd prior_y = VectorXd::Zero(kStates);
  std::vector<SmootherStage> stages;

  System(int size, double first_noise, double second_noise) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    const auto draw = [&](Index rows, Index cols) {
      return MatrixXd(MatrixXd::NullaryExpr(rows, cols, [&] { return normal(random); }));
    };
    prior_y = draw(kStates, 1);
    for (int i = 0; i < size; ++i) {
      SmootherStage stage;
      stage.H = draw(i == 1 ? 0 : 3, kStates);  // one stage without measurements
      stage.y = draw(stage.H.rows(), 1);
      stage.A_inverse = (MatrixXd::Identity(kDynamic, kDynamic) + 0.2 * draw(kDynamic, kDynamic)).inverse();
      stage.B = draw(kDynamic, kConstants);
      stage.m = draw(kDynamic, 1);
      stage.noise = Eigen::Vector2d(first_noise, second_noise);
      stages.push_back(stage);
    }
  }
};

/// The same estimates from one dense problem in the first d, all w, and c.
struct Dense {
  std::vector<VectorXd> x;
  std::vector<MatrixXd> covariance;
  double residual_square = 0;
  double log_root_determinant = 0;

  explicit Dense(const System& system) {
    const auto size = static_cast<Index>(system.stages.size());
    const Index unknowns = kDynamic * size + kConstants;
    // State of each stage: by · unknowns + offset.
    std::vector<MatrixXd> by(system.stages.size(), MatrixXd::Zero(kStates, unknowns));
    std::vector<VectorXd> offset(system.stages.size(), VectorXd::Zero(kStates));
    MatrixXd rows = MatrixXd::Zero(0, unknowns);
    VectorXd right(0);
    const auto add = [&](const MatrixXd& H, const VectorXd& y) {
      rows.conservativeResize(rows.rows() + H.rows(), unknowns);
      rows.bottomRows(H.rows()) = H;
      right.conservativeResize(right.size() + y.size());
      right.tail(y.size()) = y;
    };
    for (std::size_t i = 0; i < system.stages.size(); ++i) {
      by[i].bottomRightCorner(kConstants, kConstants).setIdentity();
      const Index column = kDynamic * static_cast<Index>(i);
      if (i == 0) {
        by[i].topLeftCorner(kDynamic, kDynamic).setIdentity();
        add(system.prior * by[i], system.prior_y);
      } else {
        const SmootherStage& before = system.stages[i - 1];
        const MatrixXd A = before.A_inverse.inverse();
        by[i].topRows(kDynamic) = A * by[i - 1].topRows(kDynamic) + before.B * by[i - 1].bottomRows(kConstants);
        by[i].block(0, column, kDynamic, kDynamic) = before.noise.asDiagonal();
        offset[i].head(kDynamic) = A * offset[i - 1].head(kDynamic) + before.m;
        MatrixXd white = MatrixXd::Zero(kDynamic, unknowns);
        white.middleCols(column, kDynamic).setIdentity();
        add(white, VectorXd::Zero(kDynamic));
      }
      const SmootherStage& stage = system.stages[i];
      add(stage.H * by[i], stage.y - stage.H * offset[i]);
    }
    const MatrixXd information = rows.transpose() * rows;
    const Eigen::LLT<MatrixXd> root(information);
    const VectorXd solution = root.solve(rows.transpose() * right);
    const MatrixXd inverse = information.inverse();
    residual_square = (right - rows * solution).squaredNorm();
    log_root_determinant = root.matrixLLT().diagonal().array().log().sum();
    for (std::size_t i = 0; i < system.stages.size(); ++i) {
      x.emplace_back(by[i] * solution + offset[i]);
      covariance.emplace_back(by[i] * inverse * by[i].transpose());
    }
  }
};

void expect_equal(const System& system) {
  const SmootherResult result = smooth(system.prior, system.prior_y, system.stages);
  const Dense dense(system);
  const CovarianceRoots roots(result, system.stages);
  const SmootherLikelihood alone =
      likelihood(system.prior, system.prior_y, system.stages.size(), [&](std::size_t i) { return system.stages[i]; });
  ASSERT_EQ(result.x.size(), dense.x.size());
  for (std::size_t i = 0; i < dense.x.size(); ++i) {
    EXPECT_LT((result.x[i] - dense.x[i]).norm(), 1e-11 * (1 + dense.x[i].norm())) << i;
    const Eigen::Index states = dense.x[i].size();
    const MatrixXd root = roots.spread(i, MatrixXd::Identity(states, states));
    EXPECT_LT((root * root.transpose() - dense.covariance[i]).norm(), 1e-11) << i;
  }
  for (const SmootherLikelihood& found : {result.likelihood, alone}) {
    EXPECT_NEAR(found.residual_square, dense.residual_square, 1e-10);
    EXPECT_NEAR(found.log_root_determinant, dense.log_root_determinant, 1e-11);
  }
}

TEST(InformationSmoother, IsTheDenseSolution) {
  expect_equal(System(1, 0.5, 0.3));
  expect_equal(System(7, 0.5, 0.3));
}

TEST(InformationSmoother, WithoutProcessNoiseIsLeastSquares) {
  expect_equal(System(7, 0, 0));
  expect_equal(System(7, 0.5, 0));
}

/// To the rounding of some hundred operations on numbers about 1.
void expect_same(const SmootherResult& found, const SmootherResult& expected) {
  for (std::size_t i = 0; i < expected.x.size(); ++i) {
    EXPECT_LT((expected.x[i] - found.x[i]).norm(), 1e-12) << i;
  }
  EXPECT_NEAR(found.likelihood.residual_square, expected.likelihood.residual_square, 1e-12);
  EXPECT_NEAR(found.likelihood.log_root_determinant, expected.likelihood.log_root_determinant, 1e-12);
}

TEST(InformationSmoother, IsTheSameWithTheConstantsGathered) {
  System system(7, 0.5, 0.3);
  const SmootherResult apart = smooth(system.prior, system.prior_y, system.stages);
  gather_constants(system.prior, system.prior_y, system.stages);
  for (const SmootherStage& stage : system.stages) {
    EXPECT_LE(stage.H.rows(), kDynamic);
  }
  const SmootherResult gathered = smooth(system.prior, system.prior_y, system.stages);
  expect_same(gathered, apart);
}

TEST(InformationSmoother, IsTheSameWithTheConstantsAtTheEndOfAPart) {
  System system(7, 0.5, 0.3);
  const SmootherResult apart = smooth(system.prior, system.prior_y, system.stages);
  ConstantSquares constants(kConstants + 1);
  for (std::size_t i = 0; i < system.stages.size(); ++i) {
    take_constants(system.stages[i], kDynamic, constants);
    if (i == 3 || i == 6) {
      put_back(constants, kDynamic, system.stages[i]);
    }
  }
  const SmootherResult at_ends = smooth(system.prior, system.prior_y, system.stages);
  expect_same(at_ends, apart);
}

TEST(InformationSmoother, EliminatesWhatMovesAsTheTriangleDoes) {
  const System system(7, 0.5, 0.3);
  const ConstantsInformation found = eliminate_moving(system.prior, system.prior_y, system.stages.size(),
                                                      [&](std::size_t i) { return system.stages[i]; });
  const MatrixXd triangle =
      triangles_after(system.prior, system.prior_y, system.stages, {system.stages.size() - 1}).front();
  const auto own = triangle.bottomRightCorner(kConstants + 1, kConstants + 1);
  const MatrixXd squares = found.squares.selfadjointView<Eigen::Lower>();
  EXPECT_LT((squares - own.transpose() * own).norm(), 1e-12 * squares.norm());
  EXPECT_NEAR(
      found.log_root_determinant + own.diagonal().head(kConstants).array().abs().log().sum(),
      likelihood(system.prior, system.prior_y, system.stages.size(), [&](std::size_t i) { return system.stages[i]; })
          .log_root_determinant,
      1e-12);
}

/// Columns of sizes as far apart as coefficients and angles are, and more of them than the buffer has rows.
TEST(InformationSmoother, RootsOfSquaresAreTheTriangleOfTheRows) {
  const VectorXd size = Eigen::Vector4d(1e11, 1, 1e6, 1e-3);
  const MatrixXd rows = MatrixXd::Random(700, 4) * size.asDiagonal();
  ConstantSquares constants(4);
  constants.add(rows.topRows(600));
  constants.add(rows.bottomRows(100));
  const MatrixXd root = lower_root(constants.take()).transpose();
  const MatrixXd triangle = triangle_of(rows);
  EXPECT_LT(((root.cwiseAbs() - triangle.cwiseAbs()) * size.cwiseInverse().asDiagonal()).norm(), 1e-12 * 700);
  EXPECT_EQ(constants.take(), MatrixXd::Zero(4, 4));
}

/// Of a combination of which 1e-10 of what is known of each column is known, four digits are left.
TEST(InformationSmoother, RootsOfSquaresKnowWhatIsKnownOfDifferences) {
  MatrixXd rows = MatrixXd::Random(700, 3);
  rows.col(2) = rows.col(1) + 1e-5 * rows.col(2);
  ConstantSquares constants(3);
  constants.add(rows);
  const MatrixXd root = lower_root(constants.take());
  const MatrixXd triangle = triangle_of(rows);
  EXPECT_NEAR(root(2, 2), std::abs(triangle(2, 2)), 1e-4 * std::abs(triangle(2, 2)));
}

TEST(InformationSmoother, RootsOfSquaresAreThereWhereNothingIsKnown) {
  MatrixXd rows = MatrixXd::Random(5, 4);
  rows.col(1) = rows.col(0);  // a combination that nothing is known of
  rows.col(3).setZero();
  const MatrixXd root = lower_root(rows.transpose() * rows);
  EXPECT_LT((root * root.transpose() - rows.transpose() * rows).norm(), 1e-13);
  EXPECT_LT(std::abs(root(1, 1)), 1e-6);
  EXPECT_EQ(root.row(3).norm(), 0);
  rows(2, 2) = std::nan("");
  EXPECT_TRUE(lower_root(rows.transpose() * rows).hasNaN());
}

TEST(InformationSmoother, KnowsTheInformationOnConstantsAtEachStage) {
  System system(7, 0.5, 0.3);
  system.prior.rightCols(kConstants).setZero();
  const std::vector<std::size_t> after = {0, 3, 6};
  const std::vector<MatrixXd> roots = information_on_constants(system.prior, system.stages, after);
  ASSERT_EQ(roots.size(), after.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    System until = system;
    until.stages.resize(after[i] + 1);
    const MatrixXd covariance = Dense(until).covariance.back().bottomRightCorner(kConstants, kConstants);
    const MatrixXd information = roots[i].transpose() * roots[i];
    EXPECT_LT((information * covariance - MatrixXd::Identity(kConstants, kConstants)).norm(), 1e-9);
  }
}

TEST(InformationSmoother, RefusesWhatNothingIsKnownOf) {
  System system(3, 0.5, 0.3);
  system.prior.col(4).setZero();
  system.prior.row(4).setZero();
  for (SmootherStage& stage : system.stages) {
    stage.H.col(4).setZero();
    stage.B.col(2).setZero();
  }
  EXPECT_THROW((void)smooth(system.prior, system.prior_y, system.stages), SetupError);
  system.prior.leftCols(kDynamic).setZero();
  for (SmootherStage& stage : system.stages) {
    stage.H.leftCols(kDynamic).setZero();
  }
  EXPECT_THROW((void)eliminate_moving(system.prior, system.prior_y, system.stages.size(),
                                      [&](std::size_t i) { return system.stages[i]; }),
               SetupError);
}

}  // namespace
}  // namespace trihedron::ground
