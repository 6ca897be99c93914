#include "choose/by_pass.hpp"

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>
#include <span>
#include <utility>

#include "choose/noise_search.hpp"
#include "model/scatter.hpp"
#include "model/setup.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;

/// Smallest number of pairs of fixes from which noise is looked for: it is then known to a tenth.
constexpr std::size_t kLeastFixPairs = 100;
/// So many tell the noise of a stretch of the pass to some percent.
constexpr std::size_t kFixPairsOfStretch = 1000;

/// The part that noise of the fixes has in the changes about an axis, in the mean, where it is so many times what they
/// say.
double part_of_fixes(std::span<const ChangeBetweenFixes> changes, int axis, double square) {
  double sum = 0;
  for (const ChangeBetweenFixes& its : changes) {
    const double by_fix = square * its.fix_variance_rad2(axis);
    sum += by_fix / (by_fix + its.readout_variance_rad2(axis));
  }
  return sum / static_cast<double>(changes.size());
}

/// By how much the 1-sigma of the fixes is larger than they say, about one axis, where the noise of the readings is as
/// it says. Needs changes.
double factor_of_fixes(std::span<const ChangeBetweenFixes> changes, int axis) {
  constexpr double kLeast = 1e-4;
  constexpr double kClose = 1e-3;
  constexpr int kMostSteps = 20;  // two to four are usual
  double square = 1;
  for (int step = 0; step < kMostSteps; ++step) {
    std::vector<double> sizes;
    for (const ChangeBetweenFixes& its : changes) {
      const double variance = 2 * (square * its.fix_variance_rad2(axis) + its.readout_variance_rad2(axis));
      sizes.push_back(std::abs(its.change_rad(axis)) / std::sqrt(variance));
    }
    // What the changes scatter too much is of the fixes alone, which have a part in the scatter.
    const double before = square;
    const double more = (std::pow(sigma_without_outliers(sizes), 2) - 1) / part_of_fixes(changes, axis, square);
    square = std::max(square * (1 + more), kLeast);
    if (std::abs(square - before) < kClose * before) {
      break;
    }
  }
  return std::sqrt(square);
}

/// The same of a pass, about all axes. Noise may be more for a part of it: the root mean square over stretches, without
/// outliers, of which no stretch counts as more than three times the median of all.
Eigen::Vector3d factors_of_fixes(std::span<const ChangeBetweenFixes> changes) {
  constexpr double kMost = 3;
  const std::size_t stretches = std::max<std::size_t>(changes.size() / kFixPairsOfStretch, 1);
  Eigen::Vector3d factors;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> of_stretches;
    for (std::size_t n = 0; n < stretches; ++n) {
      const std::size_t begin = n * changes.size() / stretches;
      const std::size_t end = (n + 1) * changes.size() / stretches;
      of_stretches.push_back(factor_of_fixes(changes.subspan(begin, end - begin), axis));
    }
    std::ranges::sort(of_stretches);
    const double most = kMost * of_stretches[of_stretches.size() / 2];
    double square = 0;
    for (const double factor : of_stretches) {
      square += std::pow(std::min(factor, most), 2) / static_cast<double>(stretches);
    }
    factors(axis) = std::sqrt(square);
  }
  return factors;
}

/// The noise of the star tracker that the changes show, where it differs from the settings.
std::optional<Eigen::Vector3d> other_star_tracker_noise(const Pass& pass,
                                                        const std::vector<ChangeBetweenFixes>& changes) {
  const Eigen::Array3d factors = factors_of_fixes(changes);
  // Neighbours share a fix, so that n changes tell the scatter to the root of 3/4n, in which the fixes have a part.
  Eigen::Array3d part;
  for (int axis = 0; axis < 3; ++axis) {
    part(axis) = part_of_fixes(changes, axis, factors(axis) * factors(axis));
  }
  const Eigen::Array3d chance = 3 * std::sqrt(0.75 / static_cast<double>(changes.size())) / part;
  const bool other = ((factors - 1).abs() > (chance * factors).max(kNoiseTolerance)).any();
  return other ? std::optional<Eigen::Vector3d>(pass.settings.star_tracker_noise_rad.array() * factors) : std::nullopt;
}

