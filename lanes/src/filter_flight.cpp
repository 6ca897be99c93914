#include "trihedron/lanes/filter_flight.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "pack.hpp"
#include "state.hpp"
#include "trihedron/core/readings.hpp"
#include "trihedron/ground/choose/settled.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/ground/model/reason_of_failure.hpp"
#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/ground/onboard/recorder.hpp"
#include "trihedron/ground/onboard/replay.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::lanes {
namespace {

static_assert(kTogether == kWidth);

bool is_eq1_alone(const DriftScenario& drift) {
  return drift.harmonics.empty() && drift.outside_sigma_rad_s == 0 && drift.coefficient_walk_rad_s_sqrt_s == 0 &&
         drift.warm_up_fraction == 0 && drift.direction_walk_rad_sqrt_s == 0 && drift.markov_sigma_rad_s == 0 &&
         drift.bump_rad_s == 0 && drift.hysteresis_rad_s == 0 && drift.slew_fraction == 0 &&
         drift.jump_sigma_rad_s == 0 && drift.polhode_fraction == 0 && drift.thermal_fraction == 0;
}

bool reads_without_faults(const ReadoutScenario& readout) {
  return readout.quantum_rad == 0 && readout.latency_s == 0 && readout.dropout_probability == 0 &&
         readout.spike_probability == 0 && readout.stuck_probability == 0;
}

bool is_plain(const GyroScenario& gyro) {
  return is_eq1_alone(gyro.drift) && reads_without_faults(gyro.readout) && !gyro.mounting_change.is_there();
}

bool is_plain(const Scenario& scenario) {
  constexpr double kMostJitter_rad = 0.1 * kDegree;  // of more the lanes' series would not be exact
  return scenario.attitude.jitter_rad <= kMostJitter_rad && scenario.gyros.size() == kGyros &&
         scenario.further_star_trackers.empty() && scenario.gyro_gaps.empty() &&
         scenario.attitude.reference != AttitudeScenario::Reference::kRecorded &&
         std::ranges::all_of(scenario.gyros, [](const GyroScenario& gyro) { return is_plain(gyro); });
}

/// Whether it meets the samples of each flight as they were simulated, at most one fix at a time, and nothing else.
bool is_plain(const Scenario& scenario, const CalibrationOptions& settled) {
  constexpr Duration kMostSpacing = std::chrono::milliseconds(500);
  const bool is_default = settled.estimator == Estimator::kInvariant && settled.drift_model == kEsg7 &&
                          settled.student_t_freedom == 0 && !settled.widen_where_correlated &&
                          std::ranges::none_of(kFurtherStates, [&](const FurtherStateRow& row) {
                            return settled.further_states.is_on(row.state);
                          });
  return is_default && scenario.gyro_period >= Readings<kGyros>::kMinSpacing && scenario.gyro_period <= kMostSpacing;
}

/// Where it has the coefficients of eq. (1) and the alignments.
std::vector<Eigen::Index> parameters_of(const Calibration& calibration) {
  const auto of_eq1 = coefficients_of(kEsg7);
  std::vector<Eigen::Index> parameters;
  for (std::size_t i = 0; i < calibration.states.size(); ++i) {
    const ParameterId& state = calibration.states[i];
    const bool is_of_eq1 = state.is_drift() && std::ranges::find(of_eq1, state.coefficient) != of_eq1.end();
    if (state.is_alignment() || is_of_eq1) {
      parameters.push_back(static_cast<Eigen::Index>(i));
    }
  }
  return parameters;
}

FilterOutcome fly_one(const FilterFlight& flight) {
  FilterOutcome outcome;
  if (auto reason = ground::reason_of_failure([&] { outcome = fly_alone(flight); })) {
    outcome = FilterFailure{std::move(*reason)};
  }
  return outcome;
}

}  // namespace

