#include "trihedron/campaign/perform.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include "trihedron/records/stop.hpp"

namespace trihedron::campaign {
namespace {

CampaignPlan six_runs() {
  CampaignPlan plan;
  plan.seed = 2;
  plan.runs = 6;
  CampaignInput input;
  input.key = "gyro.readout.noise";
  input.distribution = {.a = 1, .b = 4, .least = 1, .most = 4};
  input.unit = "arcsec";
  plan.inputs = {input};
  return plan;
}

CalibrationOptions told() {
  CalibrationOptions options;
  options.drift_model = kEsg7;
  options.find_noise = false;
  options.further_states = FurtherStateOptions::none();
  return options;
}

RunSetup short_flight(std::uint64_t seed, std::span<const double> draws) {
  Scenario scenario;
  scenario.seed = seed;
  scenario.duration = std::chrono::minutes(5);
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.readout.noise_rad = draws[0] * kArcsecond;
  }
  return {scenario, told()};
}

/// In the order of their numbers.
std::vector<RunRecord> performed(const CampaignPlan& plan, unsigned jobs, const SetupOf& setup_of) {
  std::vector<std::uint64_t> numbers;
  for (std::uint64_t run = 0; run < plan.runs; ++run) {
    numbers.push_back(run);
  }
  std::vector<RunRecord> records;
  perform_all(plan, numbers, setup_of, jobs,
              [&](std::vector<RunRecord>&& its) { records.insert(records.end(), its.begin(), its.end()); });
  std::ranges::sort(records, {}, &RunRecord::run);
  return records;
}

void expect_same(const RunRecord& a, const RunRecord& b) {
  EXPECT_EQ(a.run, b.run);
  EXPECT_EQ(a.seed, b.seed);
  EXPECT_EQ(a.draws, b.draws);
  EXPECT_EQ(a.outcome, b.outcome);
  EXPECT_EQ(a.findings, b.findings);
  for (const RunQuantityRow& row : kRunQuantityRows) {
    ASSERT_EQ(a[row.quantity].size(), b[row.quantity].size()) << row.name;
    for (std::size_t i = 0; i < a[row.quantity].size(); ++i) {
      const double x = a.at(row.quantity, i);
      const double y = b.at(row.quantity, i);
      EXPECT_TRUE(x == y || (std::isnan(x) && std::isnan(y))) << row.name << ' ' << x << ' ' << y;
    }
  }
}

/// The runs on one thread, on three, and one of them alone, to the bit.
void expect_same_on_threads_and_alone(const CampaignPlan& plan, const SetupOf& setup_of, std::uint64_t alone) {
  const std::vector<RunRecord> one = performed(plan, 1, setup_of);
  const std::vector<RunRecord> three = performed(plan, 3, setup_of);
  ASSERT_EQ(one.size(), plan.runs);
  ASSERT_EQ(three.size(), plan.runs);
  for (std::size_t i = 0; i < one.size(); ++i) {
    expect_same(one[i], three[i]);
  }
  expect_same(one[alone], perform(plan, alone, setup_of));
  EXPECT_NE(one[4].at(RunQuantity::kNees), one[5].at(RunQuantity::kNees));
}

TEST(Campaign, GivesTheSameBitsOnAnyNumberOfThreadsAndForARunAlone) {
  expect_same_on_threads_and_alone(six_runs(), short_flight, 4);
}

RunSetup flight_of_eq1(std::uint64_t seed, std::span<const double> draws) {
  RunSetup setup = short_flight(seed, draws);
  for (GyroScenario& gyro : setup.scenario.gyros) {
    gyro.drift.outside_sigma_rad_s = 0;
  }
  return setup;
}

CampaignPlan runs_of_filters(std::uint64_t runs) {
  CampaignPlan plan = six_runs();
  plan.runs = runs;
  plan.work = CampaignWork::kFilter;
  return plan;
}

TEST(CampaignOfFilters, GivesTheSameBitsOnAnyNumberOfThreadsAndForARunAlone) {
  expect_same_on_threads_and_alone(runs_of_filters(19), flight_of_eq1, 13);
}

TEST(CampaignOfFilters, MeasuresWhatACalibrationOfTheSameFlightsHas) {
  CampaignPlan plan = runs_of_filters(2);
  plan.keeps_covariance = true;
  const std::vector<RunRecord> all = performed(plan, 1, flight_of_eq1);
  plan.work = CampaignWork::kCalibrate;
  for (const RunRecord& its : all) {
    const RunRecord calibrated = perform(plan, its.run, flight_of_eq1);
    EXPECT_EQ(its.outcome, RunOutcome::kTrustworthy);
    EXPECT_EQ(its.drift_model, calibrated.drift_model);
    EXPECT_GT(its.cpu_s, 0);
    for (const RunQuantityRow& row : kRunQuantityRows) {
      if (row.quantity > RunQuantity::kAttitudeNormalisedSquare) {
        EXPECT_TRUE(its[row.quantity].empty()) << row.name;
        continue;
      }
      ASSERT_EQ(its[row.quantity].size(), calibrated[row.quantity].size()) << row.name;
      double largest = 0;
      for (const double value : calibrated[row.quantity]) {
        largest = std::max(largest, std::abs(value));
      }
      for (std::size_t i = 0; i < its[row.quantity].size(); ++i) {
        // A calibration may predict over two samples at once.
        EXPECT_NEAR(its.at(row.quantity, i), calibrated.at(row.quantity, i), 1e-3 * largest) << row.name;
      }
    }
  }
}

TEST(CampaignOfFilters, AreMeasuredByTheGyrosOfThePlanWhateverARunHas) {
  const auto two_or_three = [](std::uint64_t seed, std::span<const double> draws) {
    RunSetup setup = flight_of_eq1(seed, draws);
    if (draws[0] > 2.5) {
      GyroScenario third = setup.scenario.gyros.front();
      third.start_direction_c = {0.1, 0.2, 0.97};
      setup.scenario.gyros.push_back(third);
    }
    return setup;
  };
  for (const std::size_t gyros : {2U, 3U}) {
    CampaignPlan plan = runs_of_filters(8);
    plan.gyros = gyros;
    plan.keeps_covariance = true;
    for (const RunRecord& its : performed(plan, 1, two_or_three)) {
      const std::size_t has = its.draws[0] > 2.5 ? 3 : 2;
      const std::size_t measured = std::min(gyros, has);
      for (const RunQuantityRow& row : kRunQuantityRows) {
        if (plan.has(row.quantity)) {
          EXPECT_EQ(its[row.quantity].size(), size_of(row.shape, gyros)) << row.name;
        }
      }
      EXPECT_EQ(its.at(RunQuantity::kNeesFreedom), 10.0 * static_cast<double>(measured));
      EXPECT_EQ(its.at(RunQuantity::kNisFreedom), 2.0 * static_cast<double>(has));
      EXPECT_EQ(std::isnan(its.at(RunQuantity::kDriftError, 7 * gyros - 1)), has < gyros);
      EXPECT_EQ(std::isnan(its.at(RunQuantity::kAlignmentSigma, 3 * gyros - 1)), has < gyros);
      const std::size_t last = 10 * measured - 1;
      EXPECT_EQ(std::sqrt(its.at(RunQuantity::kCovariance, last * 10 * gyros + last)),
                its.at(RunQuantity::kAlignmentSigma, 3 * measured - 1));
    }
  }
}

TEST(CampaignOfFilters, AFailureOfTheFilterAloneIsThatOfTheCampaign) {
  const auto without_fixes = [](std::uint64_t seed, std::span<const double> draws) {
    RunSetup setup = flight_of_eq1(seed, draws);
    setup.scenario.star_tracker.dropout_probability = 1;
    return setup;
  };
  bool was_flown = false;
  const RunRecord its = perform(runs_of_filters(8), 3, without_fixes, [&](Flight&&) { was_flown = true; });
  expect_same(its, perform(runs_of_filters(8), 3, without_fixes));
  EXPECT_EQ(its.outcome, RunOutcome::kFailed);
  EXPECT_FALSE(was_flown);
  const RunRecord right = perform(runs_of_filters(8), 3, flight_of_eq1, [&](Flight&&) { was_flown = true; });
  expect_same(right, perform(runs_of_filters(8), 3, flight_of_eq1));
  EXPECT_TRUE(was_flown);
}

TEST(CampaignOfFilters, AreNotTrustworthyWhereHardlyAFixIsUsed) {
  const auto few = [](std::uint64_t seed, std::span<const double> draws) {
    RunSetup setup = flight_of_eq1(seed, draws);
    setup.scenario.star_tracker.dropout_probability = 0.95;
    return setup;
  };
  const auto rejected = [](std::uint64_t seed, std::span<const double> draws) {
    RunSetup setup = flight_of_eq1(seed, draws);
    setup.scenario.star_tracker.outlier_probability = 0.3;
    setup.scenario.star_tracker.outlier_rad = 0.02;
    return setup;
  };
  EXPECT_THAT(perform(runs_of_filters(8), 3, few).findings, testing::ElementsAre("too-few-fixes"));
  EXPECT_EQ(perform(runs_of_filters(8), 3, few).outcome, RunOutcome::kDoNotUse);
  EXPECT_THAT(perform(runs_of_filters(8), 3, rejected).findings, testing::Contains("many-rejected"));
  EXPECT_EQ(perform(runs_of_filters(8), 3, rejected).outcome, RunOutcome::kDoNotUse);
}

TEST(CampaignOfFilters, RunsThatFailAreRowsAmongTheOthers) {
  const auto some_fail = [](std::uint64_t seed, std::span<const double> draws) {
    RunSetup setup = flight_of_eq1(seed, draws);
    if (draws[0] > 3.5) {
      throw std::invalid_argument("no such scenario");
    }
    if (draws[0] > 3) {
      setup.scenario.star_tracker.dropout_probability = 1;
    }
    if (draws[0] > 2.5) {
      setup.scenario.gyros[0].misalignment_magnitude_rad = -1;
    }
    return setup;
  };
  const std::vector<RunRecord> all = performed(runs_of_filters(16), 1, some_fail);
  std::size_t failures = 0;
  for (const RunRecord& its : all) {
    const double draw = its.draws[0];
    EXPECT_EQ(its.outcome == RunOutcome::kFailed, draw > 2.5) << draw;
    EXPECT_EQ(its.reason.empty(), draw <= 2.5);
    EXPECT_EQ(its.reason.find("no such scenario") != std::string::npos, draw > 3.5);
    failures += draw > 2.5 ? 1 : 0;
  }
  EXPECT_GT(failures, 3U);
  EXPECT_LT(failures, 16U);
}

TEST(Campaign, MeasuresARunAgainstItsTruth) {
  const CampaignPlan plan = six_runs();
  const RunRecord record = perform(plan, 0, short_flight);
  EXPECT_EQ(record.at(RunQuantity::kNeesFreedom), 20);
  EXPECT_GT(record.at(RunQuantity::kNees), 0);
  EXPECT_EQ(record[RunQuantity::kAlignmentError].size(), 6U);
  EXPECT_EQ(record[RunQuantity::kDriftSigma].size(), 14U);
  EXPECT_GT(record.at(RunQuantity::kAttitudeRms), 0);
  EXPECT_GT(record.cpu_s, 0);
  // Five minutes have one correction, and an open loop counts from the second on.
  EXPECT_TRUE(std::isnan(record.at(RunQuantity::kOpenLoopError)));
}

TEST(Campaign, LeavesErrorsThatAreNoNumbersOutOfTheLargest) {
  const CampaignPlan plan = six_runs();
  Flight flight = fly(short_flight(1, std::vector<double>{2}), plan.limit_rad, ground::OpenLoopScope::kExtension);
  const double none = std::numeric_limits<double>::quiet_NaN();
  const auto errors_of = [](const std::vector<double>& sizes) {
    ground::AttitudeErrors errors;
    for (const double size : sizes) {
      errors.t.push_back(Time(std::chrono::seconds(static_cast<std::int64_t>(errors.t.size()))));
      errors.error_rad.emplace_back(0, size, 0);
      errors.age_s.push_back(static_cast<double>(errors.t.size() % 2));  // a correction at every second
    }
    return errors;
  };
  flight.evaluation.navigation.errors = errors_of({9, 3, 2, none, 2, 1, 2});
  flight.evaluation.open_loops.resize(2);
  ground::OpenLoops& loops = flight.evaluation.open_loops[1];
  loops.calibrated = errors_of({none, 5, none, 4});
  loops.known_before = errors_of({7, none, 6});
  loops.intervals.calibrated.observed = std::chrono::minutes(1);
  const RunRecord record = record_of(flight, plan);
  EXPECT_EQ(record.at(RunQuantity::kCorrectedError), 3);
  EXPECT_EQ(record.at(RunQuantity::kNavigationError, kErrorQuantiles.size() - 1), 3);
  EXPECT_EQ(record.at(RunQuantity::kOpenLoopError), 5);
  EXPECT_EQ(record.at(RunQuantity::kOpenLoopErrorBefore), 7);
  EXPECT_EQ(record.at(RunQuantity::kOpenLoopErrorToEnd), 5);
}

TEST(Campaign, TellsTheInnovationsOfRejectedFixesApart) {
  const auto with_outliers = [](std::uint64_t seed, std::span<const double> draws) {
    RunSetup setup = short_flight(seed, draws);
    setup.scenario.star_tracker.outlier_probability = 0.1;
    return setup;
  };
  const RunRecord record = perform(six_runs(), 0, with_outliers);
  EXPECT_EQ(record.at(RunQuantity::kNisFixesOfAll), 100);  // of 101 in five minutes the first starts the filter
  EXPECT_LT(record.at(RunQuantity::kNisFixes), 97);
  EXPECT_LT(record.at(RunQuantity::kNisMean), 6);
  EXPECT_GT(record.at(RunQuantity::kNisMeanOfAll), 100);
  const RunRecord clean = perform(six_runs(), 0, short_flight);
  EXPECT_EQ(clean.at(RunQuantity::kNisMeanOfAll), clean.at(RunQuantity::kNisMean));
  EXPECT_TRUE(clean[RunQuantity::kCovariance].empty());
}

TEST(Campaign, MakesARowWithItsReasonOfARunThatFails) {
  const auto fails = [](std::uint64_t seed, std::span<const double> draws) {
    RunSetup setup = short_flight(seed, draws);
    if (draws[0] > 2) {
      setup.scenario.star_tracker.dropout_probability = 1;
    }
    return setup;
  };
  const std::vector<RunRecord> records = performed(six_runs(), 2, fails);
  ASSERT_EQ(records.size(), 6U);
  for (const RunRecord& record : records) {
    EXPECT_EQ(record.outcome == RunOutcome::kFailed, record.draws[0] > 2);
    if (record.outcome == RunOutcome::kFailed) {
      EXPECT_THAT(record.reason, testing::HasSubstr("no fix"));
      EXPECT_TRUE(std::isnan(record.at(RunQuantity::kNees)));
      EXPECT_EQ(record[RunQuantity::kDriftSigma].size(), 14U);
    }
  }
  const auto impossible = [](std::uint64_t /*seed*/, std::span<const double> /*draws*/) -> RunSetup {
    throw std::invalid_argument("no such scenario");
  };
  EXPECT_EQ(perform(six_runs(), 0, impossible).reason, "no such scenario");
}

TEST(Campaign, EndsByAMachineThatFailsAndByAStop) {
  const auto exhausted = [](std::uint64_t /*seed*/, std::span<const double> /*draws*/) -> RunSetup {
    throw std::bad_alloc();
  };
  EXPECT_THROW(performed(six_runs(), 2, exhausted), std::bad_alloc);
  StopRequest request;
  const StopScope scope(&request);
  std::vector<std::uint64_t> numbers = {0, 1, 2, 3, 4, 5};
  std::size_t collected = 0;
  EXPECT_THROW(perform_all(six_runs(), numbers, short_flight, 1,
                           [&](std::vector<RunRecord>&& records) {
                             EXPECT_LT(records.at(0).run, 2U);
                             if (++collected == 2) {
                               request.make();
                             }
                           }),
               Stopped);
  EXPECT_EQ(collected, 2U);
}

}  // namespace
}  // namespace trihedron::campaign
