// Slews that calibrate best.

#include "trihedron/plan/advise.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "design_flight.hpp"
#include "flights.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/sim/attitude.hpp"
#include "trihedron/sim/random.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::plan {
namespace {

const SlewLimits kTwoSlews{.max_rate_rad_s = 0.4 * kDegree,
                           .max_angle_rad = 25 * kDegree,
                           .slews = 2,
                           .manoeuvre_time = std::chrono::minutes(8)};

const Advice& advised() {
  static const Advice advice = advise(steady_flight(), told(), kTwoSlews);
  return advice;
}

/// The search uses a flight without noise, of every fourth sample and fix; the difference is how the body jitters at
/// the fixes that are used.
TEST(DesignFlight, KnowsTheCovarianceOfASimulatedFlight) {
  const ground::Observability observed = advised().after;
  const DesignFlight flight(advised().scenario, observed.options);
  const Eigen::VectorXd ratio =
      flight.covariance_after(advised().slews()).diagonal().cwiseQuotient(observed.covariance.diagonal()).cwiseSqrt();
  EXPECT_GT(ratio.minCoeff(), 0.8);
  EXPECT_LT(ratio.maxCoeff(), 1.25);
}

/// One second is no multiple of the period of these samples, and 0.9 s are no divisor of that of the fixes.
TEST(DesignFlight, HasAReadingAtEachFix) {
  Scenario scenario = advised().scenario;
  scenario.gyro_period = std::chrono::milliseconds(300);
  const ground::Observability observed = ground::observe(sim::simulate(scenario).pass, advised().after.options);
  const DesignFlight flight(scenario, observed.options);
  const Eigen::VectorXd ratio =
      flight.covariance_after(advised().slews()).diagonal().cwiseQuotient(observed.covariance.diagonal()).cwiseSqrt();
  EXPECT_GT(ratio.minCoeff(), 0.8);
  EXPECT_LT(ratio.maxCoeff(), 1.25);
}

/// Without noise two momenta that were started along one axis lie on one line exactly; both are known as well.
TEST(DesignFlight, MayHaveTwoMomentaOnOneLine) {
  Scenario scenario = advised().scenario;
  scenario.gyros.push_back(scenario.gyros[0]);
  const Eigen::VectorXd variance = DesignFlight(scenario, told()).covariance_after(advised().slews()).diagonal();
  constexpr int kOfGyro = Layout::kEq1 + 3;
  const Eigen::VectorXd ratio = variance.segment<kOfGyro>(2L * kOfGyro).cwiseQuotient(variance.head<kOfGyro>());
  EXPECT_GT(ratio.minCoeff(), 0.9);
  EXPECT_LT(ratio.maxCoeff(), 1.1);
}

TEST(Advice, MakesTheUnobservableObservable) {
  EXPECT_TRUE(advised().before.is_harmful());
  EXPECT_FALSE(advised().after.is_harmful());
  ASSERT_EQ(advised().formerly_weak().size(), 2U);
  for (const ground::Combination& combination : advised().formerly_weak()) {
    EXPECT_GT(sigma_along(combination, advised().before, advised().before.covariance),
              100 * sigma_along(combination, advised().before, advised().after.covariance));
  }
  ASSERT_EQ(advised().gains().size(), 2U);
  for (const Advice::Gain& gain : advised().gains()) {
    EXPECT_GT(gain.sigma_before, 100 * gain.sigma_after) << gain.combination.text;
    EXPECT_TRUE(gain.combination.is_unobservable);
  }
}

TEST(Advice, StaysWithinTheLimits) {
  const std::vector<Slew>& slews = advised().slews();
  ASSERT_GE(slews.size(), 2U);
  ASSERT_LE(slews.size(), 4U);
  const AttitudeScenario& attitude = advised().scenario.attitude;
  EXPECT_EQ(attitude.max_slew_rate_rad_s, 0.4 * kDegree);
  const sim::SlewPlan plan(slews, attitude.max_slew_rate_rad_s, attitude.max_slew_acceleration_rad_s2);
  const std::vector<sim::SlewPlan::Turn>& turns = plan.turns();
  double manoeuvre_s = 0;
  for (std::size_t i = 0; i < turns.size(); i += 2) {
    EXPECT_LE(Eigen::AngleAxisd(turns[i].to).angle(), 25 * kDegree + 1e-12);
    EXPECT_NEAR(Eigen::AngleAxisd(turns[i + 1].to).angle(), 0, 1e-12);
    manoeuvre_s += turns[i + 1].end_s - turns[i].begin_s;
  }
  EXPECT_LE(manoeuvre_s, 480);
  EXPECT_LT(turns.back().end_s, to_seconds(steady_flight().duration));
}

/// Random slews within the same limits: one or two, of any axis and time, by the whole angle.
TEST(Advice, BeatsRandomSlews) {
  const DesignFlight flight(advised().scenario, advised().before.options);
  const auto mean_square = [&](const std::vector<Slew>& slews) {
    return (advised().before.attitude_metric * flight.covariance_after(slews)).trace();
  };
  const double advice = mean_square(advised().slews());
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    sim::Stream random(seed, sim::Source::kImaging);
    const auto excursion = [&](double from_s, double to_s, double share_s) {
      const Eigen::Vector3d angles = 25 * kDegree * random.direction();
      const double begin_s = random.uniform(from_s, to_s - share_s);
      const double turn_s = sim::turn_duration_s(27 * kDegree, 0.4 * kDegree, 0.02 * kDegree);
      return std::vector<Slew>{{begin_s, angles.x(), angles.y(), angles.z()}, {begin_s + share_s - turn_s, 0, 0, 0}};
    };
    std::vector<Slew> slews = excursion(0, 2400, seed % 2 == 0 ? 480 : 280);
    if (seed % 2 == 1) {
      const std::vector<Slew> second = excursion(2400, 4800, 280);
      slews.insert(slews.end(), second.begin(), second.end());
    }
    EXPECT_LE(advice, mean_square(slews)) << seed;
  }
}

