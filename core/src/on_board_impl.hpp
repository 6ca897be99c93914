#pragma once
/// Definitions of OnBoard and Navigator.

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "trihedron/core/cholesky.hpp"
#include "trihedron/core/elementary.hpp"
#include "trihedron/core/on_board.hpp"

namespace trihedron {

/// How fast a momentum of any gyro may drift by what is known before: by the mean and the 1-sigma of all coefficients.
template <class Gyros>
double largest_drift_rad_s(const Layout& layout, const Gyros& prior,
                           const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  double largest_rad_s = 0;
  for (int k = 0; k < layout.gyros; ++k) {
    const int first = layout.drift(k) - layout.drift(0);
    const double variance = covariance.diagonal().segment(first, layout.drift_size()).sum();
    largest_rad_s = std::max(largest_rad_s, std::sqrt(prior[k].drift_rad_s.squaredNorm() + variance));
  }
  return largest_rad_s;
}

template <class Estimator>
std::optional<SetupFault> OnBoard<Estimator>::set_up(const CalibrationSetup& setup, const Gyros& prior,
                                                     const Eigen::Ref<const Eigen::MatrixXd>& covariance,
                                                     const CorrectionPolicy& policy) {
  if (const auto fault = estimator_.set_up(setup, prior, covariance)) {
    return fault;
  }
  frozen_fixes_ = decltype(frozen_fixes_)(largest_drift_rad_s(setup.layout, prior, covariance));
  policy_ = policy;
  policy_.spread_over = std::min(policy.spread_over, CorrectionPolicy::kMostSpread);
  reset();
  return std::nullopt;
}

template <class Estimator>
void OnBoard<Estimator>::reset() {
  const CalibrationSetup& setup = estimator_.setup();
  estimator_.forget();
  intake_ = decltype(intake_)(setup);
  fixes_.clear();
  frozen_fixes_.forget();
  readings_ = Readings<Gyros::capacity()>(setup, Estimator::kTakesSamplesTogether);
  jitter_ = {};
  schedule_ = Schedule(reach(), Estimator::kUsesAngles ? setup.angles_after : CalibrationSetup::kNever);
  navigator_ = {};
  parameters_ = policy_.take_parameters ? ParametersInUse::kOfCalibration : ParametersInUse::kOfSetUp;
  work_ = {};
  slots_left_ = 0;
  has_worked_ = false;
  behind_ = 0;
  fixes_dropped_ = 0;
  clock_set_back_ = start_unconfirmed_ = correction_wanted_ = false;
  corrected_by_ = {};
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
  std::optional<Step> to_it;
  report.sample = let_in(screened, to_it, report);
  report.gyros = intake_.health().states();
  if (report.sample == SampleStatus::kRejectedTooFewGyros) {
    calibrate_until(sample.t - reach(), report);  // fixes that wait for samples get none; deal with them now
  } else if (report.sample == SampleStatus::kRejectedOutOfOrder) {
    calibrate_in_doubt(report);
  }
  if (!is_used(report.sample)) {
    return report;
  }
  report.fixes_dropped = std::exchange(fixes_dropped_, 0);
  if (navigator_.started() && to_it) {
    navigate(*to_it, navigator_.state());
  }
  if (is_too_far_behind()) {
    slots_left_ = 0;
    calibrate_until(readings_.latest_t() - reach(), report);
  }
  if (behind_ == readings_.size() && readings_.full()) {
    follow_next_sample();  // buffer full: the oldest sample is processed before its time
  }
  readings_.push(screened);
  ++behind_;
  calibrate_until(screened.t - reach(), report);
  slots_left_ = std::max(slots_left_ - 1, 0);
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
    const bool is_repeated =
        is_working() && work_.has_fix && fix.head == work_.its.fix.head && fix.t <= work_.its.fix.t;
    report.fix.status = is_repeated ? FixStatus::kRejectedOutOfOrder : fixes_.push(fix);
  }
  if (report.fix.status == FixStatus::kPending) {
    const Time limit = readings_.latest_t() - reach();
    if (!spreads() || fixes_.count_until(limit, kHurry + 1) > kHurry) {
      calibrate_until(limit, report);
    }
    report.angle_residual = angle_residual();
  }
  return report;
}

template <class Estimator>
StepReport OnBoard<Estimator>::carry_on() {
  StepReport report;
  report.gyros = intake_.health().states();
  if (is_working()) {
    report.t = readings_.latest_t();
    finish(report);
  } else if (fixes_.size() > 0) {
    report.t = readings_.latest_t();
    calibrate_at_once(report.t - reach(), report);
  }
  return report;
}

