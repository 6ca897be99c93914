#pragma once
/// The on-board cycle: gyro samples and fixes in, in time order; calibration and attitude out. One object, no heap, no
/// exceptions.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

#include "trihedron/core/navigator.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

enum class SampleStatus : std::uint8_t {
  kUsed,
  kRejectedNotDirection,  ///< a reading is not finite or not unit
  kRejectedOutOfOrder,    ///< not later than the sample before it, or alone more than an hour ahead
  kRejectedGeometry,      ///< momenta nearly parallel
};

/// Astro-corrections of the navigator.
struct CorrectionPolicy {
  static constexpr Duration kEveryFix = Duration::zero();
  static constexpr Duration kOnlyFirst = Duration::max();
  Duration interval = std::chrono::minutes(90);
  bool take_parameters = true;  ///< false: the parameters of the set-up are held
};

/// Complete for every sample, whatever was wrong with it.
template <class Estimator>
struct StepReport {
  Time t{};
  SampleStatus sample = SampleStatus::kUsed;
  typename Estimator::Report fix;  ///< of the fix that fell between the sample before and this one, if any
  bool corrected = false;          ///< the navigator was corrected at that fix
  /// Attitude at that fix, used or rejected as an outlier: of the calibration itself, and of the open-loop navigator.
  std::optional<AttitudeSolution> calibrated;
  std::optional<AttitudeSolution> navigated;
  /// z1 of eq. (3), cosθ predicted minus cosθ measured: the integrity of the pair, without a star tracker. Zero before
  /// the start.
  double angle_residual = 0;
};

template <class Estimator>
class Cycle {
 public:
  static constexpr int kGyros = Estimator::kGyros;
  using Report = StepReport<Estimator>;
  using Setup = typename Estimator::Setup;
  using Directions = typename Estimator::Directions;

  /// A fix is interpolated between samples no further apart than this; the body's acceleration over it is below the
  /// readout noise.
  static constexpr Duration kMaxInterpolation = std::chrono::milliseconds(500);
  /// A sample further ahead is believed only when the next one confirms it.
  static constexpr Duration kMaxGap = std::chrono::hours(1);

  [[nodiscard]] static Result<Cycle, SetupFault> create(const Setup& setup, const CorrectionPolicy& policy) {
    const auto estimator = Estimator::create(setup);
    if (!estimator) {
      return estimator.fault();
    }
    Cycle cycle;
    cycle.estimator_ = estimator.value();
    cycle.policy_ = policy;
    return cycle;
  }

  /// A default one is not set up; it exists for Result only.
  Cycle() = default;

  /// One gyro sample: the whole 125 ms step.
  Report on_gyro(const GyroSample<kGyros>& sample) {
    Report report;
    report.t = sample.t;
    Directions h_b;
    report.sample = screen(sample, h_b);
    if (report.sample == SampleStatus::kUsed && is_wild(sample.t)) {
      report.sample = SampleStatus::kRejectedOutOfOrder;
    }
    if (report.sample != SampleStatus::kUsed) {
      return report;
    }
    if (has_pending_fix_ && pending_fix_.t <= sample.t) {
      has_pending_fix_ = false;
      correct_between_samples(sample.t, h_b, report);
    }
    if (!predict_to(sample.t, h_b)) {
      report.sample = SampleStatus::kRejectedGeometry;
    }
    report.angle_residual = angle_residual();
    return report;
  }