/// Whether a drift model has all coefficients that the priors of the gyros name.
bool has_what_is_named(const DriftModelId& model, const PassSettings& settings) {
  const std::vector<DriftCoefficient> its = coefficients_of(model);
  const auto has = [&](const auto& named) { return std::ranges::find(its, named.first) != its.end(); };
  return std::ranges::all_of(settings.gyros, [&](const GyroPrior& prior) {
    return std::ranges::all_of(prior.drift_rad_s, has) && std::ranges::all_of(prior.drift_sigma_rad_s, has);
  });
}

/// Log of the odds from which on an error of the star tracker at orbital period is accepted where the pass needs noise
/// for drift that no member of the field has: such drift comes back with the orbit, which no noise does, and looks
/// alike. Of a drift model that was asked for, the states of that error may hold what it does not have.
constexpr double kLogOddsBesideOtherDrift = 10;

/// Log of the odds from which on a state is accepted. A clock that is off costs more where it is left out than where it
/// is estimated for nothing. `other_drift`: whether there is drift that no member of the field has.
double enough_for(FurtherState state, bool other_drift) {
  switch (state) {
    case FurtherState::kClockOffset:
      return 0;
    case FurtherState::kOrbitalError:
      return other_drift ? kLogOddsBesideOtherDrift : kLogOddsToAccept;
    default:
      return kLogOddsToAccept;
  }
}

/// Without an offset the stamps would be right at the very epoch.
void keep_offset_beside_rate(const CalibrationOptions& asked, Decision& decision) {
  constexpr FurtherState kOffset = FurtherState::kClockOffset;
  FurtherStateOptions& states = decision.options.further_states;
  if (states.is_on(FurtherState::kClockRate) && asked.further_states[kOffset] == Choice::kAuto) {
    states[kOffset] = Choice::kOn;
    for (Evidence& evidence : decision.evidence) {
      evidence.accepted = evidence.accepted || evidence.state == kOffset;
    }
  }
}

/// Decides the open choices and the drift model by the evidence of a trial with all states free.
void settle_states(const Trial& everything, const PassSettings& settings, const CalibrationOptions& asked,
                   bool other_drift, Decision& decision) {
  decision.evidence.clear();
  const auto settle = [&](std::optional<FurtherState> state, double log_bayes_factor, double enough) {
    decision.evidence.push_back({state, log_bayes_factor, log_bayes_factor > enough});
    return decision.evidence.back().accepted;
  };
  for (const FurtherStateRow& row : kFurtherStates) {
    if (is_judged_by_trial(row) && asked.further_states[row.state] == Choice::kAuto) {
      const bool on = settle(row.state, everything.log_evidence(row.state).value, enough_for(row.state, other_drift));
      decision.options.further_states[row.state] = on ? Choice::kOn : Choice::kOff;
    }
  }
  keep_offset_beside_rate(asked, decision);
  decision.forecasts = everything.forecasts();
  if (!asked.drift_model) {
    const Forecast* best = best_of(decision.forecasts, settings);
    settle({}, best == nullptr ? 0 : best->log_likelihood - decision.forecasts.front().log_likelihood,
           kLogOddsToAccept);
    decision.options.drift_model = best == nullptr ? kEsg7 : best->drift_model;
  }
}

/// States that were open and are taken as zero.
std::vector<FurtherState> left_out_of(const CalibrationOptions& asked, const CalibrationOptions& decided) {
  std::vector<FurtherState> left_out;
  for (const FurtherStateRow& row : kFurtherStates) {
    if (is_judged_by_trial(row) && asked.further_states[row.state] == Choice::kAuto &&
        !decided.further_states.is_on(row.state)) {
      left_out.push_back(row.state);
    }
  }
  return left_out;
}

std::vector<FurtherState> others_than(FurtherState state, std::vector<FurtherState> states) {
  std::erase(states, state);
  return states;
}

/// Tells what the pass leaves open of the states that are taken as zero.
void tell_what_is_open(const Trial& everything, const CalibrationOptions& asked, Decision& decision) {
  const std::vector<FurtherState> left_out = left_out_of(asked, decision.options);
  for (Evidence& evidence : decision.evidence) {
    if (evidence.state && std::ranges::find(left_out, *evidence.state) != left_out.end()) {
      evidence.open_sigma = everything.sigma(*evidence.state, others_than(*evidence.state, left_out));
    }
  }
}