template <class Estimator>
StepReport OnBoard<Estimator>::flush() {
  StepReport report;
  report.gyros = intake_.health().states();
  if (is_working()) {
    report.t = readings_.latest_t();
    finish(report);
  } else if (fixes_.size() > 0) {
    report.t = readings_.latest_t();
    schedule_.no_angles();  // otherwise the fix would wait for them
    calibrate_at_once(std::max(report.t, fixes_.next_t()), report);
  } else {
    follow_all_samples();
  }
  return report;
}

// ---- What comes in

template <class Estimator>
SampleStatus OnBoard<Estimator>::let_in(GyroSample& sample, std::optional<Step>& to_it, StepReport& report) {
  switch (intake_.look_at_clock(sample.t, readings_.latest())) {
    case decltype(intake_)::Clock::kOutOfOrder:
      return SampleStatus::kRejectedOutOfOrder;
    case decltype(intake_)::Clock::kSetBack:
      set_clock(sample.t, report);
      break;
    case decltype(intake_)::Clock::kRunsOn:
      break;
  }
  if (const SampleStatus status = intake_.screen(sample); !is_used(status)) {
    return status;
  }
  if (readings_.too_soon(sample.t)) {
    return SampleStatus::kThinned;
  }
  if (readings_.size() > 0) {
    to_it = step(readings_.latest_t(), readings_.latest_directions(), sample.t, sample.h_b);
    // The prediction to it is made with the middle of the step.
    if (estimator_.started() && !estimator_.gives_attitude(estimator_.gyros(), to_it->middle, to_it->used)) {
      return SampleStatus::kRejectedGeometry;
    }
  }
  return std::exchange(clock_set_back_, false) ? SampleStatus::kUsedAfterClockSetBack : SampleStatus::kUsed;
}

/// Restarts the time at `t`. The estimates stay as they are at the last sample: how long the jump took is unknown.
template <class Estimator>
void OnBoard<Estimator>::set_clock(Time t, StepReport& report) {
  const Duration shift = t - this->t();
  if (is_working()) {
    finish(report);
    report.fix.t = shifted(report.fix.t, shift);
  }
  follow_all_samples();
  corrected_t_ = shifted(corrected_t_, shift);
  worked_t_ = shifted(worked_t_, shift);
  schedule_.set_clock(shift);
  frozen_fixes_.set_clock(shift);
  follower_t_ = passed_t_ = t;
  intake_.set_clock(t);
  fixes_dropped_ += fixes_.clear();
  readings_.clear();
  clock_set_back_ = true;
}

// ---- Calibration

template <class Estimator>
void OnBoard<Estimator>::calibrate_until(Time limit, StepReport& report) {
  if (spreads()) {
    calibrate_some(limit, Beginnings::kAllowed, report);
  } else {
    calibrate_at_once(limit, report);
  }
}

/// Processes samples and fixes up to `limit` in time order; stops before a second fix (one per step).
template <class Estimator>
void OnBoard<Estimator>::calibrate_at_once(Time limit, StepReport& report) {
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
        if (begin(fixes_.pop(), report)) {
          finish(report);
        }
        break;
      case Schedule::Next::kAngles:
        if (report.angles.status != FixStatus::kNone) {
          return;
        }
        if (begin_angles()) {
          finish(report);
        }
        break;
      case Schedule::Next::kNothing:
        return;
    }
  }
}

template <class Estimator>
bool OnBoard<Estimator>::begin_next(Schedule::Next next, StepReport& report) {
  return next == Schedule::Next::kFix ? begin(fixes_.pop(), report) : begin_angles();
}

/// Whether this is left to do and costs no more than is left of the share; the first piece may.
constexpr bool is_affordable(int cost, int left, int piece) { return cost > 0 && (piece == 0 || cost <= left); }

