#include "consistency/flight.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <limits>
#include <memory>
#include <optional>

#include "consistency/bound.hpp"
#include "consistency/statistics.hpp"
#include "trihedron/core/cycles.hpp"
#include "trihedron/core/invariant_estimator.hpp"
#include "trihedron/core/paper_estimator.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
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

template <class Estimator>
typename Estimator::Setup setup_of(const PassSettings& settings, double walk_rad_sqrt_s) {
  typename Estimator::Setup setup;
  setup.prior_covariance = prior_covariance(settings);
  for (int k = 0; k < kGyros; ++k) {
    setup.readout_noise_rad[k] = settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad;
  }
  setup.star_tracker_noise_rad = settings.star_tracker_noise_rad;
  setup.direction_random_walk_rad_sqrt_s = walk_rad_sqrt_s;
  return setup;
}

/// Estimate − truth.
template <class Estimator>
ParameterErrors errors_of(const Estimator& estimator, const Truth& truth) {
  Calibration calibration;
  for (const auto& gyro : estimator.gyros()) {
    GyroCalibration& record = calibration.gyros.emplace_back();
    record.drift_rad_s.assign(gyro.drift_rad_s.begin(), gyro.drift_rad_s.end());
    record.alignment_rotation_vector_rad = Rot<C, B<1>>::assume(gyro.C_c_b).log().raw();
  }
  calibration.states = drift_and_alignment(kEsg7, calibration.gyros.size());
  return ground::estimate_minus_truth(calibration, truth);
}

template <class Estimator>
Estimate by_filter(const sim::SimulatedPass& flown, double walk_rad_sqrt_s) {
  using OnBoard = Cycle<Estimator>;
  const auto created = OnBoard::create(setup_of<Estimator>(flown.pass.settings, walk_rad_sqrt_s), {.navigate = false});
  const auto cycle = std::make_unique<OnBoard>(created.value());
  Estimate estimate;
  ground::replay(
      flown.pass, *cycle,
      [&](const auto& report) {
        const FixStatus status = report.fix.status;
        if (status == FixStatus::kRejectedByGate || (is_used(status) && status != FixStatus::kStarted)) {
          estimate.nis += report.fix.nis;
          ++estimate.fixes;
        }
      },
      [](const auto&) {});
  estimate.nis /= static_cast<double>(estimate.fixes);

  estimate.errors = errors_of(cycle->estimator(), flown.truth);
  // P = root rootᵀ = RᵀR; P itself would lose what is known of differences of poorly known parameters.
  const Eigen::MatrixXd root = cycle->estimator().error_root().template bottomRows<Parameters::kSize>();
  const Eigen::MatrixXd R = root.transpose().householderQr().matrixQR().topRows<Parameters::kSize>();
  estimate.nees = R.transpose().triangularView<Eigen::Lower>().solve(estimate.errors).squaredNorm();
  estimate.covariance = root * root.transpose();
  return estimate;
}

Estimate by_batch(const sim::SimulatedPass& flown, double walk_rad_sqrt_s) {
  CalibrationOptions options;
  options.estimator = Estimator::kBatch;
  options.drift_model = kEsg7;
  options.find_noise = false;
  options.direction_random_walk_rad_sqrt_s = walk_rad_sqrt_s;
  options.further_states = FurtherStateOptions::none();
  const Calibration calibration = ground::calibrate(flown.pass, options).calibration;
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
    invariant = by_filter<InvariantEstimator<Esg7, kGyros>>(flown, walk_rad_sqrt_s);
  }
  std::vector<Outcome> outcomes;
  for (const Estimator estimator : estimators) {
    if (estimator == Estimator::kPaper) {
      outcomes.push_back(outcome_of(by_filter<PaperEstimator<Esg7>>(flown, walk_rad_sqrt_s)));
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
