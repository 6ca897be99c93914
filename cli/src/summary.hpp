#pragma once
/// What the commands print: text for people, JSON for programs.

#include <fmt/core.h>

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/ground/calibrate/several_passes.hpp"
#include "trihedron/ground/evaluate/calibration_evaluation.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/records/finding.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::cli {

[[nodiscard]] inline double minutes(Duration duration) { return to_seconds(duration) / 60; }

/// In this format, or kNoEntry where it is infinite or none.
[[nodiscard]] std::string figure(fmt::format_string<const double&> format, double value);

[[nodiscard]] std::string pass_text(const io::LoadedPass& loaded);
/// Whether one of the files that a pass is going to be written to is there already.
[[nodiscard]] bool any_is_there(const std::vector<std::filesystem::path>& files_of_pass);
/// The line that says where a pass is, and what it has replaced.
[[nodiscard]] std::string written_pass_text(const std::string& path, bool was_there);
/// How far the clocks of the pass are apart.
[[nodiscard]] std::string clocks_text(const std::optional<Clocks>& clocks, const Pass& pass);
[[nodiscard]] std::string finding_text(const Finding& finding);
[[nodiscard]] std::string verdict_text(const Verdict& verdict);
[[nodiscard]] std::string findings_text(const Verdict& verdict);
/// In one line whether a calibration may be used, and for what.
[[nodiscard]] std::string verdict_line(const Calibration& calibration);
/// How long an accuracy is predicted to be kept, in one line each; and whether a need is met. Empty where nothing is
/// predicted.
[[nodiscard]] std::string forecast_text(const std::optional<OpenLoopForecast>& forecast);
/// `estimate_minus_truth`: by row of Calibration::states; empty where there is no truth.
[[nodiscard]] std::string calibration_text(const CalibrationRun& run, const Eigen::VectorXd& estimate_minus_truth);
/// When the parameters settled, and how long the attitude holds with them.
[[nodiscard]] std::string course_text(const CalibrationRun& run, const ground::CalibrationEvaluation& evaluation);
[[nodiscard]] std::string evaluation_text(const ground::AttitudeEvaluation& evaluation, Time epoch,
                                          const std::string& title);

/// Of several passes: each alone, and whether it agrees with those before.
[[nodiscard]] std::string passes_text(const std::vector<ground::PassAlone>& passes);
[[nodiscard]] nlohmann::ordered_json passes_json(const std::vector<ground::PassAlone>& passes);
[[nodiscard]] nlohmann::ordered_json agreement_json(const ground::Agreement& agreement);

[[nodiscard]] nlohmann::ordered_json statistics_json(const Statistics& statistics);
[[nodiscard]] nlohmann::ordered_json pass_json(const io::LoadedPass& loaded);
/// null where the pass does not show its clocks.
[[nodiscard]] nlohmann::ordered_json clocks_json(const std::optional<Clocks>& clocks, const Pass& pass);
/// A finding, with the keys that it has in every output and in calibration.json.
[[nodiscard]] nlohmann::ordered_json finding_json(std::string_view code, const std::string& text,
                                                  const std::string& evidence, const std::string& cure,
                                                  FindingSeverity severity);
[[nodiscard]] nlohmann::ordered_json findings_json(const std::vector<Finding>& findings);
/// Whether a need is met, how long the usual limit is kept, s; null where nothing is predicted.
[[nodiscard]] nlohmann::ordered_json readiness_json(const std::optional<OpenLoopForecast>& forecast);
[[nodiscard]] nlohmann::ordered_json verdict_json(const Verdict& verdict);
[[nodiscard]] nlohmann::ordered_json course_json(const CalibrationRun& run,
                                                 const ground::CalibrationEvaluation& evaluation);
[[nodiscard]] nlohmann::ordered_json extension_json(const ground::IntervalExtension& extension, Time epoch);
/// "≥ 36 times", "none measured"
[[nodiscard]] std::string extension_text(const std::optional<ground::Extension>& extension);
[[nodiscard]] nlohmann::ordered_json evaluation_json(const ground::AttitudeEvaluation& evaluation, Time epoch);

}  // namespace trihedron::cli
