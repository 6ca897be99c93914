#include "trihedron/core/frames.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numbers>
#include <utility>

#include "trihedron/core/time.hpp"

namespace trihedron {
namespace {

template <class A, class B>
concept Multiplies = requires(A a, B b) {
  a* b;
};
template <class A, class B>
concept Adds = requires(A a, B b) {
  a + b;
};
template <class To, class From>
concept Converts = std::is_convertible_v<From, To> || std::is_constructible_v<To, From>;

// Frames that do not cancel do not compile.
static_assert(Multiplies<Rot<In, C>, Vec<C>>);
static_assert(!Multiplies<Rot<In, C>, Vec<In>>);
static_assert(Multiplies<Rot<In, C>, Rot<C, B<1>>>);
static_assert(!Multiplies<Rot<In, C>, Rot<In, C>>);
static_assert(!Multiplies<Rot<In, C>, Rot<B<1>, C>>);
static_assert(Adds<Vec<C>, Vec<C>>);
static_assert(!Adds<Vec<C>, Vec<In>>);
static_assert(!Adds<Vec<B<1>>, Vec<B<2>>>);
static_assert(!Converts<Vec<C>, Eigen::Vector3d>);
static_assert(!Converts<Rot<In, C>, Eigen::Matrix3d>);
static_assert(!Converts<Rot<In, C>, Rot<C, In>>);
static_assert(std::is_same_v<decltype(std::declval<Rot<In, C>>() * std::declval<Rot<C, B<2>>>()), Rot<In, B<2>>>);
static_assert(std::is_same_v<decltype(std::declval<Rot<In, C>>().inverse()), Rot<C, In>>);
// Frames cost nothing.
static_assert(sizeof(Vec<In>) == sizeof(Eigen::Vector3d));
static_assert(sizeof(Rot<In, C>) == sizeof(Eigen::Matrix3d));

/// Rotation vectors of all lengths up to π, tiny ones and half turns among them.
rc::Gen<Eigen::Vector3d> rotation_vectors() {
  const auto component = rc::gen::map(rc::gen::inRange(-1000, 1001), [](int i) { return i / 1000.0; });
  const auto length =
      rc::gen::elementOf(std::vector<double>{0, 1e-10, 1e-8, 1e-4, 0.99e-3, 1.01e-3, 0.5, 2, std::numbers::pi - 1e-7});
  return rc::gen::apply(
      [](double x, double y, double z, double l) {
        const Eigen::Vector3d v(x, y, z);
        return Eigen::Vector3d(v.norm() > 0 ? v.normalized() * l : Eigen::Vector3d(l, 0, 0));
      },
      component, component, component, length);
}

RC_GTEST_PROP(Rotation, ExpIsOrthonormalAndLogInvertsIt, ()) {
  const Eigen::Vector3d v = *rotation_vectors();
  const auto r = Rot<In, C>::exp(Vec<In>::assume(v));
  RC_ASSERT((r.raw() * r.raw().transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-14);
  RC_ASSERT(std::abs(r.raw().determinant() - 1) < 1e-14);
  // Near a half turn the angle is known to the root of rounding at worst; the quaternion keeps it to rounding.
  RC_ASSERT((r.log().raw() - v).norm() < 1e-14 + 1e-14 * v.norm());
}

RC_GTEST_PROP(Rotation, MatrixQuaternionAndVectorFormsAgree, ()) {
  const Eigen::Vector3d v = *rotation_vectors();
  const Eigen::Vector3d u(0.3, -0.4, 0.5);
  const auto r = Rot<In, C>::exp(Vec<In>::assume(v));
  RC_ASSERT((rotated<double>(u, v) - r.raw() * u).norm() < 1e-15);
  RC_ASSERT((Rot<In, C>::assume(r.quaternion()).raw() - r.raw()).norm() < 1e-14);
  const double angle = v.norm();
  const Eigen::Matrix3d reference =
      angle > 0 ? Eigen::AngleAxisd(angle, v / angle).toRotationMatrix() : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  RC_ASSERT((reference - r.raw()).norm() < 1e-15 + 1e-14 * angle);
}

TEST(Rotation, MapsFromComponentsToToComponents) {
  // 90° about z: the x axis of C points along y of In.
  const auto C_in_c = Rot<In, C>::exp(Vec<In>::assume(0, 0, std::numbers::pi / 2));
  EXPECT_LT((C_in_c * Vec<C>::assume(1, 0, 0) - Vec<In>::assume(0, 1, 0)).norm(), 1e-15);
  const Eigen::Quaterniond q(std::sqrt(0.5), 0, 0, std::sqrt(0.5));
  EXPECT_LT((Rot<In, C>::assume(q).raw() - C_in_c.raw()).norm(), 1e-15);
}

TEST(Rotation, InverseUndoes) {
  const auto r = Rot<In, C>::exp(Vec<In>::assume(0.1, -2, 0.7));
  EXPECT_LT((r.inverse() * r).log().norm(), 1e-15);
}

TEST(Vector, CalculatesWithinItsFrame) {
  const auto a = Vec<C>::assume(1, 2, 3);
  const auto b = Vec<C>::assume(-2, 0, 1);
  EXPECT_DOUBLE_EQ(a.dot(b), 1);
  EXPECT_EQ(a.cross(b).raw(), Eigen::Vector3d(2, -7, 4));
  EXPECT_EQ((2.0 * (a - b) + (-a)).raw(), Eigen::Vector3d(5, 2, 1));
  EXPECT_NEAR(a.normalized().norm(), 1, 1e-15);
  EXPECT_EQ(Vec<C>().norm(), 0);
}

TEST(AngleBetween, IsExactAtBothEnds) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  EXPECT_NEAR(angle_between<double>(x, Eigen::Vector3d(1, 1e-10, 0)), 1e-10, 1e-24);
  EXPECT_NEAR(std::numbers::pi - angle_between<double>(x, Eigen::Vector3d(-1, 1e-10, 0)), 1e-10, 1e-15);
}

TEST(Skew, IsTheCrossProduct) {
  const Eigen::Vector3d a(1, -2, 3);
  const Eigen::Vector3d b(0.5, 4, -1);
  EXPECT_EQ(skew<double>(a) * b, a.cross(b));
}

TEST(Time, SecondsRoundToTheNearestNanosecond) {
  EXPECT_EQ(from_seconds(0.125).count(), 125'000'000);
  EXPECT_EQ(from_seconds(-1e-9 * 0.6).count(), -1);
  EXPECT_EQ(from_seconds(32400.0000000004).count(), 32'400'000'000'000);
  EXPECT_DOUBLE_EQ(to_seconds(from_seconds(1.5)), 1.5);
}

}  // namespace
}  // namespace trihedron
