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

/// Axes s of the head that is being simulated; those of the first head are c.
struct Head {};

/// What a fix depends on outside the head.
struct StarTrackerView {
  const AttitudeProgramme& attitude;
  const Ephemeris& ephemeris;
  const Sky& sky;
};

/// Fixes at the start of the pass and every `period` up to and with `duration`. Faults are appended to `events`.
/// The sign of q is continuous from fix to fix, except where the fault kFixWrongSign turns it.
[[nodiscard]] StarTrackerTelemetry simulate_fixes(const StarTrackerScenario& head, const StarTrackerView& view,
                                                  Time epoch, Duration duration, Duration period, std::uint64_t seed,
                                                  std::vector<Event>& events, int head_number = 0);

/// Uncorrected aberration as an error e of a fix C_in_s exp([e×]): the rotation by which aberration displaces a star on
/// the boresight, by the relativistic formula. velocity_m_s: of the spacecraft relative to the barycentre of the solar
/// system.
[[nodiscard]] Vec<Head> aberration_error(const Rot<In, Head>& C_in_s, const Vec<In>& velocity_m_s);

}  // namespace trihedron::sim
