#pragma once
/// Fixes that the filter believed, though the rest of the pass contradicts them.

#include <vector>

#include "choose/decide.hpp"
#include "onboard/screen.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// A filter knows only what came before: where the star tracker was wrong first, it follows the wrong fixes, takes the
/// right ones for outliers, and is set free in the end. If that happened in `run`, the pass is flown once more without
/// the fixes that least squares over the whole of it contradict, 20 and more in a row, if these are few; where the
/// filter then is set free less often, that flight takes the place of `run`. Returns the fixes left out of it, as
/// outliers, in the order of their times. `settings` and `flown`: what `run` was set up with. Can be stopped.
[[nodiscard]] std::vector<FixRecord> fly_without_contradicted(const Pass& pass, const PassSettings& settings,
                                                              const CalibrationOptions& flown, Decision& decision,
                                                              OnBoardRun& run);

/// Puts them among the others, in the order of their times.
void put_into(std::vector<FixRecord>& fixes, std::vector<FixRecord> others);

}  // namespace trihedron::ground
