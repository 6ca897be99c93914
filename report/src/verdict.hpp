#pragma once
/// The verdict in words, and the numbers that matter: what a reader sees first. Values for assets/page.html.

#include <nlohmann/json.hpp>
#include <vector>

#include "parameters.hpp"
#include "trihedron/report/report.hpp"

namespace trihedron::report {

/// Each with its word and style.
[[nodiscard]] nlohmann::json findings_of(const std::vector<Finding>& findings);

/// verdict, numbers, undetermined, has_weak_axis, is_all_determined, rejected.
[[nodiscard]] nlohmann::json verdict_values(const ReportInput& input, const std::vector<Parameter>& parameters);

}  // namespace trihedron::report
