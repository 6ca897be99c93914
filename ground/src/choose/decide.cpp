#include "choose/decide.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <future>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "batch/left_out_walk.hpp"
#include "choose/noise_search.hpp"
#include "model/drift_on_board.hpp"
#include "model/orbital_rate.hpp"
#include "model/prior.hpp"
#include "model/scatter.hpp"
#include "model/setup.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;

/// Whether a trial with everything shows the evidence of a state: of those that are a choice all but the wandering
/// drift, which the search for the noise decides, the drift at orbital period, which looks like an error of the star
/// tracker and is compared with it, and the polhodes, whose periods have to be found first.
bool is_judged_by_trial(const FurtherStateRow& row) {
  return !row.key.empty() && row.state != FurtherState::kWanderingDrift && row.state != FurtherState::kOrbitalDrift &&
         row.state != FurtherState::kPolhode;
}

/// Smallest number of pairs of fixes from which noise is looked for: it is then known to a tenth.
constexpr std::size_t kLeastFixPairs = 100;
/// So many tell the noise of a stretch of the pass to some percent.
constexpr std::size_t kFixPairsOfStretch = 1000;

/// 1-sigma of the star tracker by the changes of a trial, in the order of their times. Needs changes. Noise may be more
/// for a part of the pass: the root mean square over stretches, without outliers, of which no stretch counts as more
/// than three times the median of all.
Eigen::Vector3d star_tracker_noise_rad(const std::vector<Eigen::Vector3d>& changes_rad) {
  constexpr double kMost = 3;
  const std::size_t stretches = std::max<std::size_t>(changes_rad.size() / kFixPairsOfStretch, 1);
  Eigen::Vector3d noise_rad;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> sigmas;
    for (std::size_t n = 0; n < stretches; ++n) {
      std::vector<double> sizes;
      for (std::size_t i = n * changes_rad.size() / stretches; i < (n + 1) * changes_rad.size() / stretches; ++i) {
        sizes.push_back(std::abs(changes_rad[i](axis)) / std::numbers::sqrt2);
      }
      sigmas.push_back(sigma_without_outliers(sizes));
    }
    std::ranges::sort(sigmas);
    const double most = kMost * sigmas[sigmas.size() / 2];
    double square = 0;
    for (const double sigma : sigmas) {
      square += std::pow(std::min(sigma, most), 2) / static_cast<double>(stretches);
    }
    noise_rad(axis) = std::sqrt(square);
  }
  return noise_rad;
}

/// The noise of the star tracker that the changes show, where it differs from the settings.
std::optional<Eigen::Vector3d> other_star_tracker_noise(const Pass& pass,
                                                        const std::vector<Eigen::Vector3d>& changes_rad) {
  const Eigen::Vector3d& given = pass.settings.star_tracker_noise_rad;
  const Eigen::Vector3d found = star_tracker_noise_rad(changes_rad);
  // Neighbours share a fix, so that n changes tell a sigma to the root of 3/4n.
  const double chance = 3 * std::sqrt(0.75 / static_cast<double>(changes_rad.size()));
  const bool other = ((found - given).array().abs() > std::max(kNoiseTolerance, chance) * given.array()).any();
  return other ? std::optional(found) : std::nullopt;
}

/// Takes the noise that an earlier calibration used, but not less than the settings say.
void use_noise(const CalibrationNoise& noise, CalibrationOptions& options) {
  options.direction_random_walk_rad_sqrt_s =
      std::max(options.direction_random_walk_rad_sqrt_s, noise.direction_random_walk_rad_sqrt_s);
  options.star_tracker_noise_rad = noise.star_tracker_noise_rad;
  FurtherStateOptions& states = options.further_states;
  if (noise.wandering_drift_rad_s > 0 && states[FurtherState::kWanderingDrift] == Choice::kAuto) {
    states[FurtherState::kWanderingDrift] = Choice::kOn;
    states.wandering_drift_rad_s = noise.wandering_drift_rad_s;
    states.wandering_time = from_seconds(noise.wandering_time_s);
  }
}

/// Settles open choices as the prior calibration has them.
CalibrationOptions as_before(CalibrationOptions options, const Calibration& prior, Time epoch) {
  for (const FurtherStateRow& row : kFurtherStates) {
    // How the coefficients changed over an earlier pass says nothing of this one.
    const bool lasts = row.state != FurtherState::kCoefficientChange;
    const bool on = lasts && std::ranges::any_of(prior.further, [&](const FurtherEstimate& estimate) {
                      return estimate.parameter.is_further(row.state);
                    });
    if (Choice& choice = options.further_states[row.state]; choice == Choice::kAuto) {
      choice = on ? Choice::kOn : Choice::kOff;
    }
  }
  // Amplitudes of drift hold for the rate that they were found with. Of an error of the star tracker none are kept, and
  // the pass tells the rate better.
  if (const auto& drift = prior.gyros.at(0).orbital_drift) {
    options.orbital_rate_rad_s = drift->rate_rad_s;
  }
  for (std::size_t k = 0; k < prior.gyros.size(); ++k) {
    if (const auto& drift = prior.gyros[k].polhode) {
      options.further_states.polhodes[static_cast<int>(k)] = drift->from(epoch).polhode;
    }
  }
  return options;
}

