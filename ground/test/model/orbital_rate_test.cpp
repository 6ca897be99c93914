#include "model/orbital_rate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

namespace trihedron::ground {
namespace {

/// Fixes each 3 s of a body that turns about its y axis at this rate, with the noise of a star tracker, and that holds
/// a roll of 0.5 rad between two times, turned to and back within a minute each.
StarTrackerTelemetry fixes_of(double rate_rad_s, double hours, double slew_from_s, double slew_until_s) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  StarTrackerTelemetry fixes;
  for (double t_s = 0; t_s < 3600 * hours; t_s += 3) {
    const double roll_rad =
        0.5 * (std::clamp((t_s - slew_from_s) / 60, 0.0, 1.0) - std::clamp((t_s - slew_until_s) / 60, 0.0, 1.0));
    const Eigen::Vector3d noise_rad(1.45e-5 * normal(random), 1.45e-5 * normal(random), 9.7e-5 * normal(random));
    fixes.t.push_back(Time{} + from_seconds(t_s));
    fixes.q_in_c.push_back(Eigen::Quaterniond(Eigen::AngleAxisd(rate_rad_s * t_s, Eigen::Vector3d::UnitY()) *
                                              Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX())) *
                           Rot<C, C>::exp(Vec<C>::assume(noise_rad)).quaternion());
  }
  return fixes;
}

TEST(OrbitalRate, IsThatOfAnyOrbit) {
  for (const double rate_rad_s : {1.12e-3, 9.97e-4, 3e-4, 7.3e-5}) {
    EXPECT_NEAR(orbital_rate_rad_s(fixes_of(rate_rad_s, 9, 3000, 4000)), rate_rad_s, 1e-3 * rate_rad_s);
  }
}

TEST(OrbitalRate, IsThatOfALowOrbitWhereTheAttitudeIsFixedInSpace) {
  EXPECT_EQ(orbital_rate_rad_s(fixes_of(0, 9, 3000, 4000)), kLowOrbit_rad_s);
  EXPECT_EQ(orbital_rate_rad_s(fixes_of(0, 2, 3000, 1e9)), kLowOrbit_rad_s);  // turned once, to stay: 7e-5 rad/s
  EXPECT_EQ(orbital_rate_so_far_rad_s(fixes_of(0, 0.5, 1e9, 1e9)), std::nullopt);
  EXPECT_EQ(orbital_rate_so_far_rad_s({}), std::nullopt);
}

TEST(OrbitalRate, IsNotToldByABodyThatSpins) {
  for (const double rate_rad_s : {1.5e-3, 0.01}) {
    EXPECT_EQ(orbital_rate_rad_s(fixes_of(rate_rad_s, 9, 3000, 4000)), kLowOrbit_rad_s);
    EXPECT_EQ(orbital_rate_so_far_rad_s(fixes_of(rate_rad_s, 0.5, 1e9, 1e9)), std::nullopt);
  }
}

/// Of a body that slews there and back all the time the rate over a minute is usually several times that of its orbit.
TEST(OrbitalRate, IsNotThatOfSlews) {
  const auto agile = [](double hours) {
    StarTrackerTelemetry fixes = fixes_of(1.12e-3, hours, 1e9, 1e9);
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      const double phase = std::fmod(to_seconds(fixes.t[i] - Time{}), 130) / 130;
      fixes.q_in_c[i] =
          fixes.q_in_c[i] * Eigen::Quaterniond(Eigen::AngleAxisd(std::abs(phase - 0.5), Eigen::Vector3d::UnitX()));
    }
    return fixes;
  };
  EXPECT_EQ(orbital_rate_so_far_rad_s(agile(1.0 / 3)), std::nullopt);
  EXPECT_NEAR(orbital_rate_so_far_rad_s(agile(1.33)).value_or(0), 1.12e-3, 4e-5);
  EXPECT_NEAR(orbital_rate_so_far_rad_s(agile(2.67)).value_or(0), 1.12e-3, 2e-5);
}

TEST(OrbitalRate, IsKnownSoonInASlewThatIsNotTakenBack) {
  for (const double rate_rad_s : {1.12e-3, 9.97e-4, 7.3e-5}) {
    const StarTrackerTelemetry fixes = fixes_of(rate_rad_s, 1.0 / 3, 800, 1e9);
    EXPECT_NEAR(orbital_rate_so_far_rad_s(fixes).value_or(0), rate_rad_s, 0.01 * rate_rad_s);
  }
  EXPECT_NEAR(orbital_rate_so_far_rad_s(fixes_of(9.97e-4, 3, 3000, 4000)).value_or(0), 9.97e-4, 1e-6);
}

}  // namespace
}  // namespace trihedron::ground
