#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "trihedron/records/calibration.hpp"

namespace trihedron {
namespace {

TEST(OrbitalDrift, IsTheSameFromAnotherTimeOn) {
  const Time zero(std::chrono::hours(1000));
  const OrbitalDrift drift{{4e-8, -3e-8, 2e-8}, {-2e-8, 3e-8, 5e-8}, 1.1e-3, zero};
  const OrbitalDrift other = drift.from(zero + std::chrono::minutes(437));
  const auto at = [](const OrbitalDrift& its, Time t) -> Eigen::Vector3d {
    return std::sin(its.phase(t)) * its.sine_rad_s + std::cos(its.phase(t)) * its.cosine_rad_s;
  };
  EXPECT_EQ(at(drift, zero), drift.cosine_rad_s);
  for (int minutes = -500; minutes < 1000; minutes += 7) {
    const Time t = zero + std::chrono::minutes(minutes);
    EXPECT_LT((at(drift, t) - at(other, t)).norm(), 1e-20) << minutes;
  }
}

TEST(PolhodeDrift, IsTheSameFromAnotherTimeOn) {
  const Time zero(std::chrono::hours(1000));
  PolhodeDrift drift;
  drift.polhode = {7000, 0.02F};
  drift.zero_at = zero;
  drift.sine_rad_s << 1e-8, -2e-8, 3e-8, 4e-8, -5e-8, 6e-8, 7e-8;
  drift.cosine_rad_s << -3e-8, 2e-8, 1e-8, 5e-8, 4e-8, -6e-8, 2e-8;
  const PolhodeDrift other = drift.from(zero + std::chrono::minutes(437));
  const auto at = [](const PolhodeDrift& its, Time t) -> Esg7::Coefficients<double> {
    return std::sin(its.angle_rad(t)) * its.sine_rad_s + std::cos(its.angle_rad(t)) * its.cosine_rad_s;
  };
  EXPECT_EQ(at(drift, zero), drift.cosine_rad_s);
  for (int minutes = -500; minutes < 1000; minutes += 7) {
    const Time t = zero + std::chrono::minutes(minutes);
    EXPECT_LT((at(drift, t) - at(other, t)).norm(), 3e-13) << minutes;  // the period is a float
  }
}

}  // namespace
}  // namespace trihedron
