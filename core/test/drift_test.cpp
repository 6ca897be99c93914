#include "trihedron/core/drift.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "numerical_jacobian.hpp"

namespace trihedron {
namespace {

using Coefficients = Esg7::Coefficients<double>;

/// Unit vectors, axes and diagonals among them.
rc::Gen<Eigen::Vector3d> directions() {
  const auto component = rc::gen::map(rc::gen::inRange(-3, 4), [](int i) { return i / 3.0; });
  const auto fine = rc::gen::map(rc::gen::inRange(-1000, 1001), [](int i) { return i * 1e-4; });
  return rc::gen::apply(
      [](double x, double y, double z, double dx, double dy) {
        const Eigen::Vector3d v(x + dx, y + dy, z);
        return Eigen::Vector3d(v.norm() > 0.01 ? v.normalized() : Eigen::Vector3d::UnitZ());
      },
      component, component, component, fine, fine);
}

Eigen::Matrix3d across(const Eigen::Vector3d& h) { return Eigen::Matrix3d::Identity() - h * h.transpose(); }

Coefficients only(int index) { return Coefficients::Unit(index); }

/// Coefficients μij or νij = aj − ai, which sum to zero.
Coefficients differences(int first, const Eigen::Vector3d& a) {
  Coefficients kappa = Coefficients::Zero();
  kappa.segment<3>(first) << a(1) - a(0), a(2) - a(1), a(0) - a(2);
  return kappa;
}

const Eigen::Vector3d kA(0.7, -1.3, 0.4);

// The structure of eq. (1): docs/mathematics.md, section 3. Tolerances are some roundings of numbers near one.
RC_GTEST_PROP(Esg7Identity, K0IsTheGradientOfTheFourthPowers, ()) {
  const Eigen::Vector3d h = *directions();
  const Eigen::Vector3d gradient = h.array().cube();
  RC_ASSERT((Esg7::rate<double>(h, only(Esg7::kK0)) + across(h) * gradient).norm() < 4e-15);
}

RC_GTEST_PROP(Esg7Identity, MuIsTheGradientOfAQuadraticForm, ()) {
  const Eigen::Vector3d h = *directions();
  const Eigen::Vector3d gradient = kA.cwiseProduct(h);
  RC_ASSERT((Esg7::rate<double>(h, differences(Esg7::kMu12, kA)) + across(h) * gradient).norm() < 4e-15);
}

RC_GTEST_PROP(Esg7Identity, NuIsTheCurlOfAQuadraticForm, ()) {
  const Eigen::Vector3d h = *directions();
  const Eigen::Vector3d gradient = kA.cwiseProduct(h);
  RC_ASSERT((Esg7::rate<double>(h, differences(Esg7::kNu12, kA)) - h.cross(gradient)).norm() < 4e-15);
}

RC_GTEST_PROP(Esg7Identity, CommonModesComeFromTheProductOfTheCosines, ()) {
  const Eigen::Vector3d h = *directions();
  const Eigen::Vector3d gradient(h(1) * h(2), h(2) * h(0), h(0) * h(1));
  Coefficients mu = Coefficients::Zero();
  mu.segment<3>(Esg7::kMu12).setOnes();
  Coefficients nu = Coefficients::Zero();
  nu.segment<3>(Esg7::kNu12).setOnes();
  RC_ASSERT((Esg7::rate<double>(h, mu) - h.cross(gradient)).norm() < 4e-15);
  RC_ASSERT((Esg7::rate<double>(h, nu) - gradient).norm() < 4e-15);
}

RC_GTEST_PROP(Esg7Identity, OnlyTheCommonModeOfNuPointsAlongTheMomentum, ()) {
  const Eigen::Vector3d h = *directions();
  Coefficients kappa;
  kappa << 1.1, -0.3, 0.8, 2.0, -0.6, 0.9, 1.7;
  const double along = h.prod() * kappa.segment<3>(Esg7::kNu12).sum();
  RC_ASSERT(std::abs(Esg7::rate<double>(h, kappa).dot(h) - along) < 4e-15);
}

TEST(Esg7, SignsAreThoseOfThePaper) {
  // Rows of eq. (1) written out at one point, term by term.
  const double h1 = 0.36;
  const double h2 = 0.48;
  const double h3 = 0.8;
  const Eigen::Vector3d h(h1, h2, h3);
  const auto basis = Esg7::basis<double>(h);
  const auto p4 = [](double x) { return x * x * x * x; };
  EXPECT_NEAR(basis(0, Esg7::kK0), h1 * (-(1 - h1 * h1) * h1 * h1 + p4(h2) + p4(h3)), 1e-16);
  EXPECT_NEAR(basis(1, Esg7::kK0), h2 * (-(1 - h2 * h2) * h2 * h2 + p4(h3) + p4(h1)), 1e-16);
  EXPECT_NEAR(basis(2, Esg7::kK0), h3 * (-(1 - h3 * h3) * h3 * h3 + p4(h1) + p4(h2)), 1e-16);
  Eigen::Matrix<double, 3, 6> rest;
  // clang-format off
  rest << h1 * h2 * h2, 0, -h1 * h3 * h3, 0, h2 * h3, 0,
          -h2 * h1 * h1, h2 * h3 * h3, 0, 0, 0, h3 * h1,
          0, -h3 * h2 * h2, h3 * h1 * h1, h1 * h2, 0, 0;
  // clang-format on
  EXPECT_LT((basis.rightCols<6>() - rest).norm(), 1e-15);
}

RC_GTEST_PROP(Esg7, JacobiansMatchCentralDifferences, ()) {
  const Eigen::Vector3d h = *directions();
  RC_PRE(Esg7::basis<double>(h).norm() > 0);  // along an axis nothing drifts, and there is nothing to compare
  Coefficients kappa;
  kappa << 1.1, -0.3, 0.8, 2.0, -0.6, 0.9, 1.7;
  // Central differences of step s err by s² times third derivatives (of order 10) and by rounding over s.
  test::expect_jacobian(
      Esg7::rate_by_h<double>(h, kappa),
      test::central_differences([&](const Eigen::Vector3d& x) { return Esg7::rate<double>(x, kappa); }, h, 1e-5), 1e-8);
  test::expect_jacobian(
      Esg7::basis<double>(h),
      test::central_differences([&](const Coefficients& k) { return Esg7::rate<double>(h, k); }, kappa, 1e-3), 1e-11);
}

// ---- The models as tables of members

const DriftModelId kModels[] = {kEsg7, kEsg20, vsh(1), vsh(2), vsh(3), vsh(4), vsh(5), vsh(6), vsh(8)};

Eigen::MatrixXd basis_of(const DriftModel& model, const Eigen::Vector3d& h, const DriftTime& time = {}) {
  Columns<kMaxDriftColumns> columns;
  model.basis(h, time, columns.view(model.columns()));
  return columns.first(model.columns());
}

Eigen::VectorXd some_coefficients(int size) {
  Eigen::VectorXd kappa(size);
  for (int i = 0; i < size; ++i) {
    kappa(i) = std::sin(1.0 + i);
  }
  return kappa;
}

/// Directions that no symmetry of the harmonics picks out.
std::vector<Eigen::Vector3d> some_directions(int count) {
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double z = -1 + (2 * i + 1.0) / count;
    const double angle = 2.4 * i;
    directions.emplace_back(std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle), z);
  }
  return directions;
}

