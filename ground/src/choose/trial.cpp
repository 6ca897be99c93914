#include "choose/trial.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <chrono>
#include <optional>

#include "batch/pass_setup.hpp"

namespace trihedron::ground {
namespace {

/// ln of the Bayes factor for states being free instead of zero (Savage and Dickey): the density of zero before over
/// that after. `root`: a square root of their covariance now.
double log_bayes_factor(const Eigen::VectorXd& estimate, const Eigen::MatrixXd& root,
                        const Eigen::VectorXd& prior_sigma) {
  const Eigen::MatrixXd scaled = prior_sigma.cwiseInverse().asDiagonal() * root;
  const Eigen::LLT<Eigen::MatrixXd> covariance(scaled * scaled.transpose());
  const Eigen::VectorXd white = covariance.matrixL().solve(estimate.cwiseQuotient(prior_sigma));
  return white.squaredNorm() / 2 + covariance.matrixLLT().diagonal().array().log().sum();
}

/// From the smallest on, those that a model contains and that are tried.
std::vector<DriftModelId> models_up_to(const DriftModelId& model) {
  std::vector<DriftModelId> models{kEsg7};
  for (int degree = 1; is_for_whole_pass(model) && degree <= model.degree; ++degree) {
    models.push_back(vsh(degree));
  }
  if (models.back() != model) {
    models.push_back(model);
  }
  return models;
}

/// Of the constants, in their sigmas: decisions need no more.
constexpr double kNearEnough = 0.2;

/// What decisions need, in a fraction of the time: over some seconds the body turns by some degrees at most.
PassSetup coarse(PassSetup setup) {
  setup.sample_step = std::chrono::seconds(3);
  setup.fixes_together = std::chrono::seconds(10);
  return setup;
}

}  // namespace

Trial::Trial(const Pass& pass, const Screened& screened, const CalibrationOptions& options)
    : drift_model_(decided_drift_model(options)),
      problem_(screened.pass, coarse(setup_of(pass, options))),
      found_(most_likely(problem_, first_solution(problem_, screened), kNearEnough)) {}

void Trial::refit(const ProcessNoise& noise) {
  problem_.set_noise(noise);
  found_ = most_likely(problem_, std::move(found_.solution), kNearEnough);
}

double Trial::log_evidence(FurtherState state) const {
  switch (state) {
    case FurtherState::kClockOffset:
      return of_shared(layout().clock(), row_of(state).size, problem_.setup().clock_offset_sigma_s);
    case FurtherState::kOrbitalError:
      return of_shared(layout().orbital(), row_of(state).size, problem_.setup().orbital_error_sigma_rad);
    case FurtherState::kReadoutBias:
      return of_readout_bias();
    case FurtherState::kCoefficientChange:
      return of_coefficient_change();
    case FurtherState::kStarTrackerAlignment:
    case FurtherState::kWanderingDrift:
      break;
  }
  return 0;
}

double Trial::of_readout_bias() const {
  const int size = 3 * layout().gyros;
  Eigen::VectorXd estimate(size);
  for (int k = 0; k < layout().gyros; ++k) {
    const int row = 3 * k;
    estimate.segment<3>(row) = gyro(k).readout_bias;
  }
  return log_bayes_factor(estimate, found_.errors.last_root.middleRows(layout().bias(0), size),
                          Eigen::VectorXd::Constant(size, problem_.setup().readout_bias_sigma));
}

double Trial::of_coefficient_change() const {
  const int size = Esg7::kSize * layout().gyros;
  Eigen::VectorXd estimate(size);
  for (int k = 0; k < layout().gyros; ++k) {
    const int row = Esg7::kSize * k;
    estimate.segment<Esg7::kSize>(row) = gyro(k).change_rad_s;
  }
  return log_bayes_factor(estimate, found_.errors.last_root.middleRows(layout().change(0), size),
                          Eigen::VectorXd::Constant(size, problem_.setup().coefficient_change_sigma_rad_s));
}

std::vector<Forecast> Trial::forecasts() const {
  return ground::forecasts(problem_, found_, models_up_to(drift_model_));
}

std::vector<Eigen::Vector3d> Trial::changes_rad() const {
  constexpr Duration kClose = std::chrono::seconds(10);  // over which nothing slow changes
  std::vector<Eigen::Vector3d> changes;
  std::optional<Eigen::Quaterniond> last;
  Time last_t{};
  problem_.go_along(found_.solution, [&](const PassProblem::Moment& moment) {
    if (moment.fix == nullptr || moment.fix->fix.head != 0) {
      return;
    }
    const auto by_gyros = PassProblem::attitude(found_.solution, moment, moment.fix->h_b, moment.fix->used);
    if (!by_gyros) {
      return;
    }
    const Eigen::Quaterniond apart =
        by_gyros.value().C_in_c.quaternion().conjugate() * moment.fix->fix.q_in_c.normalized();
    if (last && moment.t - last_t < kClose) {
      changes.emplace_back(Rot<C, C>::assume(last->conjugate() * apart).log().raw());
    }
    last = apart;
    last_t = moment.t;
  });
  return changes;
}

double Trial::of_shared(int state, int size, double prior_sigma) const {
  return log_bayes_factor(found_.solution.shared.segment(state - layout().shared(), size),
                          found_.errors.last_root.middleRows(state, size),
                          Eigen::VectorXd::Constant(size, prior_sigma));
}

}  // namespace trihedron::ground
