#include "trihedron/campaign/distribute.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <span>
#include <stdexcept>

namespace trihedron::campaign {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

CampaignPlan runs_without_draws(std::uint64_t runs) {
  CampaignPlan plan;
  plan.seed = 3;
  plan.runs = runs;
  return plan;
}

WorkerEvent ready(std::uint64_t worker) { return {worker, WorkerEvent::Kind::kReady, {}, {}}; }
WorkerEvent ended(std::uint64_t worker) { return {worker, WorkerEvent::Kind::kEnded, {}, "signal 9"}; }
WorkerEvent performed(std::uint64_t worker, std::uint64_t run) {
  RunRecord record;
  record.run = run;
  record.outcome = RunOutcome::kTrustworthy;
  return {worker, WorkerEvent::Kind::kPerformed, record, {}};
}

/// Does at once what `becomes` says of each run that is given.
class Fake : public Workers {
 public:
  using Becomes = std::function<std::vector<WorkerEvent>(std::uint64_t worker, std::uint64_t run)>;

  Fake(const std::vector<WorkerEvent>& first, Becomes becomes) : becomes_(std::move(becomes)) {
    events_.push_back(first);
  }

  void give(std::uint64_t worker, std::span<const std::uint64_t> runs) override {
    together_.push_back(runs.size());
    for (const std::uint64_t run : runs) {
      given_.emplace_back(worker, run);
      events_.push_back(becomes_(worker, run));
    }
  }
  std::vector<WorkerEvent> wait() override {
    if (events_.empty()) {
      throw std::runtime_error("would wait for ever");
    }
    std::vector<WorkerEvent> now = events_.front();
    events_.pop_front();
    return now;
  }
  [[nodiscard]] const std::vector<std::pair<std::uint64_t, std::uint64_t>>& given() const { return given_; }
  /// How many runs were given at once.
  [[nodiscard]] const std::vector<std::size_t>& together() const { return together_; }

 private:
  Becomes becomes_;
  std::deque<std::vector<WorkerEvent>> events_;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> given_;
  std::vector<std::size_t> together_;
};

std::map<std::uint64_t, RunRecord> all_of(const CampaignPlan& plan, std::vector<std::uint64_t> runs, Workers& workers) {
  std::map<std::uint64_t, RunRecord> all;
  distribute(plan, runs, workers, [&](std::vector<RunRecord>&& records) {
    for (RunRecord& record : records) {
      const std::uint64_t run = record.run;
      EXPECT_TRUE(all.emplace(run, std::move(record)).second) << run;
    }
  });
  return all;
}

TEST(Distribute, GivesEachRunOnceToWorkersThatHaveNothingToDo) {
  Fake workers({ready(7), ready(3)},
               [](std::uint64_t worker, std::uint64_t run) { return std::vector{performed(worker, run)}; });
  const auto all = all_of(runs_without_draws(9), {1, 4, 5, 8}, workers);
  EXPECT_EQ(all.size(), 4U);
  EXPECT_THAT(workers.given(), ElementsAre(std::pair(7, 1), std::pair(3, 4), std::pair(7, 5), std::pair(3, 8)));
}

CampaignPlan filters(std::uint64_t runs) {
  CampaignPlan plan = runs_without_draws(runs);
  plan.work = CampaignWork::kFilter;
  return plan;
}

TEST(Distribute, GivesRunsOfFiltersEightAtATime) {
  Fake workers({ready(0)}, [](std::uint64_t worker, std::uint64_t run) { return std::vector{performed(worker, run)}; });
  const auto all = all_of(filters(30), {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 20, 21, 22, 23, 24, 25, 26, 27}, workers);
  EXPECT_EQ(all.size(), 18U);
  EXPECT_THAT(workers.together(), ElementsAre(8, 8, 2));
}

TEST(Distribute, GivesRunsThatWereTogetherWithOneThatEndsItsProcessAlone) {
  std::uint64_t next = 10;
  Fake workers({ready(0)}, [&](std::uint64_t worker, std::uint64_t run) -> std::vector<WorkerEvent> {
    if (worker == 0) {  // the third of those given ends it
      return run < 2    ? std::vector{performed(worker, run)}
             : run == 2 ? std::vector{ended(worker), ready(++next)}
                        : std::vector<WorkerEvent>{};
    }
    return run == 2 ? std::vector{ended(worker), ready(++next)} : std::vector{performed(worker, run)};
  });
  const auto all = all_of(filters(12), {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, workers);
  ASSERT_EQ(all.size(), 10U);
  for (const auto& [run, record] : all) {
    EXPECT_EQ(record.outcome, run == 2 ? RunOutcome::kFailed : RunOutcome::kTrustworthy) << run;
  }
  EXPECT_THAT(workers.together(), ElementsAre(8, 1, 1, 1, 1, 1, 1, 2));
}

TEST(Distribute, WaitsForNobodyWhereNothingIsToBeDone) {
  Fake workers({}, nullptr);
  EXPECT_TRUE(all_of(runs_without_draws(9), {}, workers).empty());
}

TEST(Distribute, GivesTheRunOfAWorkerThatEndedToTheNext) {
  Fake workers({ready(0), ready(1)}, [](std::uint64_t worker, std::uint64_t run) {
    return worker == 0 ? std::vector{ended(0), ready(2)} : std::vector{performed(worker, run)};
  });
  const auto all = all_of(runs_without_draws(3), {0, 1, 2}, workers);
  EXPECT_EQ(all.size(), 3U);
  for (const auto& [run, record] : all) {
    EXPECT_EQ(record.outcome, RunOutcome::kTrustworthy) << run;
  }
  EXPECT_EQ(std::ranges::count(workers.given(), 0U, &std::pair<std::uint64_t, std::uint64_t>::second), 2);
}

TEST(Distribute, ARunThatEndsTwoProcessesHasFailedAndTheOthersGoOn) {
  std::uint64_t next = 10;
  Fake workers({ready(0)}, [&](std::uint64_t worker, std::uint64_t run) {
    return run == 1 ? std::vector{ended(worker), ready(++next)} : std::vector{performed(worker, run)};
  });
  const auto all = all_of(runs_without_draws(3), {0, 1, 2}, workers);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all.at(1).outcome, RunOutcome::kFailed);
  EXPECT_THAT(all.at(1).reason, HasSubstr("ended its process 2 times, at last by signal 9"));
  EXPECT_EQ(all.at(1).seed, failed(runs_without_draws(3), 1, "").seed);
  EXPECT_EQ(all.at(2).outcome, RunOutcome::kTrustworthy);
}

TEST(Distribute, AWorkerThatEndsWithNothingToDoCostsNothing) {
  Fake workers({ready(0), ended(0), ready(1)},
               [](std::uint64_t worker, std::uint64_t run) { return std::vector{performed(worker, run)}; });
  EXPECT_EQ(all_of(runs_without_draws(2), {0, 1}, workers).size(), 2U);
  EXPECT_THAT(workers.given(), UnorderedElementsAre(std::pair(1, 0), std::pair(1, 1)));
}

TEST(Distribute, RefusesARecordThatNobodyAskedFor) {
  Fake workers({ready(0)},
               [](std::uint64_t worker, std::uint64_t run) { return std::vector{performed(worker, run + 1)}; });
  EXPECT_THROW(all_of(runs_without_draws(3), {0}, workers), std::logic_error);
}

}  // namespace
}  // namespace trihedron::campaign
