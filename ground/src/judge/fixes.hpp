#pragma once
/// Findings on the fixes: whether they were used, how they scatter, what their errors are like.

#include <optional>
#include <string>
#include <vector>

#include "trihedron/records/finding.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

void judge_number_of_fixes(const Statistics& statistics, std::vector<Finding>& findings);
/// Outliers, and a filter that lost the momenta.
void judge_rejections(const Statistics& statistics, std::vector<Finding>& findings);
/// A filter that widened its sigmas. `epoch`: from which times are told.
void judge_widenings(const std::vector<FixRecord>& fixes, Time epoch, std::vector<Finding>& findings);
/// Fixes that were off in a row, or frozen.
void judge_star_tracker(const Statistics& statistics, std::vector<Finding>& findings);
/// `what_is_wrong`: where they scatter more than expected.
void judge_nis(const Statistics& statistics, const std::string& what_is_wrong, std::vector<Finding>& findings);
/// Whether innovations are white, and without lines at the orbital rate.
void judge_whiteness(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings);
/// Whether errors of each star tracker are normal.
void judge_shape_of_errors(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings);
/// Noise of the star tracker other than in the settings.
void judge_noise(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings);
/// Fixes whose own covariances are far too small. `epoch`: from which times are told.
void judge_told_covariances(const std::vector<FixRecord>& fixes, Time epoch, std::vector<Finding>& findings);
void judge_beside_outages(const std::optional<ErrorsBesideOutages>& errors, std::vector<Finding>& findings);
void judge_correlated_fixes(const std::vector<CorrelatedFixes>& star_trackers, std::vector<Finding>& findings);

}  // namespace trihedron::ground