/// Whether an estimator on board has no room for the drift model of a calibration: a drift field.
bool has_field(const Calibration& calibration) {
  const DriftModelId& model = calibration.gyros.at(0).drift_model;
  return model.family == DriftModelId::Family::kVsh && model.degree > DriftModelId::kMaxDegreeOnBoard;
}

/// Throws SetupError where the earlier calibration is of other gyros, or has drift that the estimator has not: another
/// model, or drift at orbital period for estimator paper. Of one with a drift field a smaller model takes a part.
void refuse_prior_of_others(const PassSettings& settings, const CalibrationOptions& asked) {
  const std::optional<Calibration>& prior = settings.prior;
  if (!prior) {
    return;
  }
  if (prior->gyros.size() != settings.gyros.size()) {
    throw SetupError(fmt::format("the earlier calibration has {} gyros; the pass has {}", prior->gyros.size(),
                                 settings.gyros.size()),
                     "use a calibration of these gyros");
  }
  for (std::size_t k = 0; k < prior->gyros.size(); ++k) {
    const GyroCalibration& gyro = prior->gyros[k];
    const bool contains =
        asked.drift_model && has_field(*prior) && asked.drift_model->family != DriftModelId::Family::kEsg20;
    if (asked.drift_model && gyro.drift_model != *asked.drift_model && !contains) {
      throw SetupError(fmt::format("the earlier calibration of gyro {} is of drift model '{}', not {}", k + 1,
                                   name_of(gyro.drift_model), name_of(*asked.drift_model)),
                       "use a calibration made with the same drift model");
    }
    refuse_incomplete(gyro);
    if (asked.estimator == Estimator::kPaper && (gyro.orbital_drift || gyro.polhode)) {
      throw SetupError(
          fmt::format("the earlier calibration of gyro {} has drift that comes back; estimator paper has none", k + 1),
          "use estimator invariant, or an earlier calibration with orbital_drift and polhode off");
    }
  }
}

/// Whether a drift model has all coefficients that the priors of the gyros name.
bool has_what_is_named(const DriftModelId& model, const PassSettings& settings) {
  const std::vector<DriftCoefficient> its = coefficients_of(model);
  const auto has = [&](const auto& named) { return std::ranges::find(its, named.first) != its.end(); };
  return std::ranges::all_of(settings.gyros, [&](const GyroPrior& prior) {
    return std::ranges::all_of(prior.drift_rad_s, has) && std::ranges::all_of(prior.drift_sigma_rad_s, has);
  });
}

/// The smallest model with what the settings name such that no larger one is more likely by kLogOddsToAccept; nullptr
/// of an empty list.
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

/// Log of the odds from which on an error of the star tracker at orbital period is accepted where the pass needs noise
/// for drift that no member of the field has: such drift comes back with the orbit, which no noise does, and looks
/// alike. Of a drift model that was asked for, the states of that error may hold what it does not have.
constexpr double kLogOddsBesideOtherDrift = 10;

/// ln of the odds of the polhodes of all rotors together from which on they are tried.
constexpr double kLogOddsOfPolhode = 10;

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

void use_walk(const ProcessNoise& noise, CalibrationOptions& options) {
  options.direction_random_walk_rad_sqrt_s = noise.direction_random_walk_rad_sqrt_s;
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

/// There are no usable fixes to decide by: what is open is off.
void leave_out_what_is_open(CalibrationOptions& options) {
  for (const FurtherStateRow& row : kFurtherStates) {
    Choice& choice = options.further_states[row.state];
    choice = choice == Choice::kAuto ? Choice::kOff : choice;
  }
  options.drift_model = options.drift_model.value_or(kEsg7);
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
  settled.decision.evidence.insert(settled.decision.evidence.end(), taken_in.begin(), taken_in.end());
  return settled;
}

/// Decides by the data of the pass.
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
  const std::vector<Eigen::Vector3d> changes = free.trial.changes_rad();
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
  keep_field(settled.last, settled.decision);
  settled.decision.nearby = settled.last.nearby();
  settled.decision.use(moves_over(settled.last));
  compare_with_drift(pass, screened, asked, settled.last, settled.more_noise, progress, settled.decision);
  return std::move(settled.decision);
}

/// A course by which the coefficients are found to change.
struct FoundCourse {
  CourseOfChange::Kind kind;
  double time_s;           ///< an even change has none
  double least_s, most_s;  ///< between which the time is
};

