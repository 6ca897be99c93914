#pragma once
/// A star-tracker head: fixes with its errors, and the times when it gives none.

#include <vector>

#include "trihedron/records/pass.hpp"
#include "trihedron/records/scenario.hpp"
#include "trihedron/sim/attitude.hpp"
#include "trihedron/sim/event.hpp"
#include "trihedron/sim/orbit.hpp"
#include "trihedron/sim/sky.hpp"

namespace trihedron::sim {

/// Axes s of the head at hand, whichever its number; c for the first.
struct Head {};

/// Everything outside the head that a fix depends on.
struct StarTrackerView {
  const AttitudeProgramme& attitude;
  const Ephemeris& ephemeris;
  const Sky& sky;
};

/// Fixes at the start of the pass and every `period` up to and with `duration`. Faults are appended to `events`.
/// Signs of q follow on from one fix to the next, but for the wrong ones.
[[nodiscard]] StarTrackerTelemetry simulate_fixes(const StarTrackerScenario& head, const StarTrackerView& view,
                                                  Time epoch, Duration duration, Duration period, std::uint64_t seed,
                                                  std::vector<Event>& events, int head_number = 0);

/// The small rotation e of a fix C_in_s exp([e×]) that takes the stars where aberration shows them: first and higher
/// orders of the velocity, as they move the boresight. velocity_m_s: of the spacecraft in the solar system.
[[nodiscard]] Vec<Head> aberration_error(const Rot<In, Head>& C_in_s, const Vec<In>& velocity_m_s);

}  // namespace trihedron::sim
