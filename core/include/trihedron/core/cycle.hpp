#pragma once
/// The on-board cycle: gyro samples and fixes in, in time order; calibration and attitude out. One object, no heap, no
/// exceptions.

#include <algorithm>
#include <array>
#include <chrono>
#include <numbers>
#include <optional>
#include <utility>

#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/gyro_health.hpp"
#include "trihedron/core/navigator.hpp"
#include "trihedron/core/status.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// Astro-corrections of the navigator.
struct CorrectionPolicy {
  static constexpr Duration kEveryFix = Duration::zero();
  static constexpr Duration kOnlyFirst = Duration::max();
  Duration interval = std::chrono::minutes(90);
  bool take_parameters = true;  ///< false: the parameters of the set-up are held
  bool navigate = true;         ///< false: the calibration alone, no navigator beside it
};

/// Complete for every sample, whatever was wrong with it.
template <class Estimator>
struct StepReport {
  Time t{};
  SampleStatus sample = SampleStatus::kUsed;
  PerGyro<GyroState, Estimator::kGyros> gyros{};  ///< after this step
  typename Estimator::Report fix;  ///< of the fix that was dealt with in this step, if any; its time is its own
  int fixes_dropped = 0;           ///< that waited when the clock was set back: nobody knows their time now
  bool corrected = false;          ///< the navigator was corrected at that fix
  /// That fix and what it was compared with, where the estimator looked at it.
  std::optional<ComparedFix<Estimator::kGyros>> compared;
  /// Attitude at that fix, used or rejected as an outlier: of the calibration itself, and of the open-loop navigator.
  std::optional<AttitudeSolution> calibrated;
  std::optional<AttitudeSolution> navigated;
  /// Of the angles between the momenta, where they were looked at in this step because no fix could be used for long:
  /// the integrity of the gyros without a star tracker, and of use to the calibration. Its time is its own.
  typename Estimator::AngleReport angles;
  /// z1 of eq. (3), cosθ predicted minus cosθ measured: the integrity of the pair, without a star tracker. Zero before
  /// the start, and where one of the two cannot be used.
  double angle_residual = 0;
};

template <class Estimator>
class Cycle {
 public:
  static constexpr int kGyros = Estimator::kGyros;
  static constexpr int kHeads = Estimator::kHeads;
  using Report = StepReport<Estimator>;
  using Setup = typename Estimator::Setup;
  using Directions = typename Estimator::Directions;

  /// A fix is interpolated between samples no further apart than this; the body's acceleration over it is below the
  /// readout noise.
  static constexpr Duration kMaxInterpolation = std::chrono::milliseconds(500);
  /// A sample further ahead is believed only when the next one confirms it.
  static constexpr Duration kMaxGap = std::chrono::hours(1);
  /// Samples that are taken together for the attitude now, where the estimator takes any together.
  static constexpr Duration kRecent = std::chrono::milliseconds(2500);
  /// Without fixes the angles between the momenta are looked at so often; no two times share samples.
  static constexpr Duration kAngleInterval = std::chrono::seconds(3);
  static constexpr bool kUsesAngles = requires(Estimator e, FixReadings<kGyros> r) { e.check_angles(Time{}, r); };
  /// So many samples in a row behind the present time set it back.
  static constexpr int kSetBackSamples = 16;
  static constexpr int kBufferedSamples = 64;
  static constexpr int kBufferedFixes = 8;
  /// Over a longer step the readings do not tell how far the body turned.
  static constexpr double kQuarterOrbit_s = 1300;

  [[nodiscard]] static Result<Cycle, SetupFault> create(const Setup& setup, const CorrectionPolicy& policy);

  /// A default one is not set up; it exists for Result only.
  Cycle() = default;

  /// One gyro sample: the whole 125 ms step. The navigator moves to it at once; the calibration follows
  /// Estimator::kReach behind, when the samples round a fix are there. At most one fix is dealt with.
  Report on_gyro(const GyroSample<kGyros>& sample);

  /// One fix. It waits for the gyro samples round it and is reported with the step that has them; without need for them
  /// at once.
  Report on_fix(const StarFix& fix);

  /// After the last sample: deals with one of the fixes that still wait, with the samples that there are. Status kNone
  /// when none waits.
  Report flush();

