#pragma once
/// The numbers behind the figures, decimated: angles in ″, drift in 10⁻⁶ rad/s. assets/figures.js draws them, each axis
/// in the unit that suits its range.

#include <nlohmann/json.hpp>
#include <vector>

#include "parameters.hpp"
#include "trihedron/report/report.hpp"

namespace trihedron::report {

/// One member per figure; a figure without data has none.
[[nodiscard]] nlohmann::json figure_data(const ReportInput& input, const std::vector<Parameter>& parameters);

}  // namespace trihedron::report
