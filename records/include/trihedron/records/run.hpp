#pragma once
/// Everything that a calibration or navigation of a pass records.

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "trihedron/core/status.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/clocks.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/statistics.hpp"
#include "trihedron/records/status.hpp"

namespace trihedron {

/// One fix: eq. (3) from its second component on, two per gyro, and what was done with it. Of estimator batch: what is
/// left of it when the whole pass is smoothed, along two axes across each momentum.
struct FixRecord {
  Time t{};
  int head = 0;  ///< the star tracker
  FixStatus status = FixStatus::kNone;
  std::vector<double> innovation;        ///< rad
  std::vector<double> innovation_sigma;  ///< rad
  double nis = 0;
  int degrees_of_freedom = 0;  ///< of the NIS: two per gyro that could be used
  double told_sigma_rad = 0;   ///< the smallest by the covariance that it came with; 0 without one
  bool jumped = false;         ///< its misfit came at once and is more than drift can make
  bool corrected_navigator = false;
  /// Rotation vector from the attitude of the open-loop navigator to that of the fix, c axes, rad; where both are
  /// there.
  std::optional<Eigen::Vector3d> off_navigator_rad;

  [[nodiscard]] bool used() const { return is_used(status); }
};

/// Estimates along the pass, for the figures of the paper: rows after used fixes, those nearer than kStep to the last
/// one left out; columns as in Calibration::states.
struct ParameterHistory {
  static constexpr Duration kStep = std::chrono::seconds(30);
  std::vector<Time> t;
  std::vector<std::vector<double>> value;  ///< [row][state]; alignment as rotation vector, rad; drift rad/s
  std::vector<std::vector<double>> sigma;
};

/// What a navigator could start from at an astro-correction; momentum_in of both is that of `t`.
struct Correction {
  Time t{};
  std::vector<GyroCalibration> known_before;  ///< the parameters of before the pass
  std::vector<GyroCalibration> calibrated;    ///< as estimated until then
  OpenLoopStart errors;                       ///< of `calibrated`
};

/// A change of the state of a gyro.
struct GyroEvent {
  Time t{};
  int gyro = 0;  ///< index
  GyroState state = GyroState::kUsed;
};

/// For estimating a kind of further states instead of taking them as zero.
struct Evidence {
  std::optional<FurtherState> state;  ///< without it: the coefficients that eq. (1) does not have
  double log_bayes_factor = 0;
  bool accepted = false;
  /// Of a state that was open and is taken as zero: the largest 1-sigma of its components, in its unit, by the pass and
  /// its prior together, where it is free and all others that were left out are zero.
  std::optional<double> open_sigma{};

  /// For programs: the key of the further state, or "drift_outside_eq1".
  [[nodiscard]] std::string_view key() const { return state ? row_of(*state).key : "drift_outside_eq1"; }
  /// For people.
  [[nodiscard]] std::string_view label() const { return state ? row_of(*state).label : "Drift outside eq. (1)"; }
  /// What is made of it, for people.
  [[nodiscard]] std::string_view outcome() const {
    return accepted ? "estimated" : state ? "taken as zero" : "in the sigmas alone";
  }
};

/// A drift model, fitted to the beginning of the pass and judged by what comes next. Of estimator batch.
struct DriftModelForecast {
  DriftModelId drift_model;
  double log_likelihood = 0;     ///< of the rest of the pass, part by part; above that of the smallest model
  double open_loop_rms_rad = 0;  ///< attitude error, flown open loop over the next part
};

/// What may move during a pass that the estimators take to stand still.
enum class Moving : std::uint8_t {
  kGyroCase,      ///< the case of a gyro against the body
  kStarTracker,   ///< the star tracker against the body: the cases of all gyros alike
  kMomentum,      ///< the momentum of a gyro, by more than its drift
  kInertialAxes,  ///< what the star tracker takes for `in`: all momenta alike
  kCoefficients,  ///< drift coefficients of eq. (1), of a gyro or of all
  kAberration,    ///< fixes are off as starlight is by the motion of the spacecraft
  kReadoutScale,  ///< the scales of a gyro's direction cosines are off, or the right angles of their axes
  kReadoutField,  ///< the readings of a gyro are off by another function of the direction
};

/// How it does.
enum class Motion : std::uint8_t {
  kStep,     ///< once
  kRamp,     ///< evenly
  kDecay,    ///< fast at first, towards a steady value
  kWalk,     ///< by steps at random
  kOrbital,  ///< to and fro at the orbital rate, as by day and night
  kFaster,   ///< to and fro at twice or three times the orbital rate
  kPresent,  ///< it is there all the time
};

/// Something that moves during the pass, by the evidence of the whole pass.
struct Change {
  Moving moving = Moving::kGyroCase;
  Motion motion = Motion::kStep;
  int gyro = -1;         ///< from 0; −1: all
  Time from{}, until{};  ///< between which a step lies
  Duration decay{};      ///< of kDecay, until 1/e of it is left
  double log_odds = 0;   ///< ln of the Bayes factor for it against nothing that moves, less ln of the number of tries
  /// Size and 1-sigma: rotation vector, rad, c axes (kInertialAxes: in axes; kMomentum: two components across the
  /// momentum); coefficients, rad/s, gyro by gyro, for kOrbital of cosine and sine; over the pass. For kFaster,
  /// and for kOrbital of a case, of sine and cosine. For kWalk one number, the root of the sum of squares of all steps;
  /// for kReadoutField the root mean square over all directions, rad.
  Eigen::VectorXd size, sigma;
  /// Coefficients of eq. (1) and alignment of each gyro at the end of the pass, for kOrbital their mean over it, less
  /// what is estimated without the change: rad/s, rad.
  Eigen::VectorXd parameters_off;
  Eigen::MatrixXd parameters_off_covariance;  ///< of what is not known of it