  [[nodiscard]] const Estimator& estimator() const { return estimator_; }
  [[nodiscard]] const Navigator<Estimator>& navigator() const { return navigator_; }
  /// Time of the latest sample used.
  [[nodiscard]] Time t() const { return samples_.latest().t; }

  /// Open-loop attitude at the latest sample. Needs navigator().started().
  [[nodiscard]] Result<AttitudeSolution, DirectionsFault> navigation_attitude() const;

 private:
  // ---- What comes in

  [[nodiscard]] SampleStatus screen(GyroSample<kGyros>& sample) {
    if (has_sample() && !(sample.t > t())) {
      if (!is_set_back(sample.t)) {
        return SampleStatus::kRejectedOutOfOrder;
      }
      set_clock(sample.t);
    }
    behind_present_ = 0;
    if (is_wild(sample.t)) {
      return SampleStatus::kRejectedOutOfOrder;
    }
    health_.look_at(sample);
    const GyroMask<kGyros> used = health_.usable(sample.t, sample.t);
    if (count(used) < 2) {
      return SampleStatus::kRejectedTooFewGyros;
    }
    for (int k = 0; k < kGyros; ++k) {
      Eigen::Vector3d& h = sample.h_b[k];
      const double norm = h.norm();
      if (nearly_unit(norm)) {
        h /= norm;
      } else if (used[k]) {
        return SampleStatus::kRejectedNotDirection;
      } else {
        h = Eigen::Vector3d::UnitX();  // not used, but finite
      }
    }
    // The prediction to it is made with the middle of the step.
    if (estimator_.started() && has_sample() &&
        !Estimator::rotation(estimator_.gyros(), between(samples_.latest().h_b, sample.h_b, 0.5),
                             used_over(t(), sample.t))) {
      return SampleStatus::kRejectedGeometry;
    }
    return std::exchange(clock_set_back_, false) ? SampleStatus::kUsedAfterClockSetBack : SampleStatus::kUsed;
  }

  /// Whether the samples behind the present time are so many, and run so well forward among themselves, that theirs is
  /// the time now: without it all would be out of order until the old time is reached again.
  [[nodiscard]] bool is_set_back(Time t) {
    const bool runs_on = behind_present_ > 0 && t > behind_present_t_ && t - behind_present_t_ <= kMaxInterpolation;
    behind_present_ = runs_on ? behind_present_ + 1 : 1;
    behind_present_t_ = t;
    return behind_present_ >= kSetBackSamples;
  }

  /// Begins a new time at `t`. The estimates stay as they are at the last sample: how long the jump took is unknown.
  void set_clock(Time t) {
    for (; behind_ > 0; --behind_) {
      follow(next_sample().t, next_sample().h_b);
    }
    const Duration shift = t - this->t();
    corrected_t_ += shift;
    angles_t_ = angles_t_ == Time::max() ? angles_t_ : angles_t_ + shift;
    taken_until_ = Time::min();
    follower_t_ = t;
    used_fix_t_ = {};
    fixes_dropped_ += std::exchange(fixes_, 0);
    samples_ = {};
    has_suspect_ = false;
    health_.set_clock(t);
    clock_set_back_ = true;
  }

  /// Whether a time lies so far ahead that it needs a second one beside it to be believed: a single wild time stamp
  /// would otherwise put everything after it out of order.
  [[nodiscard]] bool is_wild(Time t) {
    if (!has_sample() || t - this->t() <= kMaxGap) {
      has_suspect_ = false;
      return false;
    }
    const bool confirmed = has_suspect_ && t > suspect_t_ && t - suspect_t_ <= kMaxInterpolation;
    has_suspect_ = !confirmed;
    suspect_t_ = t;
    return !confirmed;
  }

