#pragma once
/// The process noise that makes a pass most likely.

#include "choose/trial.hpp"

namespace trihedron::ground {

/// Process noise below this is lost in the readout noise; a search begins here.
inline constexpr double kLeastWalk_rad_sqrt_s = 3e-9;

/// Process noise, and how likely it makes the pass.
struct NoiseFit {
  ProcessNoise noise;
  double log_likelihood = 0;
  /// Log likelihood over that of the starting point of the grid; infinite where that was left out of the search, which
  /// it is only where this is surely above kLogOddsToAccept.
  double gain = 0;
};

/// A random walk, by factors of two above that of the options; drift that wanders as these say. Leaves the trial
/// refitted with it.
[[nodiscard]] NoiseFit with_most_likely_walk(Trial& trial, const CalibrationOptions& options);
/// The same, but searched from the noise that the trial has now, near which the best one is, since a trial with other
/// states found it.
[[nodiscard]] NoiseFit with_most_likely_walk_near(Trial& trial, const CalibrationOptions& options);

/// Level and correlation time of the drift that wanders, by factors of two and three from those of the options. The
/// time stays between 400 s, some arcs, below which it would be a random walk, and 3 h, or is that of the options.
/// Leaves the trial refitted with it.
[[nodiscard]] NoiseFit with_most_likely_wandering(Trial& trial, const CalibrationOptions& options);
/// The same, but searched from level and time of the options, near which the best ones are, since a trial with other
/// states found them.
[[nodiscard]] NoiseFit with_most_likely_wandering_near(Trial& trial, const CalibrationOptions& options);

/// Makes the options those with the random walk that was found.
void use_walk(const ProcessNoise& noise, CalibrationOptions& options);

}  // namespace trihedron::ground
