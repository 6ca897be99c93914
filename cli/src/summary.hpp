#pragma once
/// What the commands print: text for people, JSON for programs.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "trihedron/ground/calibrate/several_passes.hpp"
#include "trihedron/ground/evaluate/convergence.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/ground/evaluate/open_loop.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::cli {

/// The truth of a pass, if it has one. Refuses one of another number of gyros.
[[nodiscard]] std::optional<Truth> read_truth_of(const std::filesystem::path& path, const Pass& pass);

/// The reference attitude: the truth where there is one, else the star-tracker fixes used.
struct Reference {
  std::string name;  ///< "truth" or "star tracker"
  std::vector<Time> t;
  std::vector<Eigen::Quaterniond> q_in_c;
  Eigen::Vector3d sigma_rad{0, 0, 0};  ///< of its own error about c x, y, z
};
/// The truth, or else these fixes.
[[nodiscard]] Reference reference_of(const std::optional<Truth>& truth, const StarTrackerTelemetry& fixes,
                                     const Pass& pass);

/// Errors of an attitude against a reference.
struct Evaluation {
  std::string reference;
  ground::AttitudeErrors errors;
  ground::ErrorStatistics whole;
  std::vector<ground::ErrorStatistics> stretches;  ///< of 90 min from the pass epoch
  double limit_rad = 0;
  std::vector<ground::CorrectionInterval> intervals;  ///< empty where the file does not give the corrections
};
[[nodiscard]] Evaluation evaluate(const AttitudeHistory& attitude, const Reference& reference, Time epoch,
                                  double limit_rad);

/// How a calibration went: when its parameters settled, and how long the attitude holds with them.
struct Course {
  std::vector<ground::Convergence> convergence;
  std::vector<ground::OpenLoops> open_loops;
  double limit_rad = 0;
};

/// An angle in the unit that suits its size.
[[nodiscard]] std::string angle_text(double rad);

[[nodiscard]] std::string pass_text(const io::LoadedPass& loaded);
[[nodiscard]] std::string finding_text(const Finding& finding);
[[nodiscard]] std::string verdict_text(const Verdict& verdict);
[[nodiscard]] std::string calibration_text(const CalibrationRun& run, const std::optional<Truth>& truth);
[[nodiscard]] std::string course_text(const CalibrationRun& run, const Course& course);
[[nodiscard]] std::string evaluation_text(const Evaluation& evaluation, Time epoch, const std::string& title);

/// Of several passes: each alone, and whether it agrees with those before.
[[nodiscard]] std::string passes_text(const std::vector<ground::PassAlone>& passes);
[[nodiscard]] nlohmann::ordered_json passes_json(const std::vector<ground::PassAlone>& passes);
[[nodiscard]] nlohmann::ordered_json agreement_json(const ground::Agreement& agreement);

[[nodiscard]] nlohmann::ordered_json statistics_json(const Statistics& statistics);
[[nodiscard]] nlohmann::ordered_json pass_json(const io::LoadedPass& loaded);
[[nodiscard]] nlohmann::ordered_json findings_json(const std::vector<Finding>& findings);
[[nodiscard]] nlohmann::ordered_json verdict_json(const Verdict& verdict);
[[nodiscard]] nlohmann::ordered_json course_json(const CalibrationRun& run, const Course& course);
[[nodiscard]] nlohmann::ordered_json extension_json(const std::vector<ground::IntervalPair>& pairs,
                                                    const std::optional<ground::Extension>& median, Time epoch);
/// "≥ 36 times", "none measured"
[[nodiscard]] std::string extension_text(const std::optional<ground::Extension>& extension);
[[nodiscard]] nlohmann::ordered_json evaluation_json(const Evaluation& evaluation, Time epoch);

}  // namespace trihedron::cli
