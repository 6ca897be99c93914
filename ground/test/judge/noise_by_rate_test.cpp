#include "judge/noise_by_rate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/records/units.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

/// Three hours with slews, whose fixes have stamps that jitter by so much.
Pass pass_with_jitter(double jitter_s) {
  Pass pass = sim::simulate(scenario_in_eq1(4, std::chrono::hours(3))).pass;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (Time& t : pass.star_tracker.t) {
    t += from_seconds(jitter_s * normal(random));
  }
  return pass;
}

std::vector<Finding> judged_with_jitter(double jitter_s) {
  const Pass pass = pass_with_jitter(jitter_s);
  std::vector<Finding> findings;
  judge_noise_by_rate(pass, calibrate(pass, told()), findings);
  return findings;
}

TEST(NoiseByRate, OfANominalPassIsOne) {
  const Pass pass = pass_with_jitter(0);
  const auto found = noise_by_rate(pass.star_tracker, calibrate(pass, told()).fixes);
  ASSERT_TRUE(found.has_value());
  EXPECT_GT(found->fixes_in_slews, 100);
  EXPECT_NEAR(found->in_slews / found->at_rest, 1, 0.3);
  EXPECT_GT(found->rate_rad_s, 0.1 * kDegree);
  EXPECT_TRUE(judged_with_jitter(0).empty());
}

/// Where no cubic is what the body does for 2.8 s.
TEST(NoiseByRate, OfSlewsThatBeginAtOnceIsNearlyOne) {
  Scenario scenario = scenario_in_eq1(4, std::chrono::hours(3));
  scenario.attitude.max_slew_rate_rad_s = 3 * kDegree;
  scenario.attitude.max_slew_acceleration_rad_s2 = kDegree;
  const Pass pass = sim::simulate(scenario).pass;
  const auto found = noise_by_rate(pass.star_tracker, calibrate(pass, told()).fixes);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->in_slews / found->at_rest, 1, 0.3);
}

TEST(NoiseByRate, OfStampsThatJitterIsNamed) {
  const std::vector<Finding> little = judged_with_jitter(10e-3);
  ASSERT_EQ(little.size(), 1U);
  EXPECT_EQ(little[0].code, FindingCode::kFixesWorseInSlews);
  EXPECT_EQ(little[0].severity, FindingSeverity::kWarning);
  const std::vector<Finding> much = judged_with_jitter(40e-3);
  ASSERT_EQ(much.size(), 1U);
  EXPECT_EQ(much[0].severity, FindingSeverity::kDoNotUse);
}

/// Fixes at random for a while are no slews.
TEST(NoiseByRate, IsNotThatOfWrongFixes) {
  Pass pass = sim::simulate(scenario_in_eq1(4, std::chrono::hours(3))).pass;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (std::size_t i = 2000; i < 2400; ++i) {
    pass.star_tracker.q_in_c[i] =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
  }
  std::vector<Finding> findings;
  judge_noise_by_rate(pass, calibrate(pass, told()), findings);
  EXPECT_TRUE(findings.empty());
}

/// Samples three seconds apart, with a fix in the middle between two.
TEST(NoiseByRate, OfReadingsThatAreFarApartForbidsUse) {
  Pass pass = sim::simulate(scenario_in_eq1(4, std::chrono::hours(3))).pass;
  GyroTelemetry thinned;
  thinned.gyros = pass.gyro.gyros;
  for (std::size_t i = 12; i < pass.gyro.size(); i += 24) {
    thinned.t.push_back(pass.gyro.t[i]);
    for (int k = 0; k < thinned.gyros; ++k) {
      const Eigen::Vector3d h_b = pass.gyro.direction(i, k);
      thinned.h.insert(thinned.h.end(), h_b.begin(), h_b.end());
    }
  }
  pass.gyro = thinned;
  pass.settings.gyro_period = std::chrono::seconds(3);
  const std::vector<Finding> findings = calibrate(pass, told()).calibration.verdict.findings;
  const auto found = std::ranges::find(findings, FindingCode::kGyroSamplesFarApart, &Finding::code);
  ASSERT_NE(found, findings.end());
  EXPECT_EQ(found->severity, FindingSeverity::kDoNotUse);
}

/// Steady flight has no slews; nor are there any where no fix tells of the rate.
TEST(NoiseByRate, IsNotToldWithoutSlews) {
  Scenario scenario = scenario_in_eq1(4, std::chrono::hours(2));
  scenario.attitude.slews = std::vector<Slew>{};
  Pass pass = sim::simulate(scenario).pass;
  const std::vector<FixRecord> fixes = calibrate(pass, told()).fixes;
  EXPECT_FALSE(noise_by_rate(pass.star_tracker, fixes).has_value());
  pass.star_tracker.t.resize(2);
  pass.star_tracker.q_in_c.resize(2);
  EXPECT_FALSE(noise_by_rate(pass.star_tracker, fixes).has_value());
}

}  // namespace
}  // namespace trihedron::ground
