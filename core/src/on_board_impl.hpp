#pragma once
/// Definitions of OnBoard and Navigator.

#include <algorithm>
#include <cmath>
#include <utility>

#include "trihedron/core/cholesky.hpp"
#include "trihedron/core/elementary.hpp"
#include "trihedron/core/on_board.hpp"

namespace trihedron {

template <class Estimator>
std::optional<SetupFault> OnBoard<Estimator>::set_up(const CalibrationSetup& setup, const Gyros& prior,
                                                     const Eigen::Ref<const Eigen::MatrixXd>& covariance,
                                                     const CorrectionPolicy& policy) {
  if (const auto fault = estimator_.set_up(setup, prior, covariance)) {
    return fault;
  }
  policy_ = policy;
  reset();
  return std::nullopt;
}

template <class Estimator>
void OnBoard<Estimator>::reset() {
  const CalibrationSetup& setup = estimator_.setup();
  estimator_.forget();
  intake_ = Intake(setup);
  fixes_.clear();
  readings_ = Readings<Gyros::capacity()>(setup, Estimator::kTakesSamplesTogether);
  schedule_ = Schedule(reach(), Estimator::kUsesAngles ? setup.angles_after : CalibrationSetup::kNever);
  navigator_ = {};
  parameters_ = policy_.take_parameters ? ParametersInUse::kOfCalibration : ParametersInUse::kOfSetUp;
  behind_ = 0;
  fixes_dropped_ = 0;
  clock_set_back_ = start_unconfirmed_ = correction_wanted_ = false;
  begin_stretch();
}

template <class Estimator>
void OnBoard<Estimator>::begin_stretch() {
  for (int k = 0; k < gyros(); ++k) {
    stretch_.sensitivities[k].begin(estimator_.layout().drift_columns());
  }
  stretch_.duration_s = 0;
}

template <class Estimator>
void OnBoard<Estimator>::end_stretch(const typename Estimator::Sensitivities& stretch, double duration_s) {
  navigator_.extend(estimator_, stretch);
  for (int k = 0; k < gyros(); ++k) {
    stretch_.sensitivities[k].append(stretch[k], estimator_.layout().drift_columns());
  }
  stretch_.duration_s += duration_s;
}

template <class Estimator>
StepReport OnBoard<Estimator>::on_gyro(const GyroSample& sample) {
  StepReport report;
  report.t = sample.t;
  GyroSample screened = sample;
  report.sample = let_in(screened);
  report.gyros = intake_.health().states();
  if (report.sample == SampleStatus::kRejectedTooFewGyros) {
    calibrate_until(sample.t - reach(), report);  // fixes that wait for samples get none; deal with them now
  }
  if (!is_used(report.sample)) {
    return report;
  }
  report.fixes_dropped = std::exchange(fixes_dropped_, 0);
  if (navigator_.started() && readings_.size() > 0) {
    navigate(readings_.latest_t(), readings_.latest_directions(), screened.t, screened.h_b);
  }
  if (behind_ == readings_.size() && readings_.full()) {
    follow_next_sample();  // buffer full: the oldest sample is processed before its time
  }
  readings_.push(screened);
  ++behind_;
  calibrate_until(screened.t - reach(), report);
  report.angle_residual = angle_residual();
  return report;
}

template <class Estimator>
StepReport OnBoard<Estimator>::on_fix(const StarFix& fix) {
  StepReport report;
  report.t = fix.t;
  report.gyros = intake_.health().states();
  report.fix.t = fix.t;
  report.fix.head = fix.head;
  report.fix.status = intake_.look_at(fix, readings_.latest(), schedule_.taken_until());
  if (report.fix.status == FixStatus::kPending) {
    report.fix.status = fixes_.push(fix);
  }
  if (report.fix.status == FixStatus::kPending) {
    calibrate_until(readings_.latest_t() - reach(), report);
    report.angle_residual = angle_residual();
  }
  return report;
}

template <class Estimator>
StepReport OnBoard<Estimator>::carry_on() {
  StepReport report;
  report.gyros = intake_.health().states();
  if (fixes_.size() > 0) {
    report.t = readings_.latest_t();
    calibrate_until(report.t - reach(), report);
  }
  return report;
}

template <class Estimator>
StepReport OnBoard<Estimator>::flush() {
  StepReport report;
  report.gyros = intake_.health().states();
  if (fixes_.size() > 0) {
    report.t = readings_.latest_t();
    schedule_.no_angles();  // otherwise the fix would wait for them
    calibrate_until(std::max(report.t, fixes_.next_t()), report);
  }
  return report;
}

// ---- What comes in

template <class Estimator>
SampleStatus OnBoard<Estimator>::let_in(GyroSample& sample) {
  switch (intake_.look_at_clock(sample.t, readings_.latest())) {
    case Intake::Clock::kOutOfOrder:
      return SampleStatus::kRejectedOutOfOrder;
    case Intake::Clock::kSetBack:
      set_clock(sample.t);
      break;
    case Intake::Clock::kRunsOn:
      break;
  }
  if (const SampleStatus status = intake_.screen(sample); !is_used(status)) {
    return status;
  }
  if (readings_.too_soon(sample.t)) {
    return SampleStatus::kThinned;
  }
  if (estimator_.started() && readings_.size() > 0) {  // the prediction to it is made with the middle of the step
    const Step to_it = step(readings_.latest_t(), readings_.latest_directions(), sample.t, sample.h_b);
    if (!estimator_.rotation(estimator_.gyros(), to_it.middle, to_it.used)) {
      return SampleStatus::kRejectedGeometry;
    }
  }
  return std::exchange(clock_set_back_, false) ? SampleStatus::kUsedAfterClockSetBack : SampleStatus::kUsed;
}

/// Restarts the time at `t`. The estimates stay as they are at the last sample: how long the jump took is unknown.
template <class Estimator>
void OnBoard<Estimator>::set_clock(Time t) {
  while (behind_ > 0) {
    follow_next_sample();
  }
  const Duration shift = t - this->t();
  corrected_t_ += shift;
  schedule_.set_clock(shift);
  follower_t_ = t;
  intake_.set_clock(t);
  fixes_dropped_ += fixes_.clear();
  readings_.clear();
  clock_set_back_ = true;
}

// ---- Calibration

/// Processes samples and fixes up to `limit` in time order; stops before a second fix (one per step).
template <class Estimator>
void OnBoard<Estimator>::calibrate_until(Time limit, StepReport& report) {
  bool dealt_with_one = false;
  for (;;) {
    switch (schedule_.next(limit, next_sample_t(), fixes_.next_t())) {
      case Schedule::Next::kSample:
        follow_next_sample();
        break;
      case Schedule::Next::kFix:
        if (dealt_with_one) {
          report.more_due = true;
          return;
        }
        dealt_with_one = true;
        correct(fixes_.pop(), report);
        break;
      case Schedule::Next::kAngles:
        if (report.angles.status != FixStatus::kNone) {
          return;
        }
        look_at_angles(report);
        break;
      case Schedule::Next::kNothing:
        return;
    }
  }
}

/// Astro-correction: the calibration always, the navigator when it is due.
template <class Estimator>
void OnBoard<Estimator>::correct(const StarFix& fix, StepReport& report) {
  report.fix = {};
  report.fix.t = fix.t;
  report.fix.head = fix.head;
  const std::optional<FixReadings> readings = readings_at(fix.t);
  const int used = count(readings ? readings->used : intake_.health().usable(fix.t, fix.t));
  if (used < (estimator_.started() ? 2 : gyros())) {
    report.fix.status = FixStatus::kRejectedTooFewGyros;
    return;
  }
  if (!readings) {
    report.fix.status = FixStatus::kRejectedNoGyro;
    return;
  }
  follow(fix.t, readings->h_b);
  const typename Estimator::Sensitivities stretch = estimator_.since_fix();
  const double duration_s = estimator_.time_since_fix_s();
  report.fix = estimator_.correct(fix, *readings);
  if (report.fix.status == FixStatus::kRejectedGeometry) {
    return;  // the estimator did not move its covariance to this fix
  }
  end_stretch(stretch, duration_s);
  if (report.fix.status == FixStatus::kEstimateLost) {
    schedule_.no_angles();
    return;
  }
  judge(report.fix.odd_gyro, report);
  report.compared = {fix, *readings};
  report.calibrated = calibrated(*readings);
  if (report.fix.used()) {
    intake_.mark_used(fix);
    correct_navigator(*readings, report);
    schedule_.fix_used(fix.t);
  } else if (fix.t >= schedule_.angles_t()) {
    use_angles(fix.t, *readings, report);  // this fix was rejected, so its readings may be used for the angles
  }
  if (navigator_.started() && !report.corrected) {
    report.navigated = navigated_before(fix.t, *readings);
  }
}

/// The angles between the momenta alone, at the time that they are due.
template <class Estimator>
void OnBoard<Estimator>::look_at_angles(StepReport& report) {
  const Time t = std::max(schedule_.angles_t(), follower_t_);
  const std::optional<FixReadings> readings = readings_at(t);
  if (!readings || count(readings->used) < 2) {  // a gap of the gyros: continue where they are back
    schedule_.put_angles_off(next_sample_t() + reach());
    return;
  }
  follow(t, readings->h_b);
  const typename Estimator::Sensitivities stretch = estimator_.since_fix();
  const double duration_s = estimator_.time_since_fix_s();
  use_angles(t, *readings, report);
  judge(report.angles.odd_gyro, report);
  if (report.angles.status != FixStatus::kRejectedGeometry) {
    end_stretch(stretch, duration_s);
  }
}

template <class Estimator>
void OnBoard<Estimator>::judge(int odd_gyro, StepReport& report) {
  intake_.health().judge(odd_gyro);
  report.gyros = intake_.health().states();
}

/// Readings and estimator at `t`.
template <class Estimator>
void OnBoard<Estimator>::use_angles(Time t, const FixReadings& readings, StepReport& report) {
  if constexpr (Estimator::kUsesAngles) {
    report.angles = estimator_.check_angles(t, readings);
    schedule_.angles_used(t);
    if (report.angles.status == FixStatus::kEstimateLost) {
      schedule_.no_angles();
    }
  }
}

/// Astro-correction of the navigator at the time of this fix, when it is due; then on to the latest sample.
template <class Estimator>
void OnBoard<Estimator>::correct_navigator(const FixReadings& readings, StepReport& report) {
  if (!policy_.navigate) {
    return;
  }
  const Time t = report.fix.t;
  const bool interval_over = policy_.interval != CorrectionPolicy::kOnlyFirst && t - corrected_t_ >= policy_.interval;
  // All later fixes contradicted the one that started filter and navigator: the navigator must be corrected again.
  const bool start_was_wrong = start_unconfirmed_ && report.fix.status == FixStatus::kUsedAfterReopening;
  start_unconfirmed_ = report.fix.status == FixStatus::kStarted;
  if (navigator_.started() && !interval_over && !start_was_wrong && !correction_wanted_) {
    return;
  }
  if (parameters_ == ParametersInUse::kOfCalibration) {
    navigator_.correct(estimator_);
  } else if (report.calibrated) {
    navigator_.correct_directions(estimator_, *report.calibrated, readings.h_b,
                                  parameters_ == ParametersInUse::kOfSetUp);
  } else {
    return;
  }
  corrected_t_ = t;
  correction_wanted_ = false;
  report.corrected = true;
  if (const auto solution = navigator_.attitude(estimator_, readings)) {
    report.navigated = solution.value();
  }
  Time from_t = t;
  Directions from = readings.h_b;
  for (int i = readings_.first_after(t); i < readings_.size(); ++i) {
    const Directions to = readings_.directions(i);
    navigate(from_t, from, readings_.time(i), to);
    from_t = readings_.time(i);
    from = to;
  }
}

// ---- Prediction

template <class Estimator>
auto OnBoard<Estimator>::step(Time from_t, const Directions& from, Time to_t, const Directions& to) const -> Step {
  return {from_t, to_t, from, to, between(from, to, 0.5, gyros()), intake_.used_over(from_t, to_t)};
}

template <class Estimator>
std::optional<Eigen::Matrix3d> OnBoard<Estimator>::attitude_of(const Gyros& gyros, Step& step) const {
  const auto C_in_c = estimator_.rotation(gyros, step.middle, step.used);
  if (!C_in_c) {
    return std::nullopt;
  }
  const Eigen::Matrix3d C = C_in_c.value().raw();
  for (int k = 0; k < this->gyros(); ++k) {
    if (!step.used[k]) {  // its momentum turns all the same
      step.middle[k] = gyros[k].reading_of(C.transpose() * gyros[k].h_in);
    }
  }
  return C;
}

template <class Estimator>
double OnBoard<Estimator>::variance_of_long_step(const Step& step) const {
  double largest_rad = 0;
  for (int k = 0; k < gyros(); ++k) {
    const double drift_rad = estimator_.gyros()[k].drift_rad_s.norm() * step.dt_s();
    largest_rad = std::max(largest_rad, missed_by_long_step_rad(drift_rad, step.from[k], step.to[k], step.dt_s()));
  }
  return largest_rad * largest_rad;
}

template <class Estimator>
void OnBoard<Estimator>::follow_next_sample() {
  const int next = readings_.size() - behind_;
  follow(readings_.time(next), readings_.directions(next));
  --behind_;
}

/// The estimator to `t`, with the midpoint of the readings.
template <class Estimator>
void OnBoard<Estimator>::follow(Time t, const Directions& h_b) {
  if (count(intake_.health().usable(t, t)) < 2) {
    return;  // the next step that can be made begins where the last ended
  }
  if (estimator_.started() && t > follower_t_) {
    Step step = this->step(follower_t_, follower_h_b_, t, h_b);
    if (const auto C_in_c = attitude_of(estimator_.gyros(), step)) {
      estimator_.predict(*C_in_c, step.middle, t, step.dt_s());
      if (t - follower_t_ > estimator_.setup().max_interpolation()) {
        estimator_.add_direction_variance(variance_of_long_step(step));
      }
    }
  }
  follower_t_ = t;
  schedule_.followed_to(t);
  follower_h_b_ = h_b;
}

template <class Estimator>
void OnBoard<Estimator>::navigate(Time from_t, const Directions& from, Time to_t, const Directions& to) {
  Step step = this->step(from_t, from, to_t, to);
  if (const auto C_in_c = attitude_of(navigator_.gyros(), step)) {
    navigator_.predict(estimator_, *C_in_c, step.middle, to_t, step.dt_s());
    if (to_t - from_t > estimator_.setup().max_interpolation()) {
      navigator_.add_direction_variance(variance_of_long_step(step));
    }
  }
}

// ---- What comes out

template <class Estimator>
std::optional<AttitudeSolution> OnBoard<Estimator>::calibrated(const FixReadings& readings) const {
  const auto attitude = estimator_.attitude(estimator_.gyros(), readings.h_b, readings.used);
  if (!attitude) {
    return std::nullopt;
  }
  PerGyro<double> noise_rad;
  for (int k = 0; k < gyros(); ++k) {
    noise_rad[k] = readings.noise_factor * estimator_.setup().readout_noise_rad[k];
  }
  // Readout noise of a fix at this very sample is counted twice, which only shows at the first fixes.
  const Layout layout = estimator_.error_layout();
  auto rows = attitude_by_states_now<Estimator::kMaxErrors>(layout, attitude.value(), estimator_.gyros(), readings.h_b);
  carry_back(layout, estimator_.since_fix(), rows);
  return with_covariance(attitude.value(), estimator_.covariance_of_errors(rows), noise_rad, gyros(), 0);
}

/// The navigator's attitude at a time it has passed, within the samples buffered.
template <class Estimator>
std::optional<AttitudeSolution> OnBoard<Estimator>::navigated_before(Time t, const FixReadings& readings) const {
  Step back = step(t, readings.h_b, this->t(), readings_.latest_directions());
  const auto C_in_c = attitude_of(navigator_.gyros(), back);
  if (!C_in_c) {
    return std::nullopt;
  }
  const auto solution = navigator_.attitude_before(estimator_, readings, *C_in_c, back.middle, this->t(), back.dt_s());
  return solution ? std::optional(solution.value()) : std::nullopt;
}

template <class Estimator>
double OnBoard<Estimator>::angle_residual() const {
  const GyroMask used = intake_.health().usable(t(), t());
  if (!estimator_.started() || !used[0] || !used[1]) {
    return 0;
  }
  const auto& its = estimator_.gyros();
  const Directions h_b = readings_.latest_directions();
  return its[0].h_in.dot(its[1].h_in) - its[0].in_c(h_b[0]).dot(its[1].in_c(h_b[1]));
}

// ---- Navigator

template <class Estimator>
void Navigator<Estimator>::correct(const Estimator& estimator) {
  gyros_ = estimator.gyros();
  estimator.error_root(new_errors(estimator.error_layout().shared(), estimator.states()));
  restart_clock(estimator.layout());
}

template <class Estimator>
void Navigator<Estimator>::correct_directions(const Estimator& estimator, const AttitudeSolution& attitude,
                                              const Directions& h_b, bool of_set_up) {
  const Layout layout = estimator.error_layout();
  // Columns: the error of the attitude, then those of the parameters held. The root at an adoption is a triangle: its
  // first columns hold errors of the directions alone.
  constexpr int kAttitude = 3;
  const int first = layout.direction(layout.gyros);
  if (of_set_up || !started_) {
    gyros_ = estimator.prior_gyros();
    const int size = layout.shared() - first;
    const RowsView view = new_errors(layout.shared(), kAttitude + size);
    estimator.prior_error_root({&view(first, kAttitude), size, size, view.stride});
  }
  const bool of_calibration = error_columns_ == estimator.states();
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> errors(errors_.data(), error_rows_,
                                                                                            error_columns_);
  const Eigen::Matrix3d& C_in_c = attitude.C_in_c.raw();
  const Eigen::Matrix3d attitude_root = cholesky_root<3>(attitude.covariance_rad2);
  for (int k = 0; k < layout.gyros; ++k) {
    gyros_[k].h_in = (C_in_c * gyros_[k].in_c(h_b[k])).normalized();
    // φ = C_in_c (δ + ε − h_c × C_c_b Δb): h_in was read through what is held at the estimated attitude.
    auto phi = errors.template middleRows<3>(layout.direction(k));
    phi = C_in_c.lazyProduct(errors.template middleRows<3>(layout.alignment(k)));
    phi -= by_readout_errors(layout, C_in_c * skew<double>(gyros_[k].in_c(h_b[k])), gyros_[k], h_b[k])
               .lazyProduct(errors.middleRows(layout.readout(k), layout.readout_size()));
    phi.template leftCols<kAttitude>() = C_in_c * attitude_root;
    if (layout.further.wandering_drift &&
        of_calibration) {  // it cannot be held: back to what is known of it beforehand
      gyros_[k].drift_rad_s.template segment<3>(layout.wandering_column()).setZero();
      auto wandering = errors.template middleRows<3>(layout.wandering(k));
      wandering.setZero();
      wandering.template middleCols<3>(layout.wandering(k))
          .diagonal()
          .setConstant(estimator.setup().wandering_drift.sigma);
    }
  }
  restart_clock(layout);
}

template <class Estimator>
RowsView Navigator<Estimator>::new_errors(int rows, int columns) {
  error_rows_ = rows;
  error_columns_ = columns;
  const RowsView view{errors_.data(), rows, columns, columns};
  std::fill_n(errors_.begin(), rows * columns, 0.0);
  return view;
}

template <class Estimator>
void Navigator<Estimator>::restart_clock(const Layout& layout) {
  for (int k = 0; k < layout.gyros; ++k) {
    since_correction_[k].begin(layout.drift_columns());
  }
  extended_until_s_ = 0;
  time_since_correction_s_ = 0;
  extra_variance_rad2_ = 0;
  started_ = true;
}

template <class Estimator>
void Navigator<Estimator>::precess_all(const Estimator& estimator, const Eigen::Matrix3d& C_in_c, const Directions& h_b,
                                       Time t, double dt_s, Gyros& gyros) const {
  const Layout& layout = estimator.layout();
  const double part = estimator.setup().part_of_change(t - from_seconds(dt_s / 2));
  for (int k = 0; k < layout.gyros; ++k) {
    precess(gyros[k], estimator.drift(), C_in_c, h_b[k], part, dt_s);
    if (layout.further.wandering_drift) {
      gyros[k].drift_rad_s.template segment<3>(layout.wandering_column()) *=
          elementary::exp(-dt_s / estimator.setup().wandering_drift.time_s);
    }
  }
}

template <class Estimator>
void Navigator<Estimator>::predict(const Estimator& estimator, const Eigen::Matrix3d& C_in_c, const Directions& h_b,
                                   Time t, double dt_s) {
  precess_all(estimator, C_in_c, h_b, t, dt_s, gyros_);
  time_since_correction_s_ += dt_s;
}

template <class Estimator>
void Navigator<Estimator>::append(const Estimator& estimator, const Sensitivities& stretch,
                                  Sensitivities& since) const {
  const Layout& layout = estimator.layout();
  for (int k = 0; k < layout.gyros; ++k) {
    if (layout.further.wandering_drift) {
      auto faded = stretch[k];
      faded.by_drift.first(layout.drift_columns()).template middleCols<3>(layout.wandering_column()) *=
          elementary::exp(-extended_until_s_ / estimator.setup().wandering_drift.time_s);
      since[k].append(faded, layout.drift_columns());
    } else {
      since[k].append(stretch[k], layout.drift_columns());
    }
  }
}

template <class Estimator>
void Navigator<Estimator>::extend(const Estimator& estimator, const Sensitivities& stretch) {
  append(estimator, stretch, since_correction_);
  extended_until_s_ = time_since_correction_s_;
}

template <class Estimator>
Result<AttitudeSolution, DirectionsFault> Navigator<Estimator>::attitude(const Estimator& estimator, const Gyros& gyros,
                                                                         const FixReadings& readings,
                                                                         double time_since_correction_s) const {
  const auto by_directions = estimator.attitude(gyros, readings.h_b, readings.used);
  if (!by_directions) {
    return by_directions.fault();
  }
  const Layout layout = estimator.error_layout();
  const CalibrationSetup& setup = estimator.setup();
  auto rows = attitude_by_states_now<Estimator::kMaxErrors>(layout, by_directions.value(), gyros, readings.h_b);
  Sensitivities since = since_correction_;
  append(estimator, estimator.since_fix(), since);
  carry_back(layout, since, rows);
  StateRows3<Estimator::kMaxStates> spread(3, error_columns_);
  multiply(view_of(rows), {errors_.data(), error_rows_, error_columns_, error_columns_}, rows_of(spread));
  PerGyro<double> noise_rad;
  for (int k = 0; k < layout.gyros; ++k) {
    noise_rad[k] = readings.noise_factor * setup.readout_noise_rad[k];
  }
  const double walk = setup.direction_random_walk_rad_sqrt_s;
  double variance_rad2 = walk * walk * time_since_correction_s + extra_variance_rad2_;
  if (layout.further.wandering_drift) {
    // Variance of ∫w(t) dt given w(0): docs/mathematics.md, section 10.
    const double x = time_since_correction_s / setup.wandering_drift.time_s;
    const double scale_rad = setup.wandering_drift.sigma * setup.wandering_drift.time_s;
    variance_rad2 +=
        scale_rad * scale_rad * std::max(2 * x - 3 + 4 * elementary::exp(-x) - elementary::exp(-2 * x), 0.0);
  }
  return with_covariance(by_directions.value(), gram<Estimator::kMaxStates>(spread), noise_rad, layout.gyros,
                         variance_rad2);
}

template <class Estimator>
Result<AttitudeSolution, DirectionsFault> Navigator<Estimator>::attitude_before(const Estimator& estimator,
                                                                                const FixReadings& readings,
                                                                                const Eigen::Matrix3d& C_in_c,
                                                                                const Directions& h_b, Time t,
                                                                                double back_s) const {
  Gyros past = gyros_;
  precess_all(estimator, C_in_c, h_b, t, -back_s, past);
  return attitude(estimator, past, readings, time_since_correction_s_ - back_s);
}

}  // namespace trihedron
