#pragma once
/// Scenario files (TOML): what a simulated pass is made of. Every value with a unit is a string that carries it; what
/// is left out keeps its default, which is the paper's experiment.

#include <filesystem>
#include <string_view>
#include <vector>

#include "trihedron/records/scenario.hpp"

namespace trihedron::io {

/// Throws InputRefused with line, column, reason and cure for an unknown key, a missing unit, a value of the wrong
/// kind; MachineFailed when the file cannot be read. Whether the values make sense together is for the simulator to
/// say.
[[nodiscard]] Scenario read_scenario(const std::filesystem::path& file);

/// Same, from text; `file` is for messages, and what the scenario names is looked up beside it.
[[nodiscard]] Scenario parse_scenario(std::string_view text, const std::filesystem::path& file);

/// The files that a scenario names: an attitude, an orbit. Throws as read_scenario where it is no TOML.
[[nodiscard]] std::vector<std::filesystem::path> files_of_scenario(const std::filesystem::path& scenario_file);

}  // namespace trihedron::io