/// The same in the same order, but no more than this step's share of it. Stops behind a fix, so that the estimator is
/// still at its time when the report is read.
template <class Estimator>
void OnBoard<Estimator>::calibrate_some(Time limit, Beginnings beginnings, StepReport& report) {
  hurry(limit);
  constexpr int kMostPieces = 160;  // samples of the buffer, and stages
  int left = share_of_slot(limit);
  for (int piece = 0; piece < kMostPieces && !has_outcome(report); ++piece) {
    const auto next = is_working() ? Schedule::Next::kNothing : schedule_.next(limit, next_sample_t(), fixes_.next_t());
    const bool begins = next == Schedule::Next::kFix || next == Schedule::Next::kAngles;
    if (begins && beginnings == Beginnings::kPutOff) {
      break;
    }
    const int cost = is_working() ? cost_of_stage() : cost_of(next);
    if (!is_affordable(cost, left, piece)) {
      break;
    }
    left -= cost;
    if (work_.stage == Work::Stage::kReport) {
      hand_over(report);
    } else if (is_working()) {
      work();
    } else if (next == Schedule::Next::kSample) {
      follow_next_sample();
    } else if (begin_next(next, report)) {
      // Angles wait for a fix whose readings they would share.
      const Time due_t = work_.has_fix ? work_.t : work_.t + 2 * reach();
      plan(samples_after(due_t) - samples_after(limit));
      hurry(limit);
      left = share_of_slot(limit) - cost;
    }
  }
}

/// After a sample out of order. It takes some of them to tell that the clock has been set back, and what is being dealt
/// with must be done by then. Nothing is begun: if it has been, the time of fixes that wait is unknown. A single one
/// changes nothing.
template <class Estimator>
void OnBoard<Estimator>::calibrate_in_doubt(StepReport& report) {
  if (spreads() && intake_.may_be_set_back()) {
    slots_left_ = std::min(slots_left_, intake_.samples_to_set_back());
    calibrate_some(readings_.latest_t() - reach(), Beginnings::kPutOff, report);
  }
}

// ---- How it is spread

/// Over the samples up to the next fix, taken to come after the same time as this one, less those by which this one is
/// late already. Not less than two thirds of them: fixes that come faster than before are caught up little by little.
template <class Estimator>
void OnBoard<Estimator>::plan(int late) {
  const Duration period = std::max(estimator_.setup().gyro_period, readings_.min_spacing());
  const auto slots = std::clamp<Duration::rep>((work_.t - worked_t_) / period, 1, 2 * policy_.spread_over);
  const auto in_time = std::max(slots - late, (2 * slots + 2) / 3);
  slots_left_ = has_worked_ ? std::min(static_cast<int>(in_time), policy_.spread_over) : policy_.spread_over;
  worked_t_ = work_.t;
  has_worked_ = true;
}

/// Fixes that come faster than expected wait for the one that is dealt with.
template <class Estimator>
void OnBoard<Estimator>::hurry(Time limit) {
  if (const int waiting = fixes_.count_until(limit, kHurry + 1); is_working() && waiting > 0) {
    slots_left_ = std::min(slots_left_, kHurry / waiting);
  }
}

template <class Estimator>
int OnBoard<Estimator>::share_of_slot(Time limit) const {
  if (slots_left_ == 0) {
    return std::numeric_limits<int>::max() / 2;
  }
  const int samples_due = std::max(behind_ - samples_after(limit), 0);
  const int all = samples_due * Cost::kSample + (is_working() ? cost_to_end() : 0);
  return all / slots_left_ + Cost::kSample + Cost::kNavigatedSample;  // these come with each further sample
}

template <class Estimator>
int OnBoard<Estimator>::cost_of(Schedule::Next next) {
  return next == Schedule::Next::kNothing ? 0 : next == Schedule::Next::kSample ? Cost::kSample : Cost::kBeginning;
}

template <class Estimator>
int OnBoard<Estimator>::cost_of_stage() const {
  switch (work_.stage) {
    case Work::Stage::kNone:
      break;
    case Work::Stage::kFix:
    case Work::Stage::kAngles:
      return estimator_.started() ? Estimator::cost(work_.correction) : Cost::kStarting;
    case Work::Stage::kCalibrated:
      return Cost::kCalibrated;
    case Work::Stage::kCatchingUp:
      return Cost::kNavigatedSample * std::clamp(samples_after(work_.state_t), 1, kCaughtUpTogether);
    case Work::Stage::kTakingOver:
      return Cost::kTakingOver;
    case Work::Stage::kNavigated:
      return Cost::kNavigated;
    case Work::Stage::kReport:
      return work_.has_fix ? Cost::kReport : 1;
  }
  return 0;
}

template <class Estimator>
int OnBoard<Estimator>::cost_to_end() const {
  const auto stage = work_.stage;
  const bool is_estimating = stage == Work::Stage::kFix || stage == Work::Stage::kAngles;
  int sum = is_estimating ? Estimator::cost_to_end(work_.correction) : 0;
  if (!work_.has_fix) {
    return sum;
  }
  const bool corrects = stage == Work::Stage::kCatchingUp || stage == Work::Stage::kTakingOver ||
                        (stage <= Work::Stage::kCalibrated && is_correction_due(work_.t));
  sum += stage <= Work::Stage::kCalibrated ? Cost::kCalibrated : 0;
  if (corrects) {
    const Time from = stage == Work::Stage::kCatchingUp ? work_.state_t : work_.t;
    sum += Cost::kTakingOver + samples_after(from) * Cost::kNavigatedSample;
  }
  return sum + (stage <= Work::Stage::kNavigated ? Cost::kNavigated : 0) + Cost::kReport;
}

