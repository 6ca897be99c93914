#pragma once
/// Coefficients that change during a pass: whether they do, and by which course.

#include "choose/decide.hpp"

namespace trihedron::ground {

/// Decides by the data of the pass. `change_is_open`: whether the coefficients may be found to change; then a warm-up,
/// a jump or an even change of them is looked for, unless they come and go with the polhodes.
[[nodiscard]] Decision decide_with_course(const Pass& pass, const Screened& screened, CalibrationOptions asked,
                                          const DriftModelId& largest_model, bool change_is_open,
                                          const Progress& progress);

}  // namespace trihedron::ground
