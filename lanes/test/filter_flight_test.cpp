#include "trihedron/lanes/filter_flight.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "kernels.hpp"
#include "pack.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron::lanes {
namespace {

FilterFlight plain_flight(std::uint64_t seed, Duration duration = std::chrono::hours(2)) {
  FilterFlight flight;
  flight.scenario.seed = seed;
  flight.scenario.duration = duration;
  for (GyroScenario& gyro : flight.scenario.gyros) {
    gyro.drift.outside_sigma_rad_s = 0;
  }
  return flight;
}

const FilterResult& result_of(const FilterOutcome& outcome) { return std::get<FilterResult>(outcome); }

/// In sigmas of `b`.
double apart(const FilterResult& a, const FilterResult& b) {
  const Eigen::VectorXd sigmas = b.covariance.diagonal().cwiseSqrt();
  return (a.error - b.error).cwiseQuotient(sigmas).cwiseAbs().maxCoeff();
}

TEST(Lanes, GiveWhatTheOnBoardStepGives) {
  std::vector<FilterFlight> flights;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    flights.push_back(plain_flight(seed));
    ASSERT_TRUE(goes_in_lanes(flights.back()));
  }
  const std::vector<FilterOutcome> all = fly(flights);
  for (std::size_t i = 0; i < flights.size(); ++i) {
    const FilterResult& its = result_of(all[i]);
    const FilterResult alone = fly_alone(flights[i]);
    EXPECT_LT(apart(its, alone), 1e-6);
    EXPECT_LT(((its.covariance - alone.covariance).array() / alone.covariance.array()).abs().maxCoeff(), 1e-4);
    EXPECT_EQ(its.fixes_used, alone.fixes_used);
    EXPECT_EQ(its.fixes_judged, alone.fixes_judged);
    EXPECT_NEAR(its.nis_sum, alone.nis_sum, 1e-5 * alone.nis_sum);
    EXPECT_NEAR(its.nis_sum_of_judged, alone.nis_sum_of_judged, 1e-5 * alone.nis_sum);
    EXPECT_LT((its.attitude_rms_rad - alone.attitude_rms_rad).norm(), 1e-6 * alone.attitude_rms_rad.norm());
    EXPECT_NEAR(its.attitude_normalised_square, alone.attitude_normalised_square, 1e-6);
  }
}

/// To the bit.
void expect_same(const FilterResult& a, const FilterResult& b) {
  EXPECT_EQ(a.error, b.error);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.fixes_used, b.fixes_used);
  EXPECT_EQ(a.nis_sum, b.nis_sum);
  EXPECT_EQ(a.fixes_judged, b.fixes_judged);
  EXPECT_EQ(a.nis_sum_of_judged, b.nis_sum_of_judged);
  EXPECT_EQ(a.attitude_rms_rad, b.attitude_rms_rad);
  EXPECT_EQ(a.attitude_normalised_square, b.attitude_normalised_square);
}

/// Flights that meet different things.
std::vector<FilterFlight> various_flights() {
  std::vector<FilterFlight> flights;
  for (std::uint64_t seed = 1; seed <= 11; ++seed) {
    flights.push_back(plain_flight(seed, std::chrono::minutes(20)));
  }
  flights[1].scenario.star_tracker.dropout_probability = 0.2;
  flights[2].scenario.star_tracker.outlier_probability = 0.02;
  flights[3].scenario.attitude.slews = std::vector<Slew>{};
  flights[4].scenario.attitude.reference = AttitudeScenario::Reference::kYawSteered;
  flights[5].scenario.gyros[1].readout.noise_rad = 5 * kArcsecond;
  flights[5].scenario.gyros[1].readout.bias_rad = {1e-5, -2e-5, 0};
  flights[6].scenario.gyros[0].misalignment_magnitude_rad = 1 * kDegree;
  flights[6].scenario.gyros[0].readout.scale = {1e-5, 0, -1e-5};
  flights[7].scenario.star_tracker.outages = {{0, 30}, {300, 330}};
  flights[8].scenario.orbit.inclination_rad = 97 * kDegree;
  flights[8].options.direction_random_walk_rad_sqrt_s = 1e-8;
  flights[9].scenario.star_tracker.clock_offset_s = 0.02;  // its attitude begins at another time, and
  flights[3].scenario.star_tracker.clock_offset_s = -2.5;  // with more nodes and knots
  flights[10].scenario.attitude.reference = AttitudeScenario::Reference::kInertial;
  return flights;
}

TEST(Lanes, GiveTheSameBitsWhateverGoesBesideAFlight) {
  const std::vector<FilterFlight> flights = various_flights();
  const std::vector<FilterOutcome> together = fly(flights);
  const std::vector<FilterFlight> reversed(flights.rbegin(), flights.rend());
  const std::vector<FilterOutcome> in_another_order = fly(reversed);
  ASSERT_EQ(together.size(), flights.size());
  for (std::size_t i = 0; i < flights.size(); ++i) {
    ASSERT_TRUE(goes_in_lanes(flights[i]));
    SCOPED_TRACE(i);
    expect_same(result_of(together[i]), result_of(in_another_order[flights.size() - 1 - i]));
    expect_same(result_of(together[i]), result_of(fly({&flights[i], 1}).front()));
  }
}

