#pragma once
/// An estimator set up from a pass and the options.

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/orbital_rate.hpp"
#include "model/prior.hpp"
#include "trihedron/core/cycles.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {

/// Of options in which nothing is left to decide. Throws SetupError where the drift model is.
[[nodiscard]] inline DriftModelId decided_drift_model(const CalibrationOptions& options) {
  if (!options.drift_model) {
    throw SetupError("the drift model is left open", fmt::format("use {}", drift_model_choices()));
  }
  return *options.drift_model;
}

/// Whether any state is on that the smallest estimator of a pair does not have.
[[nodiscard]] inline bool has_further_states(const CalibrationOptions& options) {
  const FurtherStateOptions& states = options.further_states;
  return options.drift_model != kEsg7 || states.is_on(FurtherState::kClockOffset) ||
         states.is_on(FurtherState::kOrbitalError) || states.is_on(FurtherState::kWanderingDrift) ||
         states.is_on(FurtherState::kReadoutBias);
}

/// Prior sigma of each component of a readout bias: the largest that an earlier calibration has left of it.
[[nodiscard]] inline double readout_bias_sigma(const std::optional<Calibration>& earlier) {
  double sigma = 0;
  if (earlier) {
    for (const FurtherEstimate& state : earlier->further) {
      sigma = state.parameter.is_further(FurtherState::kReadoutBias) ? std::max(sigma, state.sigma) : sigma;
    }
  }
  return sigma > 0 ? sigma : row_of(FurtherState::kReadoutBias).prior_sigma;
}

/// Prior sigmas of the further states; near zero for those that are off.
template <class Estimator>
void use_further_states(const Pass& pass, const CalibrationOptions& options, typename Estimator::Setup& setup) {
  const FurtherStateOptions& states = options.further_states;
  const auto sigma = [&](FurtherState state, double off) {
    return states.is_on(state) ? row_of(state).prior_sigma : off;
  };
  setup.clock_offset_sigma_s = sigma(FurtherState::kClockOffset, 1e-9);
  setup.orbital_error_sigma_rad = sigma(FurtherState::kOrbitalError, 1e-12);
  setup.wandering_sigma_rad_s = states.is_on(FurtherState::kWanderingDrift) ? states.wandering_drift_rad_s : 1e-15;
  setup.wandering_time_s = to_seconds(states.wandering_time);
  setup.readout_bias_sigma = states.is_on(FurtherState::kReadoutBias) ? readout_bias_sigma(pass.settings.prior) : 1e-12;
  setup.orbital_rate_rad_s = orbital_rate_rad_s(pass.star_tracker);
  setup.orbital_phase_zero = pass.settings.epoch;
  for (std::size_t i = 0; i < std::min(setup.further_heads.size(), pass.settings.further_star_trackers.size()); ++i) {
    const FurtherStarTracker& tracker = pass.settings.further_star_trackers[i];
    setup.further_heads[i].noise_rad = tracker.noise_rad;
    setup.further_heads[i].C_c_s = Rot<C, C>::exp(Vec<C>::assume(tracker.mounting_rotation_vector_rad)).raw();
    setup.further_heads[i].alignment_sigma_rad = tracker.alignment_prior_sigma_rad;
  }
}

template <class Estimator>
typename Estimator::Setup make_setup(const Pass& pass, const CalibrationOptions& options) {
  const PassSettings& settings = pass.settings;
  if (settings.gyros.size() < Estimator::kGyros || pass.gyro.gyros < Estimator::kGyros) {
    throw SetupError(
        fmt::format("estimator {} needs {} gyros; the pass has {}", Estimator::kName, Estimator::kGyros,
                    std::min<std::size_t>(settings.gyros.size(), static_cast<std::size_t>(pass.gyro.gyros))),
        "give telemetry of a pair");
  }
  using Model = typename Estimator::BaseModel;
  typename Estimator::Setup setup;
  const ParameterPrior prior = prior_of(settings, Estimator::kGyros, DriftFamily::of<Model>());
  setup.prior_covariance = prior.covariance;
  for (int k = 0; k < Estimator::kGyros; ++k) {
    const auto index = static_cast<std::size_t>(k);
    setup.prior[k].drift_rad_s.template head<Model::kSize>() = prior.gyros[index].drift_rad_s;
    setup.prior[k].C_c_b = prior.gyros[index].C_c_b;
    setup.prior[k].readout_bias = prior.gyros[index].readout_bias;
    setup.readout_noise_rad[k] = settings.gyros[index].readout_noise_rad;
  }
  setup.star_tracker_noise_rad = options.star_tracker_noise_rad.value_or(settings.star_tracker_noise_rad);
  setup.direction_random_walk_rad_sqrt_s = options.direction_random_walk_rad_sqrt_s;
  setup.gate_nis = options.gate_nis;
  setup.reopen_after_rejections = options.reopen_after_rejections;
  setup.reopen_after_jump_rejections = options.reopen_after_jump_rejections;
  setup.student_t_freedom = options.student_t_freedom;
  setup.angles_after = options.angles_after;
  if constexpr (requires { setup.orbital_rate_rad_s; }) {
    use_further_states<Estimator>(pass, options, setup);
  }
  return setup;
}

inline CorrectionPolicy policy_of(const CorrectionOptions& options) {
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

template <class Estimator>
std::unique_ptr<Cycle<Estimator>> make_cycle(const Pass& pass, const CalibrationOptions& options,
                                             const CorrectionPolicy& policy) {
  const auto cycle = Cycle<Estimator>::create(make_setup<Estimator>(pass, options), policy);
  if (!cycle) {
    switch (cycle.fault()) {
      case SetupFault::kPriorNotPositiveDefinite:
        throw SetupError("the prior covariance is not positive definite",
                         "give each parameter a prior sigma above zero, and correlations below one");
      case SetupFault::kPriorMeanNotUsable:
        throw SetupError("a prior mean is not finite, or an alignment is not a rotation", "correct the prior");
      case SetupFault::kNoiseNotPositive:
        throw SetupError("a noise sigma is not positive",
                         "give positive readout and star-tracker noise, and process noise of zero or more");
      case SetupFault::kGateNotPositive:
        throw SetupError("the gate or a number of rejections before reopening is not positive",
                         "give positive numbers");
    }
  }
  return std::make_unique<Cycle<Estimator>>(cycle.value());
}

}  // namespace trihedron::ground
