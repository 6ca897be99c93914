#include "choose/decide.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "batch/left_out_walk.hpp"
#include "choose/by_pass.hpp"
#include "choose/course.hpp"
#include "choose/open_choices.hpp"
#include "model/drift_on_board.hpp"
#include "model/orbital_rate.hpp"
#include "model/prior.hpp"
#include "model/setup.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;

/// The largest drift model that is tried at first.
DriftModelId largest_to_compare(const CalibrationOptions& asked) {
  constexpr int kFirstDegree = 2;
  if (asked.estimator != Estimator::kBatch || asked.drift_model == kEsg20) {
    return asked.drift_model.value_or(kEsg20);
  }
  const bool is_vsh = asked.drift_model && asked.drift_model->family == DriftModelId::Family::kVsh;
  return vsh(is_vsh ? std::max(int{asked.drift_model->degree}, kFirstDegree) : kFirstDegree);
}

/// The model of one degree more, where there is one.
std::optional<DriftModelId> larger_model(const DriftModelId& model) {
  const bool is_there = model.family == DriftModelId::Family::kVsh && model.degree < DriftModelId::kMaxDegreeOnBoard;
  return is_there ? std::optional(vsh(model.degree + 1)) : std::nullopt;
}

/// Whether what is decided may be what the pass is screened with: eq. (1) without further states.
bool may_be_screened_with(const CalibrationOptions& asked) {
  return (asked.drift_field || !asked.drift_model || asked.drift_model == kEsg7) &&
         std::ranges::none_of(kFurtherStates,
                              [&](const FurtherStateRow& row) { return asked.further_states.is_on(row.state); });
}

/// Drift as a field against eq. (1), each with states and noise as the pass decides with it; but for the noise of the
/// star tracker, without which likelihoods cannot be compared. Nothing that comes back is looked for beside the field.
AgainstField against_field(const Pass& pass, const Screened& screened, CalibrationOptions asked, const Decision& by_eq1,
                           const Progress& progress) {
  for (const FurtherState state : {FurtherState::kOrbitalDrift, FurtherState::kPolhode}) {
    Choice& choice = asked.further_states[state];
    choice = choice == Choice::kAuto ? Choice::kOff : choice;
  }
  asked.star_tracker_noise_rad = by_eq1.options.star_tracker_noise_rad.value_or(pass.settings.star_tracker_noise_rad);
  asked.drift_field = true;
  asked.drift_model = kLargestDriftModel;
  asked.estimator = Estimator::kBatch;
  const Decision by_field = decide_by_pass(pass, screened, asked, kLargestDriftModel, progress);
  AgainstField found{by_field.log_likelihood - by_eq1.log_likelihood, {}};
  for (const FurtherStateRow& row : kFurtherStates) {
    // A clock offset is estimated for little: that it is not needed says nothing.
    const bool is_weak = std::ranges::any_of(by_eq1.evidence, [&](const Evidence& evidence) {
      return evidence.state == row.state && evidence.log_bayes_factor <= kLogOddsToAccept;
    });
    if (!is_weak && by_eq1.options.further_states.is_on(row.state) &&
        !by_field.options.further_states.is_on(row.state)) {
      found.instead.push_back(row.state);
    }
  }
  return found;
}

/// What was decided with a drift field, for an estimator that has a drift model in its place.
Decision for_on_board(Decision decided, const Pass& pass, const Screened& screened) {
  const double log_evidence = decided.field->log_evidence;
  const bool is_evident = log_evidence > kLogOddsToAccept;
  decided.evidence.push_back({{}, log_evidence, is_evident});
  // Without evidence the coefficients of eq. (1) and the alignments make up for what there may be of it all the same,
  // and are off by as much: that is in their covariance.
  const DriftOnBoard drift = is_evident ? drift_on_board(decided.field->members) : DriftOnBoard{kEsg7, 0};
  decided.settings = pass.settings;
  decided.options.drift_field = false;
  decided.options.drift_model = drift.drift_model;
  MeanSquares members = decided.field->members;
  const LeftOut left_out(*decided.members, drift.drift_model);
  if (is_evident) {
    add_made_up(left_out, *decided.members, members);
    decided.left_out_walk_rad_sqrt_s = left_out_walk_rad_sqrt_s(left_out, *decided.members, screened.pass);
  }
  decided.left_out = left_out;
  decided.levels = std::move(decided.field->levels);
  use(members, drift.drift_model, *decided.settings);
  decided.members.reset();
  decided.field.reset();
  return decided;
}

/// What there is to decide, once the estimator, the orbit and what is known before the pass have had their say.
struct OpenDecision {
  CalibrationOptions asked;
  bool change_is_open = false;
  bool by_field = false;
  /// Where nothing is left to be decided by the pass.
  std::optional<Decision> settled;

