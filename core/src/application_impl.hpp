#pragma once
/// Definitions of Application.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "forecast_impl.hpp"
#include "trihedron/core/application.hpp"
#include "trihedron/core/cholesky.hpp"

namespace trihedron {

namespace detail {

inline void count_up(std::uint32_t& counter) { counter += counter < UINT32_MAX ? 1 : 0; }

[[nodiscard]] constexpr Answer answer_to(SetupFault fault) {
  switch (fault) {
    case SetupFault::kTooLarge:
      return Answer::kTooLarge;
    case SetupFault::kPriorNotPositiveDefinite:
      return Answer::kCovarianceNotPositiveDefinite;
    case SetupFault::kPriorMeanNotUsable:
      return Answer::kMeanNotUsable;
    case SetupFault::kNoiseNotPositive:
    case SetupFault::kGateNotPositive:
      break;
  }
  return Answer::kNotPositive;
}

inline constexpr Duration kLongestTime = std::chrono::hours(24 * 365);

/// What the estimator does not check: times with which no sum can overflow, and numbers that are finite.
[[nodiscard]] inline bool is_usable(const CalibrationSetup& setup) {
  constexpr Duration kSlowest = std::chrono::minutes(1);
  const bool never_by_angles = setup.angles_after == Duration::max();
  return setup.gyro_period > Duration{} && setup.gyro_period <= kSlowest && setup.angles_after >= Duration{} &&
         (setup.angles_after <= kLongestTime || never_by_angles) && std::isfinite(setup.gate_nis);
}

/// The same of what the estimator does not know.
[[nodiscard]] inline bool is_usable(const ApplicationPolicy& policy) {
  const auto is_time = [](Duration its) { return its > Duration{} && its <= kLongestTime; };
  return policy.correction_interval >= Duration{} && policy.required_error_rad > 0 &&
         std::isfinite(policy.required_error_rad) && is_time(policy.required_interval) && is_time(policy.window) &&
         is_time(policy.star_tracker_timeout) && is_time(policy.failed_after) && policy.aligned_after_fixes > 0 &&
         policy.spread_over >= 0;
}

}  // namespace detail

// ---- Commands

template <class Estimator>
Answer Application<Estimator>::load(const CalibrationSetup& setup, const Gyros& prior,
                                    const Eigen::Ref<const Eigen::MatrixXd>& covariance,
                                    const ApplicationPolicy& policy) {
  if (!next_mode(mode_, Event::kLoadParameters)) {
    return answer(Answer::kNotInThisMode);
  }
  if (!detail::is_usable(setup) || !detail::is_usable(policy)) {
    return answer(Answer::kNotPositive);
  }
  const CorrectionPolicy corrections{
      .interval = policy.correction_interval, .take_parameters = false, .spread_over = policy.spread_over};
  if (const auto fault = on_board_.set_up(setup, prior, covariance, corrections)) {
    return answer(detail::answer_to(*fault));
  }
  policy_ = policy;
  loaded_ = true;
  begin();
  return answer(Answer::kAccepted);
}

template <class Estimator>
Answer Application<Estimator>::command(Command command, std::uint32_t argument) {
  return answer(answer_to(command, argument));
}

template <class Estimator>
Answer Application<Estimator>::answer(Answer answer) {
  counts_.last_answer = static_cast<std::uint8_t>(answer);
  detail::count_up(answer == Answer::kAccepted ? counts_.commands_accepted : counts_.commands_refused);
  return answer;
}

template <class Estimator>
Answer Application<Estimator>::answer_to(Command command, std::uint32_t argument) {
  if (static_cast<std::size_t>(command) >= kCommands || command == Command::kLoadParameters) {
    return Answer::kUnknownCommand;  // parameters are loaded by load()
  }
  if (!next_mode(mode_, event_of(command))) {
    return Answer::kNotInThisMode;
  }
  switch (command) {
    case Command::kStart:
      if (!loaded_) {
        return Answer::kNoParameters;
      }
      fix_t_ = attitude_t_ = now_;
      break;
    case Command::kCorrectNow:
      on_board_.correct_at_next_fix();
      break;
    case Command::kAdoptCalibration:
      if (!calibration_residuals_.agree()) {
        return Answer::kResidualsDisagree;
      }
      held_ = false;
      adopt();
      break;
    case Command::kHoldCalibration:
      hold();
      break;
    case Command::kSelectGyros:
      if (const Answer refusal = select(argument); refusal != Answer::kAccepted) {
        return refusal;
      }
      break;
    case Command::kReset:
      if (loaded_) {
        on_board_.reset();
        begin();
      }
      break;
    case Command::kLoadParameters:
      break;
  }
  happen(event_of(command));
  return Answer::kAccepted;
}

template <class Estimator>
Answer Application<Estimator>::select(std::uint32_t bits) {
  if (bits >> gyros() != 0) {
    return Answer::kNoSuchGyro;
  }
  GyroMask mask;
  for (int k = 0; k < gyros(); ++k) {
    mask[k] = (bits >> k & 1U) != 0;
  }
  if (count(mask) < 2) {
    return Answer::kTooFewGyros;
  }
  if (!on_board_.can_see_with(mask)) {
    return Answer::kMomentaNearlyParallel;
  }
  on_board_.select(mask);
  return Answer::kAccepted;
}

/// As after loading parameters; counters go on.
template <class Estimator>
void Application<Estimator>::begin() {
  forecast_ = Forecast<Estimator>(policy_.window, policy_.required_interval, policy_.required_error_rad);
  calibration_residuals_.restart();
  navigation_residuals_.restart();
  forget_angles();
  angle_t_ = angle_off_t_ = Time::min();
  angle_off_rad_ = last_off_rad_ = fixes_off_rad_ = 0;
  fixes_to_agree_ = 0;
  angle_gyros_ = {};
  faults_ = 0;
  fixes_since_start_ = 0;
  refused_in_a_row_ = 0;
  unknown_until_ = Time::min();
  adoption_ = Adoption::kNone;
  held_ = false;
  has_sample_ = has_time_ = false;
}

template <class Estimator>
void Application<Estimator>::happen(Event event) {
  if (const auto next = next_mode(mode_, event)) {
    mode_ = *next;
  }
}

template <class Estimator>
void Application<Estimator>::set(Fault fault, bool is_there) {
  const auto bit = static_cast<std::uint32_t>(fault);
  faults_ = is_there ? faults_ | bit : faults_ & ~bit;
}

// ---- Samples and fixes

template <class Estimator>
StepReport Application<Estimator>::on_gyro(const GyroSample& sample) {
  if (!loaded_ || mode_ == Mode::kFailed) {
    StepReport report;
    report.t = sample.t;
    return report;
  }
  const StepReport report = on_board_.on_gyro(sample);
  note(report);
  return report;
}

template <class Estimator>
StepReport Application<Estimator>::on_fix(const StarFix& fix) {
  if (!is_looking_at_fixes()) {
    detail::count_up(counts_.fixes_ignored);
    StepReport report;
    report.t = fix.t;
    return report;
  }
  const StepReport report = on_board_.on_fix(fix);
  note(report);
  return report;
}

template <class Estimator>
void Application<Estimator>::note(const StepReport& report) {
  note_sample(report);
  note_fix(report);
  watch(report);
}

template <class Estimator>
void Application<Estimator>::note_sample(const StepReport& report) {
  if (report.sample == SampleStatus::kNone) {
    return;
  }
  counts_.last_sample = static_cast<std::uint8_t>(report.sample);
  if (report.sample == SampleStatus::kThinned) {
    detail::count_up(counts_.samples_thinned);
    return;
  }
  if (!is_used(report.sample)) {
    detail::count_up(counts_.samples_rejected);
    refused_in_a_row_ = std::min(refused_in_a_row_ + 1, kStandingStill);
    if (report.sample != SampleStatus::kRejectedOutOfOrder) {
      note_time_of_refused(report);
    }
    return;
  }
  detail::count_up(counts_.samples_used);
  refused_in_a_row_ = 0;
  counts_.angle_residual = report.angle_residual;
  if (report.sample == SampleStatus::kUsedAfterClockSetBack) {
    detail::count_up(counts_.clock_set_backs);
    const Duration shift = report.t - used_t_;
    fix_t_ = shifted(fix_t_, shift);
    attitude_t_ = shifted(attitude_t_, shift);
    set(Fault::kClockSetBack, on_board_.navigator().started());
    unknown_until_ = report.t;
    forget_angles();
  } else if (has_sample_ && report.t - used_t_ > kLongGap) {
    detail::count_up(counts_.gaps);
    set(Fault::kGap, on_board_.navigator().started());
    unknown_until_ = report.t;
    forget_angles();
  }
  if (!has_sample_) {
    fix_t_ = attitude_t_ = report.t;
    has_sample_ = has_time_ = true;
  }
  now_ = used_t_ = report.t;
  note_angles(report);
}

/// A time without samples does not count as one without attitude; nor does one that a single refused sample may have
/// wrong.
template <class Estimator>
void Application<Estimator>::note_time_of_refused(const StepReport& report) {
  const Duration ahead = report.t - now_;
  if (!has_time_) {
    now_ = fix_t_ = attitude_t_ = report.t;
    has_time_ = true;
  } else if (std::chrono::abs(ahead) <= kLongGap) {
    now_ = report.t;
  } else if (refused_in_a_row_ >= kStandingStill) {
    now_ = report.t;
    attitude_t_ = shifted(attitude_t_, ahead);
    if (ahead < Duration::zero()) {  // the clock has been set back
      fix_t_ = shifted(fix_t_, ahead);
      used_t_ = shifted(used_t_, ahead);
    }
  }
}

/// Until the next fix is compared, the angles between the momenta are not known well enough.
template <class Estimator>
void Application<Estimator>::forget_angles() {
  angle_sigma_rad_ = std::numeric_limits<double>::infinity();
  angle_run_ = 0;
}

/// Of a gyro that comes back the angles are not known.
template <class Estimator>
void Application<Estimator>::note_gyros(const StepReport& report) {
  GyroMask used{};
  bool is_one_more = false;
  for (int k = 0; k < gyros(); ++k) {
    used[k] = report.gyros[k] == GyroState::kUsed;
    is_one_more = is_one_more || (used[k] && !angle_gyros_[k]);
  }
  angle_gyros_ = used;
  if (is_one_more) {
    forget_angles();
  }
}

/// Whether gyros contradict each other, whatever the star tracker says: where the angle between two momenta is off at a
/// few samples in a row. It is over when it agrees for kStandingStill samples and the navigator has been corrected
/// since, as the attitude may rest on what was wrong.
template <class Estimator>
void Application<Estimator>::note_angles(const StepReport& report) {
  constexpr int kToContradict = 4;
  constexpr Duration kFresh = std::chrono::minutes(2);
  note_gyros(report);
  if (!on_board_.estimator().started() || report.t - kFresh > angle_t_) {
    return;
  }
  const double off_rad = on_board_.largest_angle_off_rad();
  double square = angle_sigma_rad_ * angle_sigma_rad_;
  for (int k = 0; k < gyros(); ++k) {
    const double noise_rad = on_board_.estimator().setup().readout_noise_rad[k];
    square += noise_rad * noise_rad;
  }
  const bool is_off = off_rad > FixReport::kContradiction * std::sqrt(square);
  const bool is_told = has(Fault::kGyrosContradict);
  angle_off_t_ = is_off ? report.t : angle_off_t_;
  angle_run_ = is_off == is_told ? 0 : std::min(angle_run_ + 1, kStandingStill);
  if (!is_told && angle_run_ >= kToContradict) {
    set(Fault::kGyrosContradict, true);
    on_board_.correct_at_next_fix();
    angle_run_ = 0;
  } else if (is_told && angle_run_ >= kStandingStill && on_board_.corrected_t() > angle_off_t_) {
    set(Fault::kGyrosContradict, false);
    angle_run_ = 0;
  }
  // Of two samples the smaller: a single one may be wild.
  const double both_rad = std::min(off_rad, std::exchange(last_off_rad_, off_rad));
  angle_off_rad_ = has(Fault::kGyrosContradict) ? std::max(angle_off_rad_, both_rad) : 0;
}

template <class Estimator>
void Application<Estimator>::note_fix(const StepReport& report) {
  if (report.fix.angle_sigma_rad > 0 && report.fix.t >= unknown_until_) {  // an earlier one may still have waited
    angle_sigma_rad_ = report.fix.angle_sigma_rad;
    angle_t_ = report.fix.t;
  } else if (is_used(report.angles.status)) {
    angle_t_ = report.angles.t;
  }
  if (report.fix.status == FixStatus::kEstimateLost || report.angles.status == FixStatus::kEstimateLost) {
    restart();
  }
  if (report.fix.status == FixStatus::kNone || report.fix.status == FixStatus::kPending) {
    return;
  }
  counts_.last_fix = static_cast<std::uint8_t>(report.fix.status);
  if (!report.fix.used()) {
    detail::count_up(counts_.fixes_rejected);
    return;
  }
  detail::count_up(counts_.fixes_used);
  if (report.fix.status == FixStatus::kUsedAfterWidening) {
    detail::count_up(counts_.widenings);
  }
  note_used_fix(report);
}

template <class Estimator>
void Application<Estimator>::note_used_fix(const StepReport& report) {
  fix_t_ = report.fix.t;
  if (report.fix.t >= unknown_until_) {  // an earlier one may still have waited
    set(Fault::kClockSetBack, false);
    set(Fault::kGap, false);
  }
  set(Fault::kAccuracy, false);
  note_contradiction(report);
  if (report.corrected) {
    detail::count_up(counts_.corrections);
    navigation_residuals_.restart();
  }
  const StarFix& fix = report.compared->fix;
  switch (report.fix.status) {
    case FixStatus::kStarted:
      happen(Event::kFirstFix);
      fixes_since_start_ = 0;
      on_board_.begin_stretch();
      break;
    case FixStatus::kRestarted:
      restart();
      break;
    case FixStatus::kUsedAfterReopening:
      withdraw();
      break;
    default:
      ++fixes_since_start_;
      calibration_residuals_.add(report.fix.nis / static_cast<double>(report.fix.innovation.size()));
      forecast_.extend(on_board_, fix.q_in_c.normalized().toRotationMatrix());
      break;
  }
  note_navigated(report);
  if (fixes_since_start_ >= policy_.aligned_after_fixes) {
    happen(Event::kAligned);
  }
  forecast_.predict(on_board_.estimator(), on_board_.health().usable(fix.t, fix.t));
  const bool is_by_calibration = on_board_.corrected_by() == ParametersInUse::kOfCalibration;
  if (report.corrected && is_by_calibration && adoption_ == Adoption::kPending) {
    adoption_ = Adoption::kDone;
    detail::count_up(counts_.adoptions);
    happen(Event::kAdopted);
  }
  if (!held_) {
    decide_on_adoption();
  }
}

/// The largest turn of all momenta together that an innovation of this length can be of: a turn θ moves two momenta at
/// the angle α by |θ| √(1 − |cos α|) at least.
template <class Estimator>
double Application<Estimator>::largest_turn_rad(const StepReport& report) const {
  const auto& its = on_board_.estimator().gyros();
  double least = 1;
  for (int k = 0; k < gyros(); ++k) {
    for (int j = k + 1; j < gyros(); ++j) {
      if (report.gyros[k] == GyroState::kUsed && report.gyros[j] == GyroState::kUsed) {
        least = std::min(least, std::abs(its[k].h_in.dot(its[j].h_in)));
      }
    }
  }
  return report.fix.innovation.norm() / std::sqrt(std::max(1 - least, kMinSine * kMinSine / 2));
}

/// Where fixes that contradicted an adopted calibration are followed in the end, it may be the star tracker that is
/// off. As many as it takes to believe them against a jump have to agree. Gyros that contradict each other explain it.
template <class Estimator>
void Application<Estimator>::note_contradiction(const StepReport& report) {
  const FixStatus status = report.fix.status;
  if (status == FixStatus::kUsedAfterReopening || status == FixStatus::kRestarted) {
    on_board_.correct_at_next_fix();  // the attitude may rest on what was wrong
    const bool was_adopted = adoption_ == Adoption::kDone || has(Fault::kFixesContradict);
    if (was_adopted && !has(Fault::kGyrosContradict) && !report.fix.gyros_contradict()) {
      fixes_off_rad_ = std::max(fixes_off_rad_, largest_turn_rad(report));
      fixes_to_agree_ = on_board_.estimator().setup().reopen_after_jump_rejections;
    }
  } else if (fixes_to_agree_ > 0) {
    --fixes_to_agree_;
  }
  set(Fault::kFixesContradict, fixes_to_agree_ > 0);
  fixes_off_rad_ = fixes_to_agree_ > 0 ? fixes_off_rad_ : 0;
}

/// How far the open loop was off at a fix.
template <class Estimator>
void Application<Estimator>::note_navigated(const StepReport& report) {
  if (report.navigated && !report.corrected) {
    const StarFix& fix = report.compared->fix;
    const Eigen::Vector3d off =
        (report.navigated->C_in_c.inverse() * Rot<In, C>::assume(fix.q_in_c.normalized())).log().raw();
    Eigen::Vector3d white = off;
    const Eigen::Matrix3d noise = fix_noise(on_board_.estimator().setup(), fix);
    const Eigen::Matrix3d root = cholesky_root<3>(report.navigated->covariance_rad2 + noise);
    solve_factorized(matrix_of(root), white);
    navigation_residuals_.add(off.dot(white) / 3);
  }
}

template <class Estimator>
void Application<Estimator>::decide_on_adoption() {
  if (calibration_residuals_.disagree() || navigation_residuals_.disagree()) {
    withdraw();
  } else if (mode_ == Mode::kCalibrating && adoption_ == Adoption::kNone && calibration_residuals_.agree() &&
             forecast_.known() && forecast_.error_rad() <= policy_.required_error_rad) {
    adopt();
  }
}

/// The filter has restarted, or has dropped its estimate and starts with the next fix.
template <class Estimator>
void Application<Estimator>::restart() {
  detail::count_up(counts_.filter_restarts);
  withdraw();
  happen(Event::kFilterRestarted);
  fixes_since_start_ = 0;
  forget_angles();
}

/// At the next fix that is used.
template <class Estimator>
void Application<Estimator>::adopt() {
  adoption_ = adoption_ == Adoption::kDone ? Adoption::kDone : Adoption::kPending;
  on_board_.use_parameters(ParametersInUse::kOfCalibration);
  on_board_.correct_at_next_fix();
}

/// Nothing is adopted or taken back until further notice.
template <class Estimator>
void Application<Estimator>::hold() {
  held_ = true;
  const bool is_done = adoption_ == Adoption::kDone || on_board_.corrected_by() == ParametersInUse::kOfCalibration;
  adoption_ = adoption_ != Adoption::kNone && is_done ? Adoption::kDone : Adoption::kNone;
  on_board_.use_parameters(ParametersInUse::kHeld);
}

/// Its residuals contradict the calibration: back to what was known before it.
template <class Estimator>
void Application<Estimator>::withdraw() {
  calibration_residuals_.restart();
  navigation_residuals_.restart();
  if (held_ || adoption_ == Adoption::kNone) {
    return;
  }
  if (adoption_ == Adoption::kDone) {
    detail::count_up(counts_.withdrawals);
  }
  adoption_ = Adoption::kNone;
  on_board_.use_parameters(ParametersInUse::kOfSetUp);
  on_board_.correct_at_next_fix();
  happen(Event::kTakenBack);
}

// ---- Faults

template <class Estimator>
void Application<Estimator>::watch(const StepReport& report) {
  int selected = 0;
  int used = 0;
  for (int k = 0; k < gyros(); ++k) {
    selected += report.gyros[k] != GyroState::kNotSelected ? 1 : 0;
    used += report.gyros[k] == GyroState::kUsed ? 1 : 0;
  }
  const bool can_see = used >= 2 && refused_in_a_row_ < kStandingStill &&
                       now_ - used_t_ <= on_board_.estimator().setup().max_interpolation();
  attitude_t_ = can_see ? now_ : attitude_t_;
  set(Fault::kNoAttitude, !can_see);
  set(Fault::kGyroLost, used >= 2 && used < selected);
  if (!is_looking_at_fixes()) {
    return;
  }
  set(Fault::kStarTrackerLost, now_ - fix_t_ > policy_.star_tracker_timeout);
  const bool is_navigating = on_board_.navigator().started();
  if (is_navigating && has(Fault::kStarTrackerLost) && adoption_ == Adoption::kDone) {
    set(Fault::kAccuracy, to_seconds(now_ - on_board_.corrected_t()) > forecast_.ready_s());
  }
  if (now_ - attitude_t_ > policy_.failed_after) {
    happen(Event::kFailure);
    return;
  }
  change_mode_by_faults();
}

template <class Estimator>
void Application<Estimator>::change_mode_by_faults() {
  if (is_degraded()) {
    happen(Event::kFault);
  } else if (mode_ == Mode::kDegraded) {
    happen(Event::kRecovered);
    if (adoption_ == Adoption::kDone) {
      happen(Event::kAdopted);
    }
  }
}

/// An adopted calibration navigates without the star tracker: its loss is a fault only while there is none.
template <class Estimator>
bool Application<Estimator>::is_degraded() const {
  const bool needs_star_tracker = mode_ != Mode::kNavigating;
  return has(Fault::kNoAttitude) || has(Fault::kGyroLost) || has(Fault::kClockSetBack) || has(Fault::kGap) ||
         has(Fault::kAccuracy) || has(Fault::kGyrosContradict) || has(Fault::kFixesContradict) ||
         (needs_star_tracker && has(Fault::kStarTrackerLost));
}

// ---- What comes out

template <class Estimator>
std::optional<AttitudeSolution> Application<Estimator>::attitude() const {
  if (!on_board_.navigator().started() || has(Fault::kNoAttitude)) {
    return std::nullopt;
  }
  const auto solution = on_board_.navigation_attitude();
  if (!solution) {
    return std::nullopt;
  }
  // A momentum that has moved to the side is off by more than the angle shows.
  constexpr double kOverAngle = 10;
  AttitudeSolution its = solution.value();
  const double off_rad = kOverAngle * angle_off_rad_;
  its.covariance_rad2.diagonal().array() += off_rad * off_rad + fixes_off_rad_ * fixes_off_rad_;
  return its;
}

template <class Estimator>
bool Application<Estimator>::get(CalibrationRecord& record) const {
  const Estimator& estimator = on_board_.estimator();
  const Layout& layout = estimator.layout();
  constexpr int kMost = Estimator::Gyros::capacity();
  static_assert(kMost <= TRIHEDRON_MAX_GYROS && Estimator::kMaxStates == Layout{.gyros = kMost}.size(),
                "the record has room for eq. (1) alone");
  if (!estimator.started() || !on_board_.estimate_is_whole()) {
    return false;
  }
  record = {};
  record.time_ns = on_board_.fix_taken_in().value_or(fix_t_).time_since_epoch().count();
  record.version = TRIHEDRON_TABLES_VERSION;
  record.gyros = static_cast<std::uint32_t>(layout.gyros);
  for (int k = 0; k < layout.gyros; ++k) {
    const auto& gyro = estimator.gyros()[k];
    Eigen::Map<Eigen::Matrix<double, Layout::kEq1, 1>>(record.drift_rad_s[k]) =
        gyro.drift_rad_s.template head<Layout::kEq1>();
    Eigen::Map<Eigen::Vector3d>(record.alignment_rad[k]) = Rot<C, C>::assume(gyro.C_c_b).log().raw();
  }
  constexpr int kStates = Estimator::kMaxStates;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kStates, kStates> root(
      layout.behind_parameters(), estimator.states());
  estimator.error_root(rows_of(root));
  double* element = record.covariance;
  for (int row = layout.drift(0); row < layout.behind_parameters(); ++row) {
    for (int column = layout.drift(0); column <= row; ++column) {
      *element++ = root.row(row).dot(root.row(column));
    }
  }
  return true;
}

template <class Estimator>
Housekeeping Application<Estimator>::housekeeping() const {
  Housekeeping record = counts_;
  record.version = TRIHEDRON_TABLES_VERSION;
  record.time_ns = now_.time_since_epoch().count();
  record.mode = static_cast<std::uint8_t>(mode_);
  record.faults = faults_;
  record.adopted = adoption_ == Adoption::kDone ? 1 : 0;
  record.held = held_ ? 1 : 0;
  record.residual_ratio = calibration_residuals_.mean();
  record.navigation_ratio = navigation_residuals_.mean();
  record.required_error_rad = policy_.required_error_rad;
  record.required_s = to_seconds(policy_.required_interval);
  record.predicted = forecast_.known() ? 1 : 0;
  if (forecast_.known()) {
    record.predicted_error_rad = forecast_.error_rad();
    record.ready_s = forecast_.ready_s();
  }
  const auto states = on_board_.health().states();
  for (int k = 0; k < gyros() && loaded_; ++k) {
    record.gyros[k] = static_cast<std::uint8_t>(states[k]);
  }
  if (on_board_.navigator().started()) {
    record.last_fix_ns = fix_t_.time_since_epoch().count();
    record.corrected_ns = on_board_.corrected_t().time_since_epoch().count();
  }
  if (const auto solution = attitude()) {
    record.attitude_valid = 1;
    const Eigen::Quaterniond q = solution->C_in_c.quaternion();
    for (int i = 0; i < 4; ++i) {
      record.q_in_c[i] = q.coeffs()(i);
    }
    for (int i = 0; i < 3; ++i) {
      record.sigma_rad[i] = std::sqrt(solution->covariance_rad2(i, i));
    }
  }
  return record;
}

// ---- The table of parameters

template <class Estimator>
Answer Application<Estimator>::load(const Parameters& table) {
  if (!next_mode(mode_, Event::kLoadParameters)) {
    return answer(Answer::kNotInThisMode);
  }
  if (table.version != TRIHEDRON_TABLES_VERSION) {
    return answer(Answer::kWrongVersion);
  }
  constexpr int kMost = std::min(TRIHEDRON_MAX_GYROS, Estimator::Gyros::capacity());
  if (table.gyros < 2 || table.gyros > static_cast<std::uint32_t>(kMost)) {
    return answer(Answer::kTooLarge);
  }
  const auto as_int = [](std::uint32_t number) { return static_cast<int>(std::min<std::uint32_t>(number, INT32_MAX)); };
  const int gyros = as_int(table.gyros);
  CalibrationSetup setup;
  setup.layout = {.gyros = gyros};
  setup.gyro_period = Duration(table.gyro_period_ns);
  setup.angles_after = Duration(table.angles_after_ns);
  setup.star_trackers[0].noise_rad = Eigen::Vector3d(table.star_tracker_noise_rad);
  setup.direction_random_walk_rad_sqrt_s = table.direction_random_walk_rad_sqrt_s;
  setup.gate_nis = table.gate_nis;
  setup.reopen_after_rejections = as_int(table.reopen_after_rejections);
  setup.reopen_after_jump_rejections = as_int(table.reopen_after_jump_rejections);
  setup.restart_within_fixes = as_int(table.restart_within_fixes);
  setup.widen_where_correlated = table.widen_where_correlated != 0;
  Gyros prior;
  for (int k = 0; k < gyros; ++k) {
    setup.readout_noise_rad[k] = table.readout_noise_rad[k];
    prior[k].drift_rad_s = Eigen::Map<const Eigen::Matrix<double, Layout::kEq1, 1>>(table.drift_rad_s[k]);
    prior[k].C_c_b = Rot<C, C>::exp(Vec<C>::assume(Eigen::Vector3d(table.alignment_rad[k]))).raw();
  }
  constexpr int kMostParameters = Layout{.gyros = TRIHEDRON_MAX_GYROS}.parameters();
  static_assert(std::size(Parameters{}.covariance) == kMostParameters * (kMostParameters + 1) / 2);
  const int size = setup.layout.parameters();
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostParameters, kMostParameters> covariance(size, size);
  covariance.setZero();
  const double* next = table.covariance;
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column <= row; ++column) {
      covariance(row, column) = *next++;
    }
  }
  const ApplicationPolicy policy{.correction_interval = Duration(table.correction_interval_ns),
                                 .required_error_rad = table.required_error_rad,
                                 .required_interval = Duration(table.required_interval_ns),
                                 .window = Duration(table.window_ns),
                                 .star_tracker_timeout = Duration(table.star_tracker_timeout_ns),
                                 .failed_after = Duration(table.failed_after_ns),
                                 .aligned_after_fixes = as_int(table.aligned_after_fixes),
                                 .spread_over = as_int(table.spread_over)};
  return load(setup, prior, covariance, policy);
}

}  // namespace trihedron
