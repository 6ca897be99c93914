#include "schemas.hpp"

#include "trihedron/io/schema.hpp"

namespace trihedron::io {

std::vector<Schema> schemas() {
  return {{"pass", pass_schema().dump(1)},         {"telemetry", telemetry_schema().dump(1)},
          {"config", config_schema().dump(1)},     {"scenario", scenario_schema().dump(1)},
          {"campaign", campaign_schema().dump(1)}, {"calibration", calibration_schema().dump(1)},
          {"truth", truth_schema().dump(1)}};
}

}  // namespace trihedron::io