  /// What the pass is screened with.
  [[nodiscard]] CalibrationOptions screening_options() const {
    CalibrationOptions options = asked;
    options.find_noise = false;
    return options;
  }
};

OpenDecision open_decision(const Pass& pass, const CalibrationOptions& asked_for) {
  OpenDecision its{asked_for, false, false, {}};
  CalibrationOptions& asked = its.asked;
  if (pass.gyro.gyros < static_cast<int>(pass.settings.gyros.size())) {
    throw SetupError(fmt::format("the telemetry has {} gyros; the settings speak of {}", pass.gyro.gyros,
                                 pass.settings.gyros.size()),
                     "give the telemetry of all of them, or the settings of those that there are");
  }
  if (!asked.orbital_rate_rad_s) {
    const std::optional<double> shown = shown_orbital_rate_rad_s(pass.star_tracker);
    asked.orbital_rate_rad_s = shown ? *shown : first_orbital_rate_rad_s(pass.settings);
  }
  its.change_is_open = asked.further_states[FurtherState::kCoefficientChange] == Choice::kAuto;
  settle_by_estimator(asked);
  if (pass.settings.prior || asked.estimator == Estimator::kPaper) {
    its.settled.emplace().options = settled_before(pass.settings, asked);
    return its;
  }
  its.by_field = !asked.drift_model && !knows_of_drift_outside(pass.settings);
  if (its.by_field) {
    asked.drift_field = true;
    asked.drift_model = kLargestDriftModel;
    asked.estimator = Estimator::kBatch;
  }
  const bool states_are_settled =
      asked.drift_model && std::ranges::none_of(kFurtherStates, [&](const FurtherStateRow& row) {
        return is_judged_by_trial(row) && asked.further_states[row.state] == Choice::kAuto;
      });
  if (states_are_settled && !asked.find_noise && !asked.drift_field) {
    its.settled.emplace().options = its.screening_options();
    leave_out_what_is_open(its.settled->options);
  }
  return its;
}

Screened screened_for(const Pass& pass, const OpenDecision& open) {
  return screen(pass, open.screening_options(), may_be_screened_with(open.asked));
}

}  // namespace

std::optional<Screened> screened_to_decide(const Pass& pass, const CalibrationOptions& asked) {
  const OpenDecision open = open_decision(pass, asked);
  return open.settled ? std::nullopt : std::optional(screened_for(pass, open));
}

Decision decide(const Pass& pass, const CalibrationOptions& asked_for, const Progress& progress,
                std::optional<Screened> screened_ahead) {
  OpenDecision open = open_decision(pass, asked_for);
  if (open.settled) {
    return *std::move(open.settled);
  }
  const CalibrationOptions& asked = open.asked;
  begin_stage(progress, "screens the samples");
  Screened screened = screened_ahead ? *std::move(screened_ahead) : screened_for(pass, open);
  std::optional<OnBoardRun> run = std::exchange(screened.run, std::nullopt);
  if (screened.pass.fixes.empty()) {
    Decision decision;
    CalibrationOptions& options = decision.options;
    options = open.screening_options();
    options.estimator = asked_for.estimator;
    options.drift_field = asked_for.drift_field;
    options.drift_model = asked_for.drift_model;
    leave_out_what_is_open(options);
    return decision;
  }
  if (open.by_field && asked_for.estimator != Estimator::kBatch) {
    Decision decided = for_on_board(
        decide_with_course(pass, screened, asked, kLargestDriftModel, open.change_is_open, progress), pass, screened);
    decided.options.estimator = asked_for.estimator;
    decided.run = std::move(run);
    return decided;
  }
  DriftModelId largest_model = largest_to_compare(asked);
  for (;;) {
    Decision decided = decide_with_course(pass, screened, asked, largest_model, open.change_is_open, progress);
    const std::optional<DriftModelId> larger = larger_model(largest_model);
    // There are no forecasts where the pass is too short.
    if (!larger || decided.forecasts.empty() ||
        best_of(decided.forecasts, pass.settings) != &decided.forecasts.back()) {
      if (asked_for.drift_model == kEsg7 && decided.options.find_noise) {
        begin_stage(progress, "compares the drift model");
        decided.against_field = against_field(pass, screened, asked, decided, progress);
      }
      if (pass.settings.gyros.size() == 2) {  // which of more gyros is at fault is judged by the noise found
        decided.screened = std::move(screened);
      }
      decided.run = std::move(run);
      return decided;
    }
    largest_model = *larger;
  }
}

}  // namespace trihedron::ground
