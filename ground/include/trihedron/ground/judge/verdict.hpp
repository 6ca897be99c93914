#pragma once

#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Findings with evidence and cure, and whether the result may be used.
[[nodiscard]] Verdict judge(const Pass& pass, const CalibrationRun& run);
/// Whether the attitude covers the pass and agrees with the fixes, whether the parameters in use fit it, and whether
/// the gyros last until its end, as for a calibration.
[[nodiscard]] Verdict judge_navigation(const Pass& pass, const NavigationRun& run);
/// Whether enough fixes were used, and few enough rejected: what is said of a filter of which nothing else is known.
[[nodiscard]] Verdict judge_use_of_fixes(const Statistics& statistics);

/// Whether two gyros and more of `gyros` were used until the last sample of the pass, at `end`, but for less than five
/// minutes.
[[nodiscard]] bool has_pair_at_end(const std::vector<GyroEvent>& gyro_events, int gyros, Time end);

/// One for each gyro and state: how often, and when first, in minutes from `epoch`.
[[nodiscard]] std::vector<std::string> texts_of(const std::vector<GyroEvent>& events, Time epoch);

/// How well an attitude history separates an alignment from an initial direction. Where an axis n is fixed in the body
/// and in space, an alignment error about n looks like an error of the initial direction about n, whatever the number
/// of fixes.
struct AlignmentObservability {
  Eigen::Vector3d weakest_axis_c{0, 0, 0};  ///< unit: the body axis that moved least in space
  double sigma_rad =
      0;  ///< of the alignment about that axis from the fixes alone, at best; infinite where it never moved
  double best_sigma_rad = 0;  ///< the same about the axis that moved most
};
/// From the scatter of C_in_c within stretches of ten minutes; what moves more slowly than that cannot be separated
/// from drift. `tracker_noise_rad`: 1-sigma about c x, y, z; `fix_noise_rad`: of a fix about the best axis.
[[nodiscard]] AlignmentObservability alignment_observability(const StarTrackerTelemetry& tracker,
                                                             const Eigen::Vector3d& tracker_noise_rad,
                                                             double fix_noise_rad);

}  // namespace trihedron::ground
