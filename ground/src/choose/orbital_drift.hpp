#pragma once
/// What comes back with the orbit: drift, or an error of the star tracker.

#include "choose/decide.hpp"

namespace trihedron::ground {

/// Decides by the data of the pass, and whether there is drift at orbital period: once more with it where there may be,
/// in place of an error of the star tracker and beside one. Then `asked` has it as well. Where it is not all that is
/// there, but likelier than an error of the star tracker, there is no such error, and a field and noise stand for the
/// drift.
[[nodiscard]] Decision decide_on_orbital_drift(const Pass& pass, const Screened& screened, CalibrationOptions& asked,
                                               const DriftModelId& largest_model, const Progress& progress);

/// Whether what noise there is beside drift that comes back is a tenth of it at most. Drift of another kind comes back
/// too, but not as a sine: it leaves noise of its own size, and coefficients told from it would be too sure.
[[nodiscard]] bool is_all_that_is_left(const Decision& by_drift);

/// What was decided of drift at orbital period stays, with its evidence, when all else is decided again.
void keep_what_comes_back(const Decision& before, Decision& again);

}  // namespace trihedron::ground
