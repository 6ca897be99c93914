#include "trihedron/ground/tasks/on_all_cores.hpp"

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>

#include "trihedron/records/stop.hpp"

namespace trihedron::ground {

// A thread that waits for others takes up what there is meanwhile. So many workers as threads, each with a loop,
// instead of a task for each call: no more calls have begun at a time, however many there are and wherever they are
// waited for.

void for_each_on_all_cores(std::size_t count, const std::function<void(std::size_t)>& work) {
  const StopRequest* const request = StopScope::current();
  std::atomic<std::size_t> next = 0;
  std::atomic<std::size_t> end = count;  // the first one that threw
  std::exception_ptr thrown;
  std::mutex one_at_a_time;
  const auto take_one_after_the_other = [&](std::size_t /*worker*/) {
    const StopScope scope(request);
    for (std::size_t task = next++; task < end; task = next++) {
      try {
        check_stop();
        work(task);
      } catch (...) {
        const std::scoped_lock lock(one_at_a_time);
        if (task < end) {
          end = task;
          thrown = std::current_exception();
        }
      }
    }
  };
  const auto threads = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  tbb::parallel_for(std::size_t{0}, std::min(count, threads), take_one_after_the_other, tbb::simple_partitioner());
  if (thrown) {
    std::rethrow_exception(thrown);
  }
}

void side_by_side(const std::function<void()>& first, const std::function<void()>& second) {
  const StopRequest* const request = StopScope::current();
  std::atomic<bool> in_vain = false;
  std::exception_ptr thrown_by_first;
  std::exception_ptr thrown_by_second;
  const auto call = [&request](const std::function<void()>& work, std::exception_ptr& thrown) {
    const StopScope scope(request);
    try {
      check_stop();
      work();
    } catch (...) {
      thrown = std::current_exception();
    }
  };
  tbb::task_group beside;
  beside.run([&] {
    if (!in_vain) {
      call(second, thrown_by_second);
    }
  });
  call(first, thrown_by_first);
  in_vain = thrown_by_first != nullptr;
  beside.wait();
  if (const std::exception_ptr& thrown = thrown_by_first ? thrown_by_first : thrown_by_second) {
    std::rethrow_exception(thrown);
  }
}

void with_cores(unsigned cores, const std::function<void()>& work) {
  const StopRequest* const request = StopScope::current();
  // Threads beyond the processors that the process may use TBB does not start, and says so on the standard error
  // stream.
  tbb::task_arena arena(std::min(static_cast<int>(cores), tbb::info::default_concurrency()));
  arena.execute([&] {
    const StopScope scope(request);
    work();
  });
}

}  // namespace trihedron::ground
