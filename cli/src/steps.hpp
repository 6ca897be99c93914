#pragma once
/// Work that the commands and the demonstration share.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "commands.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/scenario.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::cli {

/// `name`: of the scenario, for a refusal.
[[nodiscard]] sim::SimulatedPass simulated_by(const Scenario& scenario, const std::string& name);
void simulate_pass(const Scenario& scenario, const std::string& name, const std::filesystem::path& pass,
                   const Common& common);

/// Writes calibration.json, attitude.csv, residuals.nc, report.html and effective-config.toml into `out`: of several
/// passes those of the combination, and those of each pass alone into a directory of its name there.
[[nodiscard]] ExitStatus calibrate_passes(const std::vector<std::string>& paths, const CalibrationOptions& options,
                                          const std::filesystem::path& out,
                                          const std::optional<std::filesystem::path>& catalogue, const Common& common);

/// `calibration`: a file whose values replace those known before the pass.
[[nodiscard]] ExitStatus navigate_pass(const std::filesystem::path& pass,
                                       const std::optional<std::filesystem::path>& calibration,
                                       const CalibrationOptions& options, const std::filesystem::path& attitude,
                                       const Common& common);

}  // namespace trihedron::cli