  /// Puts a fix among those that wait, in the order of their times.
  [[nodiscard]] FixStatus take_up(const StarFix& fix) {
    if (!fix.q_in_c.coeffs().allFinite() || !nearly_unit(fix.q_in_c.norm())) {
      return FixStatus::kRejectedNotRotation;
    }
    if (fix.head < 0 || fix.head >= Estimator::kHeads) {
      return FixStatus::kRejectedUnknownHead;
    }
    if (count(health_.usable(fix.t, fix.t)) < 2 || too_few_now()) {
      return FixStatus::kRejectedTooFewGyros;
    }
    if (!has_sample() || fix.t - t() > kMaxInterpolation) {
      return FixStatus::kRejectedNoGyro;
    }
    const auto waiting = pending_.begin() + fixes_;
    const bool repeated = std::any_of(pending_.begin(), waiting,
                                      [&](const StarFix& other) { return other.t == fix.t && other.head == fix.head; });
    const auto& used_t = used_fix_t_[fix.head];
    if (repeated || (used_t && fix.t <= *used_t) || fix.t < taken_until_) {
      return FixStatus::kRejectedOutOfOrder;
    }
    if (fixes_ == kBufferedFixes) {
      return FixStatus::kRejectedBacklog;
    }
    const auto place =
        std::upper_bound(pending_.begin(), waiting, fix, [](const StarFix& a, const StarFix& b) { return a.t < b.t; });
    std::move_backward(place, waiting, waiting + 1);
    *place = fix;
    ++fixes_;
    return FixStatus::kPending;
  }

  // ---- Calibration

  /// The estimator over the samples and fixes until `limit`, in time order; stops before a second fix.
  void calibrate_until(Time limit, Report& report) {
    bool dealt_with_one = false;
    while (true) {
      const Time sample_t = behind_ > 0 ? next_sample().t : Time::max();
      const Time fix_t = fixes_ > 0 ? pending_[0].t : Time::max();
      // A fix that would share samples with the angles goes before them; they wait until none can come any more.
      if (behind_ > 0 && angles_t_ < sample_t && angles_t_ <= fix_t - 2 * Estimator::kReach) {
        if (angles_t_ > limit - 2 * Estimator::kReach || report.angles.status != FixStatus::kNone) {
          return;
        }
        look_at_angles(report);
      } else if (fix_t < sample_t && fix_t <= limit) {
        if (dealt_with_one) {
          return;
        }
        dealt_with_one = true;
        const StarFix fix = pending_[0];
        std::move(pending_.begin() + 1, pending_.begin() + fixes_, pending_.begin());
        --fixes_;
        correct(fix, report);
      } else if (sample_t <= limit) {
        follow(next_sample().t, next_sample().h_b);
        --behind_;
      } else {
        return;
      }
    }
  }

  /// Astro-correction: the calibration always, the navigator when it is due.
  void correct(const StarFix& fix, Report& report) {
    report.fix = {};
    report.fix.t = fix.t;
    report.fix.head = fix.head;
    const std::optional<FixReadings<kGyros>> readings = readings_at(fix.t);
    if (count(readings ? readings->used : health_.usable(fix.t, fix.t)) < (estimator_.started() ? 2 : kGyros)) {
      report.fix.status = FixStatus::kRejectedTooFewGyros;
      return;
    }
    if (!readings) {
      report.fix.status = FixStatus::kRejectedNoGyro;
      return;
    }
    follow(fix.t, readings->h_b);
    const typename Estimator::Sensitivities stretch = estimator_.since_fix();
    report.fix = estimator_.correct(fix, *readings);
    report.fix.t = fix.t;
    report.fix.head = fix.head;
    if (report.fix.status == FixStatus::kRejectedGeometry) {
      return;  // the estimator did not move its covariance to this fix
    }
    navigator_.extend(stretch);
    judge(report.fix.odd_gyro, report);
    report.compared = {fix, *readings};
    report.calibrated = calibration_attitude(*readings);
    if (report.fix.used()) {
      used_fix_t_[fix.head] = fix.t;
      correct_navigator(*readings, report);
      const Duration after = estimator_.setup().angles_after;
      angles_t_ = kUsesAngles && after != Estimator::Setup::kNever ? fix.t + after : Time::max();
    } else if (fix.t >= angles_t_) {
      use_angles(fix.t, *readings, report);  // these samples are free, and the step has come so far
    }
    if (navigator_.started() && !report.corrected) {
      report.navigated = navigated_before(fix.t, *readings);
    }
  }