TEST(Advice, HasNoSlewsWhereTheyGainNothing) {
  SlewLimits short_of_time = kTwoSlews;
  short_of_time.manoeuvre_time = std::chrono::seconds(1);
  SlewLimits small = kTwoSlews;
  small.max_angle_rad = 0.01 * kDegree;
  for (const SlewLimits& limits : {short_of_time, small}) {
    const Advice advice = advise(steady_flight(), told(), limits);
    EXPECT_TRUE(advice.slews().empty());
    EXPECT_EQ(advice.after.attitude_error_rad, advice.before.attitude_error_rad);
    EXPECT_TRUE(advice.after.is_harmful());
  }
}

/// 15/8 of 25° at 0.4°/s there, and the same back, and the second that rounding takes.
TEST(Advice, SaysHowLongTheLargestSlewTakes) { EXPECT_EQ(advised().time_of_largest_slew, std::chrono::seconds(236)); }

TEST(Advice, RefusesWhatItCannotPlanFor) {
  const auto reason = [](const std::function<void(Scenario&, SlewLimits&)>& change) {
    Scenario scenario = steady_flight();
    SlewLimits limits = kTwoSlews;
    change(scenario, limits);
    try {
      (void)advise(scenario, told(), limits);
    } catch (const ground::SetupError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(reason([](Scenario& scenario, SlewLimits&) { scenario.attitude.slews = ImagingProgramme{}; }),
              testing::HasSubstr("slews of its own"));
  EXPECT_THAT(reason([](Scenario& scenario, SlewLimits&) { scenario.attitude.slews = std::vector<Slew>(1); }),
              testing::HasSubstr("slews of its own"));
  EXPECT_THAT(reason([](Scenario&, SlewLimits& limits) { limits.max_angle_rad = 0; }),
              testing::HasSubstr("not positive"));
  EXPECT_THAT(reason([](Scenario&, SlewLimits& limits) { limits.max_rate_rad_s = -1; }),
              testing::HasSubstr("not positive"));
  EXPECT_THAT(reason([](Scenario&, SlewLimits& limits) { limits.slews = 0; }), testing::HasSubstr("not positive"));
  EXPECT_THAT(reason([](Scenario&, SlewLimits& limits) { limits.manoeuvre_time = {}; }),
              testing::HasSubstr("not positive"));
  EXPECT_THAT(reason([](Scenario&, SlewLimits& limits) { limits.manoeuvre_time = std::chrono::minutes(50); }),
              testing::HasSubstr("no room"));
}

}  // namespace
}  // namespace trihedron::plan