/// A state that was left out, though there is evidence of it where the others that were left out are zero.
struct Doubt {
  FurtherState state;
  LogEvidence log_evidence;
};

/// The likeliest first. States that look alike in a pass hide one another while all are free.
std::vector<Doubt> doubts_of(const Trial& everything, const CalibrationOptions& asked, bool other_drift,
                             const CalibrationOptions& decided) {
  const std::vector<FurtherState> left_out = left_out_of(asked, decided);
  std::vector<Doubt> doubts;
  for (const FurtherState state : left_out) {
    if (state == FurtherState::kClockRate && asked.further_states[FurtherState::kClockOffset] == Choice::kAuto &&
        !decided.further_states.is_on(FurtherState::kClockOffset)) {
      continue;
    }
    const LogEvidence log_evidence = everything.log_evidence(state, others_than(state, left_out));
    if (log_evidence.value > enough_for(state, other_drift)) {
      doubts.push_back({state, log_evidence});
    }
  }
  std::ranges::stable_sort(doubts, std::ranges::greater{}, [](const Doubt& doubt) { return doubt.log_evidence.value; });
  return doubts;
}

/// The options with every state free that is on or open, and with the largest drift model.
CalibrationOptions with_everything(CalibrationOptions options, const CalibrationOptions& asked,
                                   const DriftModelId& largest_model) {
  for (const FurtherStateRow& row : kFurtherStates) {
    if (is_judged_by_trial(row)) {
      options.further_states[row.state] = asked.further_states[row.state] == Choice::kOff ? Choice::kOff : Choice::kOn;
    }
  }
  options.drift_model = largest_model;
  return options;
}

void use_wandering(const ProcessNoise& noise, CalibrationOptions& options) {
  options.further_states[FurtherState::kWanderingDrift] = Choice::kOn;
  options.further_states.wandering_drift_rad_s = noise.wandering_drift.sigma;
  options.further_states.wandering_time = from_seconds(noise.wandering_drift.time_s);
}

/// Drift that wanders as far over ten minutes as this random walk: walk² t = σ² t². By drift that wanders less a field
/// is fitted to the noise, with members of any size, which takes long.
CalibrationOptions wandering_like(const NoiseFit& walking, CalibrationOptions options) {
  constexpr double kOver_s = 600;
  FurtherStateOptions& states = options.further_states;
  states[FurtherState::kWanderingDrift] = Choice::kOn;
  states.wandering_drift_rad_s = walking.noise.direction_random_walk_rad_sqrt_s / std::sqrt(kOver_s);
  return options;
}

/// Whether a trial has the states of these options.
bool has_states_of(const Trial& trial, const PassSettings& settings, const CalibrationOptions& options) {
  const Layout& its = trial.problem().setup().on_board.layout;
  const Layout wanted = layout_of(settings, options);
  return its.further == wanted.further && its.drift_model == wanted.drift_model;
}

/// Keeps the field that a trial finds, if any, and its members.
void keep_field(const Trial& trial, Decision& decision) {
  decision.field = trial.field_prior();
  if (decision.field) {
    decision.members = trial.calibration(*decision.field);
  }
}

/// Looks for what comes back with the orbit, an error of the star tracker or drift, where that error was found, or what
/// may be such drift: a drift field, or more noise than the settings tell (`more_noise`). `decided`: the trial with
/// what was decided.
void compare_with_drift(const Pass& pass, const Screened& screened, const CalibrationOptions& asked,
                        const Trial& decided, bool more_noise, const Progress& progress, Decision& decision) {
  constexpr FurtherState kError = FurtherState::kOrbitalError;
  if (asked.further_states.is_on(FurtherState::kOrbitalDrift) || asked.further_states.is_on(kError)) {
    return;
  }
  if (!decision.options.further_states.is_on(kError)) {
    const bool is_eq1_alone = decision.field && decision.field->log_evidence <= kLogOddsToAccept;
    if (more_noise || !is_eq1_alone) {
      decision.orbital_odds = orbital_odds(decided);
    }
    return;
  }
  begin_stage(progress, "compares errors and drift at orbital period");
  CalibrationOptions without = decision.options;
  without.further_states[kError] = Choice::kOff;
  decision.orbital_odds = orbital_odds(Trial(pass, screened, without, {}, &decided));
}

