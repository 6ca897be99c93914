#pragma once
/// The tables of the report: values for assets/page.html.

#include <nlohmann/json.hpp>
#include <vector>

#include "parameters.hpp"
#include "trihedron/report/report.hpp"

namespace trihedron::report {

/// spacecraft, facts, gyros, has_truth, coefficients, correlations, evaluation, innovation_rows, fix_counts,
/// sample_counts, gaps, telemetry_notes, settings, statistics; has_…: whether the list that a section shows is not
/// empty.
[[nodiscard]] nlohmann::json table_values(const ReportInput& input, const std::vector<Parameter>& parameters);

}  // namespace trihedron::report
