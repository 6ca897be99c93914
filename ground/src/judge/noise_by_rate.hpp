#pragma once

#include <optional>
#include <vector>

#include "trihedron/records/finding.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Scatter of the fixes of the first star tracker in slews and at rest.
struct NoiseByRate {
  double at_rest = 0;   ///< median of the NIS over its degrees of freedom
  double in_slews = 0;  ///< the same; of fixes that were rejected as well
  long fixes_in_slews = 0;
  double rate_rad_s = 0;  ///< of the body in slews, median
};

/// Slews are where the body turns, by the fixes, three times as fast as it mostly does. Nothing where there are too few
/// fixes in slews.
[[nodiscard]] std::optional<NoiseByRate> noise_by_rate(const StarTrackerTelemetry& star_tracker,
                                                       const std::vector<FixRecord>& fixes);

/// Finds errors of the fixes that grow with the rate of the body: stamps that jitter, or noise of the star tracker or
/// of the readings. One figure for the noise gives fixes in slews too much weight, and the gate selects among them.
void judge_noise_by_rate(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings);

}  // namespace trihedron::ground