  /// The angles between the momenta alone, at the time that they are due.
  void look_at_angles(Report& report) {
    const Time t = std::max(angles_t_, follower_t_);
    const auto readings = readings_at(t);
    if (readings && count(readings->used) >= 2) {
      follow(t, readings->h_b);
      const typename Estimator::Sensitivities stretch = estimator_.since_fix();
      use_angles(t, *readings, report);
      judge(report.angles.odd_gyro, report);
      if (report.angles.status != FixStatus::kRejectedGeometry) {
        navigator_.extend(stretch);
      }
    } else {  // a gap of the gyros: on where they are back
      angles_t_ = next_sample().t + Estimator::kReach;
    }
  }

  void judge(int odd_gyro, Report& report) {
    health_.judge(odd_gyro);
    report.gyros = health_.states();
  }

  /// Readings and estimator at `t`.
  void use_angles(Time t, const FixReadings<kGyros>& readings, Report& report) {
    if constexpr (kUsesAngles) {
      report.angles = estimator_.check_angles(t, readings);
      taken_until_ = t + 2 * Estimator::kReach;
      angles_t_ = t + kAngleInterval;
    }
  }

  /// Astro-correction of the navigator at the time of this fix, when it is due; then on to the latest sample.
  void correct_navigator(const FixReadings<kGyros>& readings, Report& report) {
    if (!policy_.navigate) {
      return;
    }
    const Time t = report.fix.t;
    const bool interval_over = policy_.interval != CorrectionPolicy::kOnlyFirst && t - corrected_t_ >= policy_.interval;
    // The fix that started both was contradicted by all the fixes after it: the navigator must not rest on it.
    const bool start_was_wrong = start_unconfirmed_ && report.fix.status == FixStatus::kUsedAfterReopening;
    start_unconfirmed_ = report.fix.status == FixStatus::kStarted;
    if (navigator_.started() && !interval_over && !start_was_wrong) {
      return;
    }
    if (policy_.take_parameters) {
      navigator_.correct(estimator_);
    } else if (report.calibrated) {
      navigator_.correct_directions(estimator_, *report.calibrated, readings.h_b);
    } else {
      return;
    }
    corrected_t_ = t;
    report.corrected = true;
    const auto solution = navigator_.attitude_with_covariance(readings, estimator_.since_fix(), estimator_.setup());
    if (solution) {
      report.navigated = solution.value();
    }
    Time from_t = t;
    Directions from = readings.h_b;
    for (int i = first_after(t); i < samples_.size(); ++i) {
      predict_navigator(from_t, from, samples_[i].t, samples_[i].h_b);
      from_t = samples_[i].t;
      from = samples_[i].h_b;
    }
  }

  // ---- Prediction

  /// The estimator to `t`, with the midpoint of the readings.
  void follow(Time t, const Directions& h_b) {
    if (count(health_.usable(t, t)) < 2) {
      return;  // the next step that can be made begins where the last ended
    }
    if (estimator_.started() && t > follower_t_) {
      Directions middle = between(follower_h_b_, h_b, 0.5);
      const GyroMask<kGyros> used = used_over(follower_t_, t);
      if (const auto C_in_c = Estimator::rotation(estimator_.gyros(), middle, used)) {
        read_by_others(estimator_.gyros(), C_in_c.value().raw(), used, middle);
        const double dt_s = to_seconds(t - follower_t_);
        estimator_.predict(C_in_c.value().raw(), middle, dt_s);
        if (t - follower_t_ > kMaxInterpolation) {
          estimator_.add_direction_variance(variance_of_long_step(follower_h_b_, h_b, dt_s));
        }
      }
    }
    follower_t_ = t;
    taken_until_ = std::max(taken_until_, t);
    follower_h_b_ = h_b;
  }

  void predict_navigator(Time from_t, const Directions& from, Time to_t, const Directions& to) {
    Directions middle = between(from, to, 0.5);
    const GyroMask<kGyros> used = used_over(from_t, to_t);
    if (const auto C_in_c = Estimator::rotation(navigator_.gyros(), middle, used)) {
      read_by_others(navigator_.gyros(), C_in_c.value().raw(), used, middle);
      const double dt_s = to_seconds(to_t - from_t);
      navigator_.predict(C_in_c.value().raw(), middle, dt_s);
      if (to_t - from_t > kMaxInterpolation) {
        navigator_.add_direction_variance(variance_of_long_step(from, to, dt_s));
      }
    }
  }

