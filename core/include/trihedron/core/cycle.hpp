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
  kRejectedOutOfOrder,    ///< not later than the sample before it
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
  /// Attitude at that fix, where it was used: of the calibration itself, and of the open-loop navigator.
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
    if (report.sample != SampleStatus::kUsed) {
      return report;
    }
    if (has_pending_fix_) {
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
    } else if ((has_fix_ && fix.t <= fix_t_) || (has_sample_ && fix.t < t_)) {
      report.fix.status = FixStatus::kRejectedOutOfOrder;
    } else if (has_pending_fix_) {
      // Two fixes between two gyro samples: the gyros are silent.
      report.fix.status = FixStatus::kRejectedNoGyro;
    } else {
      has_fix_ = true;
      fix_t_ = fix.t;
      const Rot<In, C> C_in_c = Rot<In, C>::assume(fix.q_in_c.normalized());
      if (has_sample_ && fix.t == t_) {
        correct_now(C_in_c, report);
        report.angle_residual = angle_residual();
      } else {
        has_pending_fix_ = true;
        pending_C_in_c_ = C_in_c;
        report.fix.status = FixStatus::kPending;
      }
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

  /// The pending fix, at readings interpolated to its time.
  void correct_between_samples(Time t_next, const Directions& h_b_next, Report& report) {
    report.fix.t = fix_t_;
    const bool on_next = t_next == fix_t_;
    const bool interpolable = has_sample_ && t_next > fix_t_ && t_next - t_ <= kMaxInterpolation;
    if (!on_next && !interpolable) {
      report.fix.status = FixStatus::kRejectedNoGyro;
      return;
    }
    Directions h_b = h_b_next;
    if (!on_next) {
      const double fraction = to_seconds(fix_t_ - t_) / to_seconds(t_next - t_);
      for (int k = 0; k < h_b.size(); ++k) {
        h_b[k] = ((1 - fraction) * h_b_[k] + fraction * h_b_next[k]).normalized();
      }
    }
    if (!predict_to(fix_t_, h_b)) {
      report.fix.status = FixStatus::kRejectedGeometry;
      return;
    }
    correct_now(pending_C_in_c_, report);
  }

  /// Prediction of both models to `t` with the midpoint of the readings. False, and nothing moved, where the momenta
  /// are parallel.
  bool predict_to(Time t, const Directions& h_b) {
    if (estimator_.started() && t > t_) {
      Directions middle;
      for (int k = 0; k < h_b.size(); ++k) {
        middle[k] = (h_b_[k] + h_b[k]).normalized();
      }
      const auto calibrated = trihedron_attitude(estimator_.gyros(), middle);
      const auto navigated = trihedron_attitude(navigator_.gyros(), middle);
      if (!calibrated || !navigated) {
        return false;
      }
      const double dt_s = to_seconds(t - t_);
      estimator_.predict(calibrated.value().raw(), middle, dt_s);
      navigator_.predict(navigated.value().raw(), middle, dt_s);
      if (t - t_ > kMaxInterpolation) {
        estimator_.add_direction_variance(variance_of_long_step(h_b, dt_s));
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
    if (!report.fix.used()) {
      return;
    }
    if (!navigator_.started() ||
        (policy_.interval != CorrectionPolicy::kOnlyFirst && t_ - corrected_t_ >= policy_.interval)) {
      navigator_.correct(estimator_, policy_.take_parameters);
      corrected_t_ = t_;
      report.corrected = true;
    }
    if (const auto solution = calibration_attitude()) {
      report.calibrated = solution.value();
    }
    if (const auto solution = navigation_attitude()) {
      report.navigated = solution.value();
    }
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
  Time fix_t_{};
  Rot<In, C> pending_C_in_c_;
  Time corrected_t_{};
  bool has_sample_ = false;
  bool has_fix_ = false;
  bool has_pending_fix_ = false;
};

}  // namespace trihedron
