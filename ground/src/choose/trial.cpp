#include "choose/trial.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "batch/pass_setup.hpp"
#include "linear/gram.hpp"
#include "model/setup.hpp"

namespace trihedron::ground {
namespace {

/// The models to compare with a model: those that it contains, from the smallest on, and itself.
std::vector<DriftModelId> models_up_to(const DriftModelId& model) {
  std::vector<DriftModelId> models{kEsg7};
  for (int degree = 1; degree <= model.degree; ++degree) {
    models.push_back(vsh(degree));
  }
  if (models.back() != model) {
    models.push_back(model);
  }
  return models;
}

/// Convergence limit of the constants in sigmas: enough for a decision.
constexpr double kNearEnough = 0.2;
/// The first modes are chosen for drift this many times as large as the prior of the field expects.
constexpr double kFirstFieldLevel = 4;
/// ln 3: modes are to be good for drift three times as large as what was found.
constexpr double kRoom = 1.0986;

/// Coarser steps, for speed: over some seconds the body turns by some degrees at most.
PassSetup coarse(PassSetup setup) {
  setup.sample_step = std::chrono::seconds(3);
  setup.fixes_together = std::chrono::seconds(10);
  setup.turn_together_rad = std::numeric_limits<double>::infinity();
  return setup;
}

/// Covariance of the attitude by the readings at a fix, c axes, rad²; 0 where it shares them with the fix before, from
/// which it then is not independent.
Eigen::Matrix3d noise_by_readout(const CalibrationSetup& setup, const PassProblem::Moment& moment) {
  const ScreenedPass::Fix& fix = *moment.fix;
  if (setup.fixes_sharing_a_sample(fix.since_last) > 1) {
    return Eigen::Matrix3d::Zero();
  }
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (int k = 0; k < setup.layout.gyros; ++k) {
    if (fix.used[k]) {
      const Eigen::Vector3d h_c = moment.gyros[k].C_c_b * fix.h_b[k];
      information += (Eigen::Matrix3d::Identity() - h_c * h_c.transpose()) /
                     std::pow(setup.readout_noise_rad[k] * fix.noise_factor, 2);
    }
  }
  return information.inverse();
}

}  // namespace

LogEvidence log_evidence_of(const Eigen::MatrixXd& information, const Eigen::VectorXd& y) {
  constexpr std::array<double, 3> kSizes = {1, 1.0 / 4, 1.0 / 16};
  const auto identity = Eigen::MatrixXd::Identity(y.size(), y.size());
  std::array<double, kSizes.size()> log_factors;
  for (std::size_t i = 0; i < kSizes.size(); ++i) {
    const Eigen::LLT<Eigen::MatrixXd> root(identity + kSizes[i] * kSizes[i] * information);
    log_factors[i] = kSizes[i] * kSizes[i] * y.dot(root.solve(y)) / 2 - root.matrixLLT().diagonal().array().log().sum();
  }
  const double most = *std::ranges::max_element(log_factors);
  double sum = 0;
  for (const double log_factor : log_factors) {
    sum += std::exp(log_factor - most);
  }
  return {most + std::log(sum / static_cast<double>(kSizes.size())), log_factors[0]};
}

bool alike(const ProcessNoise& a, const ProcessNoise& b) {
  const auto same = [](double one, double other) { return std::abs(one - other) <= kNoiseTolerance * other; };
  return same(a.direction_random_walk_rad_sqrt_s, b.direction_random_walk_rad_sqrt_s) &&
         same(a.wandering_drift.sigma, b.wandering_drift.sigma) &&
         same(a.wandering_drift.time_s, b.wandering_drift.time_s);
}

Trial::Trial(const Pass& pass, const Screened& screened, const CalibrationOptions& options,
             const std::optional<ProcessNoise>& noise, const Trial* nearby)
    : drift_model_(*options.drift_model), problem_(screened.pass, coarse(pass_setup(pass.settings, options))) {
  if (options.drift_field) {
    field_.emplace(problem_.layout());
  }
  if (noise) {
    problem_.set_noise(*noise);
  }
  if (field_ && nearby != nullptr && nearby->field_) {
    problem_.use_modes_of(nearby->problem_);
    field_level_ = nearby->field_level_;
    spectrum_ = nearby->spectrum_;
    put_spectrum_into_prior();
  }
  const bool is_near = field_ && nearby != nullptr && nearby->field_ &&
                       alike(nearby->problem_.setup().noise(), problem_.setup().noise()) &&
                       nearby->problem_.layout().dynamic() == problem_.layout().dynamic();
  fit(nearby != nullptr ? first_solution(problem_, nearby->nearby()) : first_solution(problem_, screened), is_near);
}

/// Modes for a field of this level, and the solution by them.
void Trial::use_modes(Eigen::VectorXd level, PassSolution& solution) {
  if (!moved_) {
    moved_ = problem_.moved_by_coefficients(solution);
  }
  DriftModes modes = modes_of(problem_, *moved_, *field_, level);
  for (int k = 0; k < problem_.layout().gyros; ++k) {
    const DriftModes::OfGyro& its = modes.gyros[k];
    auto outside = solution.gyros[k].drift_rad_s.segment(Layout::kEq1, its.coefficients.rows());
    outside = (its.coefficients * (its.amplitudes * outside)).eval();
  }
  problem_.use(std::move(modes), *moved_);
  field_level_ = std::move(level);
}

void Trial::put_spectrum_into_prior() {
  Prior prior = problem_.setup().prior;
  put_sigma(problem_.setup().layout(), *field_, field_->sigma(spectrum_.log_rms), prior);
  problem_.set_prior(std::move(prior));
}

/// Linearises where that is not yet done, finds the spectrum of the field by it, and gives the problem its variances.
/// Where it is larger than the modes are for, they are chosen again.
void Trial::find_field(PassSolution& first) {
  constexpr int kMostRounds = 4;
  double enough = kRoom / 2;  // of modes that were chosen for a spectrum near this one
  if (!problem_.modes()) {
    use_modes(field_->expected().array() + std::log(kFirstFieldLevel), first);
    enough = kRoom;
  }
  for (int round = 0;; ++round) {
    if (found_.linear.stages.empty()) {
      found_.before = first;
      found_.linear = problem_.linearise_by_parts(first);
    }
    spectrum_ =
        most_likely_spectrum(*field_, field_information(found_.linear, problem_.setup().noise()), spectrum_.log_rms);
    const Eigen::VectorXd above = field_level_ - spectrum_.log_rms;
    if ((above.array() > enough).all() || round == kMostRounds) {
      break;
    }
    first = step_from(problem_, std::move(found_.before), std::move(found_.linear)).solution;
    found_ = {};
    use_modes(field_level_.cwiseMax((spectrum_.log_rms.array() + 2 * kRoom).matrix()), first);
    enough = kRoom;
  }
  put_spectrum_into_prior();
}

/// `is_near`: `first` is of nearly the same states and noise, so that the momenta follow the fixes as they should.
void Trial::fit(PassSolution first, bool is_near) {
  if (field_) {
    find_field(first);
    problem_.renew(found_.before, found_.linear);
    found_ = step_from(problem_, std::move(found_.before), std::move(found_.linear));
    first = std::move(found_.solution);
    const bool too_many = ((field_level_ - spectrum_.log_rms).array() > 2 * kRoom).all();
    if (too_many) {
      use_modes(spectrum_.log_rms.array() + kRoom, first);
    }
    moved_.reset();  // long; seldom needed again
    if (is_near && !too_many && found_.step < kNearEnough) {
      found_.solution = std::move(first);
      return;
    }
  }
  found_ = {};  // long: one at a time
  found_ = most_likely(problem_, std::move(first), kNearEnough);
}

void Trial::refit(const ProcessNoise& noise) {
  problem_.set_noise(noise);
  fit(PassSolution(found_.solution), false);
}

Trial::ByNoise Trial::by_noise(const PassProblem::Linear& linear, const ProcessNoise& noise) const {
  if (!field_) {
    return {ground::log_likelihood(problem_, found_.before, linear, noise), {}};
  }
  FieldInformation information = field_information(linear, noise);
  return {information.log_likelihood, std::move(information)};
}

double Trial::log_likelihood(const ByNoise& by) const {
  return by.field ? most_likely_spectrum(*field_, *by.field, spectrum_.log_rms).log_likelihood : by.at_most;
}

std::optional<FieldPrior> Trial::field_prior() const {
  if (!field_) {
    return std::nullopt;
  }
  const FieldInformation information = field_information(found_.linear, problem_.setup().noise());
  return ground::field_prior(problem_, *field_, information,
                             most_likely_spectrum(*field_, information, spectrum_.log_rms));
}

double Trial::log_odds_of_field(const Eigen::VectorXd& sigma_rad_s) const {
  const FieldInformation information = field_information(found_.linear, problem_.setup().noise());
  const Eigen::MatrixXd shown = information.R * sigma_rad_s.asDiagonal();
  Eigen::MatrixXd covariance = square(shown);
  covariance.diagonal().array() += 1;
  const Eigen::LLT<Eigen::MatrixXd> root(covariance);
  const double log_root = root.matrixLLT().diagonal().array().log().sum();
  return (information.y.squaredNorm() - root.matrixL().solve(information.y).squaredNorm()) / 2 - log_root;
}

Trial::InPriorSigmas Trial::in_prior_sigmas(FurtherState state, const std::vector<FurtherState>& zero) const {
  std::vector<int> rows;
  std::vector<double> values;
  std::vector<double> sigmas;
  std::vector<Eigen::Index> its;
  std::vector<Eigen::Index> others;
  const Layout& layout = problem_.layout();
  const CalibrationSetup& setup = problem_.setup().on_board;
  for (const ParameterId& parameter : further_parameters(layout)) {
    const bool is_other = std::ranges::any_of(zero, [&](FurtherState other) { return parameter.is_further(other); });
    if (!is_other && !parameter.is_further(state)) {
      continue;
    }
    (is_other ? others : its).push_back(static_cast<Eigen::Index>(rows.size()));
    rows.push_back(state_of(layout, parameter));
    values.push_back(value_of(setup.layout, found_.solution.gyros, found_.solution.shared, parameter));
    sigmas.push_back(prior_sigma_of_further_state(setup, state_of(setup.layout, parameter)));
  }
  const auto vector = [](const std::vector<double>& numbers) {
    return Eigen::VectorXd::Map(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
  };
  const Eigen::VectorXd scale = vector(sigmas).cwiseInverse();
  const Eigen::VectorXd estimate = vector(values).cwiseProduct(scale);
  const Eigen::MatrixXd root = scale.asDiagonal() * found_.errors.last_root(rows, Eigen::all);
  const Eigen::MatrixXd covariance = root * root.transpose();
  InPriorSigmas found{estimate(its), covariance(its, its), vector(sigmas)(its)};
  if (!others.empty()) {
    const Eigen::MatrixXd gain =
        Eigen::LLT<Eigen::MatrixXd>(covariance(others, others)).solve(covariance(others, its)).transpose();
    found.estimate -= gain * estimate(others);
    found.covariance -= gain * covariance(others, its);
  }
  return found;
}

LogEvidence Trial::log_evidence(FurtherState state, const std::vector<FurtherState>& zero) const {
  const InPriorSigmas found = in_prior_sigmas(state, zero);
  const auto identity = Eigen::MatrixXd::Identity(found.estimate.size(), found.estimate.size());
  const Eigen::MatrixXd information = Eigen::LLT<Eigen::MatrixXd>(found.covariance).solve(identity);
  return log_evidence_of(information - identity, information * found.estimate);
}

double Trial::sigma(FurtherState state, const std::vector<FurtherState>& zero) const {
  const InPriorSigmas found = in_prior_sigmas(state, zero);
  return found.covariance.diagonal().cwiseSqrt().cwiseProduct(found.prior_sigma).maxCoeff();
}

std::vector<Forecast> Trial::forecasts() const {
  return field_ ? std::vector<Forecast>() : ground::forecasts(problem_, found_, models_up_to(drift_model_));
}

std::vector<ChangeBetweenFixes> Trial::changes() const {
  constexpr Duration kClose = std::chrono::seconds(100);  // over which nothing slow changes by as much as the noise
  const CalibrationSetup& setup = problem_.setup().on_board;
  struct Difference {
    Time fix_t;
    Eigen::Quaterniond apart;
    Eigen::Vector3d fix_variance;
    Eigen::Vector3d readout_variance;
  };
  std::vector<ChangeBetweenFixes> changes;
  std::optional<Difference> last;
  problem_.go_along_momenta(found_.solution, [&](const PassProblem::Moment& moment) {
    if (moment.fix == nullptr || moment.fix->fix.head != 0) {
      return;
    }
    const auto by_gyros = problem_.attitude(moment, moment.fix->h_b, moment.fix->used);
    if (!by_gyros) {
      return;
    }
    const StarFix& fix = moment.fix->fix;
    const Difference now{fix.t, by_gyros.value().C_in_c.quaternion().conjugate() * fix.q_in_c.normalized(),
                         fix_noise(setup, fix).diagonal(), noise_by_readout(setup, moment).diagonal()};
    if (last && now.fix_t - last->fix_t < kClose) {
      changes.push_back({Rot<C, C>::assume(last->apart.conjugate() * now.apart).log().raw(),
                         (last->fix_variance + now.fix_variance) / 2,
                         (last->readout_variance + now.readout_variance) / 2});
    }
    last = now;
  });
  return changes;
}

}  // namespace trihedron::ground