TEST(Lanes, GiveWhatTheOnBoardStepGivesWhateverIsMet) {
  const std::vector<FilterFlight> flights = various_flights();
  const std::vector<FilterOutcome> all = fly(flights);
  for (std::size_t i = 0; i < flights.size(); ++i) {
    SCOPED_TRACE(i);
    const FilterResult& its = result_of(all[i]);
    const FilterResult alone = fly_alone(flights[i]);
    EXPECT_LT(apart(its, alone), 1e-6);
    EXPECT_EQ(its.fixes_used, alone.fixes_used);
    EXPECT_EQ(its.fixes_judged, alone.fixes_judged);
    EXPECT_NEAR(its.nis_sum_of_judged, alone.nis_sum_of_judged, 1e-5 * alone.nis_sum_of_judged);
    EXPECT_NEAR(its.attitude_normalised_square, alone.attitude_normalised_square,
                1e-6 * alone.attitude_normalised_square);
  }
  EXPECT_LT(result_of(all[2]).fixes_used, result_of(all[2]).fixes_judged);
}

/// By lanes or, where they cannot, alone: what the on-board step gives.
void expect_as_on_board(const FilterFlight& flight) {
  const FilterResult its = result_of(fly({&flight, 1}).front());
  const FilterResult alone = fly_alone(flight);
  EXPECT_LT(apart(its, alone), 1e-6);
  EXPECT_EQ(its.fixes_used, alone.fixes_used);
  EXPECT_NEAR(its.nis_sum_of_judged, alone.nis_sum_of_judged, 1e-5 * alone.nis_sum_of_judged);
}

TEST(Lanes, LeaveOutTheReadingsThatTheOnBoardStepLeavesOut) {
  FilterFlight shaken = plain_flight(1, std::chrono::minutes(10));
  shaken.scenario.attitude.jitter_bandwidth_hz = 1;
  expect_as_on_board(shaken);
  FilterFlight fast = plain_flight(2, std::chrono::minutes(10));
  fast.scenario.attitude.max_slew_rate_rad_s = 5 * kDegree;
  fast.scenario.attitude.max_slew_acceleration_rad_s2 = 2 * kDegree;
  expect_as_on_board(fast);
}

TEST(Lanes, HaveNoAttitudeOfMomentaNearlyOnOneLine) {
  FilterFlight flight = plain_flight(1, std::chrono::minutes(10));
  flight.scenario.gyros[1].start_direction_c = {0.993, 0.11, 0.06};
  flight.scenario.gyros[0].start_direction_c = {0.995, 0.06, 0.045};
  expect_as_on_board(flight);
}

TEST(Lanes, DecideAsTheOnBoardStepAtAnyPeriod) {
  for (const int period_ms : {80, 100, 200, 300, 500}) {
    SCOPED_TRACE(period_ms);
    FilterFlight flight = plain_flight(1, std::chrono::minutes(30));
    flight.scenario.gyro_period = std::chrono::milliseconds(period_ms);
    flight.scenario.star_tracker_period = std::chrono::milliseconds(3000 / period_ms * period_ms);
    flight.scenario.star_tracker.dropout_probability = 0.4;
    ASSERT_TRUE(goes_in_lanes(flight));
    expect_as_on_board(flight);
  }
}

TEST(Lanes, SeeThatAnglesAreDueBetweenTheLastFixAndTheEnd) {
  FilterFlight flight = plain_flight(1, std::chrono::seconds(625));
  flight.scenario.star_tracker_period = std::chrono::seconds(30);
  flight.options.angles_after = std::chrono::seconds(30);
  flight.scenario.star_tracker.outages = {{571, 700}};
  expect_as_on_board(flight);
}

TEST(Lanes, CompareOutliersOfAnySizeAsTheOnBoardStep) {
  FilterFlight flight = plain_flight(1, std::chrono::minutes(20));
  flight.scenario.star_tracker.outlier_probability = 0.05;
  flight.scenario.star_tracker.outlier_rad = 170 * kDegree;
  expect_as_on_board(flight);
}

TEST(Lanes, AFlightOnWhichTheFilterBeginsAnewIsFlownAlone) {
  FilterFlight flight = plain_flight(1, std::chrono::minutes(40));
  flight.scenario.star_tracker.inertial_step_rad = {2 * kDegree, 0, 0};
  flight.scenario.star_tracker.inertial_step_at_s = 1200;
  flight.options.reopen_after_jump_rejections = 30;
  ASSERT_TRUE(goes_in_lanes(flight));
  const FilterResult its = result_of(fly({&flight, 1}).front());
  EXPECT_GT(its.reopened, 0U);
  expect_same(its, fly_alone(flight));
}

