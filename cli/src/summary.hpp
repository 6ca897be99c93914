#pragma once
/// What the commands print: text for people, JSON for programs.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "trihedron/ground/calibrate.hpp"
#include "trihedron/ground/evaluate.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::cli {

/// The truth of a pass, if it has one. Refuses one of another number of gyros.
[[nodiscard]] std::optional<Truth> read_truth_of(const std::filesystem::path& path, const Pass& pass);

/// Errors of an attitude against the best reference that the pass has.
struct Evaluation {
  std::string reference;  ///< "truth" or "star tracker"
  ground::AttitudeErrors errors;
  ground::ErrorStatistics whole;
  std::vector<ground::ErrorStatistics> stretches;  ///< of 90 min from the pass epoch
  double limit_rad = 0;
  std::vector<ground::CorrectionInterval> intervals;  ///< empty where the attitude does not tell its corrections
};
[[nodiscard]] Evaluation evaluate(const AttitudeHistory& attitude, const Pass& pass, const std::optional<Truth>& truth,
                                  double limit_rad);

[[nodiscard]] std::string pass_text(const io::LoadedPass& loaded);
[[nodiscard]] std::string verdict_text(const Verdict& verdict);
[[nodiscard]] std::string calibration_text(const ground::CalibrationRun& run, const std::optional<Truth>& truth);
[[nodiscard]] std::string evaluation_text(const Evaluation& evaluation, Time epoch, const std::string& title);

[[nodiscard]] nlohmann::ordered_json pass_json(const io::LoadedPass& loaded);
[[nodiscard]] nlohmann::ordered_json verdict_json(const Verdict& verdict);
[[nodiscard]] nlohmann::ordered_json evaluation_json(const Evaluation& evaluation, Time epoch);

}  // namespace trihedron::cli