/// Of what moves most likely, where it is a change of the coefficients that has a course.
std::optional<FoundCourse> course_of(const std::vector<Change>& changes, Time epoch) {
  if (changes.empty() || !changes.front().is_found() || changes.front().moving != Moving::kCoefficients) {
    return std::nullopt;
  }
  const Change& change = changes.front();
  if (change.motion == Motion::kDecay) {
    const double decay_s = to_seconds(change.decay);
    return FoundCourse{CourseOfChange::Kind::kWarmUp, decay_s, decay_s / 2, decay_s * 2};
  }
  if (change.motion == Motion::kStep) {
    const double from_s = to_seconds(change.from - epoch);
    const double until_s = to_seconds(change.until - epoch);
    return FoundCourse{CourseOfChange::Kind::kJump, (from_s + until_s) / 2, from_s, until_s};
  }
  if (change.motion == Motion::kRamp) {
    return FoundCourse{CourseOfChange::Kind::kEven, 0, 0, 0};
  }
  return std::nullopt;
}

void use_course(CourseOfChange::Kind kind, double time_s, CalibrationOptions& options) {
  options.further_states[FurtherState::kCoefficientChange] = Choice::kOn;
  options.further_states.change_course = kind;
  if (kind != CourseOfChange::Kind::kEven) {
    options.further_states.change_time = from_seconds(time_s);
  }
}

/// From the middle of three places a step apart to the largest value, by a parabola; two steps at most.
double towards_vertex(double before, double here, double after) {
  const double bend = 2 * here - before - after;
  return bend > 0 ? std::clamp((after - before) / (2 * bend), -2.0, 2.0) : after > before ? 1 : -1;
}

/// The time of a course that makes the pass most likely, with the random walk that is then likeliest.
struct LikelyCourse {
  double time_s;
  double sigma_s;  ///< of the time; before it is known, how far it may be from the likeliest
  double walk_rad_sqrt_s;
};

/// Looks for it with these options but for the noise, from a first one on: again and again the vertex of a parabola
/// through three times a sigma apart. What noise was found without the course stands for a part of it, and goes as the
/// time is told better. A random walk is enough for that.
LikelyCourse most_likely_course(const Pass& pass, const Screened& screened, CalibrationOptions options,
                                const FoundCourse& course, LikelyCourse likely) {
  constexpr int kMostRounds = 12;
  constexpr double kEnough = 0.005;  // ln, a tenth of a sigma of the time, whose uncertainty is in no other sigma
  constexpr double kAtOnce = 4;      // times as large a step where the vertex is far, as small where it is no better
  const double least_walk = options.direction_random_walk_rad_sqrt_s;
  options.direction_random_walk_rad_sqrt_s = likely.walk_rad_sqrt_s;
  options.further_states[FurtherState::kWanderingDrift] = Choice::kOff;
  std::optional<Trial> last;
  const auto fit = [&](double at_s) {
    use_course(course.kind, at_s, options);
    if (last) {
      last->release();
    }
    Trial trial(pass, screened, options, {}, last ? &*last : nullptr);
    last.emplace(std::move(trial));
    return last->log_likelihood();
  };
  const auto within = [&](double at_s) { return std::clamp(at_s, course.least_s, course.most_s); };
  fit(likely.time_s);
  for (int round = 0; round < kMostRounds; ++round) {
    const double walk_before = likely.walk_rad_sqrt_s;
    options.direction_random_walk_rad_sqrt_s = least_walk;
    const NoiseFit walk =
        round == 0 ? with_most_likely_walk(*last, options) : with_most_likely_walk_near(*last, options);
    use_walk(walk.noise, options);
    likely.walk_rad_sqrt_s = options.direction_random_walk_rad_sqrt_s;
    const bool other_noise = std::abs(likely.walk_rad_sqrt_s - walk_before) > kNoiseTolerance * walk_before;
    const double step_s = likely.sigma_s;
    const double here = last->log_likelihood();
    const double before = fit(within(likely.time_s - step_s));
    const double after = fit(within(likely.time_s + step_s));
    const double bend = 2 * here - before - after;  // one, of a step of a sigma
    const double by = towards_vertex(before, here, after);
    const double vertex_s = within(likely.time_s + by * step_s);
    const bool is_better = fit(vertex_s) > here;
    if (is_better) {
      likely.time_s = vertex_s;
      likely.sigma_s *= bend > 0 ? std::clamp(1 / std::sqrt(bend), 1 / kAtOnce, kAtOnce) : kAtOnce;
    } else {
      likely.sigma_s /= kAtOnce;
      fit(likely.time_s);
    }
    const double expected_gain = by * ((after - before) - by * bend) / 2;
    if (expected_gain < kEnough && !other_noise) {
      break;
    }
  }
  return likely;
}

/// The same from what moves on. By eq. (1) alone it takes a fraction of the work, so that a field has only the rest of
/// the way to go.
double most_likely_time_s(const Pass& pass, const Screened& screened, const CalibrationOptions& options,
                          const FoundCourse& course) {
  LikelyCourse likely{course.time_s, (course.most_s - course.least_s) / 4, options.direction_random_walk_rad_sqrt_s};
  if (options.drift_field) {
    CalibrationOptions by_eq1 = options;
    by_eq1.drift_field = false;
    by_eq1.drift_model = kEsg7;
    likely = most_likely_course(pass, screened, by_eq1, course, likely);
  }
  return most_likely_course(pass, screened, options, course, likely).time_s;
}

