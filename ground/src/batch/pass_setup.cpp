#include "batch/pass_setup.hpp"

#include <fmt/format.h>

#include "onboard/with_estimator.hpp"

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

PassSetup setup_of(const Pass& pass, const CalibrationOptions& options) {
  return with_estimator(pass, options, [&]<class Estimator> {
    const auto cycle = make_cycle<Estimator>(pass, options, {.navigate = false});
    return pass_setup<Estimator>(cycle->estimator().setup(), pass, options);
  });
}

PassSolution first_solution(const PassProblem& problem, const Screened& screened) {
  std::vector<GyroParameters> gyros;
  for (const GyroCalibration& gyro : screened.first) {
    gyros.push_back(parameters_of(gyro, problem.setup().family));
  }
  return problem.start(gyros);
}

}  // namespace trihedron::ground
