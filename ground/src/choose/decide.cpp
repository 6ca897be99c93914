#include "choose/decide.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "choose/noise_search.hpp"
#include "model/prior.hpp"
#include "trihedron/ground/model/names.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;

/// Odds of 20 to 1.
constexpr double kStrong = 3;
/// Pairs of fixes that give the noise of the star tracker within some percent.
constexpr std::size_t kEnough = 1000;

/// 1-sigma of the star tracker by the changes of a trial: of outliers only the median feels. Needs changes.
Eigen::Vector3d star_tracker_noise_rad(const std::vector<Eigen::Vector3d>& changes_rad) {
  constexpr double kMedianOfNormal = 0.6744897501960817;
  Eigen::Vector3d noise_rad;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> changes(changes_rad.size());
    std::ranges::transform(changes_rad, changes.begin(),
                           [axis](const Eigen::Vector3d& change) { return std::abs(change(axis)); });
    const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
    std::nth_element(changes.begin(), middle, changes.end());
    noise_rad(axis) = *middle / kMedianOfNormal / std::numbers::sqrt2;
  }
  return noise_rad;
}

/// The noise of the star tracker that the changes show, where it is not what was told.
std::optional<Eigen::Vector3d> other_star_tracker_noise(const Pass& pass,
                                                        const std::vector<Eigen::Vector3d>& changes_rad) {
  const Eigen::Vector3d& told = pass.settings.star_tracker_noise_rad;
  const Eigen::Vector3d found = star_tracker_noise_rad(changes_rad);
  const bool other = ((found - told).array().abs() > kNotable * told.array()).any();
  return other ? std::optional(found) : std::nullopt;
}

/// What was asked for must be there.
void refuse_further_states(const Pass& pass, const CalibrationOptions& asked) {
  const FurtherStateOptions& states = asked.further_states;
  for (const auto& [name, choice] :
       {std::pair{"clock_offset", states.clock_offset}, std::pair{"orbital_error", states.orbital_error},
        std::pair{"readout_bias", states.readout_bias}, std::pair{"wandering_drift", states.wandering_drift},
        std::pair{"coefficient_change", states.coefficient_change}}) {
    if (choice == Choice::kOn) {
      throw SetupError(
          fmt::format("estimator {} of {} gyros has no state '{}'", asked.estimator, pass.gyro.gyros, name),
          "set it to off or auto, or use estimator invariant with two gyros");
    }
  }
}

/// The noise that an earlier calibration went by, but for the least that is told.
void use_noise(const CalibrationNoise& noise, CalibrationOptions& options) {
  options.direction_random_walk_rad_sqrt_s =
      std::max(options.direction_random_walk_rad_sqrt_s, noise.direction_random_walk_rad_sqrt_s);
  options.star_tracker_noise_rad = noise.star_tracker_noise_rad;
  FurtherStateOptions& states = options.further_states;
  if (noise.wandering_drift_rad_s > 0 && states.wandering_drift == Choice::kAuto) {
    states.wandering_drift = Choice::kOn;
    states.wandering_drift_rad_s = noise.wandering_drift_rad_s;
    states.wandering_time = from_seconds(noise.wandering_time_s);
  }
}

/// As in the prior calibration.
CalibrationOptions as_before(CalibrationOptions options, const Calibration& prior) {
  const auto had = [&](const char* name) {
    return std::ranges::any_of(prior.further,
                               [&](const FurtherEstimate& state) { return state.name.starts_with(name); });
  };
  const auto settle = [](Choice& choice, bool on) {
    if (choice == Choice::kAuto) {
      choice = on ? Choice::kOn : Choice::kOff;
    }
  };
  FurtherStateOptions& states = options.further_states;
  settle(states.clock_offset, had("clock_offset"));
  settle(states.orbital_error, had("orbital"));
  settle(states.wandering_drift, false);
  settle(states.readout_bias, had("gyro1_readout_bias"));
  settle(states.coefficient_change, false);
  return options;
}