/// Drift at this period looks like aberration as well.
Decision without_aberration(Decision decision) {
  std::erase_if(decision.changes, [](const Change& change) { return change.moving == Moving::kAberration; });
  return decision;
}

/// Whether what noise there is beside drift that comes back is a tenth of it at most. Drift of another kind comes back
/// too, but not as a sine: it leaves noise of its own size, and coefficients told from it would be too sure.
bool is_all_that_is_left(const Decision& by_drift) {
  constexpr double kMost = 0.1;
  const CalibrationOptions& options = by_drift.options;
  const Layout& layout = by_drift.nearby->layout;
  double square = 0;
  for (int k = 0; k < layout.gyros; ++k) {
    square += by_drift.nearby->solution.gyros[k]
                  .drift_rad_s.segment(layout.orbital_column(), layout.drift_columns() - layout.orbital_column())
                  .squaredNorm();
  }
  const double drift_rad_s = std::sqrt(square / layout.amplitudes_size());
  // A random walk as drift that wanders for as long as the phase takes for a radian.
  const double walk_rad_s =
      options.direction_random_walk_rad_sqrt_s * std::sqrt(std::abs(*options.orbital_rate_rad_s) / 2);
  const bool wanders = options.further_states.is_on(FurtherState::kWanderingDrift);
  return std::max(walk_rad_s, wanders ? options.further_states.wandering_drift_rad_s : 0) < kMost * drift_rad_s;
}

/// Eq. (1) in place of a field, with the least noise: the field, and noise, have taken a part of what comes back.
CalibrationOptions by_eq1(const CalibrationOptions& asked, CalibrationOptions with_field) {
  with_field.drift_field = false;
  with_field.drift_model = kEsg7;
  with_field.direction_random_walk_rad_sqrt_s = asked.direction_random_walk_rad_sqrt_s;
  with_field.further_states[FurtherState::kWanderingDrift] = Choice::kOff;
  return with_field;
}

struct ByEq1InsteadOfField {
  double log_likelihood;
  OrbitalOdds odds;  ///< where the error was found it is there, and those of drift are beside it
  OddsOfErrors of_errors;
};

/// Where a decision has a field.
std::optional<ByEq1InsteadOfField> by_eq1_instead_of_field(const Pass& pass, const Screened& screened,
                                                           const CalibrationOptions& asked, const Decision& decision) {
  if (!decision.field || !(decision.field->log_evidence > kLogOddsToAccept)) {
    return std::nullopt;
  }
  const Trial trial(pass, screened, by_eq1(asked, decision.options));
  return ByEq1InsteadOfField{trial.log_likelihood(), orbital_odds(trial), odds_of_errors(trial)};
}

/// ln of the odds of the field of a decision, of each gyro for itself, against none by what no error of the star
/// tracker moves, the angle between the momenta: fixes of a hundred times their noise say next to nothing of the
/// attitude.
double field_by_angle(const Pass& pass, const Screened& screened, const Decision& decision) {
  constexpr double kBlind = 100;
  CalibrationOptions options = decision.options;
  options.star_tracker_noise_rad =
      kBlind * options.star_tracker_noise_rad.value_or(pass.settings.star_tracker_noise_rad);
  return Trial(pass, screened, options).log_odds_of_field(decision.field->sigma_rad_s);
}

/// Where a good part of what a field explains is explained by an error of the star tracker as well.
std::optional<FieldOrError> field_or_error(const Pass& pass, const Screened& screened, const CalibrationOptions& asked,
                                           const Decision& decision,
                                           const std::optional<ByEq1InsteadOfField>& instead) {
  constexpr double kGoodPart = 0.3;
  if (!instead || asked.further_states[FurtherState::kOrbitalError] == Choice::kOff) {
    return std::nullopt;
  }
  const double by_field = decision.log_likelihood - instead->log_likelihood;
  if (instead->of_errors.with_orbit < kGoodPart * by_field) {
    return std::nullopt;
  }
  return FieldOrError{by_field, instead->of_errors.with_orbit, field_by_angle(pass, screened, decision)};
}

/// What the odds say of an error of the star tracker and of drift at orbital period.
class AtOrbit {
 public:
  /// Of a decision with odds. `instead`: where it has a field.
  AtOrbit(const Decision& decision, const std::optional<ByEq1InsteadOfField>& instead)
      : odds_(*decision.orbital_odds),
        drift_odds_(odds_.drift),
        both_odds_(odds_.both),
        has_field_(instead.has_value()),
        has_error_(decision.options.further_states.is_on(FurtherState::kOrbitalError)) {
    if (!instead) {
      return;
    }
    const double less = instead->log_likelihood - decision.log_likelihood;
    both_odds_ = has_error_ ? instead->odds.drift : instead->odds.both;
    both_over_field_ = less + log_odds(both_odds_);
    if (!has_error_) {
      drift_odds_ = instead->odds.drift;
      drift_over_field_ = less + log_odds(drift_odds_);
    }
    const double aberration = instead->of_errors.aberration - kUnusual;
    if (const double error_odds = has_error_ ? aberration : std::max(log_odds(instead->odds.error), aberration);
        error_odds > kLogOddsToAccept) {
      error_over_field_ = less + error_odds;
    }
  }