TEST(DriftModel, BeginsWithEquation1) {
  for (const DriftModelId id : kModels) {
    const DriftModel model(id, {});
    ASSERT_EQ(model.size(), id.size());
    for (int i = 0; i < Esg7::kSize; ++i) {
      EXPECT_EQ(model.member(i), DriftCoefficient::of_eq1(i));
    }
    for (const Eigen::Vector3d& h : some_directions(5)) {
      EXPECT_EQ(basis_of(model, h).leftCols(Esg7::kSize), Esg7::basis<double>(h));
    }
  }
}

TEST(DriftModel, RateIsTheBasisTimesTheCoefficients) {
  for (const DriftModelId id : kModels) {
    for (int further = 0; further < 16; ++further) {
      const DriftModel model(id, {.wandering_drift = (further & 1) != 0,
                                  .coefficient_change = (further & 2) != 0,
                                  .orbital_drift = (further & 4) != 0,
                                  .polhode = (further & 8) != 0});
      const Eigen::VectorXd kappa = some_coefficients(model.columns());
      for (const Eigen::Vector3d& h : some_directions(7)) {
        const DriftTime time{0.3, -0.6, 0.8, 0.28, -0.96};
        const Eigen::Vector3d rate = model.rate(h, time, kappa.data());
        EXPECT_LT((rate - basis_of(model, h, time) * kappa).norm(), 1e-13 * rate.norm()) << model.columns();
      }
    }
  }
}

TEST(DriftModel, HasWhatDependsOnTimeBehindItsMembers) {
  const DriftModel model(vsh(2),
                         {.wandering_drift = true, .coefficient_change = true, .orbital_drift = true, .polhode = true});
  const Eigen::Vector3d h = Eigen::Vector3d(0.3, -0.5, 0.7).normalized();
  const Eigen::MatrixXd basis = basis_of(model, h, {0.25, -0.6, 0.8, 0.28, -0.96});
  const int change = vsh(2).size() + 3;
  const int polhode = change + Esg7::kSize + 6;
  ASSERT_EQ(basis.cols(), polhode + 2 * Esg7::kSize);
  EXPECT_EQ(basis.middleCols<3>(vsh(2).size()), Eigen::Matrix3d::Identity());
  EXPECT_EQ(basis.middleCols<Esg7::kSize>(change), 0.25 * Esg7::basis<double>(h));
  EXPECT_EQ(basis.middleCols<3>(change + Esg7::kSize), -0.6 * Eigen::Matrix3d::Identity());
  EXPECT_EQ(basis.middleCols<3>(polhode - 3), 0.8 * Eigen::Matrix3d::Identity());
  EXPECT_EQ(basis.middleCols<Esg7::kSize>(polhode), 0.28 * Esg7::basis<double>(h));
  EXPECT_EQ(basis.rightCols<Esg7::kSize>(), -0.96 * Esg7::basis<double>(h));
}