/// Throws SetupError where the earlier calibration is of other gyros or of another drift model.
void refuse_prior_of_others(const Pass& pass, const CalibrationOptions& asked) {
  const std::optional<Calibration>& prior = pass.settings.prior;
  if (!prior) {
    return;
  }
  if (prior->gyros.size() != static_cast<std::size_t>(pass.gyro.gyros)) {
    throw SetupError(
        fmt::format("the earlier calibration has {} gyros; the pass has {}", prior->gyros.size(), pass.gyro.gyros),
        "use a calibration of these gyros");
  }
  for (std::size_t k = 0; k < prior->gyros.size(); ++k) {
    const GyroCalibration& gyro = prior->gyros[k];
    if (gyro.drift_model != asked.drift_model) {
      throw SetupError(fmt::format("the earlier calibration of gyro {} is of drift model '{}', not {}", k + 1,
                                   gyro.drift_model, asked.drift_model),
                       "use a calibration made with the same drift model");
    }
    static_cast<void>(family_of(gyro));
  }
}

/// The smallest than which none is strongly more likely; none of none.
const Forecast* best_of(const std::vector<Forecast>& forecasts) {
  double most = -std::numeric_limits<double>::infinity();
  const Forecast* best = nullptr;
  for (auto forecast = forecasts.rbegin(); forecast != forecasts.rend(); ++forecast) {
    most = std::max(most, forecast->log_likelihood);
    best = forecast->log_likelihood >= most - kStrong ? &*forecast : best;
  }
  return best;
}

/// Turns the choices that are left open, and the drift model, by what a trial with everything shows.
void settle_states(const Trial& everything, const CalibrationOptions& asked, Decision& decision) {
  decision.evidence.clear();
  const auto settle = [&](const char* states, double log_bayes_factor) {
    decision.evidence.push_back({states, log_bayes_factor, log_bayes_factor > kStrong});
    return decision.evidence.back().accepted;
  };
  const auto choose = [&](Choice FurtherStateOptions::*choice, const char* states, double (Trial::*evidence)() const) {
    if (asked.further_states.*choice == Choice::kAuto) {
      const bool on = settle(states, (everything.*evidence)());
      decision.options.further_states.*choice = on ? Choice::kOn : Choice::kOff;
    }
  };
  choose(&FurtherStateOptions::clock_offset, "clock_offset", &Trial::clock_offset);
  choose(&FurtherStateOptions::orbital_error, "orbital_error", &Trial::orbital_error);
  choose(&FurtherStateOptions::readout_bias, "readout_bias", &Trial::readout_bias);
  choose(&FurtherStateOptions::coefficient_change, "coefficient_change", &Trial::coefficient_change);
  decision.forecasts = everything.forecasts();
  if (asked.drift_model == kAutoDriftModel) {
    const Forecast* best = best_of(decision.forecasts);
    settle("drift_outside_eq1", best == nullptr ? 0 : best->log_likelihood - decision.forecasts.front().log_likelihood);
    decision.options.drift_model = best == nullptr ? Esg7::kModelName : best->drift_model;
  }
}

/// Everything on that is on or may be, and the largest drift model.
CalibrationOptions with_everything(CalibrationOptions options, const CalibrationOptions& asked,
                                   const std::string& largest_model) {
  for (const auto choice : {&FurtherStateOptions::clock_offset, &FurtherStateOptions::orbital_error,
                            &FurtherStateOptions::readout_bias, &FurtherStateOptions::coefficient_change}) {
    options.further_states.*choice = asked.further_states.*choice == Choice::kOff ? Choice::kOff : Choice::kOn;
  }
  options.drift_model = largest_model;
  return options;
}

void use_walk(const ProcessNoise& noise, CalibrationOptions& options) {
  options.direction_random_walk_rad_sqrt_s = noise.direction_random_walk_rad_sqrt_s;
}

void use_wandering(const ProcessNoise& noise, CalibrationOptions& options) {
  options.further_states.wandering_drift = Choice::kOn;
  options.further_states.wandering_drift_rad_s = noise.wandering_sigma_rad_s;
  options.further_states.wandering_time = from_seconds(noise.wandering_time_s);
}

/// Drift that wanders as fast as this random walk: walk² = 2 σ² τ.
CalibrationOptions wandering_like(const Likely& walking, CalibrationOptions options) {
  FurtherStateOptions& states = options.further_states;
  states.wandering_drift = Choice::kOn;
  states.wandering_drift_rad_s =
      walking.noise.direction_random_walk_rad_sqrt_s / std::sqrt(2 * to_seconds(states.wandering_time));
  return options;
}