TEST(Lanes, AFlightOnWhichTheAnglesBetweenTheMomentaAreUsedIsFlownAlone) {
  FilterFlight flight = plain_flight(1, std::chrono::minutes(20));
  flight.scenario.star_tracker.outages = {{600, 720}};
  expect_same(result_of(fly({&flight, 1}).front()), fly_alone(flight));
  flight.scenario.star_tracker.outages = {{600, 1300}};  // to the end
  expect_same(result_of(fly({&flight, 1}).front()), fly_alone(flight));
}

TEST(Lanes, AFlightWithDriftOfDegreesAMinuteIsFlownAlone) {
  FilterFlight flight = plain_flight(1, std::chrono::minutes(5));
  flight.scenario.gyros[0].drift.prior_sigma_rad_s = 1e-3;
  expect_same(result_of(fly({&flight, 1}).front()), fly_alone(flight));
}

TEST(Lanes, AreForAPairWithEq1AndNothingElse) {
  using Change = void (*)(FilterFlight&);
  const std::vector<Change> changes = {
      [](FilterFlight& its) { its.scenario.gyros.push_back(its.scenario.gyros.front()); },
      [](FilterFlight& its) { its.scenario.further_star_trackers.emplace_back(); },
      [](FilterFlight& its) {
        its.scenario.gyro_gaps = {{10, 20}};
      },
      [](FilterFlight& its) { its.scenario.gyros[1].drift.outside_sigma_rad_s = 1e-8; },
      [](FilterFlight& its) { its.scenario.gyros[1].drift.warm_up_fraction = 0.1; },
      [](FilterFlight& its) { its.scenario.gyros[1].readout.quantum_rad = 1e-6; },
      [](FilterFlight& its) { its.scenario.gyros[1].mounting_change.step_rad.x() = 1e-5; },
      [](FilterFlight& its) { its.scenario.attitude.jitter_rad = 1 * kDegree; },
      [](FilterFlight& its) { its.scenario.star_tracker_period = std::chrono::seconds(1); },
      [](FilterFlight& its) { its.scenario.gyro_period = std::chrono::milliseconds(1000); },
      [](FilterFlight& its) { its.options.estimator = Estimator::kPaper; },
      [](FilterFlight& its) { its.options.drift_model = vsh(3); },
      [](FilterFlight& its) { its.options.student_t_freedom = 8; },
      [](FilterFlight& its) {
        its.options.further_states[FurtherState::kClockOffset] = FurtherStateOptions::Choice::kOn;
      }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    FilterFlight flight = plain_flight(1, std::chrono::minutes(5));
    ASSERT_TRUE(goes_in_lanes(flight));
    changes[i](flight);
    EXPECT_FALSE(goes_in_lanes(flight)) << i;
    const FilterOutcome outcome = fly({&flight, 1}).front();
    SCOPED_TRACE(i);
    expect_same(result_of(outcome), fly_alone(flight));
  }
}

TEST(Lanes, FlightsThatCannotBeFailByThemselves) {
  std::vector<FilterFlight> flights(4, plain_flight(3, std::chrono::minutes(5)));
  flights[0].scenario.star_tracker.dropout_probability = 1;
  flights[1].scenario.gyros[0].readout.noise_rad = 0;
  flights[3].scenario.gyros[0].start_direction_c = {0, 0, 0};
  const std::vector<FilterOutcome> all = fly(flights);
  EXPECT_THAT(std::get<FilterFailure>(all[0]).reason, testing::HasSubstr("no fix"));
  EXPECT_THAT(std::get<FilterFailure>(all[1]).reason, testing::HasSubstr("not positive"));
  EXPECT_THAT(std::get<FilterFailure>(all[3]).reason, testing::HasSubstr("start direction"));
  expect_same(result_of(all[2]), result_of(fly({&flights[2], 1}).front()));
}

TEST(Lanes, GiveTheSameBitsOnAnyProcessor) {
  const std::vector<FilterFlight> flights = various_flights();
  std::vector<std::unique_ptr<Lane>> kept;
  std::vector<Lane*> lanes;
  const auto fly_by = [&](const Kernels& kernels) {
    kept.clear();
    lanes.clear();
    for (const std::size_t i : {0U, 1U, 2U, 5U, 6U}) {
      kept.push_back(std::make_unique<Lane>(flights[i], nullptr));
      lanes.push_back(kept.back().get());
    }
    return fly_pack(lanes, kernels);
  };
  const auto any = fly_by(any_processor::kKernels);
  const auto expect_all_the_same = [&](const Kernels& kernels) {
    const auto its = fly_by(kernels);
    for (std::size_t i = 0; i < any.size(); ++i) {
      ASSERT_TRUE(any[i] && its[i]);
      expect_same(*any[i], *its[i]);
    }
  };
  expect_all_the_same(kernels());
#ifdef __x86_64__
  if (static_cast<int>(__builtin_cpu_supports("avx2")) != 0) {
    expect_all_the_same(avx2::kKernels);
  }
#endif
}

}  // namespace
}  // namespace trihedron::lanes
