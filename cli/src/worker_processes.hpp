#pragma once
/// Processes of this program that perform runs of a campaign (`campaign --serve`), on this machine.

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "trihedron/io/descriptor.hpp"

namespace trihedron::cli {

/// By which the kernel tells a process its own program; there where /proc is mounted.
inline constexpr const char* kThisProgram = "/proc/self/exe";

/// What a worker process has said, or that it has ended.
struct WorkerNews {
  std::uint64_t worker = 0;
  bool ended = false;
  std::string text;  ///< the line without its end, or how it ended: "signal 9"
};

/// The first line of each is the digest of its campaign, and then one for each run that it was given. A process that
/// ends is followed by another, which has a number that no other has had; all end with this object.
class WorkerProcesses {
 public:
  /// Starts so many. Throws MachineFailed.
  WorkerProcesses(std::string campaign_file, std::size_t count);
  WorkerProcesses(const WorkerProcesses&) = delete;
  WorkerProcesses& operator=(const WorkerProcesses&) = delete;
  ~WorkerProcesses();

  /// worker: one that has said a line for each run that it was given before. What is given to one that has ended is
  /// lost.
  void give(std::uint64_t worker, std::span<const std::uint64_t> runs);
  /// What has come; waits for it at most `patience`. Throws MachineFailed where a process ends by itself before its
  /// first line, or the third in turn is killed before it, since the next would end the same way; Stopped where this
  /// process is to stop as well.
  std::vector<WorkerNews> wait(std::chrono::milliseconds patience);

 private:
  struct Process {
    std::uint64_t number = 0;
    pid_t id = -1;
    io::Descriptor socket{-1};
    std::string said;  ///< the beginning of a line
    bool is_ready = false;
  };

  [[nodiscard]] Process start();
  void listen(Process& process, std::vector<WorkerNews>& news);

  std::string campaign_file_;
  std::uint64_t started_ = 0;
  int killed_at_start_ = 0;  ///< since one has said a line
  std::vector<Process> processes_;
};

}  // namespace trihedron::cli
