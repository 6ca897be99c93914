#pragma once
/// Whether the predicted accuracy is that which a user needs.

#include <optional>
#include <vector>

#include "trihedron/records/finding.hpp"
#include "trihedron/records/open_loop_forecast.hpp"

namespace trihedron::ground {

/// Adds a finding where a need is stated that is not met.
void judge_need(const std::optional<OpenLoopForecast>& forecast, std::vector<Finding>& findings);

/// Whether that is all that forbids the use of a result.
[[nodiscard]] bool fails_a_need_alone(const Verdict& verdict);

}  // namespace trihedron::ground
