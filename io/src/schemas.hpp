#pragma once
/// The schema of each file that is read or written, made of what its reader goes by.

#include "json_node.hpp"

namespace trihedron::io {

[[nodiscard]] Json pass_schema();
[[nodiscard]] Json telemetry_schema();
[[nodiscard]] Json config_schema();
[[nodiscard]] Json scenario_schema();
[[nodiscard]] Json campaign_schema();
[[nodiscard]] Json calibration_schema();
[[nodiscard]] Json truth_schema();

}  // namespace trihedron::io
