#include "consistency/flight.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <limits>
#include <memory>

#include "consistency/bound.hpp"
#include "trihedron/core/cycles.hpp"
#include "trihedron/core/invariant_estimator.hpp"
#include "trihedron/core/paper_estimator.hpp"
#include "trihedron/ground/calibrate.hpp"
#include "trihedron/ground/replay.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::consistency {
namespace {

using ParameterErrors = Eigen::Matrix<double, Parameters::kSize, 1>;

template <class Estimator>
typename Estimator::Setup setup_of(const PassSettings& settings, double walk_rad_sqrt_s) {
  typename Estimator::Setup setup;
  for (int k = 0; k < Estimator::kGyros; ++k) {
    const GyroPrior& prior = settings.gyros[static_cast<std::size_t>(k)];
    auto variance = setup.prior_covariance.diagonal();
    variance.template segment<Esg7::kSize>(Parameters::drift(k))
        .setConstant(prior.drift_common_sigma_rad_s * prior.drift_common_sigma_rad_s);
    variance.template segment<3>(Parameters::alignment(k)) = prior.alignment_sigma_rad.cwiseAbs2();
    setup.readout_noise_rad[k] = prior.readout_noise_rad;
  }
  setup.star_tracker_noise_rad = settings.star_tracker_noise_rad;
  setup.direction_random_walk_rad_sqrt_s = walk_rad_sqrt_s;
  return setup;
}

void put_errors(const Truth::Gyro& truth, const Eigen::Matrix<double, Esg7::kSize, 1>& kappa_rad_s,
                const Eigen::Matrix3d& C_c_b, int gyro, ParameterErrors& errors) {
  for (int i = 0; i < Esg7::kSize; ++i) {
    errors(Parameters::drift(gyro) + i) = truth.drift_rad_s[static_cast<std::size_t>(i)].second - kappa_rad_s(i);
  }
  const auto true_C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(truth.alignment_rotation_vector_rad));
  errors.segment<3>(Parameters::alignment(gyro)) = (true_C_c_b * Rot<C, B<1>>::assume(C_c_b).inverse()).log().raw();
}

template <class Estimator>
ParameterErrors errors_of(const Estimator& estimator, const Truth& truth) {
  ParameterErrors errors;
  for (int k = 0; k < Estimator::kGyros; ++k) {
    const auto& estimate = estimator.gyros()[k];
    put_errors(truth.gyros[static_cast<std::size_t>(k)], estimate.drift_rad_s, estimate.C_c_b, k, errors);
  }
  return errors;
}

template <class Estimator>
Outcome calibrate(const sim::SimulatedPass& flown, double walk_rad_sqrt_s, const ParameterErrors& bound_variance) {
  using OnBoard = Cycle<Estimator>;
  const auto created = OnBoard::create(setup_of<Estimator>(flown.pass.settings, walk_rad_sqrt_s), {.navigate = false});
  const auto cycle = std::make_unique<OnBoard>(created.value());
  Outcome outcome;
  ground::replay(
      flown.pass, *cycle,
      [&](const auto& report) {
        const FixStatus status = report.fix.status;
        if (status == FixStatus::kRejectedByGate || (is_used(status) && status != FixStatus::kStarted)) {
          outcome.nis += report.fix.nis;
          ++outcome.fixes;
        }
      },
      [](const auto&) {});
  outcome.nis /= static_cast<double>(outcome.fixes);

  const ParameterErrors errors = errors_of(cycle->estimator(), flown.truth);
  // P = root rootᵀ = RᵀR; P itself would lose what is known of differences of poorly known parameters.
  const Eigen::MatrixXd root = cycle->estimator().error_root().template bottomRows<Parameters::kSize>();
  const Eigen::MatrixXd R = root.transpose().householderQr().matrixQR().topRows<Parameters::kSize>();
  outcome.nees = R.transpose().triangularView<Eigen::Lower>().solve(errors).squaredNorm();
  outcome.error_over_bound_square = errors.cwiseAbs2().cwiseQuotient(bound_variance).mean();
  return outcome;
}

Outcome calibrate_batch(const sim::SimulatedPass& flown, double walk_rad_sqrt_s,
                        const ParameterErrors& bound_variance) {
  CalibrationOptions options;
  options.estimator = ground::kBatch;
  options.drift_model = Esg7::kModelName;
  options.find_noise = false;
  options.direction_random_walk_rad_sqrt_s = walk_rad_sqrt_s;
  options.further_states = FurtherStateOptions::none();
  const Calibration calibration = ground::calibrate(flown.pass, options).calibration;
  ParameterErrors errors;
  for (int k = 0; k < Parameters::kSize / Parameters::kPerGyro; ++k) {
    const auto gyro = static_cast<std::size_t>(k);
    Eigen::Matrix<double, Esg7::kSize, 1> kappa_rad_s;
    for (std::size_t i = 0; i < Esg7::kSize; ++i) {
      kappa_rad_s(static_cast<Eigen::Index>(i)) = calibration.gyros[gyro].drift_rad_s[i].second;
    }
    const auto C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(calibration.gyros[gyro].alignment_rotation_vector_rad));
    put_errors(flown.truth.gyros[gyro], kappa_rad_s, C_c_b.raw(), k, errors);
  }
  Outcome outcome;
  outcome.nis = std::numeric_limits<double>::quiet_NaN();
  outcome.fixes = static_cast<long>(calibration.statistics.at("nis_count"));
  // In units of the sigmas, which differ by ten powers of ten.
  const ParameterErrors sigma = calibration.covariance.diagonal().cwiseSqrt();
  const ParameterErrors scaled = errors.cwiseQuotient(sigma);
  const Eigen::MatrixXd correlation =
      sigma.cwiseInverse().asDiagonal() * calibration.covariance * sigma.cwiseInverse().asDiagonal();
  outcome.nees = scaled.dot(correlation.llt().solve(scaled));
  outcome.error_over_bound_square = errors.cwiseAbs2().cwiseQuotient(bound_variance).mean();
  return outcome;
}

}  // namespace

std::vector<Outcome> fly(const Cell& cell, int run, const std::vector<std::string>& estimators) {
  const sim::SimulatedPass flown = sim::simulate(cell.scenario(run));
  const double walk_rad_sqrt_s = cell.walk_rad_sqrt_s;
  // The bound knows no process noise.
  const ParameterErrors bound_variance =
      walk_rad_sqrt_s > 0 ? ParameterErrors::Constant(std::numeric_limits<double>::quiet_NaN())
                          : ParameterErrors(parameter_bound(flown.pass.settings, flown.truth).diagonal());
  std::vector<Outcome> outcomes;
  for (const std::string& name : estimators) {
    if (name == "paper") {
      outcomes.push_back(calibrate<PaperEstimator<Esg7>>(flown, walk_rad_sqrt_s, bound_variance));
    } else if (name == "invariant") {
      outcomes.push_back(calibrate<InvariantEstimator<Esg7, 2>>(flown, walk_rad_sqrt_s, bound_variance));
    } else {
      outcomes.push_back(calibrate_batch(flown, walk_rad_sqrt_s, bound_variance));
    }
  }
  return outcomes;
}

}  // namespace trihedron::consistency