  [[nodiscard]] bool has_error() const { return has_error_; }
  /// Where a field was found, and eq. (1) alone would show an error of the star tracker in its place, at orbital period
  /// or by aberration: ln of the likelihood by eq. (1) with the error less that of the field.
  [[nodiscard]] std::optional<double> error_over_field() const { return error_over_field_; }
  [[nodiscard]] double error_over_drift() const { return log_odds(odds_.error) - log_odds(odds_.drift); }
  [[nodiscard]] bool may_be_drift() const {
    constexpr double kMayBeDrift = 20;
    return (odds_.drift.by_prior_as_it_is > kMayBeThere && error_over_drift() < kMayBeDrift) ||
           drift_over_field_ > kMayBeThere;
  }
  /// `has_one`: one of them was found.
  [[nodiscard]] bool may_be_both(bool has_one) const {
    const double over_one =
        odds_.both.by_prior_as_it_is - std::max(odds_.error.by_prior_as_it_is, odds_.drift.by_prior_as_it_is);
    return (has_one && over_one > kMayBeThere) || both_over_field_ > std::max(drift_over_field_, kMayBeThere);
  }
  /// By how much more than their likelihoods, which are by the priors as they are, drift or both are likelier than what
  /// was decided.
  [[nodiscard]] double more_for_drift() const { return by_narrower(drift_odds_) - of_decided(); }
  [[nodiscard]] double more_for_both() const { return by_narrower(both_odds_) - of_decided(); }

 private:
  /// Members of the field, or noise, that were found without what comes back have taken a part of it: its odds are
  /// larger than these.
  static constexpr double kMayBeThere = -10;
  /// ln of the odds before any pass for drift outside eq. (1), which all rotors have, against aberration that nobody
  /// corrects.
  static constexpr double kUnusual = 5;

  /// Drift that all gyros have alike, as an error of the star tracker looks, is not to be expected by eq. (1) alone.
  /// Beside other drift it is, and of any size.
  [[nodiscard]] double log_odds(const LogEvidence& of) const { return has_field_ ? of.value : of.by_prior_as_it_is; }
  [[nodiscard]] double by_narrower(const LogEvidence& of) const { return log_odds(of) - of.by_prior_as_it_is; }
  [[nodiscard]] double of_decided() const { return has_error_ ? by_narrower(odds_.error) : 0; }

  OrbitalOdds odds_;
  LogEvidence drift_odds_;
  LogEvidence both_odds_;
  bool has_field_;
  bool has_error_;
  /// ln of the likelihood by eq. (1) with drift, or both, less that of the field.
  double drift_over_field_ = -std::numeric_limits<double>::infinity();
  double both_over_field_ = -std::numeric_limits<double>::infinity();
  std::optional<double> error_over_field_;
};

/// What is decided with drift at orbital period.
struct WithDrift {
  CalibrationOptions options;  ///< what was asked for, with it
  Decision decision;
  double gain;  ///< of the logarithm of the likelihood
  bool counts;

  [[nodiscard]] Decision take(CalibrationOptions& asked) && {
    asked = std::move(options);
    return without_aberration(std::move(decision));
  }
};

/// `gain`: beside that of the likelihood; `at_least`: for which it counts.
WithDrift with_orbital_drift(const Pass& pass, const Screened& screened, CalibrationOptions options,
                             const DriftModelId& largest_model, const Progress& progress, double gain,
                             double at_least) {
  begin_stage(progress, "looks for drift at orbital period");
  options.further_states[FurtherState::kOrbitalDrift] = Choice::kOn;
  Decision decision = decide_by_pass(pass, screened, options, largest_model, progress);
  gain += decision.log_likelihood;
  const bool counts = gain > at_least && is_all_that_is_left(decision);
  return {std::move(options), std::move(decision), gain, counts};
}

