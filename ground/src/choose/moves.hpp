#pragma once
/// Whether what a fit takes to stand still does, by the whole pass: alignments, momenta, inertial axes, coefficients.

#include <vector>

#include "choose/polhode_search.hpp"
#include "choose/trial.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// What may not stand still.
struct Moves {
  std::vector<Change> changes;  ///< the likeliest first, each kind at its likeliest time
  PerGyro<LikelyPolhode> polhodes;
};

/// By a trial. Without any where the pass is shorter than an hour. Derived in docs/mathematics.md, section 12.
[[nodiscard]] Moves moves_over(const Trial& trial);

}  // namespace trihedron::ground
