#include "schemas.hpp"

#include "trihedron/io/schema.hpp"

namespace trihedron::io {

std::vector<Schema> schemas() {
  const auto schema = [](const char* name, Json (*document)()) {
    return Schema{name, [document] { return document().dump(1); }};
  };
  return {schema("pass", pass_schema),         schema("telemetry", telemetry_schema),
          schema("config", config_schema),     schema("scenario", scenario_schema),
          schema("campaign", campaign_schema), schema("calibration", calibration_schema),
          schema("truth", truth_schema)};
}

}  // namespace trihedron::io
