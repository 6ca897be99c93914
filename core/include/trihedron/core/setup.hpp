#pragma once
/// What the calibration filters are set up with.

#include <Eigen/Core>
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "trihedron/core/layout.hpp"
#include "trihedron/core/precession.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron {

/// What is wrong with a set-up.
enum class SetupFault : std::uint8_t {
  kTooLarge,  ///< the layout needs more room than there is, or has states that this estimator cannot have
  kPriorNotPositiveDefinite,
  kPriorMeanNotUsable,
  kNoiseNotPositive,
  kGateNotPositive,
};

/// A star tracker as the filter knows it.
struct StarTrackerSetup {
  Eigen::Vector3d noise_rad{1e-4, 1e-4, 1e-4};          ///< 1-sigma about its own axes s
  Eigen::Matrix3d C_c_s = Eigen::Matrix3d::Identity();  ///< as designed; c are the axes of the first
  double alignment_sigma_rad = 1e-2;                    ///< of a star tracker other than the first, per axis
};

/// A step between samples further apart than this is a long one, over which readings are not interpolated; the body's
/// acceleration over it is below the readout noise.
[[nodiscard]] Duration max_interpolation(Duration gyro_period);

/// One T for each kind of further states.
template <class T>
class PerFurtherState {
 public:
  [[nodiscard]] constexpr T& operator[](FurtherState state) { return items_[static_cast<std::size_t>(state)]; }
  [[nodiscard]] constexpr const T& operator[](FurtherState state) const {
    return items_[static_cast<std::size_t>(state)];
  }

 private:
  std::array<T, kFurtherStateCount> items_{};
};

/// The prior sigmas of kFurtherStateKinds.
[[nodiscard]] constexpr PerFurtherState<double> default_further_sigmas() {
  PerFurtherState<double> sigmas;
  for (const FurtherStateKind& kind : kFurtherStateKinds) {
    sigmas[kind.state] = kind.prior_sigma;
  }
  return sigmas;
}

/// What a calibration filter is set up with.
struct CalibrationSetup {
  static constexpr Duration kNever = Duration::max();
  static constexpr Duration kLongestGyroPeriod = std::chrono::hours(1);

  Layout layout;
  PerGyro<double> readout_noise_rad{};  ///< 1-sigma per direction cosine
  std::array<StarTrackerSetup, kMaxStarTrackers> star_trackers{};
  /// About c x, y, z: 1-sigma of fixes of the first star tracker that come with a covariance over what that says.
  Eigen::Vector3d over_told_covariance{1, 1, 1};
  Duration gyro_period = std::chrono::milliseconds(125);
  double direction_random_walk_rad_sqrt_s = 0;  ///< process noise of each momentum, per axis across it

  // Of the further states, where the layout has them.
  GaussMarkov wandering_drift;  ///< rad/s per case axis
  /// 1-sigma of each component before anything is measured, rad, rad/s, s or s/s; of the change, of the whole of it.
  PerFurtherState<double> further_sigma = default_further_sigmas();
  CourseOfChange change;               ///< of the coefficients
  PerGyro<Polhode> polhodes{};         ///< from orbital_phase_zero on
  double orbital_rate_rad_s = 1.1e-3;  ///< n
  Time orbital_phase_zero{};           ///< where nt = 0 and θ = 0, and for which the clock offset stands

  /// A fix with a NIS above this is rejected; χ² of 4 degrees of freedom passes 30 once in 2e5 good fixes. That of a
  /// pair: of more gyros a gate that good fixes pass as often.
  double gate_nis = 30;
  /// ν of Student's t, or 0 for normal noise. With it a fix above the gate is used with its weight instead of rejected,
  /// unless the misfit is attributed to the star tracker or to one gyro; a run of fixes above the gate still reopens
  /// the directions. Better than the gate where many fixes are a few times noisier than specified; against few large
  /// outliers the gate alone is as good, and for the paper's filter better. Between 5 and 20.
  double student_t_freedom = 0;
  /// Consecutive rejections after which the direction covariance is widened by the size of the misfit and the fix is
  /// used: the model was wrong, not the tracker.
  int reopen_after_rejections = 20;
  /// The same where the run of rejections began with a jump larger than drift can cause: the star tracker gave wrong
  /// fixes, or has been moved.
  int reopen_after_jump_rejections = 400;
  /// When the filter reopens twice within this number of fixes, the parameters are wrong: it restarts, dropping the
  /// information gathered. The estimates are kept; estimator invariant returns to the prior means where keeping them
  /// has not helped or the prior excludes them.
  int restart_within_fixes = 200;
  /// Whether estimator invariant widens its sigmas where its innovations are correlated in time: the coefficients have
  /// changed, or the model does not hold.
  bool widen_where_correlated = false;
  /// Without a fix that could be used for longer than this, the angles between the momenta are used alone; or kNever.
  Duration angles_after = std::chrono::minutes(1);

  /// The first fault of the settings; the prior is checked by the estimator.
  [[nodiscard]] std::optional<SetupFault> fault() const;

  /// The fraction of the change of the coefficients that has taken place at `t`.
  [[nodiscard]] double part_of_change(Time t) const { return change.part(t); }
  /// What the drift of each gyro depends on at `t`, as far as the layout has such drift.
  [[nodiscard]] DriftTimes drift_times(Time t) const;

  [[nodiscard]] Duration max_interpolation() const { return trihedron::max_interpolation(gyro_period); }
  /// How far to both sides of a fix readings are fitted together: at one fix every 3 s no reading is shared. For slow
  /// gyros further, so that there are enough readings for the polynomial.
  [[nodiscard]] Duration reach() const;
  /// How far back samples are fitted together for the attitude now.
  [[nodiscard]] Duration recent() const;
  /// Number of fixes that share a gyro sample when those of each star tracker come at this interval, at least 1. The
  /// readout variance of each is multiplied by it, so that together they do not claim more than the samples hold.
  [[nodiscard]] double fixes_sharing_a_sample(Duration since_the_last_fix) const;
};

/// Whether these prior means can be used: finite drift coefficients and biases, and alignments that are rotations.
template <class Gyros>
[[nodiscard]] bool means_are_usable(const Gyros& prior, const Layout& layout) {
  for (int k = 0; k < layout.gyros; ++k) {
    const double off = (prior[k].C_c_b * prior[k].C_c_b.transpose() - Eigen::Matrix3d::Identity()).norm();
    if (prior[k].drift_rad_s.size() != layout.drift_columns() || !prior[k].drift_rad_s.allFinite() ||
        !prior[k].errors(layout).allFinite() || !(off < 1e-6)) {
      return false;
    }
  }
  return true;
}

/// Whether estimates are means that can be used, with momenta.
template <class Gyros>
[[nodiscard]] bool estimates_are_finite(const Gyros& gyros, const Layout& layout) {
  for (int k = 0; k < layout.gyros; ++k) {
    if (!gyros[k].h_in.allFinite()) {
      return false;
    }
  }
  return means_are_usable(gyros, layout);
}

/// 1-sigma of one further state before anything is measured, rad, rad/s, s or s/s. `state`: its position, from
/// layout.behind_parameters() on.
[[nodiscard]] double prior_sigma_of_further_state(const CalibrationSetup& setup, int state);

}  // namespace trihedron
