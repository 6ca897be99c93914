#pragma once

#include <cstdint>

#include "trihedron/core/setup.hpp"
#include "trihedron/core/status.hpp"

namespace trihedron {

/// Components of a fix seen by a pair of gyros.
inline constexpr int kPairComponents = 4;

/// The gate that good measurements of `freedom` components pass as often as those of a pair pass `gate_nis` (Wilson and
/// Hilferty 1931: the cube root of χ²/n is nearly normal, of mean 1 − 2/9n and variance 2/9n).
[[nodiscard]] double gate_of_freedom(int freedom, double gate_nis);

/// Rejects fixes whose NIS is above a gate, without locking out good ones: after a run of rejections the model is taken
/// to be wrong, not the tracker, and the directions are reopened (their covariance is widened); when that happens again
/// soon, the filter restarts. Where the misfit has jumped by more than a momentum can drift, the star tracker is taken
/// to be wrong, and the run may be much longer; but not where the angle between the momenta, to which no star tracker
/// adds anything, has a part in the misfit. Where the next fix contradicts the first, on which alone the filter rests,
/// either may be wrong: the filter restarts from the later one at once, a few times.
class OutlierGate {
 public:
  /// Largest change of the misfit from one fix to the next that a wrong model can cause: at once, by an alignment wrong
  /// by ten degrees in a slew of 1°/s; and with time, by ten times the drift of a good gyro, or by an alignment wrong
  /// by half a degree in a body that turns at orbital rate.
  static constexpr double kLargestStep_rad = 8.7e-3;  // 30′
  static constexpr double kLargestRate_rad_s = 1e-5;

  /// Restarts without a run of rejections, until a fix confirms the start.
  static constexpr int kMostRestartsAtOnce = 3;

  /// Adds to the time since the last fix.
  void elapse(double dt_s) { since_fix_s_ += dt_s; }

  /// kUsed, kRejectedByGate, kUsedAfterReopening or kRestarted: what to do with the fix. `misfit_rad`: the length of
  /// the innovation; `freedom`: its components; `is_of_gyros`: whether the gyros contradict each other.
  [[nodiscard]] FixStatus judge(const CalibrationSetup& setup, double nis, double misfit_rad,
                                int freedom = kPairComponents, bool is_of_gyros = false);
  [[nodiscard]] int rejections_in_a_row() const { return rejections_in_a_row_; }
  /// Whether the present run of rejections is put down to the tracker.
  [[nodiscard]] bool jumped() const { return jumped_; }
  /// Whether the filter has restarted so few fixes ago that the model cannot be what is wrong now.
  [[nodiscard]] bool restarted_recently() const { return restarted_ && under_suspicion_ > 0; }

 private:
  /// A jump counts only after the start has been confirmed by a fix. It is over when the misfit has been back where it
  /// came from for as long as a run takes.
  void look_for_jump(bool jumped_now, double before_rad, double largest_rad, int reopen_after);

  double since_fix_s_ = 0;
  double misfit_rad_ = 0;  ///< of the last fix
  int rejections_in_a_row_ = 0;
  int under_suspicion_ = 0;
  bool restarted_ = false;  ///< when suspicion arose last
  bool confirmed_ = false;  ///< what the filter rests on has agreed with a fix after it
  bool jumped_ = false;
  std::int8_t restarts_at_once_left_ = kMostRestartsAtOnce;  ///< 0 once the start is confirmed
  double before_jump_rad_ = 0;
  int back_ = 0;  ///< fixes in a row since the jump
};

}  // namespace trihedron
