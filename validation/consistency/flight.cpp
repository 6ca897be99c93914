#include "consistency/flight.hpp"

#include <algorithm>
#include <limits>
#include <optional>

#include "consistency/bound.hpp"
#include "consistency/statistics.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/ground/onboard/replay.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::consistency {
namespace {

/// Result of one estimator on one flight.
struct Estimate {
  ParameterErrors errors;          ///< estimate − truth
  ParameterCovariance covariance;  ///< as it claims
  double nees = 0;
  double nis = 0;
  long fixes = 0;
};

ParameterCovariance prior_covariance(const PassSettings& settings) {
  ParameterErrors variance;
  for (int k = 0; k < kGyros; ++k) {
    const GyroPrior& prior = settings.gyros[static_cast<std::size_t>(k)];
    variance.segment<Esg7::kSize>(Parameters::drift(k))
        .setConstant(prior.drift_common_sigma_rad_s * prior.drift_common_sigma_rad_s);
    variance.segment<3>(Parameters::alignment(k)) = prior.alignment_sigma_rad.cwiseAbs2();
  }
  return variance.asDiagonal();
}

/// Nothing is left to decide; the noise is told.
CalibrationOptions options_of(Estimator estimator, double walk_rad_sqrt_s) {
  CalibrationOptions options;
  options.estimator = estimator;
  options.drift_model = kEsg7;
  options.find_noise = false;
  options.direction_random_walk_rad_sqrt_s = walk_rad_sqrt_s;
  options.further_states = FurtherStateOptions::none();
  return options;
}

Estimate by_filter(const sim::SimulatedPass& flown, Estimator estimator, double walk_rad_sqrt_s) {
  ground::Pipeline pipeline(flown.pass.settings, options_of(estimator, walk_rad_sqrt_s), false);
  Estimate estimate;
  ground::replay(flown.pass, pipeline, [&](const StepReport& report) {
    const FixStatus status = report.fix.status;
    if (status == FixStatus::kRejectedByGate || (is_used(status) && status != FixStatus::kStarted)) {
      estimate.nis += report.fix.nis;
      ++estimate.fixes;
    }
  });
  estimate.nis /= static_cast<double>(estimate.fixes);
  const Calibration calibration = pipeline.calibration();
  estimate.errors = ground::estimate_minus_truth(calibration, flown.truth);
  estimate.covariance = calibration.covariance;
  estimate.nees = nees(estimate.errors, estimate.covariance);
  return estimate;
}

Estimate by_batch(const sim::SimulatedPass& flown, double walk_rad_sqrt_s) {
  const Calibration calibration =
      ground::calibrate(flown.pass, options_of(Estimator::kBatch, walk_rad_sqrt_s)).calibration;
  Estimate estimate;
  estimate.errors = ground::estimate_minus_truth(calibration, flown.truth);
  estimate.covariance = calibration.covariance;
  estimate.nis = calibration.statistics.nis_mean.value();
  estimate.fixes = calibration.statistics.nis_count;
  estimate.nees = nees(estimate.errors, estimate.covariance);
  return estimate;
}

}  // namespace

std::vector<Outcome> fly(const Cell& cell, int run, const std::vector<Estimator>& estimators) {
  const sim::SimulatedPass flown = sim::simulate(cell.scenario(run));
  const double walk_rad_sqrt_s = cell.walk_rad_sqrt_s;
  const ParameterCovariance prior = prior_covariance(flown.pass.settings);
  // The bound knows no process noise.
  const ParameterErrors bound_variance =
      walk_rad_sqrt_s > 0 ? ParameterErrors::Constant(std::numeric_limits<double>::quiet_NaN())
                          : ParameterErrors(parameter_bound(flown.pass.settings, flown.truth).diagonal());
  const auto outcome_of = [&](const Estimate& estimate) {
    Outcome outcome;
    outcome.nees = estimate.nees;
    outcome.observable = observable_nees(estimate.errors, estimate.covariance, prior);
    outcome.nis = estimate.nis;
    outcome.fixes = estimate.fixes;
    outcome.error_over_bound_square = estimate.errors.cwiseAbs2().cwiseQuotient(bound_variance).mean();
    return outcome;
  };
  std::optional<Estimate> invariant;  // estimator batch is compared with it
  if (std::ranges::any_of(estimators, [](Estimator estimator) { return estimator != Estimator::kPaper; })) {
    invariant = by_filter(flown, Estimator::kInvariant, walk_rad_sqrt_s);
  }
  std::vector<Outcome> outcomes;
  for (const Estimator estimator : estimators) {
    if (estimator == Estimator::kPaper) {
      outcomes.push_back(outcome_of(by_filter(flown, Estimator::kPaper, walk_rad_sqrt_s)));
    } else if (estimator == Estimator::kInvariant) {
      outcomes.push_back(outcome_of(*invariant));
    } else {
      const Estimate batch = by_batch(flown, walk_rad_sqrt_s);
      Outcome& outcome = outcomes.emplace_back(outcome_of(batch));
      // The errors are small rotations of the truth: what they differ by is what the estimates differ by.
      const ParameterErrors difference = batch.errors - invariant->errors;
      outcome.by_parameter = difference_by_parameter(difference, invariant->covariance, batch.covariance);
      outcome.by_combination = difference_by_combination(difference, invariant->covariance, batch.covariance);
    }
  }
  return outcomes;
}

}  // namespace trihedron::consistency