template <class Estimator>
bool OnBoard<Estimator>::is_too_far_behind() const {
  const Time needed = is_working() ? work_.t : fixes_.next_t() - reach();
  return spreads() && readings_.full() && readings_.time(0) >= needed;
}

// ---- A fix, stage by stage

template <class Estimator>
bool OnBoard<Estimator>::begin(const StarFix& fix, StepReport& report) {
  const auto refuse = [&](FixStatus status) {
    report.fix = {};
    report.fix.t = fix.t;
    report.fix.head = fix.head;
    report.fix.status = status;
    return false;
  };
  const std::optional<FittedReadings> readings = readings_at(fix.t);
  const int used = count(readings ? readings->used : intake_.health().usable(fix.t, fix.t));
  if (used < (estimator_.started() ? 2 : gyros())) {
    return refuse(FixStatus::kRejectedTooFewGyros);
  }
  if (!readings) {
    return refuse(FixStatus::kRejectedNoGyro);
  }
  if (frozen_fixes_.look_at(fix, *readings, estimator_.setup(), estimator_.gyros())) {
    return refuse(FixStatus::kRejectedFrozen);
  }
  prepare(fix.t, *readings, Work::Stage::kFix);
  work_.has_fix = true;
  work_.its.fix = fix;
  if (spreads() && navigator_.started()) {
    look_back();
  }
  return true;
}

/// The angles between the momenta alone, at the time that they are due.
template <class Estimator>
bool OnBoard<Estimator>::begin_angles() {
  const Time t = std::max(schedule_.angles_t(), follower_t_);
  const std::optional<FittedReadings> readings = readings_at(t);
  if (!readings || count(readings->used) < 2) {  // a gap of the gyros: continue where they are back
    schedule_.put_angles_off(next_sample_t() + reach());
    return false;
  }
  prepare(t, *readings, Work::Stage::kAngles);
  return true;
}

template <class Estimator>
void OnBoard<Estimator>::prepare(Time t, const FittedReadings& readings, typename Work::Stage stage) {
  follow(t, readings.h_b);
  work_ = {};
  work_.correction.at_once = !spreads();
  work_.stage = stage;
  work_.t = t;
  jitter_.add(t, reach(), readings.unfollowed);
  work_.its.readings = with_jitter(readings);
}

template <class Estimator>
void OnBoard<Estimator>::finish(StepReport& report) {
  constexpr int kMostPieces = 80;
  for (int piece = 0; piece < kMostPieces && work_.stage != Work::Stage::kReport; ++piece) {
    work();
  }
  hand_over(report);
}

template <class Estimator>
void OnBoard<Estimator>::hand_over(StepReport& report) {
  if (work_.has_fix) {
    const AngleReport angles = report.angles;
    static_cast<FixOutcome&>(report) = work_.outcome;
    report.angles = work_.outcome.angles.status == FixStatus::kNone ? angles : work_.outcome.angles;
  } else {
    report.angles = work_.outcome.angles;
  }
  report.gyros = intake_.health().states();
  work_.stage = Work::Stage::kNone;
}

template <class Estimator>
void OnBoard<Estimator>::work() {
  switch (work_.stage) {
    case Work::Stage::kFix:
      work_on_fix();
      break;
    case Work::Stage::kCalibrated:
      work_.outcome.calibrated = calibrated(work_.its.readings);
      work_.stage = after_calibration();
      break;
    case Work::Stage::kAngles:
      work_on_angles();
      break;
    case Work::Stage::kCatchingUp:
      catch_up(kCaughtUpTogether);
      break;
    case Work::Stage::kTakingOver:
      take_over();
      break;
    case Work::Stage::kNavigated:
      note_navigated();
      break;
    case Work::Stage::kNone:
    case Work::Stage::kReport:
      break;
  }
}

