#include "trihedron/sim/star_tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "statistics.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::Sequence;

const Time kEpoch = Scenario{}.epoch;
constexpr Duration kDuration = std::chrono::hours{9};
constexpr Duration kFixPeriod = std::chrono::seconds{3};
constexpr double kDuration_s = 32400;
constexpr std::size_t kFixes = 10801;

StarTrackerScenario perfect() {
  StarTrackerScenario head;
  head.noise_rad.setZero();
  return head;
}

/// A head in its surroundings.
class StarTracker : public testing::Test {
 protected:
  explicit StarTracker(const AttitudeScenario& attitude = {})
      : attitude_(attitude, orbit_, 7, -10, kDuration_s + 10), sky_(kEpoch, -10, kDuration_s + 10) {}

  StarTrackerTelemetry fixes(const StarTrackerScenario& head, std::uint64_t seed = 7) {
    events_.clear();
    return simulate_fixes(head, {attitude_, orbit_, sky_}, kEpoch, kDuration, kFixPeriod, seed, events_);
  }
  double t_s(Time t) const { return to_seconds(t - kEpoch); }

  /// e of C_in_c exp([e×]), C at the stamps.
  std::vector<Vector3d> errors(const StarTrackerTelemetry& fixes) const {
    std::vector<Vector3d> result;
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      const Rot<In, C> truth = attitude_.at(t_s(fixes.t[i]));
      result.push_back((truth.inverse() * Rot<In, C>::assume(fixes.q_in_c[i])).log().raw());
    }
    return result;
  }

  KeplerJ2 orbit_{OrbitScenario{}};
  AttitudeProgramme attitude_;
  Sky sky_;
  std::vector<Event> events_;
};

Sequence component(const std::vector<Vector3d>& v, Eigen::Index axis) {
  Sequence x;
  for (const Vector3d& value : v) {
    x.push_back(value(axis));
  }
  return x;
}

/// Attitude still in space, so that what depends on motion shows.
class InertialStarTracker : public StarTracker {
 protected:
  InertialStarTracker() : StarTracker(scenario()) {}
  static AttitudeScenario scenario() {
    AttitudeScenario attitude;
    attitude.reference = AttitudeScenario::Reference::kInertial;
    attitude.slews = std::vector<Slew>{};
    attitude.jitter_rad = 0;
    return attitude;
  }
};

TEST_F(StarTracker, PerfectHeadGivesTheTruthAtEveryEpoch) {
  const StarTrackerTelemetry all = fixes(perfect());
  ASSERT_EQ(all.size(), kFixes);
  for (const Vector3d& e : errors(all)) {
    ASSERT_LT(e.norm(), 1e-15);
  }
  for (std::size_t i = 1; i < all.size(); ++i) {
    ASSERT_GT(all.q_in_c[i].dot(all.q_in_c[i - 1]), 0);
  }
  EXPECT_TRUE(events_.empty());
}

TEST_F(StarTracker, NoiseHasItsSigmaAboutEachAxisAndIsWhite) {
  const StarTrackerScenario head;
  const std::vector<Vector3d> e = errors(fixes(head));
  const double correlation_band = test::kBand * test::correlation_sigma(kFixes);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Sequence x = component(e, axis);
    EXPECT_NEAR(test::mean_square(x) / std::pow(head.noise_rad(axis), 2), 1,
                test::kBand * test::mean_square_sigma(kFixes));
    EXPECT_NEAR(test::correlation(x, component(e, (axis + 1) % 3)), 0, correlation_band);
    for (std::size_t lag = 1; lag <= 5; ++lag) {
      EXPECT_NEAR(test::correlation(x, x, lag), 0, correlation_band);
    }
    for (const std::size_t m : {4U, 32U}) {
      EXPECT_NEAR(test::allan_variance(x, m) * static_cast<double>(m) / std::pow(head.noise_rad(axis), 2), 1,
                  test::kBand * test::allan_variance_sigma(kFixes / m));
    }
  }
}