  /// Whether it counts as there: at most in 1 of 20 000 passes in which nothing moves.
  [[nodiscard]] bool is_found() const {
    constexpr double kLogOdds = 9.9;
    return log_odds >= kLogOdds;
  }
};

/// Noise of the gyro readings where a pass shows another than its settings tell: 1-sigma per direction cosine.
struct ReadoutNoise {
  int gyros = 0;
  PerGyro<double> found_rad{};  ///< the median of the hours of the pass
  PerGyro<double> most_rad{};   ///< in one of them
  PerGyro<double> told_rad{};
  PerGyro<double> lasting{};  ///< times what single readings show, found where they are fitted together; 1: no more
  double in_slews = 1;  ///< times as much while the body turns fast as while it does not; 1: no more, or not known

  [[nodiscard]] bool is_steady() const {
    constexpr double kSteady = 1.5;
    return in_slews <= kSteady && std::equal(found_rad.begin(), found_rad.begin() + gyros, most_rad.begin(),
                                             [](double found, double most) { return most <= kSteady * found; });
  }
};

/// Readings by which the angle between two momenta was off for a moment.
struct Bursts {
  long bursts = 0;
  long samples = 0;        ///< of all
  double largest_rad = 0;  ///< mean of the burst in which the angle was off most
  bool left_out = false;   ///< else they are in the attitude
};

/// What a star tracker is off beside its outages, by the attitude without these fixes.
struct ErrorsBesideOutages {
  int outages = 0;
  long fixes = 0;        ///< left out for it
  bool before = false;   ///< before it loses the stars; else after it has found them again
  int minute = 0;        ///< from an outage, where it is most
  double error_rad = 0;  ///< there, in the mean of the outages
  double sigmas = 0;     ///< how sure that is
};

/// Errors of the fixes of a star tracker that are alike from one to the next: fixes were left out, so that the errors
/// of those that stay are nearly independent.
struct CorrelatedFixes {
  int head = 0;
  double part = 0;     ///< of the variance of these errors, about the axis where it is most, has a correlation
  double time_s = 0;   ///< of exp(−t / time_s)
  double step_s = 0;   ///< between the fixes as they were given
  double apart_s = 0;  ///< the fixes that were used, at least
  long left_out = 0;   ///< fixes
};

/// Drift as a field against eq. (1) alone, by the whole pass.
struct AgainstField {
  double log_odds = 0;                ///< ln of the odds of the field
  std::vector<FurtherState> instead;  ///< found beside eq. (1), and not beside the field
};

/// A drift field that may be an error of the star tracker which comes back with the orbit: ln of odds against eq. (1)
/// alone without either.
struct FieldOrError {
  double field = 0;
  double error = 0;
  /// Of a field as large by the angle between the momenta, which no error of the star tracker moves.
  double field_by_angle = 0;
};

/// A calibration of a pass, and everything that was recorded on the way.
struct CalibrationRun {
  CalibrationOptions options;                 ///< as decided
  std::optional<Clocks> clocks;               ///< where the pass shows them, by its stamps as they are given
  std::optional<ClockStep> corrected_step;    ///< taken off the stamps before all else
  ClockCorrection clock_correction;           ///< of the stamps, made before the calibration
  double gyro_stamps_off_s = 0;               ///< rms off the regular times that were used in their place, or 0
  double gyro_stamps_late_s = 0;              ///< in the mean, by the star tracker; taken off those that scatter
  std::optional<ReadoutNoise> readout_noise;  ///< that was used in the place of that of the settings
  std::optional<Bursts> bursts;
  std::optional<ErrorsBesideOutages> beside_outages;  ///< for which fixes were left out
  std::vector<CorrelatedFixes> correlated_fixes;      ///< of the star trackers of which fixes were left out for it
  std::vector<Evidence> evidence;                     ///< of what was left to the program to decide
  /// Where an error of the star tracker at orbital period was accepted: ln of its odds against drift at that period.
  std::optional<double> orbital_error_over_drift;
  /// Where drift at orbital period was found: how far that moved the alignment of each gyro, about c axes, rad.
  std::vector<Eigen::Vector3d> moved_by_orbital_drift_rad;
  /// Where a drift field was found, and eq. (1) alone would show such an error, or aberration, in its place: ln of its
  /// odds against the field.
  std::optional<double> orbital_error_over_field;
  std::optional<FieldOrError> field_or_error;    ///< where a drift field was found that may be one
  std::vector<DriftModelForecast> drift_models;  ///< that were compared, smallest first
  std::optional<AgainstField> against_field;     ///< where eq. (1) alone was asked for
  Calibration known_before;                      ///< values and covariance before the pass; states as in `calibration`
  /// By the pass alone, without the earlier calibration that it was given as prior; where it had one, and is to be
  /// trusted without it.
  std::optional<Calibration> by_pass_alone;
  Calibration calibration;  ///< with verdict and statistics
  /// Of its states, taken for constant: without what coefficients that may have changed add.
  Eigen::MatrixXd covariance_of_constants;
  OpenLoopStart errors;  ///< of the calibration
  std::vector<FixRecord> fixes;
  ParameterHistory parameters;
  std::vector<Correction> corrections;  ///< at the first used fix, and then every 90 min
  AttitudeHistory attitude;             ///< of the calibration itself, at the fixes' epochs
  AttitudeHistory definitive_attitude;  ///< at each gyro sample, where it was asked for
  AttitudeHistory navigation;           ///< of the open-loop navigator at the fixes' epochs
  std::vector<Time> angle_t;            ///< z1 of eq. (3), decimated by min/max
  std::vector<double> angle_residual_min, angle_residual_max;
  SampleCounts samples;                ///< gyro samples by what was done with them
  FixCounts fix_counts;                ///< fixes by what was done with them
  std::vector<GyroEvent> gyro_events;  ///< changes of a gyro's state
  std::vector<Change> changes;         ///< what moves during the pass, the likeliest first
};

/// How far the navigator was off the fixes at the end of an open loop: just before a correction, or at the end of the
/// pass. Medians over the last fixes, so that a single outlier does not count.
struct OpenLoopEnd {
  Time t{};              ///< of the last of these fixes
  double error_rad = 0;  ///< angle between its attitude and that of the fix
  double square = 0;     ///< of the same by its covariance, that of the attitude and of the fix: χ² of three
};

/// The attitude of a pass by the open-loop navigator, and how well the parameters in use fitted.
struct NavigationRun {
  AttitudeHistory attitude;  ///< at every gyro sample used
  std::vector<FixRecord> fixes;
  SampleCounts samples;  ///< from that of the first attitude on, by what was done with them
  int gyros = 0;         ///< that the estimator works with
  std::vector<GyroEvent> gyro_events;
  long corrections = 0;                       ///< astro-corrections made
  long corrections_missed = 0;                ///< intervals over which there were fixes, but none that could correct
  ClockCorrection clock_correction;           ///< of the stamps, by the calibration in use
  double gyro_stamps_off_s = 0;               ///< rms off the regular times that the samples are of, or 0
  std::optional<ReadoutNoise> readout_noise;  ///< that was used in the place of that of the settings
  std::optional<Bursts> bursts;               ///< all in the attitude
  std::vector<CorrelatedFixes> correlated_fixes;  ///< of the star trackers of which fixes were left out for it
  std::optional<Clocks> clocks;                   ///< where the pass shows them, behind this correction
  bool has_clock_state = false;                   ///< an offset of the star tracker's clock is estimated along
  std::vector<OpenLoopEnd> open_loops;            ///< where fixes could be compared with it
  Statistics statistics;
  /// Where parameters are held: (estimated − held)ᵀ P⁻¹ (estimated − held), P the covariance they were given with, and
  /// its 99.9 % limit; of all of them, of the alignments or of the coefficients of eq. (1), whichever is largest
  /// against its limit.
  std::optional<double> held_parameters_misfit;
  double misfit_limit = 0;
  std::string misfit_of;                     ///< which of these
  std::optional<OpenLoopForecast> forecast;  ///< with the parameters in use at the end; nothing without a pair there
  Verdict verdict;
};

}  // namespace trihedron