/// Decides by the data of the pass, and whether there is drift at orbital period: once more with it where there may be,
/// in place of an error of the star tracker and beside one. Then `asked` has it as well. Where it is not all that is
/// there, but likelier than an error of the star tracker, there is no such error, and a field and noise stand for the
/// drift.
Decision decide_on_orbital_drift(const Pass& pass, const Screened& screened, CalibrationOptions& asked,
                                 const DriftModelId& largest_model, const Progress& progress) {
  constexpr FurtherState kError = FurtherState::kOrbitalError;
  constexpr FurtherState kDrift = FurtherState::kOrbitalDrift;
  constexpr double kLeastPhase = 3 * std::numbers::pi;
  const bool is_open = asked.further_states[kDrift] == Choice::kAuto;
  if (is_open) {
    asked.further_states[kDrift] = Choice::kOff;
  }
  Decision decision = decide_by_pass(pass, screened, asked, largest_model, progress);
  if (!decision.orbital_odds) {
    return decision;
  }
  const auto instead = by_eq1_instead_of_field(pass, screened, asked, decision);
  decision.field_or_error = field_or_error(pass, screened, asked, decision, instead);
  const AtOrbit at_orbit(decision, instead);
  if (asked.further_states[kError] == Choice::kAuto) {
    decision.orbital_error_over_field = at_orbit.error_over_field();
  }
  CalibrationOptions without_error = asked;
  CalibrationOptions with_error = asked;
  with_error.further_states[kError] = Choice::kOn;
  if (at_orbit.has_error()) {
    decision.orbital_error_over_drift = at_orbit.error_over_drift();
    without_error.further_states[kError] = Choice::kOff;
  }
  const double phase = std::abs(*asked.orbital_rate_rad_s) *
                       to_seconds(screened.pass.fixes.back().fix.t - screened.pass.fixes.front().fix.t);
  if (is_open && phase > kLeastPhase) {
    const auto with = [&](const CalibrationOptions& options, double more, double at_least) {
      return with_orbital_drift(pass, screened, options, largest_model, progress, more - decision.log_likelihood,
                                at_least + kLogOddsToAccept);
    };
    std::optional<WithDrift> by_drift;
    if (at_orbit.may_be_drift()) {
      by_drift = with(without_error, at_orbit.more_for_drift(), 0);
    }
    const bool is_drift = by_drift && by_drift->counts;
    const double gain_of_drift = is_drift ? by_drift->gain : 0;
    if (at_orbit.may_be_both(at_orbit.has_error() || is_drift)) {
      WithDrift both = with(with_error, at_orbit.more_for_both(), gain_of_drift);
      if (both.counts) {
        both.decision.evidence.push_back({kDrift, both.gain - gain_of_drift, true});
        return std::move(both).take(asked);
      }
    }
    if (is_drift) {
      by_drift->decision.evidence.push_back({kDrift, by_drift->gain, true});
      by_drift->decision.orbital_error_over_drift =
          at_orbit.has_error() ? std::optional(-by_drift->gain) : std::nullopt;
      return (*std::move(by_drift)).take(asked);
    }
    if (by_drift && at_orbit.has_error()) {
      decision.orbital_error_over_drift = std::min(at_orbit.error_over_drift(), -by_drift->gain);
    }
  }
  if (!at_orbit.has_error() || at_orbit.error_over_drift() > -kLogOddsToAccept) {
    return decision;
  }
  Decision without = decide_by_pass(pass, screened, without_error, largest_model, progress);
  without.evidence.push_back({kError, at_orbit.error_over_drift(), false});
  without.orbital_error_over_drift = at_orbit.error_over_drift();
  without.field_or_error =
      field_or_error(pass, screened, asked, without, by_eq1_instead_of_field(pass, screened, asked, without));
  asked = without_error;
  return without_aberration(std::move(without));
}

/// What was decided of drift at orbital period stays, with its evidence, when all else is decided again.
void keep_what_comes_back(const Decision& before, Decision& again) {
  std::ranges::copy_if(before.evidence, std::back_inserter(again.evidence),
                       [](const Evidence& evidence) { return evidence.state == FurtherState::kOrbitalDrift; });
  again.orbital_error_over_drift = before.orbital_error_over_drift;
  again.orbital_error_over_field = before.orbital_error_over_field;
  again.field_or_error = before.field_or_error;
}

/// The polhodes with which the pass is most likely by eq. (1), from those on that the changes of the coefficients show:
/// for each rotor the vertex of a parabola along turns and change in turn, with the random walk that is then likeliest.
/// What noise was found without them stands for a part of them, and goes as they are told better.
PerGyro<Polhode> most_likely_polhodes(const Pass& pass, const Screened& screened, CalibrationOptions options,
                                      PerGyro<Polhode> polhodes) {
  constexpr int kMostRounds = 6;
  constexpr double kNearEnough = 0.005;  // of a turn
  const double span_s = to_seconds(screened.pass.fixes.back().fix.t - pass.settings.epoch);
  const double least_walk = options.direction_random_walk_rad_sqrt_s;
  options.drift_field = false;
  options.drift_model = kEsg7;
  options.further_states[FurtherState::kPolhode] = Choice::kOn;
  options.further_states[FurtherState::kWanderingDrift] = Choice::kOff;
  options.further_states.polhodes = polhodes;
  std::optional<Trial> last;
  const auto fit = [&] {
    if (last) {
      last->release();
    }
    Trial trial(pass, screened, options, {}, last ? &*last : nullptr);
    last.emplace(std::move(trial));
    return last->log_likelihood();
  };
  double step = 0.05;  // of a turn
  for (int round = 0; round < kMostRounds && step > kNearEnough; ++round) {
    double most_moved = 0;  // in steps
    options.direction_random_walk_rad_sqrt_s = least_walk;
    fit();
    use_walk(with_most_likely_walk(*last, options).noise, options);
    double here = fit();
    for (std::size_t k = 0; k < pass.settings.gyros.size(); ++k) {
      Polhode& polhode = options.further_states.polhodes[static_cast<int>(k)];
      for (double TurnsOfPolhode::*along : {&TurnsOfPolhode::turns, &TurnsOfPolhode::change}) {
        const TurnsOfPolhode middle = TurnsOfPolhode::of(polhode, 0, span_s);
        const double size = along == &TurnsOfPolhode::turns ? step : 8 * step / middle.turns;
        const auto at = [&](double by) {
          TurnsOfPolhode moved = middle;
          moved.*along += by * size;
          polhode = moved.polhode(0, span_s);
          return fit();
        };
        const double before = at(-1);
        const double by = towards_vertex(before, here, at(1));
        if (const double there = at(by); there > here) {
          here = there;
          most_moved = std::max(most_moved, std::abs(by));
        } else {
          polhode = middle.polhode(0, span_s);
        }
      }
    }
    step /= most_moved < 1 ? 5 : 1;
  }
  return options.further_states.polhodes;
}