/// A stage of the estimator; with the one that moves its covariance to the present time, the sensitivities of the
/// stretch since the last fix go to those who carry errors over it.
template <class Estimator>
template <class Stage>
void OnBoard<Estimator>::carry_on_with(const FixStatus& status, Stage&& stage) {
  const bool moves =
      !work_.moved && (work_.correction.stage == Estimator::Correction::Stage::kPropagation || !estimator_.started());
  if (!moves) {
    stage();
    return;
  }
  const typename Estimator::Sensitivities stretch = estimator_.since_fix();
  const double duration_s = estimator_.time_since_fix_s();
  stage();
  if (status != FixStatus::kRejectedGeometry) {
    end_stretch(stretch, duration_s);
    work_.moved = true;
  }
}

template <class Estimator>
void OnBoard<Estimator>::work_on_fix() {
  FixReport& report = work_.outcome.fix;
  carry_on_with(report.status,
                [&] { estimator_.carry_on(work_.correction, work_.its.fix, work_.its.readings, report); });
  if (!work_.correction.done()) {
    return;
  }
  if (report.status == FixStatus::kRejectedGeometry) {
    work_.stage = Work::Stage::kReport;  // the estimator did not move its covariance to this fix
    return;
  }
  if (report.status == FixStatus::kEstimateLost) {
    schedule_.no_angles();
    work_.stage = Work::Stage::kReport;
    return;
  }
  intake_.health().judge(report.odd_gyro);
  work_.outcome.compared = work_.its;
  work_.stage = Work::Stage::kCalibrated;
}

/// What follows the attitude of the calibration.
template <class Estimator>
auto OnBoard<Estimator>::after_calibration() -> typename Work::Stage {
  const StarFix& fix = work_.its.fix;
  if (!work_.outcome.fix.used()) {
    if (Estimator::kUsesAngles && fix.t >= schedule_.angles_t()) {  // its readings may be used for the angles
      work_.correction = {};
      return Work::Stage::kAngles;
    }
    return Work::Stage::kNavigated;
  }
  intake_.mark_used(fix);
  schedule_.fix_used(fix.t);
  if (!policy_.navigate) {
    return Work::Stage::kNavigated;
  }
  // Later fixes contradicted the one that started filter and navigator: the navigator must be corrected again.
  const bool has_restarted = work_.outcome.fix.status == FixStatus::kRestarted;
  const bool start_was_wrong =
      start_unconfirmed_ && (has_restarted || work_.outcome.fix.status == FixStatus::kUsedAfterReopening);
  start_unconfirmed_ = work_.outcome.fix.status == FixStatus::kStarted || (start_unconfirmed_ && has_restarted);
  // The navigator rests on what the filter knew before it was contradicted.
  const bool was_contradicted =
      work_.outcome.fix.status == FixStatus::kUsedAfterWidening && parameters_ == ParametersInUse::kOfCalibration;
  const bool has_source = parameters_ == ParametersInUse::kOfCalibration || work_.outcome.calibrated;
  if (!has_source || !(is_correction_due(fix.t) || start_was_wrong || was_contradicted)) {
    return Work::Stage::kNavigated;
  }
  work_.parameters = parameters_;
  work_.state = navigator_.corrected(estimator_, source());
  work_.state_t = fix.t;
  return Work::Stage::kCatchingUp;
}

/// The angles between the momenta at the time that they are due, or at a fix that was rejected.
template <class Estimator>
void OnBoard<Estimator>::work_on_angles() {
  if constexpr (Estimator::kUsesAngles) {
    AngleReport& report = work_.outcome.angles;
    carry_on_with(report.status, [&] { estimator_.carry_on(work_.correction, work_.t, work_.its.readings, report); });
    if (!work_.correction.done()) {
      return;
    }
    schedule_.angles_used(work_.t);
    if (report.status == FixStatus::kEstimateLost) {
      schedule_.no_angles();
    }
    if (!work_.has_fix) {
      intake_.health().judge(report.odd_gyro);
    }
  }
  work_.stage = work_.has_fix ? Work::Stage::kNavigated : Work::Stage::kReport;
}

/// A correction by the others that is under way is given up: the next fix makes one by these.
template <class Estimator>
void OnBoard<Estimator>::use_parameters(ParametersInUse parameters) {
  const bool is_under_way = work_.stage == Work::Stage::kCatchingUp || work_.stage == Work::Stage::kTakingOver;
  if (is_under_way && parameters != parameters_) {
    work_.stage = Work::Stage::kNavigated;
    correction_wanted_ = true;
  }
  parameters_ = parameters;
}

template <class Estimator>
bool OnBoard<Estimator>::is_correction_due(Time t) const {
  const bool interval_over = policy_.interval != CorrectionPolicy::kOnlyFirst && t - corrected_t_ >= policy_.interval;
  return policy_.navigate && (!navigator_.started() || interval_over || correction_wanted_);
}