/// A trial with all states free, and what was found with it.
struct AllFree {
  Trial trial;
  std::optional<NoiseFit> walking;                      ///< the likeliest random walk, where it was looked for
  std::optional<std::pair<Trial, NoiseFit>> wandering;  ///< with drift that wanders, where that was looked for
};

/// What was decided, and the trial with it.
struct Settled {
  Decision decision;
  Trial last;
  NoiseFit noise;
  bool more_noise = false;  ///< the pass needs more than the settings tell
  std::vector<Doubt> doubts;
};

/// The noise is larger than the settings say, so the states were decided with too small a noise. Decides again, with
/// the noise found while all states are free, and decides whether the drift wanders. Where the largest drift model with
/// its own noise is likelier than what was settled, it is kept: noise in place of the members that the smaller one
/// lacks, which act at every orbit alike, would make its sigmas wrong, though its forecasts are as good.
void decide_again_with_more_noise(const Pass& pass, const Screened& screened, const CalibrationOptions& asked,
                                  const DriftModelId& largest_model, bool wandering_is_open, AllFree& free,
                                  Settled& settled) {
  CalibrationOptions& options = settled.decision.options;
  const NoiseFit walk = settled.noise;
  const CalibrationOptions all_free = with_everything(options, asked, largest_model);
  const bool may_wander = wandering_is_open && (!free.walking || free.walking->gain > kLogOddsToAccept);
  const CalibrationOptions all_free_wandering = wandering_like(walk, all_free);
  // Waited for only where a walk was accepted; otherwise it does not matter whether the trial failed.
  std::packaged_task<std::pair<Trial, NoiseFit>()> try_wandering([&] {
    Trial trial(pass, screened, all_free_wandering, {}, &settled.last);
    const NoiseFit likely = with_most_likely_wandering(trial, all_free_wandering);
    return std::pair(std::move(trial), likely);
  });
  side_by_side(
      [&] {
        if (!free.walking) {
          free.walking = with_most_likely_walk(free.trial, all_free);
        }
      },
      [&] {
        if (may_wander && !free.wandering) {
          try_wandering();
        }
      });
  std::optional<Evidence> wandering;
  if (may_wander && free.walking->gain > kLogOddsToAccept) {
    if (!free.wandering) {
      free.wandering = try_wandering.get_future().get();
    }
    const double gain = free.wandering->second.log_likelihood - free.walking->log_likelihood;
    wandering = Evidence{FurtherState::kWanderingDrift, gain, gain > kLogOddsToAccept};
  }
  const bool wanders = wandering && wandering->accepted;
  const Trial& everything = wanders ? free.wandering->first : free.trial;
  settle_states(everything, pass.settings, asked, asked.drift_field, settled.decision);
  settled.doubts = doubts_of(everything, asked, asked.drift_field, options);
  if (!asked.drift_model && free.walking->log_likelihood > walk.log_likelihood + kLogOddsToAccept) {
    options.drift_model = largest_model;
  }
  if (wanders) {
    const ProcessNoise& noise = free.wandering->second.noise;
    use_wandering(noise, options);
    settled.last = Trial(pass, screened, options, noise, &everything);
    settled.noise = with_most_likely_wandering_near(settled.last, options);
    use_wandering(settled.noise.noise, options);
  } else {
    if (!has_states_of(settled.last, pass.settings, options)) {
      settled.last = Trial(pass, screened, options, free.walking->noise, &everything);
      settled.noise = with_most_likely_walk(settled.last, options);
    }
    use_walk(settled.noise.noise, options);
  }
  if (wandering) {
    settled.decision.evidence.push_back(*wandering);
  }
}

/// A trial by eq. (1) alone, with everything else free.
struct ByEq1 {
  Trial trial;
  /// The random walk that makes the pass most likely, where it is more than the settings say. By less noise than there
  /// is a drift field is fitted to the noise, with members of any size; this is enough beside any field.
  std::optional<ProcessNoise> walk;
};

