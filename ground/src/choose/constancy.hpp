#pragma once
/// Whether what a fit takes to stand still does, by the whole pass: alignments, momenta, inertial axes, coefficients.

#include <vector>

#include "choose/trial.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// A polhode over a span of time by its turns in it, and how the period changes over it, as a part of that in its
/// middle: what a pass tells of it one by one.
struct TurnsOfPolhode {
  double turns;
  double change;

  /// begin_s: of the span, since the angle was 0.
  [[nodiscard]] static TurnsOfPolhode of(const Polhode& polhode, double begin_s, double span_s);
  [[nodiscard]] Polhode polhode(double begin_s, double span_s) const;
};

/// The polhode of one rotor with which its coefficients most likely come and go.
struct LikelyPolhode {
  Polhode polhode;      ///< from the epoch of the pass on
  double log_odds = 0;  ///< ln of the Bayes factor against coefficients that stay, less ln of the number of tries
};

/// What may not stand still.
struct Moves {
  std::vector<Change> changes;  ///< the likeliest first, each kind at its likeliest time
  PerGyro<LikelyPolhode> polhodes;
};

/// By a trial. Without any where the pass is shorter than an hour. Derived in docs/mathematics.md, section 12.
[[nodiscard]] Moves moves_over(const Trial& trial);

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