/// Where the noise is more than was told the states were settled by one that is too small: again, by what it is when
/// they are all free, and whether it wanders. `everything`: with the noise as told; `walk`: the noise of what was
/// settled.
void decide_beside_noise(const Pass& pass, const Screened& screened, const CalibrationOptions& asked,
                         const std::string& largest_model, bool wandering_is_open, Trial everything, const Likely& walk,
                         Decision& decision) {
  CalibrationOptions& options = decision.options;
  const CalibrationOptions free = with_everything(options, asked, largest_model);
  const CalibrationOptions like = wandering_like(walk, free);
  // Looked at only where the walk is worth it: before that, nobody asks whether it failed.
  std::packaged_task<std::pair<Trial, Likely>()> try_wandering([&] {
    Trial trial(pass, screened, like);
    const Likely likely = with_most_likely_wandering(trial, like);
    return std::pair(std::move(trial), likely);
  });
  Likely walking;
  side_by_side([&] { walking = with_most_likely_walk(everything, free); },
               [&] {
                 if (wandering_is_open) {
                   try_wandering();
                 }
               });
  std::optional<Evidence> wandering;
  std::optional<ProcessNoise> wanders;
  if (wandering_is_open && walking.gain > kStrong) {
    auto [trial, likely] = try_wandering.get_future().get();
    const double gain = likely.log_likelihood - walking.log_likelihood;
    wandering = Evidence{"wandering_drift", gain, gain > kStrong};
    if (wandering->accepted) {
      wanders = likely.noise;
      everything = std::move(trial);
    }
  }
  settle_states(everything, asked, decision);
  if (wanders) {
    use_wandering(*wanders, options);
  }
  Trial decided(pass, screened, options);
  if (wanders) {
    use_wandering(with_most_likely_wandering(decided, options).noise, options);
  } else {
    use_walk(with_most_likely_walk(decided, options).noise, options);
  }
  if (wandering) {
    decision.evidence.push_back(*wandering);
  }
}

/// It is seen over a whole pass only. Throws SetupError where it was asked for.
void leave_out_coefficient_change(CalibrationOptions& options) {
  if (options.further_states.coefficient_change == Choice::kOn) {
    throw SetupError(fmt::format("estimator {} has no state 'coefficient_change'", options.estimator),
                     "set it to off or auto, or use estimator batch");
  }
  options.further_states.coefficient_change = Choice::kOff;
}

/// Nothing to judge by.
void leave_out_what_is_open(CalibrationOptions& options) {
  FurtherStateOptions& states = options.further_states;
  for (Choice* choice : {&states.clock_offset, &states.orbital_error, &states.wandering_drift, &states.readout_bias,
                         &states.coefficient_change}) {
    *choice = *choice == Choice::kAuto ? Choice::kOff : *choice;
  }
  if (options.drift_model == kAutoDriftModel) {
    options.drift_model = Esg7::kModelName;
  }
}

/// Only the noise is found: of more than two gyros.
void find_noise(const Pass& pass, const Screened& screened, CalibrationOptions& options) {
  Trial trial(pass, screened, options);
  const std::vector<Eigen::Vector3d> changes = trial.changes_rad();
  options.find_noise = changes.size() >= kEnough;
  if (!options.find_noise) {
    return;
  }
  options.star_tracker_noise_rad = other_star_tracker_noise(pass, changes);
  if (options.star_tracker_noise_rad) {
    trial = Trial(pass, screened, options);
  }
  use_walk(with_most_likely_walk(trial, options).noise, options);
}