ByEq1 try_eq1(const Pass& pass, const Screened& screened, const CalibrationOptions& asked) {
  CalibrationOptions options = with_everything(asked, asked, kEsg7);
  options.drift_field = false;
  ByEq1 found{Trial(pass, screened, options), {}};
  if (const NoiseFit walk = with_most_likely_walk(found.trial, options); walk.gain > kLogOddsToAccept) {
    found.walk = walk.noise;
  }
  found.trial.release();
  return found;
}

/// Decides states, drift model and noise, on a pass by which the noise can be found. `undecided`: the options with what
/// is known before.
Settled settle_with_noise(const Pass& pass, const Screened& screened, const CalibrationOptions& undecided,
                          const DriftModelId& largest_model, bool wandering_is_open, AllFree& free,
                          const Progress& progress) {
  Decision decision;
  decision.options = undecided;
  settle_states(free.trial, pass.settings, undecided, false, decision);
  begin_stage(progress, "finds the noise");
  const std::optional<ProcessNoise> noise = free.walking ? std::optional(free.walking->noise) : std::nullopt;
  Trial trial(pass, screened, decision.options, noise, &free.trial);
  const NoiseFit walk = with_most_likely_walk(trial, decision.options);
  Settled settled{std::move(decision), std::move(trial), walk, walk.gain > kLogOddsToAccept, {}};
  if (settled.more_noise) {
    begin_stage(progress, "decides again with more noise");
    decide_again_with_more_noise(pass, screened, undecided, largest_model, wandering_is_open, free, settled);
  } else {
    settled.doubts = doubts_of(free.trial, undecided, false, settled.decision.options);
    use_walk(walk.noise, settled.decision.options);
  }
  settled.decision.log_likelihood = settled.noise.log_likelihood;
  return settled;
}

/// Takes an error at orbital period for none where the pass is not likelier with it than with drift alone, whose
/// spectrum is then found anew: found with that error free, it leaves the drift that the error stands for out, and what
/// it leaves out is evidence of the error.
void look_without_orbital_error(const Pass& pass, const Screened& screened, const CalibrationOptions& undecided,
                                const DriftModelId& largest_model, bool wandering_is_open, const AllFree& free,
                                const Progress& progress, Settled& settled) {
  constexpr FurtherState kError = FurtherState::kOrbitalError;
  constexpr double kBeyondDoubt = 30;
  if (!undecided.drift_field || undecided.further_states[kError] != Choice::kAuto ||
      !settled.decision.options.further_states.is_on(kError)) {
    return;
  }
  const bool wanders = settled.decision.options.further_states.is_on(FurtherState::kWanderingDrift);
  const LogEvidence log_evidence =
      (wanders && free.wandering ? free.wandering->first : free.trial).log_evidence(kError);
  if (log_evidence.value > kBeyondDoubt) {
    return;
  }
  begin_stage(progress, "looks at drift in place of an error at orbital period");
  CalibrationOptions without = undecided;
  without.further_states[kError] = Choice::kOff;
  AllFree others{
      Trial(pass, screened, with_everything(without, without, largest_model), free.trial.problem().setup().noise()),
      {},
      {}};
  Settled other = settle_with_noise(pass, screened, without, largest_model, wandering_is_open, others, progress);
  const double gain = settled.decision.log_likelihood - other.decision.log_likelihood + log_evidence.value -
                      log_evidence.by_prior_as_it_is;
  if (gain > enough_for(kError, settled.more_noise)) {
    return;
  }
  other.decision.evidence.push_back({kError, gain, false});
  settled = std::move(other);
}

/// Settles the states in doubt: one after the other is taken in where the whole pass, with the noise that is then the
/// likeliest, is by so much likelier with it. That likelihood is by the prior as it is: narrower ones add to it what
/// they add to the evidence.
Settled without_doubt(const Pass& pass, const Screened& screened, CalibrationOptions undecided,
                      const DriftModelId& largest_model, bool wandering_is_open, AllFree& free,
                      const Progress& progress) {
  Settled settled = settle_with_noise(pass, screened, undecided, largest_model, wandering_is_open, free, progress);
  std::vector<Evidence> taken_in;
  for (std::size_t i = 0; i < settled.doubts.size();) {
    const auto [state, log_evidence] = settled.doubts[i];
    begin_stage(progress, "looks at what is in doubt");
    CalibrationOptions with = undecided;
    with.further_states[state] = Choice::kOn;
    Settled other = settle_with_noise(pass, screened, with, largest_model, wandering_is_open, free, progress);
    const double gain = other.decision.log_likelihood - settled.decision.log_likelihood + log_evidence.value -
                        log_evidence.by_prior_as_it_is;
    if (gain > enough_for(state, settled.more_noise && undecided.drift_field)) {
      taken_in.push_back({state, gain, true});
      settled = std::move(other);
      undecided = with;
      i = 0;
    } else {
      ++i;
    }
  }
  look_without_orbital_error(pass, screened, undecided, largest_model, wandering_is_open, free, progress, settled);
  settled.decision.evidence.insert(settled.decision.evidence.end(), taken_in.begin(), taken_in.end());
  return settled;
}

}  // namespace