  /// What the gyros that are not used would read at the attitude of the others: their momenta turn all the same.
  static void read_by_others(const typename Estimator::Gyros& gyros, const Eigen::Matrix3d& C_in_c,
                             const GyroMask<kGyros>& used, Directions& h_b) {
    for (int k = 0; k < kGyros; ++k) {
      if (!used[k]) {
        h_b[k] = gyros[k].C_c_b.transpose() * (C_in_c.transpose() * gyros[k].h_in) + gyros[k].readout_bias;
      }
    }
  }

  /// Gyros that can be used at both ends of a step; where those are too few, at its end.
  [[nodiscard]] GyroMask<kGyros> used_over(Time from, Time to) const {
    GyroMask<kGyros> at_both = health_.usable(from, from);
    const GyroMask<kGyros> at_end = health_.usable(to, to);
    for (int k = 0; k < kGyros; ++k) {
      at_both[k] = at_both[k] && at_end[k];
    }
    return count(at_both) >= 2 ? at_both : at_end;
  }

  [[nodiscard]] bool too_few_now() const {
    const auto states = health_.states();
    return std::count(states.begin(), states.end(), GyroState::kUsed) < 2;
  }

  /// What the midpoint rule may miss when the body turned far between two samples, rad²: the drift over the step, times
  /// the turn; over a quarter of an orbit the readings no longer tell how far that was.
  [[nodiscard]] double variance_of_long_step(const Directions& from, const Directions& to, double dt_s) const {
    double largest_rad = 0;
    for (int k = 0; k < kGyros; ++k) {
      const double drift_rad = estimator_.gyros()[k].drift_rad_s.norm() * dt_s;
      const double turn_rad = dt_s < kQuarterOrbit_s ? angle_between<double>(from[k], to[k]) : std::numbers::pi;
      largest_rad = std::max(largest_rad, drift_rad * turn_rad);
    }
    return largest_rad * largest_rad;
  }

  // ---- Readings

  [[nodiscard]] static Directions between(const Directions& a, const Directions& b, double fraction) {
    Directions h_b;
    for (int k = 0; k < kGyros; ++k) {
      h_b[k] = ((1 - fraction) * a[k] + fraction * b[k]).normalized();
    }
    return h_b;
  }

  /// Index of the first buffered sample after `t`.
  [[nodiscard]] int first_after(Time t) const {
    int i = samples_.size();
    while (i > 0 && samples_[i - 1].t > t) {
      --i;
    }
    return i;
  }

  /// Readings at the time of a fix; nothing where there are no samples close enough round it.
  [[nodiscard]] std::optional<FixReadings<kGyros>> readings_at(Time t) const {
    const int after = first_after(t);
    if (after == 0) {
      return std::nullopt;
    }
    const GyroSample<kGyros>& before = samples_[after - 1];
    FixReadings<kGyros> readings;
    readings.used = health_.usable(before.t, t);
    if (before.t == t) {
      readings.h_b = before.h_b;
    } else if (after < samples_.size() && samples_[after].t - before.t <= kMaxInterpolation) {
      const GyroSample<kGyros>& next = samples_[after];
      readings.used = health_.usable(before.t, next.t);
      readings.h_b = between(before.h_b, next.h_b, to_seconds(t - before.t) / to_seconds(next.t - before.t));
    } else {
      return std::nullopt;
    }
    if constexpr (Estimator::kReach > Duration::zero()) {
      int begin = after - 1;
      while (begin > 0 && t - samples_[begin - 1].t <= Estimator::kReach && adjacent(begin - 1)) {
        --begin;
      }
      int end = after;
      while (end < samples_.size() && samples_[end].t - t <= Estimator::kReach && adjacent(end - 1)) {
        ++end;
      }
      fit(begin, end, t, 3, readings);
    }
    return readings;
  }

  /// Readings at the latest sample.
  [[nodiscard]] FixReadings<kGyros> readings_now() const {
    FixReadings<kGyros> readings;
    readings.used = health_.usable(t(), t());
    readings.h_b = samples_.latest().h_b;
    if constexpr (Estimator::kReach > Duration::zero()) {
      int begin = samples_.size() - 1;
      while (begin > 0 && t() - samples_[begin - 1].t <= kRecent && adjacent(begin - 1)) {
        --begin;
      }
      fit(begin, samples_.size(), t(), 2, readings);
    }
    return readings;
  }

