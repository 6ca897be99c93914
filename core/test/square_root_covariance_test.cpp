#include "trihedron/core/square_root_covariance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace trihedron {
namespace {

constexpr int kStates = 7;
constexpr int kDynamic = 3;
/// There is room for more than what is in use: the work must not depend on it.
using Filter = SquareRootCovariance<kStates + 5, kDynamic + 2>;
using Matrix = Eigen::MatrixXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Matrix random_matrix(int rows, int columns, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Matrix::NullaryExpr(rows, columns, [&] { return uniform(random); });
}

RowMajor random_triangle(int size, std::mt19937& random) {
  RowMajor triangle = random_matrix(size, size, random).triangularView<Eigen::Upper>();
  triangle.diagonal().array() += 3;
  return triangle;
}

/// With the root given.
template <class F>
F with_root(const Matrix& S) {
  F filter;
  filter.reset(static_cast<int>(S.rows()));
  for (int i = 0; i < S.rows(); ++i) {
    for (int j = i; j < S.rows(); ++j) {
      filter.root()(i, j) = S(i, j);
    }
  }
  return filter;
}

template <class F>
Matrix root(const F& filter) {
  RowMajor S(filter.states(), filter.states());
  filter.put_root(rows_of(S));
  return S;
}

template <class F>
Matrix covariance(const F& filter) {
  return root(filter) * root(filter).transpose();
}

template <class F>
Eigen::VectorXd update(F& filter, const Matrix& H, const Eigen::VectorXd& y) {
  RowMajor rows(H.rows(), H.cols() + 1);
  rows << H, y;
  filter.see_through_uncertainty({rows.data(), static_cast<int>(H.rows()), filter.states(), filter.states() + 1});
  filter.take(rows_of(rows));
  return filter.correction();
}

template <class F>
void propagate(F& filter, const Matrix& A, const Matrix& B, const Eigen::VectorXd& noise) {
  RowMajor moved(A.rows(), filter.states());
  moved << A, B;
  filter.propagate(rows_of(moved), noise);
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
  Eigen::VectorXd update(const Matrix& H, const Eigen::VectorXd& y) {
    const Matrix S = H * P * H.transpose() + Matrix::Identity(H.rows(), H.rows());
    const Matrix K = P * H.transpose() * S.inverse();
    const Eigen::VectorXd x = K * y;
    P = ((Matrix::Identity(kStates, kStates) - K * H) * P).eval();
    return x;
  }
};

TEST(SquareRootCovariance, AgreesWithTheTextbookFilterOverManySteps) {
  std::mt19937 random(1);
  Eigen::VectorXd prior(kStates);
  prior << 1, 1, 1, 2, 2, 2, 2;
  auto filter = with_root<Filter>(prior.asDiagonal());
  Dense dense;
  dense.P = prior.cwiseAbs2().asDiagonal();
  EXPECT_LT((covariance(filter) - dense.P).norm(), 1e-14);
  for (int step = 0; step < 200; ++step) {
    const Matrix A = Matrix::Identity(kDynamic, kDynamic) + 0.1 * random_matrix(kDynamic, kDynamic, random);
    const Matrix B = random_matrix(kDynamic, kStates - kDynamic, random);
    // Without process noise at every other step: a zero noise must not divide by anything.
    const Eigen::VectorXd noise = (step % 2) * 0.1 * random_matrix(kDynamic, 1, random).cwiseAbs();
    propagate(filter, A, B, noise);
    dense.propagate(A, B, noise);
    ASSERT_LT((covariance(filter) - dense.P).norm(), 1e-10 * dense.P.norm()) << step;
    // From one measurement to more than are taken in one pass.
    const int measurements = 1 + step % (2 * kMeasurementsAtOnce + 1);
    const Matrix H = random_matrix(measurements, kStates, random);
    RowMajor through = H;
    filter.see_through_uncertainty(rows_of(through));
    ASSERT_LT((through * through.transpose() - H * dense.P * H.transpose()).norm(), 1e-10 * dense.P.norm());
    const Eigen::VectorXd y = random_matrix(measurements, 1, random);
    ASSERT_LT((update(filter, H, y) - dense.update(H, y)).norm(), 1e-9) << step;
    ASSERT_LT((covariance(filter) - dense.P).norm(), 1e-10 * dense.P.norm()) << step;
    ASSERT_TRUE(root(filter).isUpperTriangular(0)) << step;
  }
}

TEST(SquareRootCovariance, TakesNoiseOfAnySize) {
  // Some components with noise far above what was known of them, some with little: the covariance in twice the digits.
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> decades(-4, 4);
  for (int trial = 0; trial < 200; ++trial) {
    auto filter = with_root<Filter>(random_triangle(kStates, random));
    const Long before = root(filter).cast<long double>();
    const Matrix A = Matrix::Identity(kDynamic, kDynamic) + 0.1 * random_matrix(kDynamic, kDynamic, random);
    const Matrix B = random_matrix(kDynamic, kStates - kDynamic, random);
    const Eigen::VectorXd noise = Eigen::VectorXd::NullaryExpr(kDynamic, [&] { return std::pow(10, decades(random)); });
    propagate(filter, A, B, noise);
    Long F = Long::Identity(kStates, kStates);
    F.topRows(kDynamic) << A.cast<long double>(), B.cast<long double>();
    const Long through = F * before;
    Long P = through * through.transpose();
    P.topLeftCorner(kDynamic, kDynamic) += noise.cast<long double>().cwiseAbs2().asDiagonal();
    // S⁻¹ P S⁻ᵀ is one, whatever the sizes of the components. Were S found by the squares of these, up to 1e8, it would
    // be off by their rounding, 1e-8.
    const Long S = root(filter).cast<long double>();
    const Long inverse = S.triangularView<Eigen::Upper>().solve(Long(Long::Identity(kStates, kStates)));
    EXPECT_LT((inverse * P * inverse.transpose() - Long::Identity(kStates, kStates)).norm(), 1e-10L) << trial;
  }
}

TEST(SquareRootCovariance, BeginsWithStatesMadeOfTheOthers) {
  std::mt19937 random(5);
  auto filter = with_root<Filter>(random_triangle(kStates, random));
  const int constants = kStates - kDynamic;
  const Matrix P = covariance(filter).bottomRightCorner(constants, constants);
  const Matrix B = random_matrix(kDynamic, constants, random);
  const Matrix L = random_triangle(kDynamic, random);
  const Eigen::MatrixXd noise = L * L.transpose();
  RowMajor F = RowMajor::Zero(kDynamic, kStates);
  F.rightCols(constants) = B;
  filter.begin(rows_of(F), noise);
  Matrix expected(kStates, kStates);
  expected << B * P * B.transpose() + noise, B * P, P * B.transpose(), P;
  EXPECT_LT((covariance(filter) - expected).norm(), 1e-13 * expected.norm());
  EXPECT_TRUE(root(filter).isUpperTriangular(0));
}

TEST(SquareRootCovariance, UnobservedDirectionStaysAsUncertainAsItWas) {
  std::mt19937 random(2);
  // What is not seen is known a million times worse than what is.
  const Eigen::VectorXd null = random_matrix(kStates, 1, random).normalized();
  const Matrix P = 1e-12 * Matrix::Identity(kStates, kStates) + null * null.transpose();
  RowMajor S = RowMajor::Zero(kStates, kStates);
  ASSERT_TRUE(covariance_root(P, rows_of(S)));
  auto filter = with_root<Filter>(S);
  Eigen::VectorXd unseen = null;
  const auto information = [&] { return root(filter).triangularView<Eigen::Upper>().solve(unseen).squaredNorm(); };
  const double before = information();
  EXPECT_NEAR(before, 1, 1e-5);
  for (int step = 0; step < 10'000; ++step) {
    // Measurements that do not see it, then dynamics that carry it along.
    Matrix H = 1e5 * random_matrix(2, kStates, random);
    H -= (H * unseen * unseen.transpose() / unseen.squaredNorm()).eval();
    static_cast<void>(update(filter, H, Eigen::Vector2d::Zero()));
    const Matrix B = 0.01 * random_matrix(kDynamic, kStates - kDynamic, random);
    propagate(filter, Matrix::Identity(kDynamic, kDynamic), B, Eigen::VectorXd::Zero(kDynamic));
    unseen.head(kDynamic) += B * unseen.tail(kStates - kDynamic);
  }
  EXPECT_NEAR(information(), before, 1e-6 * before);
}

TEST(SquareRootCovariance, WidensToThePriorAtMost) {
  // With correlated priors, and a state that moves and has one as well.
  std::mt19937 random(11);
  constexpr int kBefore = 2;
  constexpr double kFactor = 3;
  for (const int first : {kBefore, kDynamic}) {
    RowMajor prior_root = random_triangle(kStates - kBefore, random);
    PackedTriangle<kStates> prior;
    prior.pack(rows_of(prior_root));
    auto filter = with_root<Filter>(0.1 * random_triangle(kStates, random));
    const Matrix before = covariance(filter).inverse();
    filter.scale(kFactor);
    const double part = std::sqrt(1 - 1 / (kFactor * kFactor));
    filter.take_prior(prior, kBefore, first, first + 1, part);  // in two parts
    filter.take_prior(prior, kBefore, first + 1, kStates, part);
    // Rows of the prior from `first` on tell nothing of the states before it.
    const Matrix told = prior_root.inverse().bottomRows(kStates - first);
    Matrix expected = before / (kFactor * kFactor);
    expected.bottomRightCorner(kStates - kBefore, kStates - kBefore) +=
        (1 - 1 / (kFactor * kFactor)) * told.transpose() * told;
    EXPECT_LT((covariance(filter) * expected - Matrix::Identity(kStates, kStates)).norm(), 1e-11) << first;
  }
}

TEST(SquareRootCovariance, IsRegularWhereEveryStateHasAnUncertainty) {
  std::mt19937 random(4);
  auto filter = with_root<Filter>(random_triangle(kStates, random));
  EXPECT_TRUE(filter.regular());
  for (const double wrong : {0.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    auto broken = filter;
    broken.root()(kStates - 2, kStates - 2) = wrong;
    EXPECT_FALSE(broken.regular()) << wrong;
  }
  filter.reset(kStates);
  EXPECT_FALSE(filter.regular());
}

TEST(SquareRootCovariance, SurvivesFirstFixesThatBreakAFullCovariance) {
  // Direction and alignment fully correlated, and the first measurement tells 1e12 times what was known: a full
  // covariance turns indefinite, this one cannot.
  using OfTwo = SquareRootCovariance<2, 1>;
  Matrix S(2, 2);
  S << 1e4, 1e4, 0, 1e4;
  auto filter = with_root<OfTwo>(S);
  for (int step = 0; step < 1000; ++step) {
    const Eigen::RowVector2d H(1e8, -1e8 * (1 + 1e-9 * step));
    ASSERT_TRUE(update(filter, H, Eigen::VectorXd::Constant(1, 0.5)).allFinite());
    ASSERT_TRUE(filter.regular());
    constexpr std::array<double, 6> kExact = {1,
                                              0.999999000002,
                                              0.8333330833334583,
                                              0.699999910000018,
                                              0.599999960000004,
                                              0.5238095034013617};  // of H P Hᵀ, by fractions
    if (step < static_cast<int>(kExact.size())) {
      ASSERT_NEAR((H * root(filter)).squaredNorm(), kExact[static_cast<std::size_t>(step)], 1e-6) << step;
    }
  }
}

TEST(SquareRootCovariance, HasAfterLeverageOfAnySizeWhatTwiceTheDigitsGive) {
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  std::mt19937 random(6);
  std::uniform_real_distribution<double> decades(0, 7);
  for (int trial = 0; trial < 200; ++trial) {
    auto filter = with_root<Filter>(random_triangle(kStates, random));
    const Long before = root(filter).cast<long double>();
    Matrix H = random_matrix(4, kStates, random);
    for (int i = 0; i < 4; ++i) {
      H.row(i) *= std::pow(10, decades(random));
    }
    const Eigen::VectorXd y = random_matrix(4, 1, random);
    const Eigen::VectorXd x = update(filter, H, y);
    const Long inverse = before.triangularView<Eigen::Upper>().solve(Long(Long::Identity(kStates, kStates)));
    // Not by the square of both, which would cost half of these digits.
    Long information_root(kStates + 4, kStates);
    information_root << inverse, H.cast<long double>();
    const Long seen = information_root * root(filter).cast<long double>();
    EXPECT_LT((seen.transpose() * seen - Long::Identity(kStates, kStates)).norm(), 1e-7L) << trial;
    Long shown(kStates + 4, 1);
    shown << Long::Zero(kStates, 1), y.cast<long double>();
    const Long left = shown - information_root * x.cast<long double>();
    EXPECT_LT((seen.transpose() * left).norm(), 1e-7L) << trial;
  }
}

TEST(PackedTriangle, GivesBackWhatItTookAndItsInverse) {
  std::mt19937 random(8);
  RowMajor S = random_triangle(kStates, random);
  PackedTriangle<kStates + 1> packed;
  packed.pack(rows_of(S));
  RowMajor back = RowMajor::Zero(kStates - 2, kStates - 2);
  packed.unpack(rows_of(back));
  EXPECT_EQ(back, S.topLeftCorner(kStates - 2, kStates - 2));
  for (int i = 0; i < kStates; ++i) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(kStates);
    packed.put_inverse(i, &row(i));
    EXPECT_LT((row * S - Eigen::RowVectorXd::Unit(kStates, i)).norm(), 1e-13) << i;
  }
  const Eigen::VectorXd right = random_matrix(kStates, 1, random);
  Eigen::VectorXd x = right;
  packed.solve(x.data());
  EXPECT_LT((S * x - right).norm(), 1e-13);
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

TEST(SeeThrough, IsTheProductAlsoOfRowsWithZeros) {
  std::mt19937 random(9);
  for (int n = 1; n <= 9; ++n) {
    const RowMajor S = random_triangle(n, random);
    for (int count = 1; count <= 6; ++count) {
      for (int zeros = 0; zeros <= n; ++zeros) {
        RowMajor rows = random_matrix(count, n, random);
        rows.leftCols(zeros).setZero();
        RowMajor seen = rows;
        see_through(view_of(S), rows_of(seen));
        EXPECT_LT((seen - rows * S).norm(), 1e-14 * S.norm()) << n;
        EXPECT_EQ(seen.leftCols(zeros).cwiseAbs().sum(), 0) << n;
      }
    }
  }
}

TEST(SeeThrough, IsTheProductWhateverColumnsAreZero) {
  std::mt19937 random(14);
  constexpr int kMany = 60;
  const RowMajor S = random_triangle(kMany, random);
  for (const int each : {2, 3, 7, 20}) {  // with more gaps than are looked for, and with few
    RowMajor rows = random_matrix(3, kMany, random);
    for (int j = 0; j < kMany; j += each) {
      rows.col(j).setZero();
    }
    RowMajor seen = rows;
    see_through(view_of(S), rows_of(seen));
    EXPECT_LT((seen - rows * S).norm(), 1e-13 * S.norm()) << each;
  }
}

TEST(AddSquare, IsTheSquare) {
  std::mt19937 random(10);
  for (const int columns : {1, 3, 5, 7, 8, 26, 49}) {
    const RowMajor rows = random_matrix(3, columns, random);
    Matrix square = Matrix::Identity(4, 4);
    add_square(view_of(rows), square.data(), 4);
    EXPECT_LT((square.topLeftCorner(3, 3) - Matrix::Identity(3, 3) - rows * rows.transpose()).norm(), 1e-13) << columns;
    EXPECT_EQ(square(3, 3), 1);
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
  for (const int columns : {8, 9, 10, 11, 26, 49, 101}) {
    constexpr int kSome = 3;
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

/// A column is made of those before it, so that those of a short root are the first ones of a long root.
TEST(LongRows, AreSeenThroughToTheBitsOfShortOnes) {
  std::mt19937 random(15);
  constexpr int kShort = 7;
  for (const int n : {8, 26, 49}) {
    const RowMajor root = random_triangle(n, random);
    const RowMajor corner = root.topLeftCorner(kShort, kShort);
    RowMajor seen = random_matrix(4, n, random);
    RowMajor short_seen = seen.leftCols(kShort);
    see_through(view_of(root), rows_of(seen));
    see_through(view_of(corner), rows_of(short_seen));
    EXPECT_TRUE(same_bits(seen.leftCols(kShort), short_seen)) << n;
  }
}

TEST(LongRows, HaveTheSquaresOfShortOnes) {
  std::mt19937 random(16);
  RowMajor rows = random_matrix(4, 8, random);
  rows.col(7).setZero();
  const RowMajor short_rows = rows.leftCols(7);
  RowMajor square = RowMajor::Identity(4, 4);
  RowMajor short_square = square;
  add_square(view_of(rows), square.data(), 4);
  add_square(view_of(short_rows), short_square.data(), 4);
  EXPECT_TRUE(same_bits(square, short_square));
}

TEST(LongRows, AreSeenThroughExactlyWhereAllNumbersAreWhole) {
  std::mt19937 random(12);
  for (int n = 8; n <= 30; ++n) {
    const RowMajor root = (100 * random_triangle(n, random)).array().round();
    for (int rows = 1; rows <= 5; ++rows) {
      const RowMajor before = (100 * random_matrix(rows, n, random)).array().round();
      RowMajor seen = before;
      see_through(view_of(root), rows_of(seen));
      EXPECT_EQ(seen, before * root) << n;
    }
  }
}

/// Rows of the root are updated many at a time, measurements that wait for the next pass one by one.
TEST(LongRows, AreUpdatedToTheBitsOfOneByOne) {
  std::mt19937 random(13);
  constexpr int kRows = kMeasurementsAtOnce;
  for (int n = 8; n <= 30; ++n) {
    const RowMajor S = random_triangle(n, random);
    for (int first = 0; first + kRows <= n; ++first) {
      RowMajor rows = random_matrix(2 * kRows, n + 1, random);
      rows.bottomLeftCorner(kRows, n) = S.middleRows(first, kRows);
      std::vector<double> numbers(static_cast<std::size_t>(n) * kNumbersOfColumn);
      Eigen::VectorXd correction(n);
      RowMajor alone = S;
      RowMajor measurements = rows.topRows(kRows);
      take_measurements(rows_of(alone), rows_of(measurements), numbers.data(), correction.data());
      RowMajor all = S;
      take_measurements(rows_of(all), rows_of(rows), numbers.data(), correction.data());
      EXPECT_TRUE(same_bits(alone.middleRows(first, kRows), rows.bottomLeftCorner(kRows, n))) << n << ' ' << first;
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
