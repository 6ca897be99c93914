#pragma once
/// From an estimator and options to the problem that the whole pass poses.

#include <algorithm>
#include <vector>

#include "batch/pass_problem.hpp"
#include "onboard/screen.hpp"
#include "onboard/setup.hpp"

namespace trihedron::ground {

/// Star trackers beside the first that the estimator uses.
template <class Estimator>
[[nodiscard]] int further_heads(const Pass& pass) {
  return std::min(static_cast<int>(pass.further_star_trackers.size()), Estimator::kHeads - 1);
}

/// Of the further states that are on, but for wandering drift; shared ones first, then those of the gyros.
[[nodiscard]] std::vector<ParameterId> further_parameters(const FurtherStateOptions& states, int further_heads,
                                                          int gyros);

/// The problem that Estimator solves on board, with the drift model asked for and only those further states that are
/// on. Throws SetupError.
template <class Estimator>
[[nodiscard]] PassSetup pass_setup(const typename Estimator::Setup& from, const Pass& pass,
                                   const CalibrationOptions& options) {
  const FurtherStateOptions& states = options.further_states;
  const int heads = further_heads<Estimator>(pass);
  PassSetup setup;
  setup.family = family_of(decided_drift_model(options));
  setup.layout = {.gyros = Estimator::kGyros,
                  .drift_size = setup.family.size(),
                  .wandering_drift = states.is_on(FurtherState::kWanderingDrift),
                  .readout_bias = states.is_on(FurtherState::kReadoutBias),
                  .coefficient_change = states.is_on(FurtherState::kCoefficientChange),
                  .clock_offset = states.is_on(FurtherState::kClockOffset),
                  .orbital_error = states.is_on(FurtherState::kOrbitalError),
                  .further_heads = heads};
  setup.prior = prior_of(pass.settings, Estimator::kGyros, setup.family);
  for (int k = 0; k < Estimator::kGyros; ++k) {
    setup.readout_noise_rad.push_back(from.readout_noise_rad[k]);
  }
  setup.fix_noise.emplace_back(from.star_tracker_noise_rad.cwiseAbs2().asDiagonal());
  if constexpr (Estimator::kHeads > 1) {
    for (int i = 0; i < heads; ++i) {
      const HeadSetup& head = from.further_heads[static_cast<std::size_t>(i)];
      setup.fix_noise.emplace_back(head.C_c_s * head.noise_rad.cwiseAbs2().asDiagonal() * head.C_c_s.transpose());
      setup.head_alignment_sigma_rad.push_back(head.alignment_sigma_rad);
    }
  }
  setup.noise.direction_random_walk_rad_sqrt_s = from.direction_random_walk_rad_sqrt_s;
  if constexpr (requires { from.orbital_rate_rad_s; }) {
    setup.readout_bias_sigma = from.readout_bias_sigma;
    setup.clock_offset_sigma_s = from.clock_offset_sigma_s;
    setup.orbital_error_sigma_rad = from.orbital_error_sigma_rad;
    setup.orbital_rate_rad_s = from.orbital_rate_rad_s;
    setup.orbital_phase_zero = from.orbital_phase_zero;
    setup.noise.wandering_sigma_rad_s = from.wandering_sigma_rad_s;
    setup.noise.wandering_time_s = from.wandering_time_s;
  }
  setup.coefficient_change_sigma_rad_s =
      row_of(FurtherState::kCoefficientChange).prior_sigma * pass.settings.gyros[0].drift_common_sigma_rad_s;
  setup.gate_nis = from.gate_nis;
  return setup;
}

/// The problem that these options pose; nothing is left to decide in them. Throws SetupError.
[[nodiscard]] PassSetup setup_of(const Pass& pass, const CalibrationOptions& options);

/// Where the iteration to the most likely solution begins.
[[nodiscard]] PassSolution first_solution(const PassProblem& problem, const Screened& screened);

}  // namespace trihedron::ground