TEST_F(StarTracker, NoiseOfAFurtherHeadIsAboutItsOwnAxesAndIndependent) {
  StarTrackerScenario head;
  head.mounting_rotation_vector_rad = {std::numbers::pi / 2, 0, 0};  // its boresight along −c_y
  head.misalignment_rad = {1e-3, -2e-3, 3e-3};
  const std::vector<Vector3d> first = errors(fixes({}));
  const auto second = simulate_fixes(head, {attitude_, orbit_, sky_}, kEpoch, kDuration, kFixPeriod, 7, events_, 1);
  std::vector<Vector3d> e;
  for (std::size_t i = 0; i < second.size(); ++i) {
    const Rot<In, C> expected = attitude_.at(t_s(second.t[i])) * Rot<C, C>::exp(Vec<C>::assume(head.misalignment_rad));
    e.push_back((expected.inverse() * Rot<In, C>::assume(second.q_in_c[i])).log().raw());
  }
  const Vector3d sigma(head.noise_rad.x(), head.noise_rad.z(), head.noise_rad.y());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Sequence x = component(e, axis);
    EXPECT_NEAR(test::mean_square(x) / std::pow(sigma(axis), 2), 1, test::kBand * test::mean_square_sigma(kFixes));
    EXPECT_NEAR(test::correlation(x, component(first, axis)), 0, test::kBand * test::correlation_sigma(kFixes));
  }
}

TEST_F(InertialStarTracker, ExclusionAnglesOfAFurtherHeadAreFromItsOwnBoresight) {
  StarTrackerScenario head = perfect();
  head.earth_exclusion_rad = 20 * kDegree;
  const std::size_t of_the_first = fixes(head).size();
  head.mounting_rotation_vector_rad = {std::numbers::pi, 0,
                                       0};  // the other way: sees the Earth when the first does not
  const auto second = simulate_fixes(head, {attitude_, orbit_, sky_}, kEpoch, kDuration, kFixPeriod, 7, events_, 1);
  EXPECT_GT(of_the_first, kFixes / 4);
  EXPECT_LT(of_the_first, kFixes);
  EXPECT_GT(of_the_first + second.size(), kFixes / 2);
  EXPECT_LT(second.size(), kFixes);
  EXPECT_NE(second.size(), of_the_first);
  EXPECT_EQ(events_.back().head, 1);
}

TEST_F(StarTracker, NoiseOfSeedsIsIndependent) {
  const std::vector<Vector3d> seed0 = errors(fixes({}, 0));
  const std::vector<Vector3d> seed1 = errors(fixes({}, 1));
  EXPECT_NEAR(test::correlation(component(seed0, 2), component(seed1, 2)), 0,
              test::kBand * test::correlation_sigma(kFixes));
}

TEST_F(StarTracker, FixStampedTHoldsTheAttitudeOfTheClockOffsetLater) {
  StarTrackerScenario head = perfect();
  head.clock_offset_s = 0.25;
  head.latency_s = 0.1;
  const StarTrackerTelemetry all = fixes(head);
  const std::vector<Vector3d> error = errors(all);
  double most = 0;
  for (std::size_t i = 0; i < all.size(); i += 101) {
    const Rot<In, C> fix = Rot<In, C>::assume(all.q_in_c[i]);
    ASSERT_LT((attitude_.at(t_s(all.t[i]) + 0.15).inverse() * fix).log().norm(), 1e-15);
    most = std::max(most, error[i].norm());
  }
  EXPECT_GT(most, 1e-4);  // 1.1e-3 rad/s × 0.15 s: it does show
}

TEST_F(StarTracker, MountingMovesByItsStepAndEvenly) {
  StarTrackerScenario head = perfect();
  head.mounting_change = {.step_rad = {1e-4, 0, 0}, .step_at_s = 9000, .rate_rad_s = {0, 1e-9, 0}};
  const std::vector<Vector3d> error = errors(fixes(head));
  EXPECT_LT((error[2999] - Vector3d(0, 8997e-9, 0)).norm(), 1e-12);
  EXPECT_LT((error[3000] - Vector3d(1e-4, 9000e-9, 0)).norm(), 1e-12);
}

TEST_F(StarTracker, InertialAxesTurnAtOnce) {
  StarTrackerScenario head = perfect();
  head.inertial_step_rad = {0, 0, 1e-3};
  head.inertial_step_at_s = 9000;
  const StarTrackerTelemetry turned = fixes(head);
  const StarTrackerTelemetry still = fixes(perfect());
  EXPECT_EQ(turned.q_in_c[2999].coeffs(), still.q_in_c[2999].coeffs());
  const auto by = Rot<In, In>::assume(turned.q_in_c[3000] * still.q_in_c[3000].conjugate()).log().raw();
  EXPECT_LT((by - Vector3d(0, 0, 1e-3)).norm(), 1e-12);
}