template <class Estimator>
auto OnBoard<Estimator>::source() const -> typename Navigator<Estimator>::Source {
  return {work_.parameters, work_.outcome.calibrated.value_or(AttitudeSolution{}), work_.its.readings.h_b};
}

/// The corrected state along the samples since the fix, so many of them.
template <class Estimator>
void OnBoard<Estimator>::catch_up(int samples) {
  const int first = readings_.first_after(work_.state_t);
  const int end = std::min(first + samples, readings_.size());
  Directions from = work_.state_t == work_.t ? work_.its.readings.h_b : readings_.directions(std::max(first, 1) - 1);
  for (int i = first; i < end; ++i) {
    const Directions to = readings_.directions(i);
    Step to_it = step(work_.state_t, from, readings_.time(i), to);
    navigate(to_it, work_.state);
    work_.state_t = readings_.time(i);
    from = to;
  }
  work_.stage = end == readings_.size() ? Work::Stage::kTakingOver : work_.stage;
}

/// Astro-correction of the navigator, whose corrected state then is at the latest sample.
template <class Estimator>
void OnBoard<Estimator>::take_over() {
  catch_up(readings_.size());
  navigator_.take_over(estimator_, source(), work_.state);
  corrected_t_ = work_.t;
  corrected_by_ = work_.parameters;
  correction_wanted_ = false;
  work_.outcome.corrected = true;
  work_.stage = Work::Stage::kNavigated;
}

/// The navigator's attitude at the fix: after its correction there, or without.
template <class Estimator>
void OnBoard<Estimator>::note_navigated() {
  work_.stage = Work::Stage::kReport;
  if (!navigator_.started()) {
    return;
  }
  if (work_.outcome.corrected) {
    work_.state = navigator_.corrected(estimator_, source());
  } else if (!spreads()) {
    look_back();
  }
  if (work_.outcome.corrected || work_.has_past) {
    const auto solution = navigator_.attitude(estimator_, work_.its.readings, work_.state);
    work_.outcome.navigated = solution ? std::optional(solution.value()) : std::nullopt;
  }
}

/// The navigator's state back to the fix, within the samples buffered.
template <class Estimator>
void OnBoard<Estimator>::look_back() {
  Step back = step(work_.t, work_.its.readings.h_b, t(), readings_.latest_directions());
  const auto C_in_c = attitude_of(navigator_.gyros(), back);
  work_.has_past = C_in_c.has_value();
  if (C_in_c) {
    work_.state = navigator_.state();
    Navigator<Estimator>::predict(estimator_, *C_in_c, back.middle, t(), -back.dt_s(), work_.state);
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
  if (can_be_passed_over(next)) {
    passed_t_ = readings_.time(next);
    schedule_.followed_to(passed_t_);
  } else {
    follow(readings_.time(next), readings_.directions(next));
  }
  --behind_;
}

template <class Estimator>
void OnBoard<Estimator>::follow_all_samples() {
  while (behind_ > 0) {
    follow_next_sample();
  }
}

/// Whether the step to the sample after this one can be made at once. The readings turn by so little over it that their
/// middle is off by some 1e-5 rad where the body turns evenly.
template <class Estimator>
bool OnBoard<Estimator>::can_be_passed_over(int sample) const {
  constexpr Duration kLongest = std::chrono::seconds(1);
  constexpr double kMostTurned_rad = 0.01;
  if (!policy_.steps_over_samples || !estimator_.started() || sample + 1 >= readings_.size()) {
    return false;
  }
  const Time t = readings_.time(sample);
  const Time to_t = readings_.time(sample + 1);
  const Duration gap = estimator_.setup().max_interpolation();
  if (to_t - follower_t_ > kLongest || t - passed_t_ > gap || to_t - t > gap ||
      count(intake_.used_over(follower_t_, to_t)) < gyros()) {
    return false;
  }
  const Directions to = readings_.directions(sample + 1);
  for (int k = 0; k < gyros(); ++k) {
    if (!((to[k] - follower_h_b_[k]).squaredNorm() <= kMostTurned_rad * kMostTurned_rad)) {
      return false;
    }
  }
  return true;
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
      if (t - passed_t_ > estimator_.setup().max_interpolation()) {
        estimator_.add_direction_variance(variance_of_long_step(step));
      }
    }
  }
  follower_t_ = passed_t_ = t;
  schedule_.followed_to(t);
  follower_h_b_ = h_b;
}

