#pragma once
/// Slews that calibrate best.

#include <Eigen/Core>
#include <chrono>
#include <optional>
#include <vector>

#include "trihedron/ground/observe/observe.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/progress.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::plan {

struct SlewLimits {
  std::optional<double> max_rate_rad_s;                ///< or that of the scenario
  double max_angle_rad = 30 * kDegree;                 ///< of each slew from the reference attitude
  int slews = 4;                                       ///< at most, each there and back
  Duration manoeuvre_time = std::chrono::minutes(10);  ///< of all together, turns and holds
};

struct Advice {
  Scenario scenario;  ///< with the slews
  ground::Observability before;
  ground::Observability after;

  [[nodiscard]] const std::vector<Slew>& slews() const { return std::get<std::vector<Slew>>(scenario.attitude.slews); }
  /// The combinations that are harmful without the slews; where none is, all that are weak.
  [[nodiscard]] std::vector<ground::Combination> formerly_weak() const;
};

/// Searches the slews that leave the least attitude error (Observability::attitude_metric): one more slew at a time
/// while that helps, and each time for all of them axis, angle and time by coordinate exchange (Meyer and Nachtsheim
/// 1995), on the linear information of a flight without noise. Before and after are those of simulated flights. The
/// scenario must have no slews of its own. Throws ground::SetupError.
[[nodiscard]] Advice advise(const Scenario& scenario, const CalibrationOptions& options, const SlewLimits& limits,
                            const ground::Mission& mission = {}, const Progress& progress = {});

}  // namespace trihedron::plan
