#pragma once
/// The runs of a campaign in other processes: who is given which run, and what becomes of one whose process ends. What
/// carries numbers and records to and fro is the caller's.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "trihedron/campaign/perform.hpp"
#include "trihedron/records/campaign.hpp"

namespace trihedron::campaign {

/// What has happened to a worker, which is a process that performs the runs that it is given, one at a time or
/// together.
struct WorkerEvent {
  enum class Kind : std::uint8_t {
    kReady,      ///< it is there and has nothing to do
    kPerformed,  ///< it has performed a run; after the last one that it was given it has nothing to do
    kEnded       ///< it is no more; a worker that takes its place begins with kReady
  };
  std::uint64_t worker = 0;
  Kind kind = Kind::kReady;
  RunRecord record;    ///< of kPerformed
  std::string reason;  ///< of kEnded: "signal 9"
};

/// Processes that perform runs, wherever they are.
class Workers {
 public:
  Workers() = default;
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  virtual ~Workers() = default;

  /// worker: has nothing to do. runs: one at least.
  virtual void give(std::uint64_t worker, std::span<const std::uint64_t> runs) = 0;
  /// Waits until something happens. Throws Stopped, and whatever ends the campaign.
  virtual std::vector<WorkerEvent> wait() = 0;
};

/// Processes that one run may end before it counts as failed.
inline constexpr int kProcessesForARun = 2;

/// Whether a run has failed in that its process ended so often. Performed again it may succeed.
[[nodiscard]] bool was_lost(const RunRecord& record);

/// Gives runs to workers as they have nothing to do, as many as are best performed together, and hands over what has
/// come, in no order. Runs whose worker ends are given to others, each by itself; a run whose worker ends a second time
/// has failed. Throws what `workers` and `collect` throw, and std::logic_error where a worker gives a record of another
/// run than it was given.
void distribute(const CampaignPlan& plan, std::span<const std::uint64_t> runs, Workers& workers,
                const Collect& collect);

}  // namespace trihedron::campaign
