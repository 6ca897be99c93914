#pragma once
/// Whether a time lies in one of the stretches that a scenario names.

#include <algorithm>
#include <vector>

#include "trihedron/core/time.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::sim {

/// since: from the start of the pass. Compared in whole nanoseconds: seconds in floating point would lose samples at
/// the edges.
[[nodiscard]] inline bool within(const std::vector<Interval>& intervals, Duration since) {
  return std::ranges::any_of(intervals, [since](const Interval& interval) {
    return since >= from_seconds(interval.begin_s) && since < from_seconds(interval.end_s);
  });
}

}  // namespace trihedron::sim
