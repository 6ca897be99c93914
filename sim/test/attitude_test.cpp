#include "trihedron/sim/attitude.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "statistics.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Reference = AttitudeScenario::Reference;

constexpr double kPass_s = 32400;

/// No slews, no jitter.
AttitudeScenario still(Reference reference) {
  AttitudeScenario scenario;
  scenario.reference = reference;
  scenario.slews = std::vector<Slew>{};
  scenario.jitter_rad = 0;
  return scenario;
}

double angle_between_attitudes(const Rot<In, C>& a, const Rot<In, C>& b) { return (a.inverse() * b).log().norm(); }

TEST(Attitude, OrbitalAxesAreAlongTrackNormalAndUp) {
  const KeplerJ2 orbit{OrbitScenario{}};
  for (double t = 0; t < 6000; t += 300) {
    const OrbitState s = orbit.at(t);
    const Eigen::Matrix3d axes = orbital_attitude(s).raw();
    EXPECT_LT((axes.transpose() * axes - Eigen::Matrix3d::Identity()).norm(), 1e-15);
    EXPECT_NEAR(axes.determinant(), 1, 1e-15);
    EXPECT_NEAR(axes.col(2).dot(s.position_m.normalized().raw()), 1, 1e-15);
    EXPECT_NEAR(axes.col(1).dot(s.position_m.cross(s.velocity_m_s).normalized().raw()), 1, 1e-15);
    EXPECT_GT(axes.col(0).dot(s.velocity_m_s.normalized().raw()), 0.99);  // the flight path leans by e at most
  }
}

TEST(Attitude, OrbitalAttitudeTurnsAboutTheOrbitNormalOncePerRevolution) {
  const KeplerJ2 orbit{OrbitScenario{}};
  const AttitudeProgramme attitude(still(Reference::kOrbital), orbit, 0, 0, kPass_s);
  const double revolution_s = 2 * std::numbers::pi / orbit.mean_rate_rad_s();
  Vector3d sum = Vector3d::Zero();
  constexpr int kSteps = 1000;
  for (int i = 0; i < kSteps; ++i) {
    sum += attitude.rate((i + 0.5) * revolution_s / kSteps).raw() / kSteps;
  }
  // The node adds its part along the normal, cos i, and leaves what is across small. The perigee moves in a revolution,
  // and the equation of the centre, 2 e + 5/2 e², with it.
  EXPECT_NEAR(sum.y(), orbit.mean_rate_rad_s() + orbit.node_rate_rad_s() * std::cos(70 * kDegree),
              2.1 * orbit.eccentricity() * std::abs(orbit.perigee_rate_rad_s()));
  EXPECT_NEAR(sum.z(), 0, std::abs(orbit.node_rate_rad_s()));
  EXPECT_NEAR(sum.x(), 0, std::abs(orbit.node_rate_rad_s()));
}

TEST(Attitude, TabulatedReferenceIsTheFormula) {
  const KeplerJ2 orbit{OrbitScenario{}};
  const AttitudeProgramme orbital(still(Reference::kOrbital), orbit, 0, 0, kPass_s);
  const AttitudeProgramme steered(still(Reference::kYawSteered), orbit, 0, 0, kPass_s);
  for (double t = 0; t <= kPass_s; t += 97.3) {
    // 5/384 (rate/2 × 2 s)⁴ = 2e-14 rad, and the faster harmonics of an eccentric orbit.
    EXPECT_LT(angle_between_attitudes(orbital.at(t), orbital_attitude(orbit.at(t))), 1e-12);
    EXPECT_LT(angle_between_attitudes(steered.at(t), yaw_steered_attitude(orbit.at(t))), 1e-12);
  }
}