TEST(DriftModel, MembersAreThoseOfTheirPotentials) {
  // ω = −∇W + h × ∇D: against central differences of the harmonics along the sphere.
  const HarmonicTable harmonics(DriftModelId::kMaxDegree);
  for (const DriftModelId id : {kEsg20, vsh(8)}) {
    const DriftModel model(id, {});
    for (const Eigen::Vector3d& h : some_directions(5)) {
      const Eigen::MatrixXd basis = basis_of(model, h);
      for (int i = Esg7::kSize; i < model.size(); ++i) {
        const DriftCoefficient& its = model.member(i);
        const auto potential = [&](const Eigen::Vector3d& turn) {
          const Eigen::Vector3d there = rotated<double>(h, turn);
          if (its.member == DriftCoefficient::Member::kCubeD) {
            return Eigen::Matrix<double, 1, 1>(there.array().pow(4).sum() / 4);
          }
          const auto at = harmonics.at<double>(there);
          double value = at(its.degree, its.order).value;
          if (its.member == DriftCoefficient::Member::kW && its.degree == 4 && its.order == 4) {  // beside k0
            value = std::sqrt(7.0 / 12) * value - std::sqrt(5.0 / 12) * at(4, 0).value;
          }
          return Eigen::Matrix<double, 1, 1>(value);
        };
        // Turned by v, h moves by v × h: the derivative by v is h × ∇.
        const Eigen::Vector3d h_cross_gradient =
            test::central_differences(potential, Eigen::Vector3d(0, 0, 0), 1e-5).transpose();
        const Eigen::Vector3d expected =
            its.member == DriftCoefficient::Member::kW ? h.cross(h_cross_gradient) : Eigen::Vector3d(h_cross_gradient);
        const double size = std::max(basis.col(i).norm(), 1.0);
        EXPECT_LT((across(h) * basis.col(i) - expected).norm(), 1e-8 * size) << model.size() << " " << i;
      }
    }
  }
}

TEST(DriftModel, MembersAreIndependent) {
  // Over the sphere no member is a sum of others, so that each can be estimated.
  for (const DriftModelId id : kModels) {
    const DriftModel model(id, {});
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(model.size(), model.size());
    for (const Eigen::Vector3d& h : some_directions(200)) {
      const Eigen::MatrixXd moves = across(h) * basis_of(model, h);
      gram.selfadjointView<Eigen::Lower>().rankUpdate(moves.transpose());
    }
    const Eigen::VectorXd scale = gram.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(
                                            scale.asDiagonal() * gram * scale.asDiagonal(), Eigen::EigenvaluesOnly)
                                            .eigenvalues();
    EXPECT_GT(eigenvalues.minCoeff(), 1e-3) << model.size();
  }
}

TEST(DriftModel, MembersOutsideEquation1HaveNoPartInIt) {
  // Least squares over the sphere of any drift of such members by eq. (1) gives zeros, so that the coefficients of eq.
  // (1) mean the same in each model. The points integrate to some thousandths.
  const DriftModel model(vsh(8), {});
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(Esg7::kSize, model.size());
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(model.size());
  for (const Eigen::Vector3d& h : some_directions(4000)) {
    const Eigen::MatrixXd moves = across(h) * basis_of(model, h);
    products += moves.leftCols<Esg7::kSize>().transpose() * moves;
    squares += moves.colwise().squaredNorm();
  }
  const Eigen::VectorXd scale = squares.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd alike = scale.head<Esg7::kSize>().asDiagonal() * products * scale.asDiagonal();
  EXPECT_LT(alike.rightCols(model.size() - Esg7::kSize).cwiseAbs().maxCoeff(), 5e-3);
}

TEST(DriftModel, OfHigherDegreeHasAllMembersOfTheLower) {
  for (int degree = 2; degree <= DriftModelId::kMaxDegree; ++degree) {
    const DriftModel greater(vsh(degree), {});
    const DriftModel lower(vsh(degree - 1), {});
    for (int i = 0; i < lower.size(); ++i) {
      bool found = false;
      for (int j = 0; j < greater.size() && !found; ++j) {
        found = lower.member(i) == greater.member(j);
      }
      EXPECT_TRUE(found) << degree << " " << i;
    }
  }
}

}  // namespace
}  // namespace trihedron
