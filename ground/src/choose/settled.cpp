#include "trihedron/ground/choose/settled.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "choose/open_choices.hpp"
#include "model/drift_on_board.hpp"
#include "model/prior.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;

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

/// Turns on what star trackers and rotors usually have; the priors allow for its absence.
CalibrationOptions with_usual_states(CalibrationOptions options) {
  options.drift_model = options.drift_model.value_or(kEsg20);
  for (const FurtherState state : {FurtherState::kClockOffset, FurtherState::kOrbitalError}) {
    Choice& choice = options.further_states[state];
    choice = choice == Choice::kAuto ? Choice::kOn : choice;
  }
  return options;
}

}  // namespace

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

void leave_out_what_is_open(CalibrationOptions& options) {
  for (const FurtherStateRow& row : kFurtherStates) {
    Choice& choice = options.further_states[row.state];
    choice = choice == Choice::kAuto ? Choice::kOff : choice;
  }
  options.drift_model = options.drift_model.value_or(kEsg7);
}

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

CalibrationOptions settled_as_told(CalibrationOptions options) {
  options.find_noise = false;
  leave_out_what_is_open(options);
  return options;
}

CalibrationOptions settled_for_flight(const PassSettings& settings, const CalibrationOptions& options) {
  CalibrationOptions settled = settled_before(settings, options);
  settled.widen_where_correlated = options.corrections.take_parameters;
  return settled;
}

}  // namespace trihedron::ground