  /// Whether sample i and the next are close enough to be taken together.
  [[nodiscard]] bool adjacent(int i) const { return samples_[i + 1].t - samples_[i].t <= kMaxInterpolation; }

  /// Takes the samples begin … end − 1 together, if they are more than a polynomial needs.
  void fit(int begin, int end, Time t, int degree, FixReadings<kGyros>& readings) const {
    if (end - begin < 2 * (degree + 1)) {
      return;
    }
    const FittedDirections<kGyros> fitted = fit_directions<kGyros>(samples_, begin, end, t, degree);
    const GyroMask<kGyros> used = health_.usable(samples_[begin].t, samples_[end - 1].t);
    if (count(used) < 2 || !explains(fitted, used)) {
      return;
    }
    readings.used = used;
    readings.h_b = fitted.h_b;
    readings.noise_factor = fitted.noise_factor;
    // ḣ_c = −ω × h_c: each gyro sees ω across its momentum.
    Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
    Eigen::Vector3d seen = Eigen::Vector3d::Zero();
    for (int k = 0; k < kGyros; ++k) {
      if (used[k]) {
        const auto& gyro = estimator_.gyros()[k];
        const Eigen::Vector3d h_c = gyro.in_c(fitted.h_b[k]);
        across += Eigen::Matrix3d::Identity() - h_c * h_c.transpose();
        seen += (gyro.C_c_b * fitted.h_b_rate[k]).cross(h_c);
      }
    }
    readings.rate_c = across.inverse() * seen;
  }

  /// Whether a polynomial is what the body did: its residuals are those of the readout, within five sigmas.
  [[nodiscard]] bool explains(const FittedDirections<kGyros>& fitted, const GyroMask<kGyros>& used) const {
    const double bound = fitted.freedom + 5 * std::sqrt(2.0 * fitted.freedom);
    for (int k = 0; k < kGyros; ++k) {
      const double sigma_rad = estimator_.setup().readout_noise_rad[k];
      if (used[k] && !(fitted.residual_square[k] <= bound * sigma_rad * sigma_rad)) {
        return false;
      }
    }
    return true;
  }

  // ---- What comes out

  [[nodiscard]] std::optional<AttitudeSolution> calibration_attitude(const FixReadings<kGyros>& readings) const {
    const auto attitude = Estimator::attitude(estimator_.gyros(), readings.h_b, readings.used);
    if (!attitude) {
      return std::nullopt;
    }
    PerGyro<double, kGyros> noise_rad;
    for (int k = 0; k < kGyros; ++k) {
      noise_rad[k] = readings.noise_factor * estimator_.setup().readout_noise_rad[k];
    }
    // Readout noise of a fix at this very sample is counted twice, which only shows at the first fixes.
    const auto by_errors =
        attitude_by_errors<Estimator>(attitude.value(), estimator_.gyros(), readings.h_b, estimator_.since_fix());
    return with_covariance(attitude.value(), estimator_.through_uncertainty(by_errors), noise_rad, 0.0);
  }

  /// The navigator's attitude at a time it has passed, within the samples buffered.
  [[nodiscard]] std::optional<AttitudeSolution> navigated_before(Time t, const FixReadings<kGyros>& readings) const {
    Navigator<Estimator> past = navigator_;
    Directions middle = between(readings.h_b, samples_.latest().h_b, 0.5);
    const GyroMask<kGyros> used = used_over(t, this->t());
    const auto C_in_c = Estimator::rotation(past.gyros(), middle, used);
    if (!C_in_c) {
      return std::nullopt;
    }
    read_by_others(past.gyros(), C_in_c.value().raw(), used, middle);
    past.predict(C_in_c.value().raw(), middle, to_seconds(t - this->t()));
    const auto solution = past.attitude_with_covariance(readings, estimator_.since_fix(), estimator_.setup());
    return solution ? std::optional(solution.value()) : std::nullopt;
  }

  [[nodiscard]] double angle_residual() const {
    const GyroMask<kGyros> used = health_.usable(t(), t());
    if (!estimator_.started() || !used[0] || !used[1]) {
      return 0;
    }
    const auto& gyros = estimator_.gyros();
    const Directions& h_b = samples_.latest().h_b;
    return gyros[0].h_in.dot(gyros[1].h_in) - gyros[0].in_c(h_b[0]).dot(gyros[1].in_c(h_b[1]));
  }