/// By what the pass itself shows.
Decision decide_by_pass(const Pass& pass, const Screened& screened, const CalibrationOptions& asked,
                        const std::string& largest_model) {
  Decision decision{asked, {}, {}, {}};
  CalibrationOptions& options = decision.options;
  const bool wandering_is_open = options.further_states.wandering_drift == Choice::kAuto;
  if (wandering_is_open) {
    options.further_states.wandering_drift = Choice::kOff;
  }
  Trial everything(pass, screened, with_everything(options, asked, largest_model));
  const std::vector<Eigen::Vector3d> changes = everything.changes_rad();
  options.find_noise = asked.find_noise && changes.size() >= kEnough;
  if (!options.find_noise) {
    settle_states(everything, asked, decision);
    return decision;
  }
  options.star_tracker_noise_rad = other_star_tracker_noise(pass, changes);
  if (options.star_tracker_noise_rad) {
    everything = Trial(pass, screened, with_everything(options, asked, largest_model));
  }
  settle_states(everything, asked, decision);
  Trial decided(pass, screened, options);
  const Likely walking = with_most_likely_walk(decided, options);
  if (walking.gain > kStrong) {
    decide_beside_noise(pass, screened, asked, largest_model, wandering_is_open, std::move(everything), walking,
                        decision);
  } else {
    use_walk(walking.noise, options);
  }
  return decision;
}

/// The largest drift model that is tried at first.
std::string largest_to_compare(const CalibrationOptions& asked) {
  const std::string kFirst = "vsh:2";
  const bool fixed = asked.drift_model != kAutoDriftModel;
  if (asked.estimator != kBatch || asked.drift_model == Esg20::kModelName) {
    return fixed ? asked.drift_model : Esg20::kModelName;
  }
  return is_for_whole_pass(asked.drift_model) ? std::max(asked.drift_model, kFirst) : kFirst;
}

/// By one degree, where there is one.
std::optional<std::string> larger_model(const std::string& model) {
  if (!is_for_whole_pass(model)) {
    return std::nullopt;
  }
  std::string larger = model;
  ++larger.back();
  return DriftFamily::named(larger) ? std::optional(larger) : std::nullopt;
}

}  // namespace

Decision decide(const Pass& pass, const CalibrationOptions& asked_for) {
  CalibrationOptions asked = asked_for;
  if (pass.settings.prior && asked.drift_model == kAutoDriftModel) {
    asked.drift_model = pass.settings.prior->gyros.at(0).drift_model;
  }
  if (is_for_whole_pass(asked.drift_model) && asked.estimator == kInvariant) {
    asked.estimator = kBatch;
  }
  if (asked.estimator != kBatch) {
    leave_out_coefficient_change(asked);
  }
  refuse_prior_of_others(pass, asked);
  Decision decision{asked, {}, {}, {}};
  CalibrationOptions& options = decision.options;
  options.find_noise = false;
  const bool invariant = asked.estimator != kPaper;
  const std::optional<Calibration>& prior = pass.settings.prior;
  if (prior && prior->noise && asked.find_noise && invariant) {
    use_noise(*prior->noise, options);
  }
  if (!invariant || pass.gyro.gyros > 2) {
    refuse_further_states(pass, asked);
    options = without_further_states(options);
    if (asked.drift_model != kAutoDriftModel) {
      options.drift_model = asked.drift_model;
    }
    if (asked.find_noise && invariant && !prior) {
      // Not kept: which gyro is at fault is to be judged by the noise found.
      const Screened screened = screen(pass, options);
      if (!screened.pass.fixes.empty()) {
        find_noise(pass, screened, options);
      }
    }
    return decision;
  }
  if (prior) {
    options = as_before(options, *prior);
    return decision;
  }
  const FurtherStateOptions& states = asked.further_states;
  const bool states_are_settled = asked.drift_model != kAutoDriftModel && states.clock_offset != Choice::kAuto &&
                                  states.orbital_error != Choice::kAuto && states.readout_bias != Choice::kAuto &&
                                  states.coefficient_change != Choice::kAuto;
  if (states_are_settled && !asked.find_noise) {
    leave_out_what_is_open(options);
    return decision;
  }
  Screened screened = screen(pass, options);
  if (screened.pass.fixes.empty()) {
    leave_out_what_is_open(options);
    return decision;
  }
  std::string largest_model = largest_to_compare(asked);
  for (;;) {
    Decision decided = decide_by_pass(pass, screened, asked, largest_model);
    const std::optional<std::string> larger = larger_model(largest_model);
    // None where the pass is too short for any.
    if (!larger || decided.forecasts.empty() || best_of(decided.forecasts) != &decided.forecasts.back()) {
      decided.screened = std::move(screened);
      return decided;
    }
    largest_model = *larger;
  }
}

}  // namespace trihedron::ground
