#include "trihedron/core/square_root_information.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstring>
#include <random>
#include <string>

namespace trihedron {
namespace {

constexpr int kStates = 7;
constexpr int kDynamic = 3;
/// There is room for more than what is in use: the work must not depend on it.
using Filter = SquareRootInformation<kStates + 5, kDynamic + 2>;
using Matrix = Eigen::MatrixXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Matrix random_matrix(int rows, int columns, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Matrix::NullaryExpr(rows, columns, [&] { return uniform(random); });
}

Filter empty() {
  Filter filter;
  filter.reset(kStates, kDynamic);
  return filter;
}

Matrix root(const Filter& filter) {
  Matrix R(filter.states(), filter.states());
  for (int i = 0; i < filter.states(); ++i) {
    for (int j = 0; j < filter.states(); ++j) {
      R(i, j) = filter.root()(i, j);
    }
  }
  return R;
}

template <class F>
RowMajor inverse_root(const F& filter) {
  RowMajor inverse(filter.states(), filter.states());
  filter.inverse_root(rows_of(inverse));
  return inverse;
}

template <class F>
Matrix covariance(const F& filter) {
  return inverse_root(filter) * inverse_root(filter).transpose();
}

template <class F>
void add_information(F& filter, RowMajor rows) {
  filter.add_information(rows_of(rows));
}

template <class F>
Eigen::VectorXd update(F& filter, const Matrix& H, const Eigen::VectorXd& y) {
  RowMajor rows(H.rows(), H.cols() + 1);
  rows << H, y;
  return filter.update(rows_of(rows));
}

/// The textbook Kalman filter with a full covariance, beside the filter under test.
struct Dense {
  Matrix P = Matrix::Zero(kStates, kStates);