FilterResult fly_alone(const FilterFlight& flight) {
  const sim::SimulatedPass simulated = sim::simulate(flight.scenario);
  const Pass& pass = simulated.pass;
  ground::Pipeline pipeline(pass.settings, ground::settled_as_told(flight.options),
                            ground::Pipeline::Steps::kEachSample, false);
  FilterResult result;
  AttitudeHistory attitude;
  ground::replay(pass, pipeline, [&](const StepReport& report) {
    const FixReport& fix = report.fix;
    if (fix.status == FixStatus::kNone || fix.status == FixStatus::kPending) {
      return;
    }
    const bool is_judged =
        fix.status == FixStatus::kRejectedByGate || (fix.used() && fix.status != FixStatus::kStarted);
    result.fixes_judged += is_judged ? 1 : 0;
    result.nis_sum_of_judged += is_judged ? fix.nis : 0;
    result.fixes_used += fix.status == FixStatus::kUsed ? 1 : 0;
    result.nis_sum += fix.status == FixStatus::kUsed ? fix.nis : 0;
    result.reopened += fix.status == FixStatus::kUsedAfterReopening || fix.status == FixStatus::kRestarted ||
                               fix.status == FixStatus::kEstimateLost
                           ? 1
                           : 0;
    if (report.calibrated) {
      ground::append(attitude, fix.t, *report.calibrated);
    }
  });
  if (!pipeline.started()) {
    throw std::invalid_argument("no fix could start the filter");
  }
  const Calibration calibration = pipeline.calibration();
  const std::vector<Eigen::Index> parameters = parameters_of(calibration);
  result.drift_model = pipeline.layout().drift_model;
  result.error = ground::estimate_minus_truth(calibration, simulated.truth)(parameters);
  result.covariance = calibration.covariance(parameters, parameters);
  const ground::ErrorStatistics errors =
      ground::statistics(ground::attitude_errors(attitude, simulated.truth.t, simulated.truth.q_in_c));
  result.attitude_rms_rad = errors.rms_rad;
  result.attitude_normalised_square = errors.normalised_square.value_or(0);
  return result;
}

bool goes_in_lanes(const FilterFlight& flight) {
  if (!is_plain(flight.scenario)) {
    return false;
  }
  const PassSettings settings = sim::settings_of(flight.scenario);
  const CalibrationOptions settled = ground::settled_as_told(flight.options);
  if (!is_plain(flight.scenario, settled)) {
    return false;
  }
  const CalibrationSetup setup = ground::pair_estimator(settings, settled)->setup();
  return setup.fixes_sharing_a_sample(flight.scenario.star_tracker_period) <= 1;
}

std::vector<FilterOutcome> fly(std::span<const FilterFlight> flights) {
  std::vector<std::optional<FilterOutcome>> outcomes(flights.size());
  std::vector<std::pair<std::size_t, std::unique_ptr<Lane>>> waiting;
  for (std::size_t i = 0; i < flights.size(); ++i) {
    // One that fails does so once more by itself, which then says why.
    static_cast<void>(ground::reason_of_failure([&] {
      sim::expect_possible(flights[i].scenario);
      if (goes_in_lanes(flights[i])) {
        const auto before = std::ranges::find_if(
            waiting, [&](const auto& its) { return its.second->has_reference_of(flights[i].scenario); });
        auto lane = std::make_unique<Lane>(flights[i], before != waiting.end() ? before->second.get() : nullptr);
        if (lane->turns_by_little()) {
          waiting.emplace_back(i, std::move(lane));
        }
      }
    }));
  }
  while (!waiting.empty()) {
    // Those that are like the first, as many as there is room for.
    const Lane& first = *waiting.front().second;
    const auto others = std::stable_partition(waiting.begin(), waiting.end(), [&](const auto& its) {
      return its.second.get() == &first || its.second->is_like(first);
    });
    const auto size = std::min<std::ptrdiff_t>(others - waiting.begin(), kWidth);
    std::vector<Lane*> lanes;
    std::transform(waiting.begin(), waiting.begin() + size, std::back_inserter(lanes),
                   [](const auto& its) { return its.second.get(); });
    std::vector<std::optional<FilterResult>> results = fly_pack(lanes, kernels());
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (results[i]) {
        outcomes[waiting[i].first] = std::move(*results[i]);
      }
    }
    waiting.erase(waiting.begin(), waiting.begin() + size);
  }
  std::vector<FilterOutcome> all;
  for (std::size_t i = 0; i < flights.size(); ++i) {
    all.push_back(outcomes[i] ? std::move(*outcomes[i]) : fly_one(flights[i]));
  }
  return all;
}

}  // namespace trihedron::lanes
