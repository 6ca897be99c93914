#pragma once
/// Errors of the star tracker and drift that come back with the orbit: the odds of each.

#include "choose/trial.hpp"

namespace trihedron::ground {

/// ln of the odds, against neither, of what comes back with the orbit: an error of the star tracker, or drift about the
/// case axes of each gyro, as of a temperature or of a magnetic field, that would move the momenta as far. Both turn
/// directions alike, but in slews the error stays in the body and the drift in space, and drift of one gyro is not that
/// of the other.
struct OrbitalOdds {
  LogEvidence error;
  LogEvidence drift;
  LogEvidence both;  ///< that of the error by its prior as it is
};
/// Of a trial with neither, with the noise and the spectrum of the drift field that were found by it.
[[nodiscard]] OrbitalOdds orbital_odds(const Trial& trial);

/// ln of the odds, against none, of errors of the star tracker.
struct OddsOfErrors {
  /// That comes back with the orbit, whatever its shape: as many of its first harmonics as make the pass likeliest, six
  /// at most.
  double with_orbit;
  double aberration;  ///< that is not corrected
};
/// By a trial with eq. (1).
[[nodiscard]] OddsOfErrors odds_of_errors(const Trial& trial);

}  // namespace trihedron::ground