TEST_F(StarTracker, FixStampedTHoldsTheAttitudeOfAClockThatRunsAtAnotherRate) {
  StarTrackerScenario head = perfect();
  head.clock_rate = 1e-4;
  const StarTrackerTelemetry all = fixes(head);
  for (std::size_t i = 0; i < all.size(); i += 100) {
    const Rot<In, C> fix = Rot<In, C>::assume(all.q_in_c[i]);
    ASSERT_LT((attitude_.at(1.0001 * t_s(all.t[i])).inverse() * fix).log().norm(), 1e-12);
  }
}

TEST_F(StarTracker, OrbitalErrorRepeatsEveryRevolution) {
  StarTrackerScenario head = perfect();
  head.orbital_sine_rad = Vector3d(8, 0, 3) * kArcsecond;
  head.orbital_cosine_rad = Vector3d(0, -5, 1) * kArcsecond;
  const StarTrackerTelemetry all = fixes(head);
  const std::vector<Vector3d> e = errors(all);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double phase = orbit_.mean_rate_rad_s() * t_s(all.t[i]);
    ASSERT_LT((e[i] - head.orbital_sine_rad * std::sin(phase) - head.orbital_cosine_rad * std::cos(phase)).norm(),
              1e-15);
  }
}

TEST_F(StarTracker, FieldErrorHasItsSigmaAndForgetsWithTheAngleThatTheFieldMoves) {
  StarTrackerScenario head = perfect();
  head.field_error_rad = Vector3d(4, 4, 12) * kArcsecond;
  head.field_correlation_rad = 2 * kDegree;
  // The mean over seeds; one pass of 2000° has some 500 independent values.
  std::array<double, 3> square{};
  double kept = 0;
  double moved = 0;
  constexpr int kSeeds = 20;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const std::vector<Vector3d> e = errors(fixes(head, seed));
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      square[static_cast<std::size_t>(axis)] += test::mean_square(component(e, axis)) / kSeeds;
    }
    // In the first 30 s, at rest or slewing alike, against what the angle moved lets survive.
    kept += (e[0].cwiseQuotient(head.field_error_rad)).dot(e[10].cwiseQuotient(head.field_error_rad)) / (3 * kSeeds);
  }
  for (int i = 1; i <= 10; ++i) {
    moved += attitude_.rate(3.0 * i).norm() * 3;
  }
  const double independent = kSeeds * 360 * kDegree * 5.8 / head.field_correlation_rad;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(square[static_cast<std::size_t>(axis)] / std::pow(head.field_error_rad(axis), 2), 1,
                test::kBand * std::sqrt(2 / independent));
  }
  EXPECT_NEAR(kept, std::exp(-moved / head.field_correlation_rad), test::kBand / std::sqrt(3.0 * kSeeds));
}

TEST_F(InertialStarTracker, FieldErrorIsFrozen) {
  StarTrackerScenario head = perfect();
  head.field_error_rad = Vector3d(4, 4, 12) * kArcsecond;
  const std::vector<Vector3d> e = errors(fixes(head));
  EXPECT_GT(e.front().norm(), 1e-6);
  EXPECT_LT((e.back() - e.front()).norm(), 1e-9);  // rounding of the rate, 1e-15 rad/s, moves it by less than its root
}

TEST_F(StarTracker, UncorrectedAberrationShiftsTheStarsTowardsTheVelocity) {
  StarTrackerScenario head = perfect();
  head.aberration = StarTrackerScenario::Aberration::kUncorrected;
  const StarTrackerTelemetry all = fixes(head);
  double most = 0;
  for (std::size_t i = 0; i < all.size(); i += 10) {
    const double t = t_s(all.t[i]);
    const Vector3d star = attitude_.at(t).raw().col(2);  // the one on the boresight
    const Vector3d beta = (orbit_.at(t).velocity_m_s.raw() + sky_.at(t).earth_velocity_m_s.raw()) / 299'792'458.0;
    const Vector3d seen = (star + beta).normalized();  // the classical formula
    // The head finds the star in c where the light comes from; by its attitude the catalogue's star must lie there.
    const Vector3d seen_c = attitude_.at(t).raw().transpose() * seen;
    const Vector3d catalogue_c = all.q_in_c[i].conjugate() * star;
    // The relativistic formula differs in β² / 4 = 3e-9 at most.
    EXPECT_LT((seen_c - catalogue_c).norm(), 3e-9);
    most = std::max(most, (seen - star).norm());
  }
  // 20.5″ of the Earth's motion and up to 5.3″ of the orbit's.
  EXPECT_GT(most, 15 * kArcsecond);
  EXPECT_LT(most, 26 * kArcsecond);
}

