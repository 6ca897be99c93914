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

}  // namespace
}  // namespace trihedron