bool is_judged_by_trial(const FurtherStateRow& row) {
  return !row.key.empty() && row.state != FurtherState::kWanderingDrift && row.state != FurtherState::kOrbitalDrift &&
         row.state != FurtherState::kPolhode;
}

const Forecast* best_of(const std::vector<Forecast>& forecasts, const PassSettings& settings) {
  double most = -std::numeric_limits<double>::infinity();
  const Forecast* best = nullptr;
  for (auto forecast = forecasts.rbegin(); forecast != forecasts.rend(); ++forecast) {
    most = std::max(most, forecast->log_likelihood);
    const bool enough = forecast->log_likelihood >= most - kLogOddsToAccept;
    best = enough && has_what_is_named(forecast->drift_model, settings) ? &*forecast : best;
  }
  return best;
}

Decision decide_by_pass(const Pass& pass, const Screened& screened, const CalibrationOptions& asked,
                        const DriftModelId& largest_model, const Progress& progress) {
  Decision decision;
  decision.options = asked;
  CalibrationOptions& options = decision.options;
  const bool wandering_is_open = options.further_states[FurtherState::kWanderingDrift] == Choice::kAuto;
  if (wandering_is_open) {
    options.further_states[FurtherState::kWanderingDrift] = Choice::kOff;
  }
  std::optional<ByEq1> by_eq1;
  std::optional<ProcessNoise> noise;
  if (options.drift_field && asked.find_noise) {
    begin_stage(progress, "decides by eq. (1) alone");
    by_eq1 = try_eq1(pass, screened, options);
    noise = by_eq1->walk;
  }
  begin_stage(progress, "decides what is there");
  AllFree free{
      Trial(pass, screened, with_everything(options, asked, largest_model), noise, by_eq1 ? &by_eq1->trial : nullptr),
      {},
      {}};
  const std::vector<ChangeBetweenFixes> changes = free.trial.changes();
  options.find_noise = asked.find_noise && changes.size() >= kLeastFixPairs;
  if (!options.find_noise) {
    settle_states(free.trial, pass.settings, asked, false, decision);
    tell_what_is_open(free.trial, asked, decision);
    decision.use(moves_over(free.trial));
    decision.nearby = free.trial.nearby();
    if (options.drift_field) {
      keep_field(Trial(pass, screened, options, noise, &free.trial), decision);
    }
    return decision;
  }
  if (!asked.star_tracker_noise_rad) {
    options.star_tracker_noise_rad = other_star_tracker_noise(pass, changes);
    if (options.star_tracker_noise_rad) {
      free.trial = Trial(pass, screened, with_everything(options, asked, largest_model), noise, &free.trial);
    }
  }
  if (noise) {
    free.walking = with_most_likely_walk(free.trial, with_everything(options, asked, largest_model));
  }
  Settled settled = without_doubt(pass, screened, options, largest_model, wandering_is_open, free, progress);
  const bool wanders = settled.decision.options.further_states.is_on(FurtherState::kWanderingDrift);
  tell_what_is_open(wanders && free.wandering ? free.wandering->first : free.trial, options, settled.decision);
  Moves moves;
  side_by_side(
      [&] {
        keep_field(settled.last, settled.decision);
        settled.decision.nearby = settled.last.nearby();
        compare_with_drift(pass, screened, asked, settled.last, settled.more_noise, progress, settled.decision);
      },
      [&] { moves = moves_over(settled.last); });
  settled.decision.use(std::move(moves));
  return std::move(settled.decision);
}

}  // namespace trihedron::ground