TEST(SkyTest, SunAndEarthVelocityAreThoseOfTheDate) {
  // 2009-06-21 05:46 UTC, June solstice, with 34 leap seconds. In coordinates of date the right ascension is 90°; in
  // ICRF less by 9.5 years of precession, 50.3″ a year over the cosine of the obliquity. The declination is the
  // obliquity.
  const Time solstice{std::chrono::sys_days{std::chrono::year{2009} / 6 / 21} -
                      std::chrono::sys_days{std::chrono::year{1958} / 1 / 1} +
                      std::chrono::seconds{5 * 3600 + 46 * 60 + 34}};
  const SkyState sky = Sky(solstice, 0, 3600).at(0);
  const Vector3d sun = sky.sun_m.raw();
  EXPECT_NEAR(std::atan2(sun.y(), sun.x()), (90 - 0.144) * kDegree, 0.01 * kDegree);
  EXPECT_NEAR(std::asin(sun.z() / sun.norm()), 23.44 * kDegree, 0.01 * kDegree);
  EXPECT_NEAR(sun.norm() / 1.496e11, 1.016, 0.001);
  // In June the Earth, south of the Sun's 90°, moves along +x.
  EXPECT_NEAR(sky.earth_velocity_m_s.norm(), 29300, 100);
  EXPECT_NEAR(sky.earth_velocity_m_s.dot(sky.sun_m) / sun.norm() / 29300, 0, 0.01);
  EXPECT_GT(sky.earth_velocity_m_s.raw().x(), 29000);
}

TEST(SkyTest, TableBetweenItsHoursIsTheEphemeris) {
  const Sky table(kEpoch, 0, 7200);
  for (const double t : {900.0, 1800.0, 5000.0}) {
    const SkyState direct = Sky(kEpoch + from_seconds(t), 0, 1).at(0);
    // Curvature of the Earth's path over an hour: v (2e-7 × 3600)² / 8 = 2 mm/s.
    EXPECT_LT((table.at(t).earth_velocity_m_s - direct.earth_velocity_m_s).norm(), 5e-3);
    EXPECT_LT(angle_between<double>(table.at(t).sun_m.raw(), direct.sun_m.raw()), 1e-7);
  }
}

TEST_F(StarTracker, SunBlindsWithinItsExclusionAngleOnly) {
  StarTrackerScenario head = perfect();
  head.sun_exclusion_rad = 40 * kDegree;
  const StarTrackerTelemetry all = fixes(head);
  const auto to_sun = [&](Time t) {
    return angle_between<double>(attitude_.at(t_s(t)).raw().col(2),
                                 sky_.at(t_s(t)).sun_m.raw() - orbit_.at(t_s(t)).position_m.raw());
  };
  ASSERT_FALSE(events_.empty());
  EXPECT_EQ(all.size() + events_.size(), kFixes);
  for (const Time t : all.t) {
    ASSERT_GE(to_sun(t), 40 * kDegree);
  }
  for (const Event& event : events_) {
    ASSERT_EQ(event.fault, Fault::kFixSunBlinded);
    ASSERT_LT(to_sun(event.t), 40 * kDegree);
  }
}

TEST_F(InertialStarTracker, EarthBlindsOncePerRevolution) {
  StarTrackerScenario head = perfect();
  head.earth_exclusion_rad = 20 * kDegree;
  fixes(head);
  std::size_t passages = 0;
  for (std::size_t i = 0; i < events_.size(); ++i) {
    ASSERT_EQ(events_[i].fault, Fault::kFixEarthBlinded);
    passages += i == 0 || events_[i].t - events_[i - 1].t > kFixPeriod ? 1U : 0U;
    const Vector3d to_earth = -orbit_.at(t_s(events_[i].t)).position_m.raw();
    const double limb = std::asin(kEarthRadius_m / to_earth.norm());
    ASSERT_LT(angle_between<double>(Vector3d::UnitZ(), to_earth), limb + 20 * kDegree);
  }
  EXPECT_GE(passages, 5U);
  EXPECT_LE(passages, 6U);  // 5.7 revolutions
}

TEST_F(StarTracker, ZenithLookingHeadNeverSeesTheEarth) {
  StarTrackerScenario head = perfect();
  head.earth_exclusion_rad = 20 * kDegree;  // 70° + 20° + slews of at most 33° stay below 180°
  EXPECT_EQ(fixes(head).size(), kFixes);
}

