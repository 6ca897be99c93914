#include "trihedron/sim/orbit.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace trihedron::sim {
namespace {

OrbitScenario round_orbit(double altitude_m, double inclination_rad) {
  OrbitScenario orbit;
  orbit.perigee_altitude_m = orbit.apogee_altitude_m = altitude_m;
  orbit.inclination_rad = inclination_rad;
  return orbit;
}

TEST(Kepler, EccentricAnomalySolvesItsEquation) {
  for (const double e : {0.0, 1e-10, 0.018, 0.0999, 0.1, 0.5, 0.9, 0.999}) {
    for (int i = -100; i <= 100; ++i) {
      const double m = i * std::numbers::pi / 100;
      const double anomaly = eccentric_anomaly(m, e);
      // Rounding of the sine and the subtraction.
      ASSERT_NEAR(anomaly - e * std::sin(anomaly), m, 2e-15) << e << " " << m;
    }
  }
}

TEST(Orbit, DefaultIsThatOfResursDk1) {
  const KeplerJ2 orbit{OrbitScenario{}};
  double low = 1e9;
  double high = 0;
  for (double t = 0; t < 6000; t += 1) {
    const double altitude = orbit.at(t).position_m.norm() - kEarthRadius_m;
    low = std::min(low, altitude);
    high = std::max(high, altitude);
  }
  // At ± 0.5 s from the apse the altitude is off by e a n² t² / 2 < 1 m.
  EXPECT_NEAR(low, 360e3, 1);
  EXPECT_NEAR(high, 604e3, 1);
  const OrbitState s = orbit.at(1234);
  EXPECT_NEAR(s.position_m.cross(s.velocity_m_s).normalized().raw().z(), std::cos(70 * kDegree), 1e-14);
}

TEST(Orbit, RadiusRepeatsWithTheAnomalisticPeriod) {
  const KeplerJ2 orbit{OrbitScenario{}};
  const double period_s = 2 * std::numbers::pi / orbit.anomaly_rate_rad_s();
  for (const double t : {0.0, 700.0, 2500.0, 5000.0}) {
    // 1e-8 m of 7e6 m is rounding.
    EXPECT_NEAR(orbit.at(t).position_m.norm(), orbit.at(t + period_s).position_m.norm(), 1e-7);
  }
}

TEST(Orbit, PeriodWithoutJ2IsKeplers) {
  // Where 3 cos²i = 1 the first-order rate of the mean anomaly has no J2.
  const KeplerJ2 orbit(round_orbit(500e3, std::acos(std::sqrt(1.0 / 3))));
  const double a = kEarthRadius_m + 500e3;
  EXPECT_NEAR(orbit.anomaly_rate_rad_s() / std::sqrt(kEarthGravity_m3_s2 / (a * a * a)), 1, 1e-14);
}

TEST(Orbit, SunSynchronousNodeFollowsTheSun) {
  // 700 km, 98.19°: the textbook case; a tropical year's 360° in 365.2422 days, to the two digits of the inclination.
  const KeplerJ2 orbit(round_orbit(700e3, 98.19 * kDegree));
  EXPECT_NEAR(orbit.node_rate_rad_s() * 86400 / kDegree, 360 / 365.2422, 0.001);
}

TEST(Orbit, PerigeeStandsAtTheCriticalInclination) {
  OrbitScenario orbit;
  orbit.inclination_rad = std::acos(std::sqrt(0.2));
  EXPECT_NEAR(KeplerJ2(orbit).perigee_rate_rad_s(), 0, 1e-21);
}

TEST(Orbit, NodeAndPerigeeMoveAtTheirRates) {
  const KeplerJ2 orbit{OrbitScenario{}};
  const double later_s = 86400;
  const auto node_of = [](const OrbitState& s) {
    const Eigen::Vector3d normal = s.position_m.cross(s.velocity_m_s).raw();
    return std::atan2(normal.x(), -normal.y());
  };
  EXPECT_NEAR(node_of(orbit.at(later_s)) - node_of(orbit.at(0)), orbit.node_rate_rad_s() * later_s, 1e-12);

  // The eccentricity vector points to the perigee; its angle from the node is the argument.
  const auto perigee_of = [&](const OrbitState& s) {
    const Eigen::Vector3d r = s.position_m.raw();
    const Eigen::Vector3d v = s.velocity_m_s.raw();
    const Eigen::Vector3d e = v.cross(r.cross(v)) / kEarthGravity_m3_s2 - r.normalized();
    const double node = node_of(s);
    const Eigen::Vector3d to_node(std::cos(node), std::sin(node), 0);
    return std::atan2(r.cross(v).normalized().dot(to_node.cross(e)), to_node.dot(e));
  };
  // The velocity belongs to the ellipse of the moment: 1e-16 of e = 0.018 leaves 1e-13.
  EXPECT_NEAR(perigee_of(orbit.at(later_s)) - perigee_of(orbit.at(0)), orbit.perigee_rate_rad_s() * later_s, 1e-11);
}

TEST(Orbit, VelocityIsTheDerivativeOfPositionButForJ2) {
  const KeplerJ2 orbit{OrbitScenario{}};
  const double half_s = 0.5;
  for (double t = 0; t < 6000; t += 500) {
    const Eigen::Vector3d difference =
        (orbit.at(t + half_s).position_m.raw() - orbit.at(t - half_s).position_m.raw()) / (2 * half_s);
    // J2 moves the ellipse by up to 1.6 J2 (R/p)² of the motion; the curvature over 1 s is 1e-7 of it.
    EXPECT_LT((difference - orbit.at(t).velocity_m_s.raw()).norm(), 2 * kEarthJ2 * difference.norm());
  }
}

TEST(Orbit, RefusesApsesThatMakeNoSense) {
  OrbitScenario orbit;
  orbit.perigee_altitude_m = 700e3;
  EXPECT_THROW(KeplerJ2{orbit}, std::invalid_argument);
  orbit.perigee_altitude_m = std::nan("");
  EXPECT_THROW(KeplerJ2{orbit}, std::invalid_argument);
}

using Interpolation = EphemerisSegment::Interpolation;

/// States of the default orbit, whose velocity is not the derivative of its position to the last.
EphemerisSegment told(double begin_s, double end_s, double step_s, Interpolation interpolation, int degree) {
  const KeplerJ2 orbit{OrbitScenario{}};
  EphemerisSegment its{begin_s, end_s, interpolation, degree, {}, {}, {}};
  for (double t_s = begin_s; t_s <= end_s; t_s += step_s) {
    its.t_s.push_back(t_s);
    its.position_m.push_back(orbit.at(t_s).position_m.raw());
    its.velocity_m_s.push_back(orbit.at(t_s).velocity_m_s.raw());
  }
  return its;
}

TEST(ToldEphemeris, GoesThroughItsStatesAndAPolynomialOfItsDegree) {
  for (const auto interpolation : {Interpolation::kHermite, Interpolation::kLagrange}) {
    for (const int degree : {1, 2, 3, 6, 7, 8}) {
      // A polynomial of that degree on top of an orbit's radius, at uneven steps; Lagrange takes the velocity by
      // itself.
      EphemerisSegment its{0, 1000, interpolation, degree, {}, {}, {}};
      const auto position = [&](double t_s) {
        return Eigen::Vector3d(7e6 + 1e5 * std::pow(t_s / 1000, degree), 2e5 * t_s / 1000, -3e4);
      };
      const auto velocity = [&](double t_s) {
        return Eigen::Vector3d(100 * degree * std::pow(t_s / 1000, degree - 1), 200, 0);
      };
      for (const double t_s : {0.0, 50.0, 130.0, 200.0, 330.0, 410.0, 500.0, 640.0, 700.0, 810.0, 940.0, 1000.0}) {
        its.t_s.push_back(t_s);
        its.position_m.push_back(position(t_s));
        its.velocity_m_s.push_back(velocity(t_s));
      }
      const ToldEphemeris orbit({its}, 0, 1000);
      for (double t_s = 0; t_s <= 1000; t_s += 12.5) {
        EXPECT_LT((orbit.at(t_s).position_m.raw() - position(t_s)).norm(), 1e-5) << degree << " " << t_s;
        EXPECT_LT((orbit.at(t_s).velocity_m_s.raw() - velocity(t_s)).norm(), 1e-6) << degree << " " << t_s;
      }
    }
  }
}

TEST(ToldEphemeris, IsTheOrbitThatItWasTakenFrom) {
  const KeplerJ2 truth{OrbitScenario{}};
  const ToldEphemeris orbit(
      {told(-60, 6000, 60, Interpolation::kLagrange, 9), told(6000, 12060, 60, Interpolation::kLagrange, 9)}, 0, 12000);
  for (double t_s = 0; t_s <= 12000; t_s += 7) {
    EXPECT_LT((orbit.at(t_s).position_m.raw() - truth.at(t_s).position_m.raw()).norm(), 1e-2);
    EXPECT_LT((orbit.at(t_s).velocity_m_s.raw() - truth.at(t_s).velocity_m_s.raw()).norm(), 1e-5);
  }
  // Two revolutions, within which perigee turns by 0.2°; it changes the time of one by 2 e of that.
  EXPECT_NEAR(orbit.mean_rate_rad_s() / truth.mean_rate_rad_s(), 1, 3e-5);
  // Of a part of a revolution the size of the orbit says it; J2 and the place on it matter then.
  const ToldEphemeris part({told(0, 600, 60, Interpolation::kHermite, 7)}, 0, 600);
  EXPECT_NEAR(part.mean_rate_rad_s() / truth.mean_rate_rad_s(), 1, 3e-3);
}

TEST(ToldEphemeris, ThatDoesNotReachIsRefused) {
  const auto one = told(0, 600, 60, Interpolation::kHermite, 7);
  const auto later = told(660, 1200, 60, Interpolation::kHermite, 7);
  EXPECT_NO_THROW(ToldEphemeris({one}, 0, 600));
  EXPECT_THROW(ToldEphemeris({one}, -1, 600), std::invalid_argument);
  EXPECT_THROW(ToldEphemeris({one}, 0, 601), std::invalid_argument);
  EXPECT_THROW(ToldEphemeris({one, later}, 0, 1200), std::invalid_argument);  // a gap
  EXPECT_THROW(ToldEphemeris({}, 0, 1), std::invalid_argument);
  EphemerisSegment leaving = one;
  for (Eigen::Vector3d& velocity : leaving.velocity_m_s) {
    velocity *= 2;
  }
  EXPECT_THROW(ToldEphemeris({leaving}, 0, 600), std::invalid_argument);
}

}  // namespace
}  // namespace trihedron::sim
