#pragma once
/// A pass of telemetry and its truth from a scenario.

#include <vector>

#include "trihedron/records/pass.hpp"
#include "trihedron/records/scenario.hpp"
#include "trihedron/sim/event.hpp"

namespace trihedron::sim {

/// What simulate() makes: telemetry, the truth behind it, and the faults that were put into it.
struct SimulatedPass {
  Pass pass;
  /// At every epoch at which a fix is due, whether there is one or not. Drift coefficients by
  /// Drift::part_in_eq1_rad_s() at the end of the pass; `unmodelled_rad_s` holds the amplitudes of orthonormal
  /// harmonics, "W(1,0)", the whole of them.
  Truth truth;
  std::vector<Event>
      events;  ///< what was done to the telemetry; gyros' first, then the star tracker's, each in time order
};

/// The same scenario gives the same pass, bit for bit, whatever else runs. Throws std::invalid_argument for a scenario
/// that makes no sense, naming the field.
[[nodiscard]] SimulatedPass simulate(const Scenario& scenario);

/// What the pass.toml of such a pass says.
[[nodiscard]] PassSettings settings_of(const Scenario& scenario);

/// How far beyond both ends of the pass simulate() has to know the attitude, s: fixes look at C(t + offset), and their
/// rate a little to both sides; readings at C(t − latency).
[[nodiscard]] double margin_s(const Scenario& scenario);

/// What simulate() asks of the numbers of a scenario, without its work. Throws as that.
void expect_possible(const Scenario& scenario);

}  // namespace trihedron::sim