template <class Estimator>
void OnBoard<Estimator>::navigate(Step& step, typename Navigator<Estimator>::State& state) const {
  if (const auto C_in_c = attitude_of(state.gyros, step)) {
    Navigator<Estimator>::predict(estimator_, *C_in_c, step.middle, step.to_t, step.dt_s(), state);
    if (step.to_t - step.from_t > estimator_.setup().max_interpolation()) {
      state.extra_variance_rad2 += variance_of_long_step(step);
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
  Eigen::Matrix3d spread_rad2 = estimator_.covariance_of_errors(rows);
  spread_rad2.diagonal().array() += static_cast<double>(readings.jitter_rad2);
  return with_covariance(attitude.value(), spread_rad2, noise_rad, gyros(), 0);
}

template <class Estimator>
double OnBoard<Estimator>::angle_residual() const {
  const GyroMask used = intake_.health().usable(t(), t());
  if (!estimator_.started() || !used[0] || !used[1]) {
    return 0;
  }
  const Directions h_b = readings_.latest_directions();
  return cosine_off(estimator_.gyros()[0], estimator_.gyros()[1], h_b[0], h_b[1]);
}

template <class Estimator>
double OnBoard<Estimator>::largest_angle_off_rad() const {
  double largest = 0;
  if (readings_.size() == 0) {
    return largest;
  }
  const GyroMask used = intake_.health().usable(t(), t());
  const auto& its = estimator_.gyros();
  const Directions h_b = readings_.latest_directions();
  for (int k = 0; k < gyros(); ++k) {
    for (int j = k + 1; j < gyros(); ++j) {
      const double sine = its[k].h_in.cross(its[j].h_in).norm();
      if (used[k] && used[j] && sine >= kMinSine) {
        largest = std::max(largest, std::abs(cosine_off(its[k], its[j], h_b[k], h_b[j])) / sine);
      }
    }
  }
  return largest;
}

// ---- Navigator

template <class Estimator>
auto Navigator<Estimator>::corrected(const Estimator& estimator, const Source& source) const -> State {
  if (source.parameters == ParametersInUse::kOfCalibration) {
    return {estimator.gyros()};
  }
  const bool of_set_up = are_of_set_up(source);
  const Layout layout = estimator.error_layout();
  State state{of_set_up ? estimator.prior_gyros() : state_.gyros};
  for (int k = 0; k < layout.gyros; ++k) {
    auto& gyro = state.gyros[k];
    gyro.h_in = (source.attitude.C_in_c.raw() * gyro.in_c(source.h_b[k])).normalized();
    if (layout.further.wandering_drift && !of_set_up && error_columns_ == estimator.states()) {
      // It cannot be held: back to what is known of it beforehand.
      gyro.drift_rad_s.template segment<3>(layout.wandering_column()).setZero();
    }
  }
  return state;
}

template <class Estimator>
void Navigator<Estimator>::take_over(const Estimator& estimator, const Source& source, const State& state) {
  const Layout& layout = estimator.layout();
  if (source.parameters == ParametersInUse::kOfCalibration) {
    estimator.error_root(new_errors(estimator.error_layout().shared(), estimator.states()));
  } else {
    hold_errors(estimator, source, state.gyros);
  }
  for (int k = 0; k < layout.gyros; ++k) {
    since_correction_[k].begin(layout.drift_columns());
  }
  extended_until_s_ = 0;
  state_ = state;
  started_ = true;
}

template <class Estimator>
void Navigator<Estimator>::hold_errors(const Estimator& estimator, const Source& source, const Gyros& gyros) {
  const Layout layout = estimator.error_layout();
  // Columns: the error of the attitude, then those of the parameters held. The root at an adoption is a triangle: its
  // first columns hold errors of the directions alone.
  constexpr int kAttitude = 3;
  const int first = layout.direction(layout.gyros);
  if (are_of_set_up(source)) {
    const int size = layout.shared() - first;
    const RowsView view = new_errors(layout.shared(), kAttitude + size);
    estimator.prior_error_root({&view(first, kAttitude), size, size, view.stride});
  }
  const bool of_calibration = error_columns_ == estimator.states();
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> errors(errors_.data(), error_rows_,
                                                                                            error_columns_);
  const Eigen::Matrix3d& C_in_c = source.attitude.C_in_c.raw();
  const Eigen::Matrix3d attitude_root = cholesky_root<3>(source.attitude.covariance_rad2);
  for (int k = 0; k < layout.gyros; ++k) {
    // φ = C_in_c (δ + ε − h_c × C_c_b Δb): h_in was read through what is held at the estimated attitude.
    auto phi = errors.template middleRows<3>(layout.direction(k));
    phi = C_in_c.lazyProduct(errors.template middleRows<3>(layout.alignment(k)));
    if (layout.readout_size() > 0) {
      phi -= by_readout_errors(layout, C_in_c * skew<double>(gyros[k].in_c(source.h_b[k])), gyros[k], source.h_b[k])
                 .lazyProduct(errors.middleRows(layout.readout(k), layout.readout_size()));
    }
    phi.template leftCols<kAttitude>() = C_in_c * attitude_root;
    if (layout.further.wandering_drift && of_calibration) {
      auto wandering = errors.template middleRows<3>(layout.wandering(k));
      wandering.setZero();
      wandering.template middleCols<3>(layout.wandering(k))
          .diagonal()
          .setConstant(estimator.setup().wandering_drift.sigma);
    }
  }
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
void Navigator<Estimator>::predict(const Estimator& estimator, const Eigen::Matrix3d& C_in_c, const Directions& h_b,
                                   Time t, double dt_s, State& state) {
  const Layout& layout = estimator.layout();
  const auto times = [&] { return estimator.setup().drift_times(t - from_seconds(dt_s / 2)); };
  precess_all(state.gyros, layout.gyros, estimator.drift(), C_in_c, h_b, times, dt_s);
  for (int k = 0; layout.further.wandering_drift && k < layout.gyros; ++k) {
    state.gyros[k].drift_rad_s.template segment<3>(layout.wandering_column()) *=
        elementary::exp(-dt_s / estimator.setup().wandering_drift.time_s);
  }
  state.time_s += dt_s;
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
  extended_until_s_ = state_.time_s;
}

template <class Estimator>
Result<AttitudeSolution, DirectionsFault> Navigator<Estimator>::attitude(const Estimator& estimator,
                                                                         const FixReadings& readings,
                                                                         const State& state) const {
  const auto by_directions = estimator.attitude(state.gyros, readings.h_b, readings.used);
  if (!by_directions) {
    return by_directions.fault();
  }
  const Layout layout = estimator.error_layout();
  const CalibrationSetup& setup = estimator.setup();
  auto rows = attitude_by_states_now<Estimator::kMaxErrors>(layout, by_directions.value(), state.gyros, readings.h_b);
  Sensitivities since = since_correction_;
  append(estimator, estimator.since_fix(), since);
  carry_back(layout, since, rows);
  StateRows3<Estimator::kMaxStates> spread(3, error_columns_);
  // After the momenta each row begins a column further than the one above, whatever made the errors: see take_over().
  const int momenta = layout.direction(layout.gyros);
  const double* parameters = errors_.data() + static_cast<std::ptrdiff_t>(momenta) * error_columns_;
  const int begin = static_cast<int>(
      std::find_if(parameters, parameters + error_columns_, [](double error) { return error != 0; }) - parameters);
  const ConstRowsView by_errors = view_of(rows);
  const RowsView found = rows_of(spread);
  multiply({by_errors.data, 3, momenta, by_errors.stride}, {errors_.data(), momenta, error_columns_, error_columns_},
           found);
  add_product_of_triangle({by_errors.data + momenta, 3, error_rows_ - momenta, by_errors.stride},
                          {parameters + begin, error_rows_ - momenta, error_columns_ - begin, error_columns_},
                          {found.data + begin, 3, error_columns_ - begin, found.stride});
  PerGyro<double> noise_rad;
  for (int k = 0; k < layout.gyros; ++k) {
    noise_rad[k] = readings.noise_factor * setup.readout_noise_rad[k];
  }
  const double walk = setup.direction_random_walk_rad_sqrt_s;
  double variance_rad2 = walk * walk * state.time_s + state.extra_variance_rad2;
  if (layout.further.wandering_drift) {
    // Variance of ∫w(t) dt given w(0): docs/mathematics.md, section 10.
    const double x = state.time_s / setup.wandering_drift.time_s;
    const double scale_rad = setup.wandering_drift.sigma * setup.wandering_drift.time_s;
    variance_rad2 +=
        scale_rad * scale_rad * std::max(2 * x - 3 + 4 * elementary::exp(-x) - elementary::exp(-2 * x), 0.0);
  }
  Eigen::Matrix3d spread_rad2 = gram<Estimator::kMaxStates>(spread);
  spread_rad2.diagonal().array() += static_cast<double>(readings.jitter_rad2);
  return with_covariance(by_directions.value(), spread_rad2, noise_rad, layout.gyros, variance_rad2);
}

}  // namespace trihedron
