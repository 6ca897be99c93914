#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <future>
#include <thread>
#include <vector>

namespace trihedron::ground {

/// The results of work(0) … work(count − 1), as many at once as there are cores. Throws what they throw, and then
/// begins no more of them.
template <class Work>
auto on_all_cores(std::size_t count, const Work& work,
                  unsigned threads = std::max(std::thread::hardware_concurrency(), 1U)) {
  std::vector<decltype(work(std::size_t{0}))> results(count);
  std::atomic<std::size_t> next = 0;
  std::vector<std::future<void>> workers;
  for (std::size_t i = 0; i < std::min<std::size_t>(count, threads); ++i) {
    workers.push_back(std::async(std::launch::async, [&] {
      try {
        for (std::size_t task = next++; task < count; task = next++) {
          results[task] = work(task);
        }
      } catch (...) {
        next = count;
        throw;
      }
    }));
  }
  for (std::future<void>& worker : workers) {
    worker.get();
  }
  return results;
}

}  // namespace trihedron::ground
