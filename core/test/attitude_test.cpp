#include "trihedron/core/attitude.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

#include "numerical_jacobian.hpp"
#include "trihedron/core/optimal_attitude.hpp"

namespace trihedron {
namespace {

const auto kH1 = Vec<In>::assume(Eigen::Vector3d(0.5, 0.6, 0.62).normalized());
const auto kH2 = Vec<In>::assume(Eigen::Vector3d(-0.7, 0.5, 0.5).normalized());

TEST(Trihedron, FollowsTheRuleOfThePaper) {
  const auto t = make_trihedron(kH1, kH2).value();
  const Eigen::Matrix3d axes = t.C_f_g.raw();
  EXPECT_LT((axes.transpose() * axes - Eigen::Matrix3d::Identity()).norm(), 1e-15);
  EXPECT_NEAR(axes.determinant(), 1, 1e-15);
  EXPECT_LT((t.q2() - kH1.raw()).norm(), 1e-15);
  EXPECT_NEAR(t.q1().dot(kH2.raw()), 0, 1e-15);
  EXPECT_LT((t.cosine * t.q2() + t.sine * t.q3() - kH2.raw()).norm(), 1e-15);
  EXPECT_NEAR(std::atan2(t.sine, t.cosine), angle_between<double>(kH1.raw(), kH2.raw()), 1e-15);
}

TEST(Trihedron, RejectsMomentaCloserThanLimit) {
  const auto apart = [](double angle) { return Vec<In>::assume(std::cos(angle), std::sin(angle), 0); };
  const auto x = Vec<In>::assume(1, 0, 0);
  const double limit = std::asin(kMinSine);
  EXPECT_TRUE(make_trihedron(x, apart(limit * 1.001)).ok());
  for (const double angle : {0.0, 1e-10, limit * 0.999, std::numbers::pi - limit * 0.999, std::numbers::pi}) {
    const auto t = make_trihedron(x, apart(angle));
    ASSERT_FALSE(t.ok()) << angle;
    EXPECT_EQ(t.fault(), DirectionsFault::kMomentaNearlyParallel);
  }
}

TEST(Trihedron, RejectsWhatIsNoDirection) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const auto& bad : {Vec<In>::assume(nan, 0, 1), Vec<In>::assume(0, infinity, 0), Vec<In>()}) {
    EXPECT_EQ(make_trihedron(kH1, bad).fault(), DirectionsFault::kNotFinite);
    EXPECT_EQ(make_trihedron(bad, kH2).fault(), DirectionsFault::kNotFinite);
  }
}

Directions two(const Eigen::Vector3d& first, const Eigen::Vector3d& second) {
  Directions directions;
  directions[0] = first;
  directions[1] = second;
  return directions;
}
Rot<In, C> attitude(const Vec<In>& h1_in, const Vec<In>& h2_in, const Vec<C>& h1_c, const Vec<C>& h2_c) {
  return trihedron_rotation(two(h1_in.raw(), h2_in.raw()), two(h1_c.raw(), h2_c.raw())).value();
}

TEST(Attitude, LaysTheFirstDirectionsAndThePlanesOnEachOther) {
  const Eigen::Vector3d h2_c = kH2.raw() + Eigen::Vector3d(0, 0.01, 0.02);  // at another angle from the first
  const Eigen::Matrix3d C_in_c = attitude(kH1, kH2, Vec<C>::assume(kH1.raw()), Vec<C>::assume(h2_c)).raw();
  EXPECT_LT((C_in_c * kH1.raw() - kH1.raw()).norm(), 1e-15);
  EXPECT_NEAR((C_in_c * h2_c).dot(kH1.raw().cross(kH2.raw())), 0, 1e-15);
  EXPECT_GT((C_in_c * h2_c).dot(kH2.raw()), 0);
}

