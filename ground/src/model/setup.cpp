#include "model/setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "model/prior.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/records/drift_models.hpp"
#include "trihedron/records/further_state.hpp"

namespace trihedron::ground {
namespace {

/// The largest sigma that an earlier calibration has left of any component, or else that of the table.
double prior_sigma(FurtherState state, const std::optional<Calibration>& earlier) {
  double sigma = 0;
  if (earlier && state == FurtherState::kReadoutBias) {
    for (const FurtherEstimate& estimate : earlier->further) {
      sigma = estimate.parameter.is_further(state) ? std::max(sigma, estimate.sigma) : sigma;
    }
  }
  return sigma > 0 ? sigma : row_of(state).prior_sigma;
}

}  // namespace

Layout layout_of(const PassSettings& settings, const CalibrationOptions& options) {
  if (!options.drift_model) {
    throw SetupError("the drift model is left open", fmt::format("use {}", drift_model_choices()));
  }
  refuse_unknown(*options.drift_model);
  const int gyros = static_cast<int>(settings.gyros.size());
  if (gyros < 2 || gyros > kMaxGyros) {
    throw SetupError(fmt::format("a calibration needs two to {} gyros; the pass has {}", kMaxGyros, gyros),
                     "give telemetry of a pair");
  }
  if (settings.further_star_trackers.size() + 1 > kMaxStarTrackers) {
    throw SetupError(fmt::format("there are {} star trackers", settings.further_star_trackers.size() + 1),
                     fmt::format("leave out some: at most {} are used", kMaxStarTrackers));
  }
  const FurtherStateOptions& states = options.further_states;
  Layout layout;
  layout.drift_model = *options.drift_model;
  layout.further = {.wandering_drift = states.is_on(FurtherState::kWanderingDrift),
                    .readout_bias = states.is_on(FurtherState::kReadoutBias),
                    .coefficient_change = states.is_on(FurtherState::kCoefficientChange),
                    .clock_offset = states.is_on(FurtherState::kClockOffset),
                    .orbital_error = states.is_on(FurtherState::kOrbitalError)};
  if (options.estimator == Estimator::kPaper) {  // of two gyros and one star tracker, whatever else there is
    if (!(layout == Layout{})) {
      throw SetupError("estimator paper has eq. (1) alone, and no further states",
                       "use drift model esg7 and set all further states to off or auto, or use estimator invariant");
    }
    return layout;
  }
  layout.gyros = gyros;
  layout.star_trackers = 1 + static_cast<int>(settings.further_star_trackers.size());
  return layout;
}

CalibrationSetup setup_of(const PassSettings& settings, const CalibrationOptions& options) {
  CalibrationSetup setup;
  setup.layout = layout_of(settings, options);
  for (int k = 0; k < setup.layout.gyros; ++k) {
    setup.readout_noise_rad[k] = settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad;
  }
  setup.star_trackers[0].noise_rad = options.star_tracker_noise_rad.value_or(settings.star_tracker_noise_rad);
  for (int head = 1; head < setup.layout.star_trackers; ++head) {
    const FurtherStarTracker& tracker = settings.further_star_trackers[static_cast<std::size_t>(head - 1)];
    StarTrackerSetup& its = setup.star_trackers[static_cast<std::size_t>(head)];
    its.noise_rad = tracker.noise_rad;
    its.C_c_s = Rot<C, C>::exp(Vec<C>::assume(tracker.mounting_rotation_vector_rad)).raw();
    its.alignment_sigma_rad = tracker.alignment_prior_sigma_rad;
  }
  if (settings.gyro_period > Duration::zero()) {
    setup.gyro_period = settings.gyro_period;
  }
  setup.direction_random_walk_rad_sqrt_s = options.direction_random_walk_rad_sqrt_s;

  const FurtherStateOptions& states = options.further_states;
  setup.wandering_drift = {states.wandering_drift_rad_s, to_seconds(states.wandering_time)};
  setup.readout_bias_sigma = prior_sigma(FurtherState::kReadoutBias, settings.prior);
  setup.coefficient_change_sigma_rad_s =
      prior_sigma(FurtherState::kCoefficientChange, settings.prior) * settings.gyros[0].drift_common_sigma_rad_s;
  setup.no_change_at = settings.epoch;
  if (settings.duration > Duration::zero()) {
    setup.change_time_s = to_seconds(settings.duration);
  }
  setup.clock_offset_sigma_s = prior_sigma(FurtherState::kClockOffset, settings.prior);
  setup.orbital_error_sigma_rad = prior_sigma(FurtherState::kOrbitalError, settings.prior);
  setup.orbital_rate_rad_s = options.orbital_rate_rad_s.value_or(setup.orbital_rate_rad_s);
  setup.orbital_phase_zero = settings.epoch;

  setup.gate_nis = options.gate_nis;
  setup.reopen_after_rejections = options.reopen_after_rejections;
  setup.reopen_after_jump_rejections = options.reopen_after_jump_rejections;
  setup.student_t_freedom = options.student_t_freedom;
  setup.angles_after = options.angles_after;
  return setup;
}

CorrectionPolicy policy_of(const CorrectionOptions& options) {
  CorrectionPolicy policy;
  policy.take_parameters = options.take_parameters;
  switch (options.when) {
    case CorrectionOptions::When::kEvery:
      policy.interval = options.interval;
      break;
    case CorrectionOptions::When::kOnlyFirst:
      policy.interval = CorrectionPolicy::kOnlyFirst;
      break;
    case CorrectionOptions::When::kEachFix:
      policy.interval = CorrectionPolicy::kEveryFix;
      break;
  }
  return policy;
}

std::vector<ParameterId> further_parameters(const Layout& layout) {
  using Owner = FurtherStateRow::Owner;
  const auto is_there = [&](FurtherState state) {
    switch (state) {
      case FurtherState::kClockOffset:
        return layout.further.clock_offset;
      case FurtherState::kOrbitalError:
        return layout.further.orbital_error;
      case FurtherState::kStarTrackerAlignment:
        return layout.star_trackers > 1;
      case FurtherState::kReadoutBias:
        return layout.further.readout_bias;
      case FurtherState::kCoefficientChange:
        return layout.further.coefficient_change;
      case FurtherState::kWanderingDrift:
        break;
    }
    return false;  // does not last
  };
  std::vector<ParameterId> parameters;
  for (const FurtherStateRow& row : kFurtherStates) {
    // The first star tracker has no alignment of its own.
    const int begin = row.owner == Owner::kFurtherStarTracker ? 1 : 0;
    const int end = row.owner == Owner::kFurtherStarTracker ? layout.star_trackers
                    : row.owner == Owner::kGyro             ? layout.gyros
                                                            : 1;
    for (int owner = begin; is_there(row.state) && owner < end; ++owner) {
      for (int component = 0; component < row.size; ++component) {
        parameters.push_back(ParameterId::further(row.state, static_cast<std::size_t>(owner), component));
      }
    }
  }
  return parameters;
}

int state_of(const Layout& layout, const ParameterId& parameter) {
  const int owner = parameter.owner;
  const int first = [&] {
    switch (parameter.further_state) {
      case FurtherState::kClockOffset:
        return layout.clock_offset();
      case FurtherState::kOrbitalError:
        return layout.orbital_error();
      case FurtherState::kStarTrackerAlignment:
        return layout.star_tracker(owner);
      case FurtherState::kReadoutBias:
        return layout.readout_bias(owner);
      case FurtherState::kCoefficientChange:
        return layout.change(owner);
      case FurtherState::kWanderingDrift:
        break;
    }
    return layout.wandering(owner);
  }();
  return first + parameter.component;
}

}  // namespace trihedron::ground