/// Decides by the data of the pass, and once more with coefficients that come and go with the polhodes of the rotors
/// where these are likelier than anything else that moves. If they stay, `asked` has them as well.
Decision decide_on_polhodes(const Pass& pass, const Screened& screened, CalibrationOptions& asked,
                            const DriftModelId& largest_model, const Progress& progress) {
  constexpr FurtherState kPolhode = FurtherState::kPolhode;
  const bool is_open = asked.further_states[kPolhode] == Choice::kAuto;
  if (is_open) {
    asked.further_states[kPolhode] = Choice::kOff;
  }
  Decision decision = decide_on_orbital_drift(pass, screened, asked, largest_model, progress);
  double log_odds = 0;  // of those of all rotors
  for (const LikelyPolhode& likely : decision.polhodes) {
    log_odds += std::max(likely.log_odds, 0.0);
  }
  const bool is_likeliest = decision.changes.empty() || log_odds > decision.changes.front().log_odds;
  if (!is_open || log_odds < kLogOddsOfPolhode || !is_likeliest) {
    return decision;
  }
  begin_stage(progress, "looks for the polhodes of the rotors");
  PerGyro<Polhode> first;
  const auto likeliest = std::ranges::max_element(decision.polhodes, {}, &LikelyPolhode::log_odds);
  for (int k = 0; k < PerGyro<Polhode>::capacity(); ++k) {
    first[k] = (decision.polhodes[k].log_odds > 0 ? decision.polhodes[k] : *likeliest).polhode;
  }
  CalibrationOptions with = asked;
  with.further_states[kPolhode] = Choice::kOn;
  with.further_states.polhodes = most_likely_polhodes(pass, screened, decision.options, first);
  Decision by_polhodes = decide_by_pass(pass, screened, with, largest_model, progress);
  const double gain = by_polhodes.log_likelihood - decision.log_likelihood;
  if (gain <= kLogOddsToAccept || !is_all_that_is_left(by_polhodes)) {
    return decision;
  }
  keep_what_comes_back(decision, by_polhodes);
  by_polhodes.evidence.push_back({kPolhode, gain, true});
  asked = with;
  return by_polhodes;
}

/// Decides by the data of the pass. `change_is_open`: whether the coefficients may be found to change; then a warm-up,
/// a jump or an even change of them is looked for, unless they come and go with the polhodes.
Decision decide_with_course(const Pass& pass, const Screened& screened, CalibrationOptions asked,
                            const DriftModelId& largest_model, bool change_is_open, const Progress& progress) {
  Decision decision = decide_on_polhodes(pass, screened, asked, largest_model, progress);
  const bool has_polhodes = decision.options.further_states.is_on(FurtherState::kPolhode);
  const std::optional<FoundCourse> course =
      change_is_open && !has_polhodes ? course_of(decision.changes, pass.settings.epoch) : std::nullopt;
  if (!course) {
    return decision;
  }
  begin_stage(progress, "looks for the time of a change");
  CalibrationOptions with = asked;
  const bool is_even = course->kind == CourseOfChange::Kind::kEven;
  use_course(course->kind, is_even ? 0 : most_likely_time_s(pass, screened, decision.options, *course), with);
  Decision changing = decide_by_pass(pass, screened, with, largest_model, progress);
  const double gain = changing.log_likelihood - decision.log_likelihood;
  if (gain <= kLogOddsToAccept) {
    return decision;
  }
  keep_what_comes_back(decision, changing);
  changing.evidence.push_back({FurtherState::kCoefficientChange, gain, true});
  return changing;
}

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

