#include "trihedron/plan/confirm.hpp"

#include <cmath>
#include <mutex>
#include <utility>

#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/sim/random.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::plan {
namespace {

/// The scenario with another seed, and with alignments and coefficients drawn from their priors.
Scenario drawn(Scenario scenario, std::uint64_t run) {
  scenario.seed += 1 + run;
  for (std::size_t k = 0; k < scenario.gyros.size(); ++k) {
    GyroScenario& gyro = scenario.gyros[k];
    gyro.misalignment_rad =
        gyro.alignment_prior_sigma_rad * sim::Stream(scenario.seed, sim::Source::kMisalignment, k).normal3();
    gyro.drift.kappa_rad_s.reset();
  }
  return scenario;
}

struct Outcome {
  Eigen::VectorXd errors;  ///< estimate − truth
  double nees = 0;
};

Outcome fly(const Scenario& scenario, const CalibrationOptions& options) {
  const sim::SimulatedPass flown = sim::simulate(scenario);
  const Calibration calibration = ground::calibrate(flown.pass, options).calibration;
  Outcome outcome{ground::estimate_minus_truth(calibration, flown.truth, ground::UnnamedDrift::kIsZero)};
  outcome.nees = ground::normalised_square(outcome.errors, calibration.covariance);
  return outcome;
}

}  // namespace

Confirmation confirm(const Scenario& scenario, const std::vector<ground::Combination>& combinations,
                     const ground::Observability& predicted, int runs, const Progress& progress) {
  CalibrationOptions options = predicted.options;
  options.estimator = Estimator::kBatch;
  std::mutex one_at_a_time;
  double done = 0;
  const std::vector<Outcome> outcomes = ground::on_all_cores(static_cast<std::size_t>(runs), [&](std::size_t run) {
    Outcome outcome = fly(drawn(scenario, run), options);
    const std::scoped_lock lock(one_at_a_time);
    done += 1;
    if (progress) {
      progress({}, done / runs);
    }
    return outcome;
  });

  Confirmation confirmation;
  confirmation.runs = runs;
  for (const Outcome& outcome : outcomes) {
    confirmation.nees += outcome.nees / runs;
    confirmation.parameters = static_cast<int>(outcome.errors.size());
  }
  double square = 0;
  for (const ground::Combination& combination : combinations) {
    // Further states stand after the parameters of the gyros; their truth is not known here, so their errors count as
    // zero.
    Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(predicted.covariance.rows(), predicted.covariance.cols());
    for (const Outcome& outcome : outcomes) {
      scatter.topLeftCorner(outcome.errors.size(), outcome.errors.size()) +=
          outcome.errors * outcome.errors.transpose() / runs;
    }
    const Confirmation::Along along{combination, sigma_along(combination, predicted, predicted.covariance),
                                    sigma_along(combination, predicted, scatter)};
    square += std::pow(along.simulated / along.predicted, 2) / static_cast<double>(combinations.size());
    confirmation.along.push_back(along);
  }
  confirmation.ratio = std::sqrt(square);
  return confirmation;
}

}  // namespace trihedron::plan
