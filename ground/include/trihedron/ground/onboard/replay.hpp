#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "trihedron/core/status.hpp"
#include "trihedron/core/telemetry.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {

/// Feeds a pass to the on-board cycle in time order: a fix on the time of a gyro sample comes after it. Calls
/// on_fix(report) when what was done with a fix is known, and on_sample(report) after each sample and the fixes on its
/// time. Gyros and star trackers beyond those of the cycle are not used. Can be stopped.
template <class Cycle, class OnFix, class OnSample>
void replay(const Pass& pass, Cycle& cycle, OnFix&& on_fix, OnSample&& on_sample) {
  using Report = typename Cycle::Report;
  const auto tell = [&](const Report& report) {
    if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
      on_fix(report);
    }
  };
  std::vector<const StarTrackerTelemetry*> heads{&pass.star_tracker};
  for (const StarTrackerTelemetry& further : pass.further_star_trackers) {
    heads.push_back(&further);
  }
  heads.resize(std::min<std::size_t>(heads.size(), Cycle::kHeads));
  std::vector<std::size_t> next_fix(heads.size(), 0);
  const auto feed_fixes = [&](auto due) {
    for (std::size_t head = 0; head < heads.size(); ++head) {
      const StarTrackerTelemetry& tracker = *heads[head];
      for (std::size_t& i = next_fix[head]; i < tracker.size() && due(tracker.t[i]); ++i) {
        tell(cycle.on_fix(StarFix{tracker.t[i], tracker.q_in_c[i], static_cast<int>(head)}));
      }
    }
  };
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    check_stop();
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
