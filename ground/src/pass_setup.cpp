#include "pass_setup.hpp"

#include <fmt/format.h>

namespace trihedron::ground {

std::vector<std::string> further_names(const FurtherStateOptions& states, int further_heads, int gyros) {
  constexpr auto kOn = FurtherStateOptions::Choice::kOn;
  std::vector<std::string> names;
  if (states.clock_offset == kOn) {
    names.emplace_back("clock_offset_s");
  }
  if (states.orbital_error == kOn) {
    for (const char* wave : {"sine", "cosine"}) {
      for (const char axis : {'x', 'y', 'z'}) {
        names.push_back(fmt::format("orbital_{}_{}_rad", wave, axis));
      }
    }
  }
  for (int head = 1; head <= further_heads; ++head) {
    for (const char axis : {'x', 'y', 'z'}) {
      names.push_back(fmt::format("star_tracker_{}_align_{}_rad", head + 1, axis));
    }
  }
  if (states.readout_bias == kOn) {
    for (int k = 1; k <= gyros; ++k) {
      for (const char axis : {'x', 'y', 'z'}) {
        names.push_back(fmt::format("gyro{}_readout_bias_{}_rad", k, axis));
      }
    }
  }
  if (states.coefficient_change == kOn) {
    for (int k = 1; k <= gyros; ++k) {
      for (const char* coefficient : Esg7::kNames) {
        names.push_back(fmt::format("gyro{}_{}_change_rad_s", k, coefficient));
      }
    }
  }
  return names;
}

}  // namespace trihedron::ground
