#pragma once

#include <cstddef>

#include "trihedron/core/telemetry.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Feeds a pass to the on-board cycle in time order: a fix on the time of a gyro sample comes after it. Calls
/// on_fix(report) when what was done with a fix is known, and on_sample(report) after each sample and the fixes on its
/// time. Gyros beyond the cycle's number are not used.
template <class Cycle, class OnFix, class OnSample>
void replay(const Pass& pass, Cycle& cycle, OnFix&& on_fix, OnSample&& on_sample) {
  using Report = typename Cycle::Report;
  const auto tell = [&](const Report& report) {
    if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
      on_fix(report);
    }
  };
  const auto& tracker = pass.star_tracker;
  std::size_t next_fix = 0;
  const auto feed_fixes = [&](auto due) {
    for (; next_fix < tracker.size() && due(tracker.t[next_fix]); ++next_fix) {
      tell(cycle.on_fix(StarFix{tracker.t[next_fix], tracker.q_in_c[next_fix]}));
    }
  };
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    GyroSample<Cycle::kGyros> sample;
    sample.t = pass.gyro.t[i];
    for (int k = 0; k < Cycle::kGyros; ++k) {
      sample.h_b[k] = pass.gyro.direction(i, k);
    }
    feed_fixes([&](Time t) { return t < sample.t; });
    const Report report = cycle.on_gyro(sample);
    tell(report);
    feed_fixes([&](Time t) { return t == sample.t; });
    on_sample(report);
  }
  feed_fixes([](Time) { return true; });
  for (Report report = cycle.flush(); report.fix.status != FixStatus::kNone; report = cycle.flush()) {
    on_fix(report);
  }
}

}  // namespace trihedron::ground
