#pragma once
/// What a user may set for a calibration; the effective values are written beside each result.

#include <chrono>
#include <string>

#include "trihedron/core/time.hpp"

namespace trihedron {

/// When the navigator takes an astro-correction, and what it takes over.
struct CorrectionOptions {
  enum class When { kEvery, kOnlyFirst, kEachFix };
  When when = When::kEvery;
  Duration interval = std::chrono::minutes(90);  ///< for kEvery
  bool take_parameters = true;                   ///< false: the parameters known before the pass are held
};

struct CalibrationOptions {
  std::string estimator = "paper";
  std::string drift_model = "esg7";
  /// Process noise of each momentum across itself. The default is small against the readout, and lets go of 0.1″ in 9
  /// h.
  double direction_random_walk_rad_sqrt_s = 3e-9;
  /// A fix with a NIS above this is rejected. χ² of 4 degrees of freedom passes 30 once in 2e5 good fixes.
  double gate_nis = 30;
  /// After so many rejections in a row the directions are set free and the fix is used.
  int reopen_after_rejections = 20;
  /// Estimator invariant: clock offset and error at orbital period of the star tracker, and a drift that wanders.
  bool further_states = false;
  double wandering_drift_rad_s = 1e-8;  ///< 1-sigma about each case axis, first-order Gauss–Markov
  Duration wandering_time = std::chrono::hours(1);
  CorrectionOptions corrections;
};

}  // namespace trihedron
