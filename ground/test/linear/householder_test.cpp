#include "linear/householder.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <string>

namespace trihedron::ground {
namespace {

using Eigen::MatrixXd;

struct Shape {
  int rows;
  int all_columns;
  int columns;
};

class RotateUp : public testing::TestWithParam<Shape> {};

TEST_P(RotateUp, LeavesATriangleAndTheSameNormalEquations) {
  const Shape shape = GetParam();
  const MatrixXd before = MatrixXd::Random(shape.rows, shape.all_columns);
  MatrixXd after = before;
  rotate_up(after.data(), after.rows(), after.cols(), shape.columns);
  for (int column = 0; column < shape.columns; ++column) {  // what is below has no meaning
    after.col(column).tail(shape.rows - std::min(column + 1, shape.rows)).setZero();
  }
  // A rotation changes no inner product of columns.
  EXPECT_LT((after.transpose() * after - before.transpose() * before).cwiseAbs().maxCoeff(), 1e-12 * shape.rows);
}

TEST_P(RotateUp, AgreesWithTheQrDecompositionUpToSigns) {
  const Shape shape = GetParam();
  MatrixXd rows = MatrixXd::Random(shape.rows, shape.all_columns);
  const MatrixXd other = Eigen::HouseholderQR<MatrixXd>(rows.leftCols(shape.columns)).matrixQR();
  rotate_up(rows.data(), rows.rows(), rows.cols(), shape.columns);
  for (int row = 0; row < std::min(shape.rows, shape.columns); ++row) {
    for (int column = row; column < shape.columns; ++column) {
      EXPECT_NEAR(std::abs(rows(row, column)), std::abs(other(row, column)), 1e-12);
    }
  }
}

TEST_P(RotateUp, IsTheSameRowByRow) {
  const Shape shape = GetParam();
  const MatrixXd before = MatrixXd::Random(shape.rows, shape.all_columns);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> after = before;
  rotate_rows_up(after.data(), after.rows(), after.cols(), shape.columns);
  for (int column = 0; column < shape.columns; ++column) {
    EXPECT_TRUE((after.col(column).tail(shape.rows - std::min(column + 1, shape.rows)).array() == 0).all()) << column;
  }
  EXPECT_LT((after.transpose() * after - before.transpose() * before).cwiseAbs().maxCoeff(), 1e-12 * shape.rows);
}

/// Nothing to rotate: columns that are zero, and rows that are.
TEST(RotateRowsUp, LeavesZerosAsTheyAre) {
  Eigen::Matrix<double, 4, 5, Eigen::RowMajor> rows = Eigen::Matrix<double, 4, 5, Eigen::RowMajor>::Zero();
  rows.row(1).tail(3) << 1, -2, 3;
  const auto before = rows;
  rotate_rows_up(rows.data(), rows.rows(), rows.cols(), 2);
  EXPECT_EQ(rows, before);
}

INSTANTIATE_TEST_SUITE_P(Of, RotateUp,
                         testing::Values(Shape{1, 1, 1}, Shape{3, 7, 5}, Shape{40, 12, 4}, Shape{12, 12, 12},
                                         Shape{200, 130, 130}, Shape{130, 200, 60}),
                         [](const auto& of) {
                           return std::to_string(of.param.rows) + "_by_" + std::to_string(of.param.all_columns) +
                                  "_about_" + std::to_string(of.param.columns);
                         });

}  // namespace
}  // namespace trihedron::ground
