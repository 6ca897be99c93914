#pragma once

#include <variant>

#include "trihedron/ground/onboard/events.hpp"
#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {

/// Feeds a pass to a pipeline as the spacecraft would have, and calls receive(report) for each report. Gyros and star
/// trackers beyond those of the pipeline's layout are not used. Can be stopped.
template <class Receive>
void replay(const Pass& pass, Pipeline& pipeline, Receive&& receive) {
  Events events(pass, pipeline.layout().star_trackers);
  while (const auto event = events.next()) {
    check_stop();
    for (const StepReport& report : std::visit([&](const auto& its) { return pipeline.feed(its); }, *event)) {
      receive(report);
    }
  }
  for (const StepReport& report : pipeline.finish()) {
    receive(report);
  }
}

}  // namespace trihedron::ground
