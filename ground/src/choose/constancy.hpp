#pragma once
/// Whether what a fit takes to stand still does, by the whole pass: alignments, momenta, inertial axes, coefficients.

#include <vector>

#include "choose/trial.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// What may move, the likeliest first, each kind at its likeliest time. Empty where the pass is shorter than an hour.
/// Derived in docs/mathematics.md, section 12.
[[nodiscard]] std::vector<Change> changes_over(const Trial& trial);

}  // namespace trihedron::ground