TEST(Attitude, YawSteeringLetsTheGroundMoveAlongX) {
  const KeplerJ2 orbit{OrbitScenario{}};
  double most = 0;
  for (double t = 0; t < 6000; t += 100) {
    const OrbitState s = orbit.at(t);
    const Vector3d ground = s.velocity_m_s.raw() - Vector3d(0, 0, kEarthRate_rad_s).cross(s.position_m.raw());
    const Vector3d ground_c = yaw_steered_attitude(s).raw().transpose() * ground;
    EXPECT_NEAR(ground_c.y() / ground_c.x(), 0, 1e-15);
    EXPECT_GT(ground_c.x(), 0);
    most = std::max(most, angle_between_attitudes(yaw_steered_attitude(s), orbital_attitude(s)));
  }
  // At the equator crossing the ground's speed across the track is Ω r sin i of 7.5 km/s: about 3.7°.
  EXPECT_NEAR(most, 3.7 * kDegree, 0.3 * kDegree);
}

TEST(Slews, TurnsKeepTheirLimitsAndUseThem) {
  const double max_rate = 0.5 * kDegree;
  const double max_acceleration = 0.02 * kDegree;
  for (const double angle : {1 * kDegree, 90 * kDegree}) {  // the first is bound by acceleration, the second by rate
    const SlewPlan plan({{.begin_s = 10, .roll_rad = angle}}, max_rate, max_acceleration);
    double rate = 0;
    double acceleration = 0;
    double previous_rate = 0;
    const double step = 0.01;
    for (double t = 0; t < 10 + plan.turns().front().end_s; t += step) {
      const double now = 2 * (plan.at(t).conjugate() * plan.at(t + step)).vec().x() / step;
      rate = std::max(rate, std::abs(now));
      acceleration = std::max(acceleration, std::abs(now - previous_rate) / step);
      previous_rate = now;
    }
    // Differences over 0.01 s see 1e-4 of the limits less than there is; 1e-9 rounding of the second difference.
    EXPECT_LE(rate, max_rate * (1 + 1e-6));
    EXPECT_LE(acceleration, max_acceleration * (1 + 1e-4));
    EXPECT_GT(std::max(rate / max_rate, acceleration / max_acceleration), 0.999);
  }
}

TEST(Slews, ListReachesItsTargetsAndStaysThere) {
  const SlewPlan plan({{.begin_s = 100, .roll_rad = 30 * kDegree},
                       {.begin_s = 500, .roll_rad = -20 * kDegree, .pitch_rad = 10 * kDegree, .yaw_rad = 5 * kDegree},
                       {.begin_s = 900}},
                      0.5 * kDegree, 0.02 * kDegree);
  EXPECT_TRUE(plan.at(99.9).isApprox(Quaterniond::Identity(), 1e-15));
  for (const double t : {300.0, 499.9}) {
    EXPECT_LT(plan.at(t).angularDistance(Quaterniond(Eigen::AngleAxisd(30 * kDegree, Vector3d::UnitX()))), 1e-14);
  }
  const Quaterniond target = Eigen::AngleAxisd(5 * kDegree, Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(10 * kDegree, Vector3d::UnitY()) *
                             Eigen::AngleAxisd(-20 * kDegree, Vector3d::UnitX());
  EXPECT_LT(plan.at(899).angularDistance(target), 1e-14);
  EXPECT_LT(plan.at(2000).angularDistance(Quaterniond::Identity()), 1e-14);
}

TEST(Slews, RefuseToBeginBeforeTheLastHasEnded) {
  const std::vector<Slew> slews = {{.begin_s = 0, .roll_rad = 0.5}, {.begin_s = 1}};
  EXPECT_THROW(SlewPlan(slews, 0.5 * kDegree, 0.02 * kDegree), std::invalid_argument);
  EXPECT_THROW(SlewPlan({}, 0, 0.02 * kDegree), std::invalid_argument);
}

TEST(Slews, ImagingProgrammeFillsThePassWithinItsLimits) {
  const ImagingProgramme programme;
  const double rate = 0.5 * kDegree;
  const double acceleration = 0.02 * kDegree;
  const std::vector<Slew> slews =
      imaging_slews(programme, rate, acceleration, 20 * kPass_s, Stream(1, Source::kImaging));
  EXPECT_NO_THROW(SlewPlan(slews, rate, acceleration));
  double most_roll = 0;
  double most_pitch = 0;
  for (const Slew& slew : slews) {
    most_roll = std::max(most_roll, std::abs(slew.roll_rad));
    most_pitch = std::max(most_pitch, std::abs(slew.pitch_rad));
  }
  const double targets = static_cast<double>(slews.size()) / 2;
  // The most of n even draws is short of the limit by 1/n on average, 10/n with a chance of 5e-5.
  EXPECT_LE(most_roll, programme.max_roll_rad);
  EXPECT_GT(most_roll, programme.max_roll_rad * (1 - 10 / targets));
  EXPECT_LE(most_pitch, programme.max_pitch_rad);
  EXPECT_GT(most_pitch, programme.max_pitch_rad * (1 - 10 / targets));

  double rest = slews.front().begin_s;
  for (std::size_t i = 1; i + 1 < slews.size(); i += 2) {
    const double turn = slews[i].begin_s - slews[i - 1].begin_s - programme.dwell_s;
    rest += slews[i + 1].begin_s - slews[i].begin_s - turn;
  }
  EXPECT_NEAR(rest / targets, programme.mean_rest_s, test::kBand * programme.mean_rest_s / std::sqrt(targets));
}

TEST(Jitter, HasUnitVarianceAtEveryPhaseAndIndependentAxes) {
  const double bandwidth_hz = 0.1863;  // knots 1 s apart
  constexpr std::size_t kN = 100'000;
  const SmoothNoise noise(bandwidth_hz, 0, 4.0 * kN, Stream(1, Source::kJitter));
  for (const double phase : {0.0, 0.25, 0.5}) {
    std::array<test::Sequence, 3> x;
    for (std::size_t i = 0; i < kN; ++i) {
      const Vector3d value =
          noise.at(4 * static_cast<double>(i) + phase);  // nearly independent: the spline spans 6 knots
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        x[static_cast<std::size_t>(axis)].push_back(value(axis));
      }
    }
    for (const test::Sequence& axis : x) {
      // The variance ripples by 1 % between the knots.
      EXPECT_NEAR(test::mean_square(axis), 1, 0.01 + test::kBand * test::mean_square_sigma(kN));
    }
    EXPECT_NEAR(test::correlation(x[0], x[1]), 0, test::kBand * test::correlation_sigma(kN));
    EXPECT_NEAR(test::correlation(x[0], x[2]), 0, test::kBand * test::correlation_sigma(kN));
  }
}

