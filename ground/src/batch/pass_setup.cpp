#include "batch/pass_setup.hpp"

#include <fmt/format.h>

#include "onboard/with_estimator.hpp"

namespace trihedron::ground {

std::vector<ParameterId> further_parameters(const FurtherStateOptions& states, int further_heads, int gyros) {
  using Owner = FurtherStateRow::Owner;
  std::vector<ParameterId> parameters;
  for (const FurtherStateRow& row : kFurtherStates) {
    const bool is_there = row.owner == Owner::kFurtherStarTracker || states.is_on(row.state);
    // The first star tracker has none of its own.
    const int begin = row.owner == Owner::kFurtherStarTracker ? 1 : 0;
    const int end = row.owner == Owner::kFurtherStarTracker ? 1 + further_heads : row.owner == Owner::kGyro ? gyros : 1;
    for (int owner = begin; is_there && owner < end; ++owner) {
      for (int component = 0; component < static_cast<int>(row.components.size()); ++component) {
        parameters.push_back(ParameterId::further(row.state, static_cast<std::size_t>(owner), component));
      }
    }
  }
  return parameters;
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
