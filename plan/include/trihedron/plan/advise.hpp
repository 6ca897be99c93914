#pragma once
/// Advice on the slews from which the calibration learns most.

#include <Eigen/Core>
#include <chrono>
#include <optional>
#include <vector>

#include "trihedron/ground/observe/observe.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/progress.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::plan {

/// What the spacecraft can do, and how much of the flight may be given to calibration.
struct SlewLimits {
  std::optional<double> max_rate_rad_s;                ///< where absent, the limit of the scenario
  double max_angle_rad = 30 * kDegree;                 ///< of each slew from the reference attitude
  int slews = 4;                                       ///< largest number; each goes to an attitude and back
  Duration manoeuvre_time = std::chrono::minutes(10);  ///< of all slews together, turns and holds
};

/// The slews found, and what the flight tells of the parameters without and with them. There are none where those
/// within the limits gain too little.
struct Advice {
  /// A slew is taken only where it makes the mean square error of the attitude smaller by this part of it.
  static constexpr double kLeastGain = 0.05;

  Scenario scenario;  ///< with the slews
  ground::Observability before;
  ground::Observability after;
  Duration time_of_largest_slew{};  ///< that a slew by the largest angle takes, there and back

  [[nodiscard]] const std::vector<Slew>& slews() const { return std::get<std::vector<Slew>>(scenario.attitude.slews); }
  /// The combinations of parameters that do harm without the slews; where none does, all weak ones.
  [[nodiscard]] std::vector<ground::Combination> formerly_weak() const;

  /// One of these, and its 1-sigma, rad or rad/s.
  struct Gain {
    ground::Combination combination;
    double sigma_before = 0;
    double sigma_after = 0;
  };
  [[nodiscard]] std::vector<Gain> gains() const;
};

/// Searches the slews that leave the least attitude error (Observability::attitude_metric): one more slew at a time
/// while that gains enough, and each time for all of them axis, angle and time by coordinate exchange (Meyer and
/// Nachtsheim 1995), on the linear information of a flight without noise. Before and after are those of simulated
/// flights. The scenario must have no slews of its own. Throws ground::SetupError.
[[nodiscard]] Advice advise(const Scenario& scenario, const CalibrationOptions& options, const SlewLimits& limits,
                            const ground::Mission& mission = {}, const Progress& progress = {});

}  // namespace trihedron::plan
