#include "decide.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "setup.hpp"
#include "trihedron/core/invariant_estimator.hpp"
#include "trihedron/ground/replay.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;
using Full = InvariantEstimator<Esg20, 2, kAllFurtherStates>;

/// Odds of 20 to 1.
constexpr double kStrong = 3;

/// ln of the Bayes factor for states being free instead of zero (Savage and Dickey): the density of zero before over
/// that after. `root`: a square root of their covariance now.
double log_evidence(const Eigen::VectorXd& estimate, const Eigen::MatrixXd& root, const Eigen::VectorXd& prior_sigma) {
  const Eigen::MatrixXd scaled = prior_sigma.cwiseInverse().asDiagonal() * root;
  const Eigen::LLT<Eigen::MatrixXd> covariance(scaled * scaled.transpose());
  const Eigen::VectorXd white = covariance.matrixL().solve(estimate.cwiseQuotient(prior_sigma));
  return white.squaredNorm() / 2 + covariance.matrixLLT().diagonal().array().log().sum();
}

/// States of the estimator, and how they stand after the pass.
class Outcome {
 public:
  explicit Outcome(const Full& estimator) : estimator_(estimator), root_(estimator.information().inverse_root()) {}

  [[nodiscard]] double of_shared(int state, int size, double prior_sigma) const {
    return log_evidence(estimator_.shared().segment(state - Full::Layout::kShared, size), root_.middleRows(state, size),
                        Eigen::VectorXd::Constant(size, prior_sigma));
  }
  /// Of all gyros' coefficients that Esg20 has and eq. (1) does not.
  [[nodiscard]] double of_drift_outside() const {
    constexpr int kMembers = Esg20::kMembers;
    Eigen::VectorXd estimate(2 * kMembers);
    Eigen::VectorXd sigma(2 * kMembers);
    Eigen::MatrixXd root(2 * kMembers, root_.cols());
    for (int k = 0; k < 2; ++k) {
      const int row = k * kMembers;
      estimate.segment<kMembers>(row) = estimator_.gyros()[k].drift_rad_s.segment<kMembers>(Esg7::kSize);
      root.middleRows<kMembers>(row) = root_.middleRows<kMembers>(Full::Layout::drift(k) + Esg7::kSize);
      sigma.segment<kMembers>(row) = estimator_.setup()
                                         .prior_covariance.diagonal()
                                         .segment<kMembers>(Full::Setup::Layout::drift(k) + Esg7::kSize)
                                         .cwiseSqrt();
    }
    return log_evidence(estimate, root, sigma);
  }

 private:
  const Full& estimator_;
  Full::Information::Matrix root_;
};

CalibrationOptions without_further_states(CalibrationOptions options) {
  options.drift_model = Esg7::kModelName;
  for (Choice* choice : {&options.further_states.clock_offset, &options.further_states.orbital_error,
                         &options.further_states.wandering_drift}) {
    *choice = Choice::kOff;
  }
  return options;
}

/// As in the prior calibration.
CalibrationOptions as_before(CalibrationOptions options, const Calibration& prior) {
  const auto had = [&](const char* name) {
    return std::any_of(prior.further.begin(), prior.further.end(),
                       [&](const FurtherEstimate& state) { return state.name.starts_with(name); });
  };
  const auto settle = [](Choice& choice, bool on) {
    if (choice == Choice::kAuto) {
      choice = on ? Choice::kOn : Choice::kOff;
    }
  };
  FurtherStateOptions& states = options.further_states;
  settle(states.clock_offset, had("clock_offset"));
  settle(states.orbital_error, had("orbital"));
  settle(states.wandering_drift, false);
  if (options.drift_model == kAutoDriftModel && !prior.gyros.empty()) {
    options.drift_model = prior.gyros[0].drift_model;
  }
  return options;
}

}  // namespace

Decision decide(const Pass& pass, const CalibrationOptions& options) {
  FurtherStateOptions states = options.further_states;
  if (options.estimator != Full::kName || pass.gyro.gyros != Full::kGyros) {
    CalibrationOptions decided = without_further_states(options);
    decided.drift_model = options.drift_model == kAutoDriftModel ? Esg7::kModelName : options.drift_model;
    return {decided, {}};
  }
  if (pass.settings.prior) {
    return {as_before(options, *pass.settings.prior), {}};
  }
  Decision decision{options, {}};
  FurtherStateOptions& decided = decision.options.further_states;
  if (decided.wandering_drift == Choice::kAuto) {
    decided.wandering_drift = Choice::kOff;
  }
  if (options.drift_model != kAutoDriftModel && states.clock_offset != Choice::kAuto &&
      states.orbital_error != Choice::kAuto) {
    return decision;
  }
  CalibrationOptions everything = decision.options;
  everything.drift_model = Esg20::kModelName;
  for (Choice* choice : {&everything.further_states.clock_offset, &everything.further_states.orbital_error}) {
    *choice = Choice::kOn;
  }
  const auto cycle = make_cycle<Full>(pass, everything);
  const auto ignore = [](const auto&) {};
  replay(pass, *cycle, ignore, ignore);
  if (!cycle->estimator().started()) {
    return {without_further_states(options), {}};
  }
  const Outcome outcome(cycle->estimator());
  const auto& setup = cycle->estimator().setup();
  const auto settle = [&](const char* name, double log_evidence) {
    decision.evidence.push_back({name, log_evidence, log_evidence > kStrong});
    return decision.evidence.back().accepted;
  };
  if (states.clock_offset == Choice::kAuto) {
    const bool on =
        settle("clock_offset", outcome.of_shared(Full::Layout::clock_offset(), 1, setup.clock_offset_sigma_s));
    decided.clock_offset = on ? Choice::kOn : Choice::kOff;
  }
  if (states.orbital_error == Choice::kAuto) {
    const bool on =
        settle("orbital_error", outcome.of_shared(Full::Layout::orbital_error(), 6, setup.orbital_error_sigma_rad));
    decided.orbital_error = on ? Choice::kOn : Choice::kOff;
  }
  if (options.drift_model == kAutoDriftModel) {
    const bool on = settle("drift_outside_eq1", outcome.of_drift_outside());
    decision.options.drift_model = on ? Esg20::kModelName : Esg7::kModelName;
  }
  return decision;
}

}  // namespace trihedron::ground
