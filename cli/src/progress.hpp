#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "trihedron/records/progress.hpp"

namespace trihedron::cli {

/// A progress bar on stderr: only to a terminal, gone when its owner is.
class ProgressBar {
 public:
  ProgressBar(std::string what, bool quiet);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  [[nodiscard]] Progress meter() const;

 private:
  std::string what_;
  bool shown_;
};

/// The same for work that consists of many runs: how many are done, how fast, and how long it will take.
class RunCounter {
 public:
  /// `done` of `all` runs are there already.
  RunCounter(std::string what, std::size_t done, std::size_t all, bool quiet);
  ~RunCounter();
  RunCounter(const RunCounter&) = delete;
  RunCounter& operator=(const RunCounter&) = delete;

  /// To be called when another run is done, by one thread at a time.
  void add();

 private:
  void show() const;

  std::string what_;
  std::size_t before_;
  std::size_t done_;
  std::size_t all_;
  bool shown_;
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
};

}  // namespace trihedron::cli
