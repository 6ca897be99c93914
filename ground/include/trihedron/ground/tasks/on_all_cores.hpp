#pragma once
/// Work on all cores. Calls may be nested: together they use no more threads than there are cores. The work has the
/// StopRequest of the thread that asked for it. Nothing that is computed depends on the number of threads. A lock must
/// not be held while such work is waited for: the thread that waits may take up other work, which asks for the lock.

#include <cstddef>
#include <functional>
#include <type_traits>
#include <vector>

namespace trihedron::ground {

/// Calls work(0) … work(count − 1), begun in this order. Throws as if they ran one after the other: what the first that
/// fails throws; those after it are not begun any more.
void for_each_on_all_cores(std::size_t count, const std::function<void(std::size_t)>& work);

/// The results of work(0) … work(count − 1). Throws as for_each_on_all_cores().
template <class Work>
auto on_all_cores(std::size_t count, const Work& work) {
  using Result = std::invoke_result_t<const Work&, std::size_t>;
  static_assert(!std::is_same_v<Result, bool>, "neighbours in std::vector<bool> cannot be written at the same time");
  std::vector<Result> results(count);
  for_each_on_all_cores(count, [&](std::size_t i) { results[i] = work(i); });
  return results;
}

/// Calls both: the first in this thread, the second beside it where a core is free, or after it. Throws what the first
/// throws, or else what the second throws.
void side_by_side(const std::function<void()>& first, const std::function<void()>& second);

/// Calls work(), which uses at most `cores` threads.
void with_cores(unsigned cores, const std::function<void()>& work);

}  // namespace trihedron::ground
