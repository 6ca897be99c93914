#pragma once
/// An estimator set up from a pass and the options.

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gyro_model.hpp"
#include "trihedron/core/cycles.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/ground/calibrate.hpp"

namespace trihedron::ground {

/// Prior sigma of drift outside eq. (1), over that of its coefficients, where the pass does not give it.
inline constexpr double kOutsideEq1 = 0.05;

template <class Model>
std::vector<std::string> state_names(int gyros) {
  std::vector<std::string> names;
  for (int k = 1; k <= gyros; ++k) {
    for (const char* coefficient : Model::kNames) {
      names.push_back(fmt::format("gyro{}.{}", k, coefficient));
    }
    for (const char axis : {'x', 'y', 'z'}) {
      names.push_back(fmt::format("gyro{}.align_{}", k, axis));
    }
  }
  return names;
}

/// Prior means and sigmas of pass.toml.
template <class Estimator>
void use_settings(const PassSettings& settings, typename Estimator::Setup& setup) {
  using Model = typename Estimator::BaseModel;
  using Layout = typename Estimator::Setup::Layout;
  for (int k = 0; k < Estimator::kGyros; ++k) {
    const GyroPrior& prior = settings.gyros[static_cast<std::size_t>(k)];
    for (const auto* table : {&prior.drift_rad_s, &prior.drift_sigma_rad_s}) {
      for (const auto& [name, value] : *table) {
        if (std::find(Model::kNames.begin(), Model::kNames.end(), name) == Model::kNames.end()) {
          throw SetupError(fmt::format("the prior of gyro {} names drift coefficient '{}'", k + 1, name),
                           fmt::format("drift model {} has {}", Model::kModelName, fmt::join(Model::kNames, ", ")));
        }
      }
    }
    const auto value_or = [](const std::map<std::string, double>& table, const char* name, double otherwise) {
      const auto found = table.find(name);
      return found == table.end() ? otherwise : found->second;
    };
    Eigen::Matrix<double, Layout::kPerGyro, 1> sigma;
    for (int i = 0; i < Model::kSize; ++i) {
      const char* name = Model::kNames[static_cast<std::size_t>(i)];
      setup.prior[k].drift_rad_s(i) = value_or(prior.drift_rad_s, name, 0);
      const double common = (i < Esg7::kSize ? 1 : kOutsideEq1) * prior.drift_common_sigma_rad_s;
      sigma(i) = value_or(prior.drift_sigma_rad_s, name, common);
    }
    setup.prior[k].C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(prior.alignment_rotation_vector_rad)).raw();
    sigma.template tail<3>() = prior.alignment_sigma_rad;
    setup.prior_covariance.diagonal().template segment<Layout::kPerGyro>(Layout::drift(k)) = sigma.cwiseAbs2();
  }
}

/// Values and covariance of an earlier calibration.
template <class Estimator>
void use_calibration(const Calibration& prior, typename Estimator::Setup& setup) {
  using Model = typename Estimator::BaseModel;
  const std::vector<std::string> names = state_names<Model>(Estimator::kGyros);
  std::vector<Eigen::Index> rows;
  for (const std::string& name : names) {
    const auto found = std::find(prior.states.begin(), prior.states.end(), name);
    if (found == prior.states.end()) {
      throw SetupError(fmt::format("the earlier calibration has no covariance of '{}'", name),
                       "use a calibration of this pair of gyros");
    }
    rows.push_back(found - prior.states.begin());
  }
  for (Eigen::Index i = 0; i < setup.prior_covariance.rows(); ++i) {
    for (Eigen::Index j = 0; j < setup.prior_covariance.cols(); ++j) {
      setup.prior_covariance(i, j) =
          prior.covariance(rows[static_cast<std::size_t>(i)], rows[static_cast<std::size_t>(j)]);
    }
  }
  for (int k = 0; k < Estimator::kGyros; ++k) {
    const GyroCalibration& gyro = prior.gyros[static_cast<std::size_t>(k)];
    if (!is_of_model<Model>(gyro)) {
      throw SetupError(fmt::format("the earlier calibration of gyro {} is of drift model '{}', not {}", k + 1,
                                   gyro.drift_model, Model::kModelName),
                       "use a calibration made with the same drift model");
    }
    setup.prior[k] = to_model<Model>(gyro);
  }
}

/// Whether any state is on that the smallest estimator of a pair does not have.
[[nodiscard]] inline bool has_further_states(const CalibrationOptions& options) {
  constexpr auto kOn = FurtherStateOptions::Choice::kOn;
  const FurtherStateOptions& states = options.further_states;
  return options.drift_model != Esg7::kModelName || states.clock_offset == kOn || states.orbital_error == kOn ||
         states.wandering_drift == kOn || states.readout_bias == kOn;
}

/// The rate of the orbit, as the attitude shows it. An attitude that stands still in space does not show it; then that
/// of a low orbit.
[[nodiscard]] double orbital_rate_rad_s(const StarTrackerTelemetry& tracker);

/// Prior sigma of each component of a readout bias: the largest that an earlier calibration has left of it.
[[nodiscard]] inline double readout_bias_sigma(const std::optional<Calibration>& earlier) {
  double sigma = 0;
  if (earlier) {
    for (const FurtherEstimate& state : earlier->further) {
      sigma = state.name.find("readout_bias") == std::string::npos ? sigma : std::max(sigma, state.sigma);
    }
  }
  return sigma > 0 ? sigma : 1e-4;
}

/// Prior sigmas of the further states; near zero for those that are off.
template <class Estimator>
void use_further_states(const Pass& pass, const CalibrationOptions& options, typename Estimator::Setup& setup) {
  constexpr auto kOn = FurtherStateOptions::Choice::kOn;
  const FurtherStateOptions& states = options.further_states;
  setup.clock_offset_sigma_s = states.clock_offset == kOn ? 0.1 : 1e-9;
  setup.orbital_error_sigma_rad = states.orbital_error == kOn ? 1e-4 : 1e-12;
  setup.wandering_sigma_rad_s = states.wandering_drift == kOn ? states.wandering_drift_rad_s : 1e-15;
  setup.wandering_time_s = to_seconds(states.wandering_time);
  setup.readout_bias_sigma = states.readout_bias == kOn ? readout_bias_sigma(pass.settings.prior) : 1e-12;
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
  typename Estimator::Setup setup;
  use_settings<Estimator>(settings, setup);
  if (settings.prior) {
    if (settings.prior->gyros.size() != static_cast<std::size_t>(pass.gyro.gyros)) {
      throw SetupError(fmt::format("the earlier calibration has {} gyros; the pass has {}",
                                   settings.prior->gyros.size(), pass.gyro.gyros),
                       "use a calibration of these gyros");
    }
    use_calibration<Estimator>(*settings.prior, setup);
  }
  for (int k = 0; k < Estimator::kGyros; ++k) {
    setup.readout_noise_rad[k] = settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad;
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