TEST(Attitude, SaysWhyThereIsNone) {
  const Directions good = two(kH1.raw(), kH2.raw());
  const Directions parallel = two(kH1.raw(), kH1.raw() + 0.01 * kH2.raw());
  const Directions bad = two(kH1.raw(), {0, std::numeric_limits<double>::quiet_NaN(), 1});
  const Directions zero = two(kH1.raw(), Eigen::Vector3d::Zero());
  for (const auto& [its, fault] :
       {std::pair(parallel, DirectionsFault::kMomentaNearlyParallel), std::pair(bad, DirectionsFault::kNotFinite),
        std::pair(zero, DirectionsFault::kNotFinite)}) {
    EXPECT_EQ(trihedron_rotation(its, good).fault(), fault);
    EXPECT_EQ(trihedron_rotation(good, its).fault(), fault);
    EXPECT_EQ(trihedron_attitude(good, its).fault(), fault);
  }
}

/// Two ways of rounding may not agree at the limit on whether there is one.
TEST(Attitude, OfDirectionsAtTheLimitIsThereOrNot) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> near(-5e-17, 5e-17);
  std::uniform_real_distribution<double> length(0.99, 1.01);
  const auto direction = [&] {
    return Eigen::Vector3d::NullaryExpr([&] { return normal(random); }).normalized().eval();
  };
  int without_derivatives = 0;
  for (int i = 0; i < 40000; ++i) {
    const Eigen::Vector3d first = direction();
    const Eigen::Vector3d across = first.cross(direction()).normalized();
    const double angle = std::asin(kMinSine) + near(random);
    const Directions both =
        two(first * length(random), (std::cos(angle) * first + std::sin(angle) * across) * length(random));
    const bool is_there = trihedron_rotation(both, both).ok();
    const bool with_derivatives = trihedron_attitude(both, both).ok();
    EXPECT_TRUE(is_there || !with_derivatives);
    without_derivatives += is_there && !with_derivatives ? 1 : 0;
  }
  EXPECT_GT(without_derivatives, 10);
}

TEST(Attitude, IsRecoveredFromTwoDirections) {
  const auto C_in_c = Rot<In, C>::exp(Vec<In>::assume(1, -2, 0.5));
  EXPECT_LT((attitude(kH1, kH2, C_in_c.inverse() * kH1, C_in_c.inverse() * kH2).inverse() * C_in_c).log().norm(),
            1e-15);
}

TEST(Attitude, ErrorFollowsErrorsOfTheDirections) {
  const auto C_in_c = Rot<In, C>::exp(Vec<In>::assume(1, -2, 0.5));
  const auto h1_c = C_in_c.inverse() * kH1;
  const auto h2_c = C_in_c.inverse() * kH2;
  const auto c = make_trihedron(h1_c, h2_c).value();
  // ρ on the inertial side, in c axes: true C = exp([ε×]) est in `in`, so ε in c is log of estᵀ true.
  const auto error = [&](const Eigen::Matrix<double, 6, 1>& rho) {
    const auto turned = [&](const Vec<In>& h, const Eigen::Vector3d& by_c) {
      return Vec<In>::assume(rotated<double>(h.raw(), C_in_c.raw() * by_c));
    };
    const auto found = attitude(turned(kH1, rho.head<3>()), turned(kH2, rho.tail<3>()), h1_c, h2_c);
    return Eigen::Vector3d((C_in_c.inverse() * found).log().raw());
  };
  test::expect_jacobian(
      attitude_by_directions(c),
      test::central_differences<decltype(error)&, 6>(error, Eigen::Matrix<double, 6, 1>::Zero(), 1e-5), 1e-8);
}

TEST(Attitude, FollowsARigidTurnOfBothDirections) {
  const auto t = make_trihedron(kH1, kH2).value();
  const Eigen::Matrix<double, 3, 6> j = attitude_by_directions(t);
  EXPECT_LT((j.leftCols<3>() + j.rightCols<3>() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
}

}  // namespace
}  // namespace trihedron
