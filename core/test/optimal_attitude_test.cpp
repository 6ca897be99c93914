#include "trihedron/core/optimal_attitude.hpp"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>

#include "numerical_jacobian.hpp"

namespace trihedron {
namespace {

constexpr int kGyros = 3;

const Rot<In, C> kAttitude = Rot<In, C>::exp(Vec<In>::assume(1, -2, 0.5));

Directions in_space() {
  Directions h{};
  h[0] = Eigen::Vector3d(0.5, 0.6, 0.62).normalized();
  h[1] = Eigen::Vector3d(-0.7, 0.5, 0.5).normalized();
  h[2] = Eigen::Vector3d(0.1, -0.8, 0.6).normalized();
  return h;
}

/// As seen in c, each turned by ρ_k from where it should be.
Directions in_body(const Eigen::Matrix<double, 3 * kGyros, 1>& rho = Eigen::Matrix<double, 3 * kGyros, 1>::Zero()) {
  Directions h = in_space();
  for (int k = 0; k < kGyros; ++k) {
    h[k] = rotated<double>(kAttitude.raw().transpose() * h[k], Eigen::Vector3d(rho.segment<3>(3 * k)));
  }
  return h;
}

constexpr GyroMask kAll = all_gyros(kGyros);

GyroMask all_but(std::initializer_list<int> gyros) {
  GyroMask used = kAll;
  for (const int k : gyros) {
    used[k] = false;
  }
  return used;
}

double off(const Rot<In, C>& attitude) { return (kAttitude.inverse() * attitude).log().norm(); }

TEST(OptimalAttitude, IsExactForDirectionsThatAgree) {
  EXPECT_LT(off(optimal_attitude(in_space(), in_body(), kAll).value().C_in_c), 1e-15);
}

TEST(OptimalAttitude, IsThatOfTheSingularValueDecomposition) {
  // Markley's solution of Wahba's problem, for directions that disagree by half a degree.
  Eigen::Matrix<double, 3 * kGyros, 1> rho;
  rho << 5e-3, -3e-3, 8e-3, -7e-3, 2e-3, 4e-3, 1e-3, 6e-3, -9e-3;
  const Directions in = in_space();
  const Directions c = in_body(rho);
  Eigen::Matrix3d B = Eigen::Matrix3d::Zero();
  for (int k = 0; k < kGyros; ++k) {
    B += in[k] * c[k].transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(B, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant();
  const Eigen::Matrix3d expected = svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  // Three steps of Gauss–Newton: what is left is of the fourth order in the disagreement.
  EXPECT_LT((optimal_attitude(in, c, kAll).value().C_in_c.raw() - expected).norm(), 1e-8);
}

TEST(OptimalAttitude, ErrorFollowsErrorsOfTheDirections) {
  const auto solution = optimal_attitude(in_space(), in_body(), kAll).value();
  // True C = est · exp([ε×]), ε = J (C_c_in φ − ρ): a direction read too far by ρ has the true one at −ρ.
  const auto error = [&](const Eigen::Matrix<double, 3 * kGyros, 1>& rho) {
    const auto moved = optimal_attitude(in_space(), in_body(rho), kAll).value().C_in_c;
    return Eigen::Vector3d((moved.inverse() * solution.C_in_c).log().raw());
  };
  test::expect_jacobian(solution.by_directions.leftCols<3 * kGyros>(),
                        test::central_differences<decltype(error)&, 3 * kGyros>(
                            error, Eigen::Matrix<double, 3 * kGyros, 1>::Zero(), 1e-5),
                        1e-8);
}

TEST(OptimalAttitude, DoesNotLookAtADirectionThatIsNotUsed) {
  Directions c = in_body();
  c[1] = rotated<double>(c[1], Eigen::Vector3d(0.5, 0, 0));
  EXPECT_GT(off(optimal_attitude(in_space(), c, kAll).value().C_in_c), 0.1);
  EXPECT_LT(off(optimal_attitude(in_space(), c, all_but({1})).value().C_in_c), 1e-15);
}

TEST(OptimalAttitude, NeedsTwoDirectionsApart) {
  EXPECT_EQ(optimal_attitude(in_space(), in_body(), all_but({1, 2})).fault(), DirectionsFault::kTooFew);
  Directions in = in_space();
  in[2] = in[1] = -in[0];
  EXPECT_EQ(optimal_attitude(in, in_body(), kAll).fault(), DirectionsFault::kMomentaNearlyParallel);
  // By more than asin(kMinSine).
  for (const double part : {0.98, 1.02}) {
    in = in_space();
    in[1] = rotated<double>(in[0], std::asin(part * kMinSine) * in[0].unitOrthogonal());
    EXPECT_EQ(optimal_attitude(in, in, all_gyros(2)).ok(), part > 1);
  }
  in = in_space();
  in[0].setZero();
  EXPECT_EQ(optimal_attitude(in, in_body(), all_gyros(2)).fault(), DirectionsFault::kNotFinite);
  EXPECT_EQ(optimal_attitude(in_space(), in, all_gyros(2)).fault(), DirectionsFault::kNotFinite);
}

TEST(OptimalAttitude, FaultIsThatOfTheRotation) {
  Directions parallel = in_space();
  parallel[1] = parallel[0];
  EXPECT_FALSE(fault_of_directions(in_space(), in_body(), kAll));
  EXPECT_EQ(fault_of_directions(in_space(), in_body(), all_but({1, 2})), DirectionsFault::kTooFew);
  EXPECT_EQ(fault_of_directions(in_space(), parallel, all_gyros(2)), DirectionsFault::kMomentaNearlyParallel);
}

TEST(OptimalAttitude, OfTwoAlikeIsExactHoweverTheyDisagree) {
  // Both lie in one plane, with one middle.
  Directions in;
  in[0] = Eigen::Vector3d(0.6, 0.8, 0);
  in[1] = Eigen::Vector3d(-0.6, 0.8, 0);
  Directions c;
  c[0] = Eigen::Vector3d(0.8, 0.6, 0);
  c[1] = Eigen::Vector3d(-0.8, 0.6, 0);
  EXPECT_LT(optimal_attitude(in, c, all_gyros(2)).value().C_in_c.log().norm(), 1e-15);
}

TEST(OptimalAttitude, OfTwoIsBetterThanTheTrihedron) {
  // Where both are read with the same noise, the trihedron does not use what the second says about q1.
  Directions in;
  in[0] = Eigen::Vector3d::UnitX();
  in[1] = Eigen::Vector3d::UnitY();
  const auto optimal = optimal_attitude(in, in, all_gyros(2)).value().by_directions;
  const auto trihedron = trihedron_attitude(in, in).value().by_directions;
  EXPECT_NEAR((optimal * optimal.transpose()).trace(), 2.5, 1e-12);
  EXPECT_NEAR((trihedron * trihedron.transpose()).trace(), 3, 1e-12);
}

}  // namespace
}  // namespace trihedron