  [[nodiscard]] bool has_sample() const { return samples_.size() > 0; }
  /// The oldest sample that the estimator has not yet followed.
  [[nodiscard]] const GyroSample<kGyros>& next_sample() const { return samples_[samples_.size() - behind_]; }

  Estimator estimator_;
  Navigator<Estimator> navigator_;
  CorrectionPolicy policy_;
  GyroHealth<kGyros> health_;
  SampleBuffer<kGyros, kBufferedSamples> samples_;
  int behind_ = 0;  ///< samples that the estimator has not yet followed
  Time follower_t_{};
  Directions follower_h_b_;
  std::array<StarFix, kBufferedFixes + 1> pending_{};
  int fixes_ = 0;                                               ///< of them
  PerGyro<std::optional<Time>, Estimator::kHeads> used_fix_t_;  ///< per star tracker
  Time corrected_t_{};
  Time suspect_t_{};
  Time angles_t_ = Time::max();     ///< when the angles are due
  Time taken_until_ = Time::min();  ///< a fix before it is too late: passed, or its samples are used
  int behind_present_ = 0;          ///< samples in a row
  Time behind_present_t_{};
  int fixes_dropped_ = 0;
  bool clock_set_back_ = false;  ///< and no sample used since
  bool has_suspect_ = false;
  bool start_unconfirmed_ = false;
};

// Not in the class, so that a cycle whose instantiation is declared (cycles.hpp) is not compiled where it is used.

template <class Estimator>
Result<Cycle<Estimator>, SetupFault> Cycle<Estimator>::create(const Setup& setup, const CorrectionPolicy& policy) {
  const auto estimator = Estimator::create(setup);
  if (!estimator) {
    return estimator.fault();
  }
  Cycle cycle;
  cycle.estimator_ = estimator.value();
  cycle.policy_ = policy;
  return cycle;
}

template <class Estimator>
auto Cycle<Estimator>::on_gyro(const GyroSample<kGyros>& sample) -> Report {
  Report report;
  report.t = sample.t;
  GyroSample<kGyros> screened = sample;
  report.sample = screen(screened);
  report.gyros = health_.states();
  if (report.sample == SampleStatus::kRejectedTooFewGyros) {
    calibrate_until(screened.t - Estimator::kReach, report);  // what waits for samples waits in vain
  }
  if (!is_used(report.sample)) {
    return report;
  }
  report.fixes_dropped = std::exchange(fixes_dropped_, 0);
  if (navigator_.started() && has_sample()) {
    predict_navigator(samples_.latest().t, samples_.latest().h_b, screened.t, screened.h_b);
  }
  if (behind_ == kBufferedSamples) {  // more samples than the reach was made for: the oldest cannot wait
    follow(samples_[0].t, samples_[0].h_b);
    --behind_;
  }
  samples_.push(screened);
  ++behind_;
  calibrate_until(screened.t - Estimator::kReach, report);
  report.angle_residual = angle_residual();
  return report;
}

template <class Estimator>
auto Cycle<Estimator>::on_fix(const StarFix& fix) -> Report {
  Report report;
  report.t = fix.t;
  report.gyros = health_.states();
  report.fix.t = fix.t;
  report.fix.head = fix.head;
  report.fix.status = take_up(fix);
  if (report.fix.status == FixStatus::kPending) {
    calibrate_until(samples_.latest().t - Estimator::kReach, report);
    report.angle_residual = angle_residual();
  }
  return report;
}

template <class Estimator>
auto Cycle<Estimator>::flush() -> Report {
  Report report;
  report.gyros = health_.states();
  if (fixes_ > 0) {
    report.t = samples_.latest().t;
    angles_t_ = Time::max();  // or the fix would wait for them
    calibrate_until(std::max(report.t, pending_[0].t), report);
  }
  return report;
}

template <class Estimator>
Result<AttitudeSolution, DirectionsFault> Cycle<Estimator>::navigation_attitude() const {
  const FixReadings<kGyros> now = readings_now();
  return navigator_.attitude_with_covariance(now, estimator_.since_fix(), estimator_.setup());
}

}  // namespace trihedron
