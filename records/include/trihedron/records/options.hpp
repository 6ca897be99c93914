#pragma once
/// What a user may set for a calibration; the effective values are written beside each result.

#include <Eigen/Core>
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/core/drift_model.hpp"
#include "trihedron/core/precession.hpp"
#include "trihedron/core/time.hpp"
#include "trihedron/records/estimator.hpp"
#include "trihedron/records/further_state.hpp"
#include "trihedron/records/open_loop_forecast.hpp"

namespace trihedron {

/// When the navigator takes an astro-correction, and what it takes over.
struct CorrectionOptions {
  enum class When { kEvery, kOnlyFirst, kEachFix };
  When when = When::kEvery;
  Duration interval = std::chrono::minutes(90);  ///< for kEvery
  bool take_parameters = true;                   ///< false: the parameters known before the pass are held
};

/// What estimators invariant and batch estimate in addition to alignment and eq. (1). kAuto: decided by the evidence of
/// the pass. The alignments of further star trackers are estimated where the pass has such; for them nothing is chosen
/// here.
struct FurtherStateOptions {
  enum class Choice : std::uint8_t { kAuto, kOff, kOn };

  double wandering_drift_rad_s = 1e-8;  ///< 1-sigma of the wandering drift, where on
  Duration wandering_time = std::chrono::hours(1);
  CourseOfChange::Kind change_course = CourseOfChange::Kind::kEven;  ///< of the change of the coefficients, where on
  Duration change_time = std::chrono::hours(1);                      ///< CourseOfChange::time_s
  /// Of the rotor of each gyro, from the epoch of the pass on; where the change with it is on.
  PerGyro<Polhode> polhodes{};

  [[nodiscard]] constexpr Choice& operator[](FurtherState state) { return choices_[static_cast<std::size_t>(state)]; }
  [[nodiscard]] constexpr Choice operator[](FurtherState state) const {
    return choices_[static_cast<std::size_t>(state)];
  }
  [[nodiscard]] constexpr bool is_on(FurtherState state) const { return (*this)[state] == Choice::kOn; }

  [[nodiscard]] static FurtherStateOptions none() {
    FurtherStateOptions states;
    states.choices_.fill(Choice::kOff);
    return states;
  }

 private:
  std::array<Choice, kFurtherStateCount> choices_{};
};

/// All settings of a calibration; the defaults are those of the program.
struct CalibrationOptions {
  Estimator estimator = Estimator::kInvariant;
  std::optional<DriftModelId> drift_model;  ///< without it the one that the pass gives evidence of
  /// Whether the prior variances of the members outside eq. (1) are found from the pass; needs kLargestDriftModel.
  bool drift_field = false;
  /// Whether the noise, and what of it is correlated in time, is estimated from a pass that is long enough, instead of
  /// taken from the settings.
  bool find_noise = true;
  /// Process noise of each momentum, per axis across it; where the noise is found from the pass, its lower limit. The
  /// default is small against the readout noise: 0.1″ in 9 h.
  double direction_random_walk_rad_sqrt_s = 3e-9;
  /// Replaces the value in the pass settings, where one was estimated.
  std::optional<Eigen::Vector3d> star_tracker_noise_rad;
  /// Of the error of the star tracker at orbital period, where it is known; without it that of a low orbit.
  std::optional<double> orbital_rate_rad_s;
  /// A fix with a NIS above this is rejected; χ² of 4 degrees of freedom passes 30 once in 2e5 good fixes. That of a
  /// pair: of more gyros a gate that good fixes pass as often.
  double gate_nis = 30;
  /// Consecutive rejections after which the directions are reopened and the fix is used.
  int reopen_after_rejections = 20;
  /// The same where the run began with a jump larger than drift can cause: the star tracker gave wrong fixes, or has
  /// been moved.
  int reopen_after_jump_rejections = 400;
  /// ν of Student's t: a fix above the gate is used with less weight instead of rejected. 0: normal noise, the gate
  /// alone.
  double student_t_freedom = 0;
  /// Without a usable fix for longer than this the angles between the momenta are used alone; Duration::max(): never.
  /// Of estimator invariant.
  Duration angles_after = std::chrono::minutes(1);
  /// Whether a causal filter (on board, `navigate --online`) widens its sigmas where its innovations are correlated in
  /// time. `calibrate`, which has the whole pass, finds what changes during it and does not need this.
  bool widen_where_correlated = false;
  FurtherStateOptions further_states;
  CorrectionOptions corrections;
  std::optional<Need> need;          ///< of the attitude between corrections; without one nothing is judged by it
  bool definitive_attitude = false;  ///< of estimator batch: the smoothed attitude at each gyro sample as well
};

/// The drift model as settings name it: "auto", "field", or that of a model.
[[nodiscard]] std::string drift_model_word(const CalibrationOptions& options);
/// Sets it by such a word. False, and nothing set, for another word.
[[nodiscard]] bool set_drift_model(std::string_view word, CalibrationOptions& options);
/// The words.
[[nodiscard]] std::vector<std::string> drift_model_words();
/// For messages: "auto, field, esg7, esg20, or vsh:1 … vsh:8"
[[nodiscard]] std::string drift_model_word_choices();

}  // namespace trihedron
