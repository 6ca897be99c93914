#pragma once
/// Drift that the model leaves unexplained, as it shows in the innovations.

#include <optional>
#include <vector>

#include "trihedron/records/finding.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// The strongest slow line in the innovations of one gyro. Drift that is a function of place comes back as the momentum
/// does, and so do coefficients that follow day and night or the polhode: what of it the model does not contain makes
/// lines at periods of minutes to hours. Process noise that was found large enough keeps the scatter of the innovations
/// and the correlation of neighbours as expected, but it cannot make their spectrum flat.
struct SlowLine {
  int gyro = 0;
  double period_s = 0;
  double amplitude = 0;  ///< of its stronger component, in sigmas of an innovation
  double amplitude_rad = 0;
  double log_chance = 0;  ///< ln of the probability, bounded from above, that white innovations have one as strong
};

/// By the periodogram of the first star tracker's innovations in their sigmas, at the multiples of 1/T up to that of
/// `shortest_period_s`. Nothing where there are too few of them.
[[nodiscard]] std::optional<SlowLine> strongest_slow_line(const std::vector<FixRecord>& fixes,
                                                          double shortest_period_s);

/// Finds drift that is a function of place or history: in what the model and its noise leave in the innovations, unless
/// `findings` tell already that these are not white, or in the noise that was needed to explain the rest. Where the
/// angle between the momenta does not move as either would move it, it is an error of the star tracker.
void judge_drift_left(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings);

}  // namespace trihedron::ground
