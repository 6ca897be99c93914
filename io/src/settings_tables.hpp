#pragma once
/// Scenarios and settings as tables of a larger document.

#include <filesystem>
#include <string>

#include "toml_table.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::io {

/// As parse_scenario(); `name` of the table is for people.
[[nodiscard]] Scenario scenario_of_table(const toml::table& table, const std::filesystem::path& file,
                                         const std::string& name);
/// As read_config().
[[nodiscard]] CalibrationOptions config_of_table(const toml::table& table, const std::filesystem::path& file,
                                                 const std::string& name);

[[nodiscard]] Json scenario_table_schema();
[[nodiscard]] Json config_table_schema();

}  // namespace trihedron::io
