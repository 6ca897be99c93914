#pragma once
/// Coefficients that come and go with the polhodes of the rotors.

#include "choose/decide.hpp"

namespace trihedron::ground {

/// Decides by the data of the pass, and once more with coefficients that come and go with the polhodes of the rotors
/// where these are likelier than anything else that moves. If they stay, `asked` has them as well.
[[nodiscard]] Decision decide_on_polhodes(const Pass& pass, const Screened& screened, CalibrationOptions& asked,
                                          const DriftModelId& largest_model, const Progress& progress);

}  // namespace trihedron::ground
