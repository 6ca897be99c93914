#pragma once
/// Work that the commands and the demonstration share.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "commands.hpp"
#include "trihedron/ground/evaluate/calibration_evaluation.hpp"
#include "trihedron/io/named_pass.hpp"
#include "trihedron/io/staged_directory.hpp"
#include "trihedron/records/catalogue.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/records/scenario.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::cli {

/// `name`: of the scenario, for a refusal.
[[nodiscard]] sim::SimulatedPass simulated_by(const Scenario& scenario, const std::string& name);
/// Reads the scenario, which is named `name` in a refusal, and writes the pass.
void simulate_pass(const std::filesystem::path& scenario, const std::string& name, const std::filesystem::path& pass,
                   const Common& common);

/// Result of a calibration whose files are staged.
struct Calibrated {
  ExitStatus exit_status = kDoNotUse;
  std::string summary;  ///< text or JSON, to be printed when the files have their places
  std::vector<CatalogueEntry> catalogue_entries;
};

/// Stages calibration.json, attitude.csv, residuals.nc, report.html and effective-config.toml for the directory `out`:
/// of several passes those of the combination, and those of each pass alone into a directory of its name there.
[[nodiscard]] Calibrated calibrate_into(io::StagedDirectory& staged, const std::filesystem::path& out,
                                        const std::vector<io::NamedPass>& passes, const CalibrationOptions& options,
                                        const Common& common);

/// Names of the files that a calibration of one pass may write.
[[nodiscard]] std::span<const std::string_view> outcome_files();

/// Stages the files of a calibration that has been made and evaluated.
void stage_calibration(io::StagedDirectory& staged, const io::NamedPass& pass, const CalibrationRun& run,
                       ground::CalibrationEvaluation evaluation, const CalibrationOptions& options);

/// Of a calibration; an empty path is none.
struct CalibrationFiles {
  std::filesystem::path out;
  std::filesystem::path config;  ///< that the options were read from
  std::filesystem::path catalogue;
};

/// All files, and the entries of the catalogue, or none.
[[nodiscard]] ExitStatus calibrate_passes(const std::vector<std::string>& paths, const CalibrationOptions& options,
                                          const CalibrationFiles& files, const Common& common);

/// Of a navigation; an empty path is none.
struct NavigationFiles {
  std::filesystem::path attitude;     ///< to write
  std::filesystem::path calibration;  ///< whose values replace those known before the pass
  std::filesystem::path config;       ///< that the options were read from
};

[[nodiscard]] ExitStatus navigate_pass(const std::filesystem::path& pass, const NavigationFiles& files,
                                       const CalibrationOptions& options, const Common& common);

}  // namespace trihedron::cli
