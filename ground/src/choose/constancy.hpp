#pragma once
/// Whether what a fit takes to stand still does, by the whole pass: alignments, momenta, inertial axes, coefficients.

#include <vector>

#include "choose/trial.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// What may move, the likeliest first, each kind at its likeliest time. Empty where the pass is shorter than an hour.
/// Derived in docs/mathematics.md, section 12.
[[nodiscard]] std::vector<Change> changes_over(const Trial& trial);

/// ln of the odds of an error of the star tracker at orbital period against drift about the case axes of each gyro at
/// it, as of a temperature or of a magnetic field, that would move the momenta as far. Both turn directions alike, but
/// in slews the error stays in the body and the drift in space, and drift of one gyro is not that of the other. Of a
/// trial with neither.
[[nodiscard]] double orbital_error_over_drift(const Trial& trial);

}  // namespace trihedron::ground