  void propagate(const Matrix& A, const Matrix& B, const Eigen::VectorXd& noise) {
    Matrix F = Matrix::Identity(kStates, kStates);
    F.topLeftCorner(kDynamic, kDynamic) = A;
    F.topRightCorner(kDynamic, kStates - kDynamic) = B;
    P = F * P * F.transpose();
    P.topLeftCorner(kDynamic, kDynamic) += noise.cwiseAbs2().asDiagonal();
  }
  Eigen::VectorXd update(const Matrix& H, const Eigen::Vector2d& y) {
    const Eigen::Matrix2d S = H * P * H.transpose() + Eigen::Matrix2d::Identity();
    const Matrix K = P * H.transpose() * S.inverse();
    const Eigen::VectorXd x = K * y;
    P = ((Matrix::Identity(kStates, kStates) - K * H) * P).eval();
    return x;
  }
};

TEST(SquareRootInformation, AgreesWithTheTextbookFilterOverManySteps) {
  std::mt19937 random(1);
  Filter filter = empty();
  RowMajor prior = RowMajor::Identity(kStates, kStates);
  prior.diagonal().tail(kStates - kDynamic).setConstant(0.5);
  add_information(filter, prior);
  Dense dense;
  dense.P.diagonal() << 1, 1, 1, 4, 4, 4, 4;
  EXPECT_LT((covariance(filter) - dense.P).norm(), 1e-14);
  for (int step = 0; step < 200; ++step) {
    const Matrix A = Matrix::Identity(kDynamic, kDynamic) + 0.1 * random_matrix(kDynamic, kDynamic, random);
    const Matrix B = random_matrix(kDynamic, kStates - kDynamic, random);
    // Without process noise at every other step: a zero noise must not divide by anything.
    const Eigen::VectorXd noise = (step % 2) * 0.1 * random_matrix(kDynamic, 1, random).cwiseAbs();
    filter.propagate(A.inverse(), B, noise);
    dense.propagate(A, B, noise);
    ASSERT_LT((covariance(filter) - dense.P).norm(), 1e-10 * dense.P.norm()) << step;
    const Matrix H = random_matrix(2, kStates, random);
    RowMajor through = H;
    filter.see_through_uncertainty(rows_of(through));
    ASSERT_LT((through * through.transpose() - H * dense.P * H.transpose()).norm(), 1e-10 * dense.P.norm());
    const Eigen::Vector2d y = random_matrix(2, 1, random);
    ASSERT_LT((update(filter, H, y) - dense.update(H, y)).norm(), 1e-9) << step;
    ASSERT_LT((covariance(filter) - dense.P).norm(), 1e-10 * dense.P.norm()) << step;
  }
}

TEST(SquareRootInformation, TakesNoiseOfAnySize) {
  // Some components with noise far above what was known of them, some with little: the covariance in twice the digits.
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> decades(-4, 4);
  for (int trial = 0; trial < 200; ++trial) {
    Filter filter = empty();
    add_information(filter, random_matrix(kStates + 2, kStates, random));
    const Long before = root(filter).cast<long double>().triangularView<Eigen::Upper>();
    const Matrix A = Matrix::Identity(kDynamic, kDynamic) + 0.1 * random_matrix(kDynamic, kDynamic, random);
    const Matrix B = random_matrix(kDynamic, kStates - kDynamic, random);
    const Eigen::VectorXd noise = Eigen::VectorXd::NullaryExpr(kDynamic, [&] { return std::pow(10, decades(random)); });
    filter.propagate(A.inverse(), B, noise);
    Long F = Long::Identity(kStates, kStates);
    F.topRows(kDynamic) << A.cast<long double>(), B.cast<long double>();
    const Long through = F * before.inverse();
    Long P = through * through.transpose();
    P.topLeftCorner(kDynamic, kDynamic) += noise.cast<long double>().cwiseAbs2().asDiagonal();
    // R P Rᵀ is one, whatever the sizes of the components. Were U found by the squares of these, up to 1e8, it would be
    // off by their rounding, 1e-8.
    const Long R = root(filter).cast<long double>().triangularView<Eigen::Upper>();
    EXPECT_LT((R * P * R.transpose() - Long::Identity(kStates, kStates)).norm(), 1e-10L) << trial;
  }
}

TEST(SquareRootInformation, GivesTheFirstRowsOfItsInverse) {
  std::mt19937 random(5);
  Filter filter = empty();
  add_information(filter, random_matrix(kStates + 2, kStates, random));
  RowMajor first(4, kStates);
  filter.inverse_root(rows_of(first));
  EXPECT_EQ(first, inverse_root(filter).topRows(4));
  EXPECT_LT((inverse_root(filter) * root(filter) - Matrix::Identity(kStates, kStates)).norm(), 1e-12);
}

TEST(SquareRootInformation, UnobservedDirectionStaysUnobservedThroughManySteps) {
  std::mt19937 random(2);
  Filter filter = empty();  // no prior at all
  Eigen::VectorXd null = random_matrix(kStates, 1, random).normalized();
  double scale = 0;
  for (int step = 0; step < 10'000; ++step) {
    // Measurements that do not see `null`, then dynamics that carry it along.
    Matrix H = random_matrix(2, kStates, random);
    H -= (H * null * null.transpose() / null.squaredNorm()).eval();
    static_cast<void>(update(filter, H, Eigen::Vector2d::Zero()));
    if (step > kStates) {
      const Matrix B = 0.01 * random_matrix(kDynamic, kStates - kDynamic, random);
      filter.propagate(Matrix::Identity(kDynamic, kDynamic), B, Eigen::VectorXd::Zero(kDynamic));
      null.head(kDynamic) += B * null.tail(kStates - kDynamic);
    }
    scale = root(filter).norm();
  }
  // 10⁴ orthogonal steps, each with its rounding: far below one rounding per step in sum.
  EXPECT_LT((root(filter) * null).norm(), 1e-13 * scale * null.norm());
}

TEST(SquareRootInformation, IsRegularOnlyOnceEveryStateIsKnown) {
  Filter filter = empty();
  EXPECT_FALSE(filter.regular());
  const RowMajor all = RowMajor::Identity(kStates, kStates);
  add_information(filter, all.bottomRows(kStates - kDynamic));
  EXPECT_FALSE(filter.regular());
  add_information(filter, all.topRows(kDynamic));
  EXPECT_TRUE(filter.regular());
  filter.reset(kStates, kDynamic);
  EXPECT_FALSE(filter.regular());
}

TEST(SquareRootInformation, SurvivesFirstFixesThatBreakAFullCovariance) {
  // Direction and alignment fully correlated, leverage of 1e7: a full covariance turns indefinite, this one cannot.
  SquareRootInformation<2, 1> filter;
  filter.reset(2, 1);
  add_information(filter, Eigen::RowVector2d(0, 1e-4));
  for (int step = 0; step < 1000; ++step) {
    const Eigen::RowVector2d H(1e8, -1e8 * (1 + 1e-9 * step));
    ASSERT_TRUE(update(filter, H, Eigen::VectorXd::Constant(1, 0.5)).allFinite());
    ASSERT_TRUE(inverse_root(filter).allFinite());
    ASSERT_GT(covariance(filter).diagonal().minCoeff(), 0);
  }
}

TEST(Triangularise, LeavesAllInformationInTheFirstRows) {
  std::mt19937 random(3);
  for (const int columns : {1, 3, 5, 8}) {  // also more than there are rows
    const RowMajor before = random_matrix(6, 8, random);
    RowMajor rows = before;
    triangularise(rows_of(rows), columns);
    EXPECT_LT((rows.transpose() * rows - before.transpose() * before).norm(), 1e-13) << columns;
    for (int j = 0; j < std::min(columns, 5); ++j) {
      EXPECT_LT(rows.col(j).tail(5 - j).norm(), 1e-14) << columns;
    }
  }
}

TEST(RotateInto, TakesAnyNumberOfRows) {
  std::mt19937 random(4);
  for (int count = 1; count <= 20; ++count) {
    const RowMajor rows = random_matrix(count, kStates, random);
    RowMajor R = RowMajor::Identity(kStates, kStates);
    const Matrix expected = R.transpose() * R + rows.transpose() * rows;
    RowMajor extra = rows;
    rotate_into(rows_of(R), rows_of(extra), kStates);
    EXPECT_LT((R.transpose() * R - expected).norm(), 1e-13 * expected.norm()) << count;
    EXPECT_TRUE(R.isUpperTriangular(1e-15)) << count;
    EXPECT_EQ(extra.norm(), 0) << count;
  }
}

TEST(SolveRows, IsTheSolutionAlsoOfRowsThatBeginWithZerosOrHaveNothingElse) {
  std::mt19937 random(9);
  for (int n = 1; n <= 9; ++n) {
    RowMajor root = random_matrix(n, n, random);
    root.triangularView<Eigen::StrictlyLower>().setZero();
    root.diagonal().array() += 3;
    for (int zeros = 0; zeros <= n; ++zeros) {
      RowMajor rows = random_matrix(3, n, random);
      rows.leftCols(zeros).setZero();
      RowMajor solved = rows;
      solve_rows(view_of(root), rows_of(solved));
      EXPECT_LT((solved * root - rows).norm(), 1e-13 * root.norm()) << n;
      EXPECT_EQ(solved.leftCols(zeros).cwiseAbs().sum(), 0) << n;
    }
  }
}

TEST(SolveColumn, IsTheSolution) {
  std::mt19937 random(8);
  for (int n = 1; n <= 9; ++n) {
    RowMajor root = random_matrix(n, n + 1, random);
    root.leftCols(n).triangularView<Eigen::StrictlyLower>().setZero();
    root.diagonal().array() += 3;
    Eigen::VectorXd x(n);
    solve_column(view_of(root), x.data());
    EXPECT_LT((root.leftCols(n) * x - root.col(n)).norm(), 1e-13 * root.norm()) << n;
  }
}

/// The same bits, also of a zero's sign.
bool same_bits(const RowMajor& a, const RowMajor& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(double)) == 0;
}

/// The first columns and the last ones.
RowMajor ends_of(const RowMajor& m, int columns) {
  RowMajor ends(m.rows(), 2 * columns);
  ends << m.leftCols(columns), m.rightCols(columns);
  return ends;
}

/// What is done to a column depends on those that are eliminated alone: a matrix of some of the columns, which is
/// worked on another way, has the same bits in them.
TEST(LongRows, HaveTheBitsOfShortOnes) {
  std::mt19937 random(7);
  for (const int columns : {48, 49, 50, 51, 101}) {
    constexpr int kSome = 10;
    for (int rows = 1; rows <= 9; ++rows) {
      const std::string which = std::to_string(rows) + " × " + std::to_string(columns);
      RowMajor root = random_matrix(columns, columns, random);
      root.triangularView<Eigen::StrictlyLower>().setZero();
      root.diagonal().array() += 5;
      RowMajor extra = random_matrix(rows, columns, random);
      extra.col(columns - 1).setZero();

      RowMajor long_root = root.topRows(kSome);
      RowMajor long_extra = extra;
      rotate_into(rows_of(long_root), rows_of(long_extra), kSome);
      RowMajor short_root = ends_of(root.topRows(kSome), kSome);
      RowMajor short_extra = ends_of(extra, kSome);
      rotate_into(rows_of(short_root), rows_of(short_extra), kSome);
      EXPECT_TRUE(same_bits(ends_of(long_root, kSome), short_root)) << which;
      EXPECT_TRUE(same_bits(ends_of(long_extra, kSome), short_extra)) << which;

      RowMajor solved = extra;
      solve_rows(view_of(root), rows_of(solved));
      EXPECT_LT((solved * root - extra).norm(), 1e-10 * extra.norm()) << which;
      const RowMajor corner = root.topLeftCorner(kSome, kSome);
      RowMajor short_solved = extra.leftCols(kSome);
      solve_rows(view_of(corner), rows_of(short_solved));
      EXPECT_TRUE(same_bits(solved.leftCols(kSome), short_solved)) << which;

      RowMajor factors = random_matrix(rows, columns, random);
      factors.col(0).setZero();
      const RowMajor ends_of_root = ends_of(root, kSome);
      RowMajor rest = extra.topRows(1);
      take_off(factors.data(), 1, view_of(root), rest.data());
      RowMajor short_rest = ends_of(extra.topRows(1), kSome);
      take_off(factors.data(), 1, view_of(ends_of_root), short_rest.data());
      EXPECT_TRUE(same_bits(ends_of(rest, kSome), short_rest)) << which;

      RowMajor product(rows, columns);
      multiply(view_of(factors), view_of(root), rows_of(product));
      RowMajor short_product(rows, 2 * kSome);
      multiply(view_of(factors), view_of(ends_of_root), rows_of(short_product));
      EXPECT_TRUE(same_bits(ends_of(product, kSome), short_product)) << which;
    }
  }
}

TEST(Multiply, IsTheProduct) {
  std::mt19937 random(6);
  const RowMajor a = random_matrix(3, 7, random);
  const RowMajor b = random_matrix(7, 9, random);
  RowMajor product = RowMajor::Constant(3, 9, 7.0);
  multiply(view_of(a), view_of(b), rows_of(product));
  EXPECT_LT((product - a * b).norm(), 1e-14);
}

TEST(AddProductOfTriangle, AddsTheBitsOfTheProductWithZerosBelowTheDiagonal) {
  std::mt19937 random(7);
  for (const int size : {7, 60}) {
    const RowMajor a = random_matrix(3, size - 2, random);
    const RowMajor triangle = random_matrix(size - 2, size, random).triangularView<Eigen::Upper>();
    RowMajor expected(3, size);
    multiply(view_of(a), view_of(triangle), rows_of(expected));
    RowMajor found = RowMajor::Zero(3, size);
    add_product_of_triangle(view_of(a), view_of(triangle), rows_of(found));
    EXPECT_TRUE(same_bits(found, expected)) << size;
    add_product_of_triangle(view_of(a), view_of(triangle), rows_of(found));
    EXPECT_LT((found - 2 * expected).norm(), 1e-13) << size;
  }
}

}  // namespace
}  // namespace trihedron
