#pragma once
/// Which states, which drift model and which noise the data of a pass speak for.

#include <vector>

#include "choose/decide.hpp"

namespace trihedron::ground {

/// Whether a trial with everything shows the evidence of a state: of those that are a choice all but the wandering
/// drift, which the search for the noise decides, the drift at orbital period, which looks like an error of the star
/// tracker and is compared with it, and the polhodes, whose periods have to be found first.
[[nodiscard]] bool is_judged_by_trial(const FurtherStateRow& row);

/// The smallest model with what the settings name such that no larger one is more likely by kLogOddsToAccept; nullptr
/// of an empty list.
[[nodiscard]] const Forecast* best_of(const std::vector<Forecast>& forecasts, const PassSettings& settings);

/// Decides by the data of the pass.
[[nodiscard]] Decision decide_by_pass(const Pass& pass, const Screened& screened, const CalibrationOptions& asked,
                                      const DriftModelId& largest_model, const Progress& progress);

}  // namespace trihedron::ground
