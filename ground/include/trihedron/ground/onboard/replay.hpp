#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {

/// Feeds a pass to a pipeline as the spacecraft would have: in time order, a fix on the time of a gyro sample after it.
/// Calls receive(report, sample) for each report, with the latest sample that was fed. Gyros and star trackers beyond
/// those of the pipeline's layout are not used. Can be stopped.
template <class Receive>
void replay(const Pass& pass, Pipeline& pipeline, Receive&& receive) {
  std::vector<const StarTrackerTelemetry*> heads{&pass.star_tracker};
  for (const StarTrackerTelemetry& further : pass.further_star_trackers) {
    heads.push_back(&further);
  }
  heads.resize(std::min(heads.size(), static_cast<std::size_t>(pipeline.layout().star_trackers)));
  std::vector<std::size_t> next_fix(heads.size(), 0);
  GyroSample sample;
  const auto feed_fixes = [&](auto due) {
    for (std::size_t head = 0; head < heads.size(); ++head) {
      const StarTrackerTelemetry& tracker = *heads[head];
      for (std::size_t& i = next_fix[head]; i < tracker.size() && due(tracker.t[i]); ++i) {
        for (const StepReport& report :
             pipeline.feed(StarFix{tracker.t[i], tracker.q_in_c[i], static_cast<int>(head)})) {
          receive(report, sample);
        }
      }
    }
  };
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    check_stop();
    sample = sample_of(pass.gyro, i);
    feed_fixes([&](Time t) { return t < sample.t; });
    for (const StepReport& report : pipeline.feed(sample)) {
      receive(report, sample);
    }
    feed_fixes([&](Time t) { return t == sample.t; });
  }
  feed_fixes([](Time) { return true; });
  for (const StepReport& report : pipeline.finish()) {
    receive(report, sample);
  }
}

}  // namespace trihedron::ground
