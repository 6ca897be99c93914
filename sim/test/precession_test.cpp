#include "trihedron/sim/precession.hpp"

#include <gtest/gtest.h>

#include "trihedron/core/drift.hpp"
#include "trihedron/sim/harmonics.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Vector3d;
using Potential = DriftHarmonic::Potential;

template <class Omega>  // omega(t, h)
Vector3d integrate(Vector3d h, double end_s, int steps, const Omega& omega) {
  const double step_s = end_s / steps;
  for (int i = 0; i < steps; ++i) {
    h = precess<double>(
        h, step_s, [&](int stage, const Vector3d& at) -> Vector3d { return omega((i + 0.5 * stage) * step_s, at); });
  }
  return h;
}

const Vector3d kStart = Vector3d(0.6, -0.3, 0.8).normalized();

TEST(Precession, RotatedAgreesWithTheExponentialOfAnyLength) {
  const Vector3d axis = Vector3d(1, -2, 0.5).normalized();
  for (const double angle : {0.0, 1e-12, 1e-7, 9.99e-4, 1.001e-3, 0.5, 3.14159, 7.0}) {
    const Vector3d expected = Eigen::AngleAxisd(angle, axis) * kStart;
    EXPECT_LT((rotated<double>(angle * axis, kStart) - expected).norm(), 1e-15) << angle;
  }
}

TEST(Precession, ConstantRateIsIntegratedExactly) {
  const Vector3d omega(2e-6, -1e-6, 3e-6);
  const double end_s = 32400;
  const Vector3d h = integrate(kStart, end_s, 32400 * 8, [&](double, const Vector3d&) { return omega; });
  const Vector3d expected = Eigen::AngleAxisd(omega.norm() * end_s, omega.normalized()) * kStart;
  // 259 200 roundings of 1e-16, were they all the same way.
  EXPECT_LT((h - expected).norm(), 3e-11);
  EXPECT_NEAR(h.norm(), 1, 3e-11);
}

TEST(Precession, MomentumStaysUnitOverNineHours) {
  Esg7::Coefficients<double> kappa;
  kappa << 5e-6, -3e-6, 2e-6, 4e-6, 1e-6, -5e-6, 3e-6;
  const Vector3d h =
      integrate(kStart, 32400, 32400 * 8, [&](double, const Vector3d& at) { return Esg7::rate<double>(at, kappa); });
  EXPECT_NEAR(h.norm(), 1, 3e-11);
}

TEST(Precession, ErrorFallsWithTheFourthPowerOfTheStep) {
  Esg7::Coefficients<double> kappa;
  kappa << 1.0, -0.6, 0.4, 0.8, 0.2, -1.0, 0.6;
  const auto omega = [&](double t, const Vector3d& h) -> Vector3d {
    // The case turns in space, so that ω depends on time and direction as in flight.
    const Eigen::AngleAxisd turned(1.7 * t, Vector3d(1, 2, 2) / 3);
    return turned * Esg7::rate<double>(turned.inverse() * h, kappa);
  };
  const Vector3d exact = integrate(kStart, 2, 40000, omega);
  double previous = (integrate(kStart, 2, 160, omega) - exact).norm();
  for (const int steps : {320, 640}) {
    const double error = (integrate(kStart, 2, steps, omega) - exact).norm();
    const double order = std::log2(previous / error);
    EXPECT_NEAR(order, 4, 0.25) << steps;
    previous = error;
  }
}

TEST(Precession, ConservativeDriftKeepsItsPotentialInAFixedCase) {
  Esg7::Coefficients<double> k0 = Esg7::Coefficients<double>::Zero();
  k0(Esg7::kK0) = 1;
  const auto quartic = [](const Vector3d& h) { return h.array().pow(4).sum() / 4; };
  const Vector3d by_k0 =
      integrate(kStart, 20, 20000, [&](double, const Vector3d& h) { return Esg7::rate<double>(h, k0); });
  EXPECT_GT((by_k0 - kStart).norm(), 0.1);
  EXPECT_NEAR(quartic(by_k0), quartic(kStart), 1e-13);

  const Vector3d a(0.3, -0.5, 1.1);
  Esg7::Coefficients<double> mu = Esg7::Coefficients<double>::Zero();
  mu.segment<3>(Esg7::kMu12) << a(1) - a(0), a(2) - a(1), a(0) - a(2);
  const auto quadratic = [&](const Vector3d& h) { return h.cwiseAbs2().dot(a) / 2; };
  const Vector3d by_mu =
      integrate(kStart, 20, 20000, [&](double, const Vector3d& h) { return Esg7::rate<double>(h, mu); });
  EXPECT_GT((by_mu - kStart).norm(), 0.1);
  EXPECT_NEAR(quadratic(by_mu), quadratic(kStart), 1e-13);

  const HarmonicField field({{Potential::kW, 3, 1, 1.0}});
  const HarmonicTable table(3);
  const Vector3d by_harmonic = integrate(kStart, 20, 20000, [&](double, const Vector3d& h) { return field.rate(h); });
  EXPECT_GT((by_harmonic - kStart).norm(), 0.1);
  EXPECT_NEAR(table.at(by_harmonic)(3, 1).value, table.at(kStart)(3, 1).value, 1e-13);
}

TEST(Precession, ConservativeDipoleTurnsTheMomentumEvenlyAboutItsAxis) {
  // W = c z: dh/dt = −∇W × h = −c ẑ × h.
  const double c = 0.8;
  const HarmonicField field({{Potential::kW, 1, 0, c / std::sqrt(0.75 / std::numbers::pi)}});
  const Vector3d h = integrate(kStart, 5, 5000, [&](double, const Vector3d& at) { return field.rate(at); });
  const Vector3d expected = Eigen::AngleAxisd(-c * 5, Vector3d::UnitZ()) * kStart;
  EXPECT_LT((h - expected).norm(), 1e-12);
}

TEST(Precession, DissipativeDipoleDrawsTheMomentumToItsAxis) {
  // D = c z: dz/dt = c (1 − z²), so z = tanh(c t + artanh z₀) at unchanged azimuth.
  const double c = 0.8;
  const HarmonicField field({{Potential::kD, 1, 0, c / std::sqrt(0.75 / std::numbers::pi)}});
  const Vector3d h = integrate(kStart, 2, 2000, [&](double, const Vector3d& at) { return field.rate(at); });
  EXPECT_NEAR(h.z(), std::tanh(c * 2 + std::atanh(kStart.z())), 1e-12);
  EXPECT_NEAR(std::atan2(h.y(), h.x()), std::atan2(kStart.y(), kStart.x()), 1e-12);
}

}  // namespace
}  // namespace trihedron::sim
