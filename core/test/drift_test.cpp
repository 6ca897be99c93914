#include "trihedron/core/drift.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

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

// The structure of eq. (1): mathematics, "Drift model". Tolerances are some roundings of numbers near one.
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

}  // namespace
}  // namespace trihedron