TEST(Jitter, HasHalfItsPowerAtTheBandwidthAndNoneFarAbove) {
  const double bandwidth_hz = 0.02;
  const double step_s = 1;
  constexpr std::size_t kN = 2000;
  constexpr int kRuns = 400;
  double low = 0;
  double half = 0;
  double far = 0;
  for (int run = 0; run < kRuns; ++run) {
    const SmoothNoise noise(bandwidth_hz, 0, kN * step_s, Stream(static_cast<std::uint64_t>(run), Source::kJitter));
    test::Sequence x(kN);
    for (std::size_t i = 0; i < kN; ++i) {
      // A Hann window keeps the ends from leaking into the far frequencies.
      const double window = std::sin(std::numbers::pi * static_cast<double>(i) / kN);
      x[i] = window * window * noise.at(static_cast<double>(i) * step_s).x();
    }
    low += test::power_at(x, 0.002 * step_s) / kRuns;
    half += test::power_at(x, bandwidth_hz * step_s) / kRuns;
    far += test::power_at(x, 5 * bandwidth_hz * step_s) / kRuns;
  }
  // Each power has a relative chance of 1/√runs; sinc¹² at a tenth of the bandwidth is 0.993.
  EXPECT_NEAR(half / low, 0.5, 0.5 * test::kBand * std::sqrt(2.0 / kRuns));
  EXPECT_LT(far / low, 1e-6);
}

TEST(Jitter, IsFourTimesDifferentiableAtTheKnots) {
  const SmoothNoise noise(0.1863, 0, 100, Stream(1, Source::kJitter));
  const double step = 1e-2;
  for (double knot = 10; knot < 20; knot += 1) {
    const auto fourth = [&](double at) -> Vector3d {
      return (noise.at(at - 2 * step) - 4 * noise.at(at - step) + 6 * noise.at(at) - 4 * noise.at(at + step) +
              noise.at(at + 2 * step)) /
             std::pow(step, 4);
    };
    // Over 2 × 2.5 steps the fourth derivative, of order 10, changes by its own derivative, of order 50; a jump would
    // show as 10.
    EXPECT_LT((fourth(knot + 2.5 * step) - fourth(knot - 2.5 * step)).norm(), 6);
  }
}