  /// One fix. On the time of the latest gyro sample it is used at once, later ones are held for the sample after them
  /// and reported there.
  Report on_fix(const StarFix& fix) {
    Report report;
    report.t = fix.t;
    report.fix.t = fix.t;
    if (!fix.q_in_c.coeffs().allFinite() || !nearly_unit(fix.q_in_c.norm())) {
      report.fix.status = FixStatus::kRejectedNotRotation;
    } else if ((has_used_fix_ && fix.t <= used_fix_t_) || (has_sample_ && fix.t < t_)) {
      report.fix.status = FixStatus::kRejectedOutOfOrder;
    } else if (!has_sample_ || fix.t - t_ > kMaxInterpolation || has_pending_fix_) {
      // Too far from the latest sample to be interpolated, whatever comes next; or a second one before the next sample.
      report.fix.status = FixStatus::kRejectedNoGyro;
    } else if (fix.t == t_) {
      correct_now(Rot<In, C>::assume(fix.q_in_c.normalized()), report);
      report.angle_residual = angle_residual();
    } else {
      has_pending_fix_ = true;
      pending_fix_ = fix;
      report.fix.status = FixStatus::kPending;
    }
    return report;
  }

  [[nodiscard]] const Estimator& estimator() const { return estimator_; }
  [[nodiscard]] const Navigator<Estimator>& navigator() const { return navigator_; }
  /// Time of the latest sample used.
  [[nodiscard]] Time t() const { return t_; }

  /// Open-loop attitude at the latest sample. Needs navigator().started().
  [[nodiscard]] Result<AttitudeSolution, DirectionsFault> navigation_attitude() const {
    return navigator_.attitude_with_covariance(h_b_, estimator_.since_fix(), estimator_.setup());
  }

 private:
  [[nodiscard]] SampleStatus screen(const GyroSample<kGyros>& sample, Directions& h_b) const {
    if (has_sample_ && !(sample.t > t_)) {
      return SampleStatus::kRejectedOutOfOrder;
    }
    for (int k = 0; k < h_b.size(); ++k) {
      const double norm = sample.h_b[k].norm();
      if (!nearly_unit(norm)) {
        return SampleStatus::kRejectedNotDirection;
      }
      h_b[k] = sample.h_b[k] / norm;
    }
    return SampleStatus::kUsed;
  }

  /// Whether a time lies so far ahead that it needs a second one beside it to be believed: a single wild time stamp
  /// would otherwise put everything after it out of order.
  [[nodiscard]] bool is_wild(Time t) {
    if (!has_sample_ || t - t_ <= kMaxGap) {
      return false;
    }
    const bool confirmed = has_suspect_ && t > suspect_t_ && t - suspect_t_ <= kMaxInterpolation;
    has_suspect_ = !confirmed;
    suspect_t_ = t;
    return !confirmed;
  }

  /// The pending fix, at readings interpolated to its time.
  void correct_between_samples(Time t_next, const Directions& h_b_next, Report& report) {
    report.fix.t = pending_fix_.t;
    if (t_next - t_ > kMaxInterpolation) {
      report.fix.status = FixStatus::kRejectedNoGyro;
      return;
    }
    const double fraction = to_seconds(pending_fix_.t - t_) / to_seconds(t_next - t_);
    Directions h_b;
    for (int k = 0; k < h_b.size(); ++k) {
      h_b[k] = ((1 - fraction) * h_b_[k] + fraction * h_b_next[k]).normalized();
    }
    if (!predict_to(pending_fix_.t, h_b)) {
      report.fix.status = FixStatus::kRejectedGeometry;
      return;
    }
    correct_now(Rot<In, C>::assume(pending_fix_.q_in_c.normalized()), report);
  }

  /// Prediction of both models to `t` with the midpoint of the readings. False, and nothing moved, where the momenta
  /// are parallel.
  bool predict_to(Time t, const Directions& h_b) {
    if (estimator_.started() && t > t_) {
      Directions middle;
      for (int k = 0; k < h_b.size(); ++k) {
        middle[k] = (h_b_[k] + h_b[k]).normalized();
      }
      const auto calibrated = make_trihedra(estimator_.gyros(), middle);
      const auto navigated = make_trihedra(navigator_.gyros(), middle);
      if (!calibrated || !navigated) {
        return false;
      }
      const double dt_s = to_seconds(t - t_);
      estimator_.predict(calibrated.value().C_in_c().raw(), middle, dt_s);
      navigator_.predict(navigated.value().C_in_c().raw(), middle, dt_s);
      if (t - t_ > kMaxInterpolation) {
        const double variance_rad2 = variance_of_long_step(h_b, dt_s);
        estimator_.add_direction_variance(variance_rad2);
        navigator_.add_direction_variance(variance_rad2);
      }
    }
    t_ = t;
    h_b_ = h_b;
    has_sample_ = true;
    return true;
  }

