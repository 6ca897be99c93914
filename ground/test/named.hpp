#pragma once
/// Parameters by their names in calibration.json, which tests are better read with.

#include <initializer_list>
#include <string_view>
#include <vector>

#include "trihedron/records/parameter_id.hpp"

namespace trihedron::ground {

inline ParameterId parameter(std::string_view name) { return parameter_named(name).value(); }

inline std::vector<ParameterId> parameters(std::initializer_list<std::string_view> names) {
  std::vector<ParameterId> all;
  for (const std::string_view name : names) {
    all.push_back(parameter(name));
  }
  return all;
}

inline DriftCoefficient coefficient(std::string_view name) { return drift_coefficient_named(name).value(); }

}  // namespace trihedron::ground