TEST(RecordedAttitude, PassesThroughItsSamplesWhateverTheirSigns) {
  const KeplerJ2 orbit{OrbitScenario{}};
  std::vector<AttitudeSample> samples;
  for (int i = 0; i < 50; ++i) {
    const double t = 10 * i + i % 3;
    Quaterniond q = orbital_attitude(orbit.at(t)).quaternion();
    q.coeffs() *= i % 2 == 0 ? 1 : -1;
    samples.push_back({t, q});
  }
  const AttitudeSpline spline(samples);
  for (const AttitudeSample& sample : samples) {
    EXPECT_LT(spline.at(sample.t_s).angularDistance(sample.q_in_c), 1e-14);
  }
  // Away from the ends: 5/384 (n/2 × 11 s)⁴ < 1e-10 rad.
  EXPECT_LT(spline.at(254).angularDistance(orbital_attitude(orbit.at(254)).quaternion()), 1e-10);
}

TEST(RecordedAttitude, PassesThroughSamplesOfAnySpacing) {
  const KeplerJ2 orbit{OrbitScenario{}};
  std::vector<AttitudeSample> samples;
  for (int i = 0; i < 30; ++i) {
    const double t = i * i;
    samples.push_back({t, orbital_attitude(orbit.at(t)).quaternion()});
  }
  const AttitudeSpline spline(samples);
  for (const AttitudeSample& sample : samples) {
    EXPECT_LT(spline.at(sample.t_s).angularDistance(sample.q_in_c), 1e-14);
  }
}

TEST(RecordedAttitude, RefusesWhatItCannotJoin) {
  const Quaterniond one = Quaterniond::Identity();
  const Quaterniond far(Eigen::AngleAxisd(100 * kDegree, Vector3d::UnitX()));
  EXPECT_THROW(AttitudeSpline({{0, one}}), std::invalid_argument);
  EXPECT_THROW(AttitudeSpline({{0, one}, {0, one}}), std::invalid_argument);
  EXPECT_THROW(AttitudeSpline({{0, one}, {1, far}}), std::invalid_argument);

  AttitudeScenario scenario = still(Reference::kRecorded);
  scenario.recorded = {{0, one}, {50, one}};
  const KeplerJ2 orbit{OrbitScenario{}};
  EXPECT_NO_THROW(AttitudeProgramme(scenario, orbit, 0, 0, 50));
  EXPECT_THROW(AttitudeProgramme(scenario, orbit, 0, 0, 51), std::invalid_argument);
}

TEST(Attitude, InertialStandsStillButForJitter) {
  AttitudeScenario scenario = still(Reference::kInertial);
  scenario.inertial_q_in_c = Quaterniond(Eigen::AngleAxisd(1, Vector3d(1, 2, 2) / 3));
  const KeplerJ2 orbit{OrbitScenario{}};
  const AttitudeProgramme attitude(scenario, orbit, 0, 0, 1000);
  EXPECT_LT(attitude.rate(300).norm(), 1e-14);
  EXPECT_LT(attitude.at(700).quaternion().angularDistance(scenario.inertial_q_in_c), 1e-15);

  scenario.jitter_rad = 20 * kArcsecond;
  const AttitudeProgramme shaken(scenario, orbit, 0, 0, kPass_s);
  test::Sequence x;
  for (double t = 0; t < kPass_s; t += 50) {  // independent: knots are 9.3 s apart, the spline spans six
    const Vector3d v = (attitude.at(0).inverse() * shaken.at(t)).log().raw();
    x.insert(x.end(), v.begin(), v.end());
  }
  EXPECT_NEAR(test::mean_square(x) / std::pow(20 * kArcsecond, 2), 1,
              0.01 + test::kBand * test::mean_square_sigma(x.size()));
}

}  // namespace
}  // namespace trihedron::sim
