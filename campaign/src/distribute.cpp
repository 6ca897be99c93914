#include "trihedron/campaign/distribute.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <deque>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "trihedron/campaign/perform.hpp"

namespace trihedron::campaign {
namespace {

constexpr std::string_view kLost = "ended its process";

/// Who performs what.
class Assignments {
 public:
  Assignments(const CampaignPlan& plan, std::span<const std::uint64_t> runs, Workers& workers)
      : plan_(plan), workers_(workers), waiting_(runs.begin(), runs.end()), left_(runs.size()) {}

  [[nodiscard]] bool is_done() const { return left_ == 0; }

  /// Waits for what happens next; the records that it brings.
  std::vector<RunRecord> next() {
    std::vector<RunRecord> records;
    for (WorkerEvent& event : workers_.wait()) {
      switch (event.kind) {
        case WorkerEvent::Kind::kReady:
          idle_.push_back(event.worker);
          break;
        case WorkerEvent::Kind::kPerformed:
          take(event);
          records.push_back(std::move(event.record));
          break;
        case WorkerEvent::Kind::kEnded:
          lose(event, records);
          break;
      }
    }
    left_ -= records.size();
    give();
    return records;
  }

 private:
  void take(const WorkerEvent& event) {
    const auto its = performed_by_.find(event.worker);
    if (its == performed_by_.end() || std::erase(its->second, event.record.run) == 0) {
      throw std::logic_error(fmt::format("a worker gives run {}, which it was not to perform", event.record.run));
    }
    if (its->second.empty()) {
      performed_by_.erase(its);
      idle_.push_back(event.worker);
    }
  }

  void lose(const WorkerEvent& event, std::vector<RunRecord>& records) {
    std::erase(idle_, event.worker);
    const auto its = performed_by_.find(event.worker);
    if (its == performed_by_.end()) {
      return;
    }
    for (const std::uint64_t run : its->second) {
      if (++lost_[run] < kProcessesForARun) {
        again_.push_back(run);
      } else {
        records.push_back(
            failed(plan_, run, fmt::format("{} {} times, at last by {}", kLost, lost_[run], event.reason)));
      }
    }
    performed_by_.erase(its);
  }

  /// Those that a worker performs next. One that has ended a process, perhaps by itself, goes alone.
  std::vector<std::uint64_t> next_runs() {
    std::deque<std::uint64_t>& from = again_.empty() ? waiting_ : again_;
    const std::size_t size = again_.empty() ? std::min(runs_together(plan_), waiting_.size()) : 1;
    const auto end = from.begin() + static_cast<std::ptrdiff_t>(size);
    std::vector<std::uint64_t> runs(from.begin(), end);
    from.erase(from.begin(), end);
    return runs;
  }

  void give() {
    while (!idle_.empty() && !(waiting_.empty() && again_.empty())) {
      const std::uint64_t worker = idle_.front();
      idle_.pop_front();
      const std::vector<std::uint64_t>& runs = performed_by_[worker] = next_runs();
      workers_.give(worker, runs);
    }
  }

  const CampaignPlan& plan_;
  Workers& workers_;
  std::deque<std::uint64_t> waiting_;
  std::deque<std::uint64_t> again_;  ///< those whose worker has ended
  std::deque<std::uint64_t> idle_;
  std::map<std::uint64_t, std::vector<std::uint64_t>> performed_by_;  ///< runs, by their workers
  std::map<std::uint64_t, int> lost_;                                 ///< processes that a run has ended
  std::size_t left_;
};

}  // namespace

bool was_lost(const RunRecord& record) {
  return record.outcome == RunOutcome::kFailed && record.reason.starts_with(kLost);
}

void distribute(const CampaignPlan& plan, std::span<const std::uint64_t> runs, Workers& workers,
                const Collect& collect) {
  Assignments assignments(plan, runs, workers);
  while (!assignments.is_done()) {
    if (std::vector<RunRecord> records = assignments.next(); !records.empty()) {
      collect(std::move(records));
    }
  }
}

}  // namespace trihedron::campaign