/// Turns on what star trackers and rotors usually have; the priors allow for its absence.
CalibrationOptions with_usual_states(CalibrationOptions options) {
  options.drift_model = options.drift_model.value_or(kEsg20);
  for (const FurtherState state : {FurtherState::kClockOffset, FurtherState::kOrbitalError}) {
    Choice& choice = options.further_states[state];
    choice = choice == Choice::kAuto ? Choice::kOn : choice;
  }
  return options;
}

/// Estimator paper has nothing to choose; the change of the coefficients is searched for by a whole pass only.
void settle_by_estimator(CalibrationOptions& asked) {
  if (asked.estimator == Estimator::kPaper) {
    asked.drift_model = asked.drift_model.value_or(kEsg7);
    leave_out_what_is_open(asked);
    asked.find_noise = false;
  } else if (asked.estimator == Estimator::kInvariant) {
    Choice& choice = asked.further_states[FurtherState::kCoefficientChange];
    choice = choice == Choice::kAuto ? Choice::kOff : choice;
  }
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

}  // namespace

CalibrationOptions settled_before(const PassSettings& settings, CalibrationOptions options) {
  const std::optional<Calibration>& prior = settings.prior;
  const bool by_batch = options.estimator == Estimator::kBatch;
  const bool is_of_field = prior && has_field(*prior);
  const std::optional<DriftModelId> asked = options.drift_model;
  if (prior && !asked && (by_batch || !is_of_field)) {
    options.drift_model = prior->gyros.at(0).drift_model;
  }
  settle_by_estimator(options);
  refuse_prior_of_others(settings, options);
  if (options.estimator != Estimator::kPaper) {
    if (prior && prior->noise && options.find_noise) {
      use_noise(*prior->noise, options);
    }
    options = prior ? as_before(options, *prior, settings.epoch) : with_usual_states(options);
  }
  if (is_of_field && by_batch && options.drift_model == prior->gyros.at(0).drift_model) {
    options.drift_field = true;
  } else if (is_of_field && options.estimator != Estimator::kPaper) {
    use_on_board(*prior, options);
  }
  options.find_noise = false;
  leave_out_what_is_open(options);
  return options;
}

CalibrationOptions settled_for_flight(const PassSettings& settings, const CalibrationOptions& options) {
  CalibrationOptions settled = settled_before(settings, options);
  settled.widen_where_correlated = options.corrections.take_parameters;
  return settled;
}

Decision decide(const Pass& pass, const CalibrationOptions& asked_for, const Progress& progress) {
  CalibrationOptions asked = asked_for;
  if (pass.gyro.gyros < static_cast<int>(pass.settings.gyros.size())) {
    throw SetupError(fmt::format("the telemetry has {} gyros; the settings speak of {}", pass.gyro.gyros,
                                 pass.settings.gyros.size()),
                     "give the telemetry of all of them, or the settings of those that there are");
  }
  if (!asked.orbital_rate_rad_s) {
    const std::optional<double> shown = shown_orbital_rate_rad_s(pass.star_tracker);
    asked.orbital_rate_rad_s = shown ? *shown : first_orbital_rate_rad_s(pass.settings);
  }
  const bool change_is_open = asked.further_states[FurtherState::kCoefficientChange] == Choice::kAuto;
  settle_by_estimator(asked);
  if (pass.settings.prior || asked.estimator == Estimator::kPaper) {
    Decision settled;
    settled.options = settled_before(pass.settings, asked);
    return settled;
  }
  const bool on_board = asked.estimator != Estimator::kBatch;
  const bool by_field = !asked.drift_model && !knows_of_drift_outside(pass.settings);
  if (by_field) {
    asked.drift_field = true;
    asked.drift_model = kLargestDriftModel;
    asked.estimator = Estimator::kBatch;
  }
  Decision decision;
  decision.options = asked;
  CalibrationOptions& options = decision.options;
  options.find_noise = false;
  const bool states_are_settled =
      asked.drift_model && std::ranges::none_of(kFurtherStates, [&](const FurtherStateRow& row) {
        return is_judged_by_trial(row) && asked.further_states[row.state] == Choice::kAuto;
      });
  if (states_are_settled && !asked.find_noise && !asked.drift_field) {
    leave_out_what_is_open(options);
    return decision;
  }
  begin_stage(progress, "screens the samples");
  Screened screened = screen(pass, options, may_be_screened_with(asked));
  std::optional<OnBoardRun> run = std::exchange(screened.run, std::nullopt);
  if (screened.pass.fixes.empty()) {
    options.estimator = asked_for.estimator;
    options.drift_field = asked_for.drift_field;
    options.drift_model = asked_for.drift_model;
    leave_out_what_is_open(options);
    return decision;
  }
  if (by_field && on_board) {
    Decision decided = for_on_board(
        decide_with_course(pass, screened, asked, kLargestDriftModel, change_is_open, progress), pass, screened);
    decided.options.estimator = asked_for.estimator;
    decided.run = std::move(run);
    return decided;
  }
  DriftModelId largest_model = largest_to_compare(asked);
  for (;;) {
    Decision decided = decide_with_course(pass, screened, asked, largest_model, change_is_open, progress);
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
