#pragma once
/// Whether the predicted accuracy is that which a user needs.

#include <optional>
#include <vector>

#include "trihedron/records/finding.hpp"
#include "trihedron/records/open_loop_forecast.hpp"

namespace trihedron::ground {

/// Adds a finding where a need is stated that is not met.
void judge_need(const std::optional<OpenLoopForecast>& forecast, std::vector<Finding>& findings);

}  // namespace trihedron::ground