TEST_F(StarTracker, LosesLockAboveItsBodyRateOnly) {
  StarTrackerScenario head = perfect();
  head.max_rate_rad_s = 0.2 * kDegree;
  const StarTrackerTelemetry all = fixes(head);
  ASSERT_FALSE(events_.empty());
  EXPECT_EQ(all.size() + events_.size(), kFixes);
  for (const Time t : all.t) {
    ASSERT_LE(attitude_.rate(t_s(t)).norm(), head.max_rate_rad_s);
  }
  for (const Event& event : events_) {
    ASSERT_EQ(event.fault, Fault::kFixTooFast);
    ASSERT_GT(attitude_.rate(t_s(event.t)).norm(), head.max_rate_rad_s);
  }
}

TEST_F(StarTracker, OutageHoldsItsBeginningAndNotItsEnd) {
  StarTrackerScenario head = perfect();
  head.outages = {{600, 3120}, {9000, 9003}};
  const StarTrackerTelemetry all = fixes(head);
  EXPECT_EQ(events_.size(), 2520U / 3 + 1);
  const auto has = [&](int s) {
    return std::find(all.t.begin(), all.t.end(), kEpoch + std::chrono::seconds{s}) != all.t.end();
  };
  EXPECT_TRUE(has(597));
  EXPECT_FALSE(has(600));
  EXPECT_FALSE(has(3117));
  EXPECT_TRUE(has(3120));
  EXPECT_FALSE(has(9000));
}

TEST_F(StarTracker, DropoutsOutliersAndWrongSignsComeAtTheirRates) {
  StarTrackerScenario head;
  head.dropout_probability = 0.02;
  head.outlier_probability = 0.01;
  head.wrong_sign_probability = 0.03;
  const StarTrackerTelemetry all = fixes(head);
  const auto count = [&](Fault fault) {
    return static_cast<double>(
        std::count_if(events_.begin(), events_.end(), [fault](const Event& e) { return e.fault == fault; }));
  };
  const double n = static_cast<double>(kFixes);
  EXPECT_NEAR(count(Fault::kFixDropout), 0.02 * n, test::kBand * std::sqrt(0.02 * n));
  EXPECT_NEAR(count(Fault::kFixOutlier), 0.01 * 0.98 * n, test::kBand * std::sqrt(0.01 * n));
  EXPECT_NEAR(count(Fault::kFixWrongSign), 0.03 * 0.98 * n, test::kBand * std::sqrt(0.03 * n));
  EXPECT_EQ(static_cast<double>(all.size()), n - count(Fault::kFixDropout));

  // Outliers are where they are reported, and their angles even up to the limit.
  const std::vector<Vector3d> e = errors(all);
  double sum = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool reported = std::any_of(events_.begin(), events_.end(), [&](const Event& event) {
      return event.t == all.t[i] && event.fault == Fault::kFixOutlier;
    });
    if (reported) {
      ASSERT_LT(e[i].norm(), head.outlier_rad + 200 * kArcsecond);
      sum += e[i].norm();
    } else {
      ASSERT_LT(e[i].norm(), 120 * kArcsecond);  // six sigmas of the boresight noise
    }
  }
  const double outliers = count(Fault::kFixOutlier);
  EXPECT_NEAR(sum / outliers / head.outlier_rad, 0.5, test::kBand * std::sqrt(1.0 / 12 / outliers));
}

TEST_F(StarTracker, WrongSignIsTheSameAttitude) {
  StarTrackerScenario head = perfect();
  head.wrong_sign_probability = 1;
  const StarTrackerTelemetry wrong = fixes(head);
  const StarTrackerTelemetry right = fixes(perfect());
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    ASSERT_EQ(wrong.q_in_c[i].coeffs(), -right.q_in_c[i].coeffs());
  }
}

TEST_F(StarTracker, AFaultLeavesTheOtherFixesAsTheyWere) {
  const StarTrackerTelemetry clean = fixes({});
  StarTrackerScenario head;
  head.dropout_probability = 0.1;
  head.outages = {{300, 3000}};
  const StarTrackerTelemetry dirty = fixes(head);
  std::size_t j = 0;
  for (std::size_t i = 0; i < clean.size(); ++i) {
    if (j < dirty.size() && dirty.t[j] == clean.t[i]) {
      ASSERT_LT(clean.q_in_c[i].angularDistance(dirty.q_in_c[j]), 1e-15);
      ++j;
    }
  }
  EXPECT_EQ(j, dirty.size());
}

}  // namespace
}  // namespace trihedron::sim