  /// What the midpoint rule may miss when the body turned far between two samples, rad²: the drift over the step, times
  /// the turn.
  [[nodiscard]] double variance_of_long_step(const Directions& h_b, double dt_s) const {
    double largest_rad = 0;
    for (int k = 0; k < h_b.size(); ++k) {
      const double drift_rad = estimator_.gyros()[k].drift_rad_s.norm() * dt_s;
      largest_rad = std::max(largest_rad, drift_rad * angle_between<double>(h_b_[k], h_b[k]));
    }
    return largest_rad * largest_rad;
  }

  /// Astro-correction at the present time: the calibration always, the navigator when it is due.
  void correct_now(const Rot<In, C>& C_in_c, Report& report) {
    const typename Estimator::Sensitivities stretch = estimator_.since_fix();
    report.fix = estimator_.correct(C_in_c.raw(), h_b_);
    report.fix.t = t_;
    if (report.fix.status == FixStatus::kRejectedGeometry) {
      return;  // the estimator did not move its covariance to this fix
    }
    navigator_.extend(stretch);
    if (const auto solution = calibration_attitude()) {
      report.calibrated = solution.value();
    }
    if (report.fix.used()) {
      has_used_fix_ = true;
      used_fix_t_ = t_;
      correct_navigator(report);
    }
    if (const auto solution = navigation_attitude()) {
      report.navigated = solution.value();
    }
  }

  /// Astro-correction of the navigator, when it is due.
  void correct_navigator(Report& report) {
    const bool interval_over =
        policy_.interval != CorrectionPolicy::kOnlyFirst && t_ - corrected_t_ >= policy_.interval;
    // The fix that started both was contradicted by all the fixes after it: the navigator must not rest on it.
    const bool start_was_wrong = start_unconfirmed_ && report.fix.status == FixStatus::kUsedAfterReopening;
    start_unconfirmed_ = report.fix.status == FixStatus::kStarted;
    if (navigator_.started() && !interval_over && !start_was_wrong) {
      return;
    }
    if (policy_.take_parameters) {
      navigator_.correct(estimator_);
    } else if (report.calibrated) {
      navigator_.correct_directions(estimator_, *report.calibrated, h_b_);
    } else {
      return;
    }
    corrected_t_ = t_;
    report.corrected = true;
  }

  /// The calibration's own attitude; readout noise of a fix at this very sample is counted twice, which only shows at
  /// the first fixes.
  [[nodiscard]] Result<AttitudeSolution, DirectionsFault> calibration_attitude() const {
    return trihedron_attitude<typename Estimator::DriftModel>(estimator_.gyros(), h_b_, estimator_.error_root(),
                                                              estimator_.since_fix(),
                                                              estimator_.setup().readout_noise_rad, 0.0);
  }

  [[nodiscard]] double angle_residual() const {
    if (!estimator_.started()) {
      return 0;
    }
    const auto& gyros = estimator_.gyros();
    return gyros[0].h_in.dot(gyros[1].h_in) - (gyros[0].C_c_b * h_b_[0]).dot(gyros[1].C_c_b * h_b_[1]);
  }

  Estimator estimator_;
  Navigator<Estimator> navigator_;
  CorrectionPolicy policy_;
  Time t_{};
  Directions h_b_;
  Time used_fix_t_{};
  StarFix pending_fix_;
  Time corrected_t_{};
  Time suspect_t_{};
  bool has_sample_ = false;
  bool has_suspect_ = false;
  bool start_unconfirmed_ = false;
  bool has_used_fix_ = false;
  bool has_pending_fix_ = false;
};

}  // namespace trihedron
