#include "trihedron/campaign/distribute.hpp"

#include <fmt/format.h>

#include <deque>
#include <map>
#include <stdexcept>
#include <utility>

#include "trihedron/campaign/perform.hpp"

namespace trihedron::campaign {
namespace {

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
          expect(event);
          idle_.push_back(event.worker);
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
  void expect(const WorkerEvent& event) {
    const auto its = performed_by_.find(event.worker);
    if (its == performed_by_.end() || its->second != event.record.run) {
      throw std::logic_error(fmt::format("a worker gives run {}, which it was not to perform", event.record.run));
    }
    performed_by_.erase(its);
  }

  void lose(const WorkerEvent& event, std::vector<RunRecord>& records) {
    std::erase(idle_, event.worker);
    const auto its = performed_by_.find(event.worker);
    if (its == performed_by_.end()) {
      return;
    }
    const std::uint64_t run = its->second;
    performed_by_.erase(its);
    if (++lost_[run] < kProcessesForARun) {
      waiting_.push_front(run);
    } else {
      records.push_back(
          failed(plan_, run, fmt::format("ended its process {} times, at last by {}", lost_[run], event.reason)));
    }
  }

  void give() {
    while (!idle_.empty() && !waiting_.empty()) {
      const std::uint64_t worker = idle_.front();
      const std::uint64_t run = waiting_.front();
      idle_.pop_front();
      waiting_.pop_front();
      performed_by_[worker] = run;
      workers_.give(worker, run);
    }
  }

  const CampaignPlan& plan_;
  Workers& workers_;
  std::deque<std::uint64_t> waiting_;
  std::deque<std::uint64_t> idle_;
  std::map<std::uint64_t, std::uint64_t> performed_by_;  ///< runs, by their workers
  std::map<std::uint64_t, int> lost_;                    ///< processes that a run has ended
  std::size_t left_;
};

}  // namespace

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
