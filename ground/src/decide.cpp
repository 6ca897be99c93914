#include "decide.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "setup.hpp"
#include "trihedron/core/invariant_estimator.hpp"
#include "trihedron/ground/replay.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;
using Full = InvariantEstimator<Esg20, 2, kAllFurtherStates>;

/// Odds of 20 to 1.
constexpr double kStrong = 3;
/// Pairs of fixes that give the noise of the star tracker within some percent.
constexpr std::size_t kEnough = 1000;
/// A difference of the noise that is more than chance.
constexpr double kNotable = 0.1;

/// ln of the Bayes factor for states being free instead of zero (Savage and Dickey): the density of zero before over
/// that after. `root`: a square root of their covariance now.
double log_evidence(const Eigen::VectorXd& estimate, const Eigen::MatrixXd& root, const Eigen::VectorXd& prior_sigma) {
  const Eigen::MatrixXd scaled = prior_sigma.cwiseInverse().asDiagonal() * root;
  const Eigen::LLT<Eigen::MatrixXd> covariance(scaled * scaled.transpose());
  const Eigen::VectorXd white = covariance.matrixL().solve(estimate.cwiseQuotient(prior_sigma));
  return white.squaredNorm() / 2 + covariance.matrixLLT().diagonal().array().log().sum();
}

/// One run over the pass.
template <class Estimator>
class Trial {
 public:
  Trial(const Pass& pass, const CalibrationOptions& options) : cycle_(make_cycle<Estimator>(pass, options)) {
    const auto ignore = [](const auto&) {};
    const double gate_nis = options.gate_nis;
    std::optional<Eigen::Quaterniond> last;
    Time last_t{};
    auto fix = pass.star_tracker.t.begin();
    const auto on_fix = [&](const typename Cycle<Estimator>::Report& report) {
      if (report.fix.status != FixStatus::kUsed && report.fix.status != FixStatus::kRejectedByGate) {
        return;
      }
      // An outlier counts as one, however far out it is.
      log_likelihood_ -= std::min(report.fix.nis, gate_nis) / 2 +
                         report.fix.innovation_covariance.llt().matrixLLT().diagonal().array().log().sum();
      fix = std::lower_bound(fix, pass.star_tracker.t.end(), report.fix.t);
      if (!report.calibrated || fix == pass.star_tracker.t.end() || *fix != report.fix.t) {
        return;
      }
      const auto i = static_cast<std::size_t>(fix - pass.star_tracker.t.begin());
      const Eigen::Quaterniond apart =
          report.calibrated->C_in_c.quaternion().conjugate() * pass.star_tracker.q_in_c[i].normalized();
      if (last && report.fix.t - last_t < kClose) {
        const Eigen::Vector3d change = Rot<C, C>::assume(last->conjugate() * apart).log().raw();
        for (int axis = 0; axis < 3; ++axis) {
          changes_rad_[static_cast<std::size_t>(axis)].push_back(std::abs(change(axis)));
        }
      }
      last = apart;
      last_t = report.fix.t;
    };
    replay(pass, *cycle_, on_fix, ignore);
  }

  [[nodiscard]] const Estimator& estimator() const { return cycle_->estimator(); }
  [[nodiscard]] double log_likelihood() const { return log_likelihood_; }

  /// 1-sigma of the first star tracker about c x, y, z, by how its difference from the gyros changes from fix to fix:
  /// all that is slow cancels, and of outliers only the median feels. Needs changes().
  [[nodiscard]] Eigen::Vector3d star_tracker_noise_rad() const {
    constexpr double kMedianOfNormal = 0.6744897501960817;
    Eigen::Vector3d noise_rad;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> changes = changes_rad_[static_cast<std::size_t>(axis)];
      const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
      std::nth_element(changes.begin(), middle, changes.end());
      noise_rad(axis) = *middle / kMedianOfNormal / std::numbers::sqrt2;
    }
    return noise_rad;
  }
  [[nodiscard]] std::size_t changes() const { return changes_rad_[0].size(); }

 private:
  static constexpr Duration kClose = std::chrono::seconds(10);  ///< fixes between which nothing slow changes

  std::unique_ptr<Cycle<Estimator>> cycle_;
  double log_likelihood_ = 0;
  std::array<std::vector<double>, 3> changes_rad_;
};

/// What a run with all further states shows of each.
class States {
 public:
  /// Needs estimator.started().
  explicit States(const Full& estimator) : estimator_(estimator), root_(estimator.information().inverse_root()) {}

  [[nodiscard]] double clock_offset() const {
    return of_shared(Full::Layout::clock_offset(), 1, setup().clock_offset_sigma_s);
  }
  [[nodiscard]] double orbital_error() const {
    return of_shared(Full::Layout::orbital_error(), 6, setup().orbital_error_sigma_rad);
  }
  /// Of all gyros' coefficients that eq. (1) does not have.
  [[nodiscard]] double drift_outside() const {
    constexpr int kMembers = Esg20::kMembers;
    Eigen::VectorXd estimate(2 * kMembers);
    Eigen::VectorXd sigma(2 * kMembers);
    Eigen::MatrixXd root(2 * kMembers, root_.cols());
    for (int k = 0; k < 2; ++k) {
      const int row = k * kMembers;
      estimate.segment<kMembers>(row) = estimator_.gyros()[k].drift_rad_s.segment<kMembers>(Esg7::kSize);
      root.middleRows<kMembers>(row) = root_.middleRows<kMembers>(Full::Layout::drift(k) + Esg7::kSize);
      sigma.segment<kMembers>(row) = setup()
                                         .prior_covariance.diagonal()
                                         .segment<kMembers>(Full::Setup::Layout::drift(k) + Esg7::kSize)
                                         .cwiseSqrt();
    }
    return log_evidence(estimate, root, sigma);
  }

 private:
  [[nodiscard]] const Full::Setup& setup() const { return estimator_.setup(); }
  [[nodiscard]] double of_shared(int state, int size, double prior_sigma) const {
    return log_evidence(estimator_.shared().segment(state - Full::Layout::kShared, size), root_.middleRows(state, size),
                        Eigen::VectorXd::Constant(size, prior_sigma));
  }

  const Full& estimator_;
  Eigen::MatrixXd root_;
};

/// The log likelihood of a pass under options.
using Likelihood = std::function<double(const CalibrationOptions&)>;

/// The process noise that makes the pass most likely, not below that of the options: by factors of eight, since where
/// the model is wrong and the filter has to reopen there is more than one maximum; round the best of them by factors of
/// two; then a parabola over its logarithm.
double most_likely_walk(const CalibrationOptions& options, const Likelihood& likelihood) {
  const auto walk = [&](double i) { return options.direction_random_walk_rad_sqrt_s * std::pow(2, i); };
  constexpr int kMost = 9;
  std::map<int, double> found;
  std::vector<int> next = {0, 3, 6, kMost};
  int best = 0;
  while (!next.empty()) {
    std::vector<std::future<double>> runs;
    runs.reserve(next.size());
    for (const int i : next) {
      runs.push_back(std::async(std::launch::async, [&, i] {
        CalibrationOptions trial = options;
        trial.direction_random_walk_rad_sqrt_s = walk(i);
        return likelihood(trial);
      }));
    }
    for (std::size_t i = 0; i < next.size(); ++i) {
      found[next[i]] = runs[i].get();
    }
    best = std::max_element(found.begin(), found.end(), [](const auto& a, const auto& b) {
             return a.second < b.second;
           })->first;
    next = {best - 1, best + 1};
    std::erase_if(next, [&](int i) { return i < 0 || i > kMost || found.contains(i); });
  }
  if (best == 0 || best == kMost) {
    return walk(best);
  }
  const double below = found[best - 1];
  const double above = found[best + 1];
  return walk(best + (above - below) / (4 * found[best] - 2 * below - 2 * above));
}

/// The noise of the star tracker that a trial shows, where it is not what was told.
template <class Estimator>
std::optional<Eigen::Vector3d> other_star_tracker_noise(const Pass& pass, const Trial<Estimator>& trial) {
  const Eigen::Vector3d& told = pass.settings.star_tracker_noise_rad;
  const Eigen::Vector3d found = trial.star_tracker_noise_rad();
  const bool other = ((found - told).array().abs() > kNotable * told.array()).any();
  return other ? std::optional(found) : std::nullopt;
}

/// Only the noise is found: of more than two gyros.
template <class Estimator>
CalibrationOptions with_noise_found(const Pass& pass, CalibrationOptions options) {
  const Trial<Estimator> trial(pass, options);
  options.find_noise = trial.changes() >= kEnough;
  if (options.find_noise) {
    options.star_tracker_noise_rad = other_star_tracker_noise(pass, trial);
    options.direction_random_walk_rad_sqrt_s = most_likely_walk(
        options, [&](const CalibrationOptions& trials) { return Trial<Estimator>(pass, trials).log_likelihood(); });
  }
  return options;
}

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

/// Turns the choices that are left open, and the drift model, by what a trial with everything shows.
void settle_states(const States& everything, const CalibrationOptions& asked, Decision& decision) {
  decision.evidence.clear();
  const auto settle = [&](const char* states, double log_bayes_factor) {
    decision.evidence.push_back({states, log_bayes_factor, log_bayes_factor > kStrong});
    return decision.evidence.back().accepted;
  };
  const auto choose = [&](Choice FurtherStateOptions::*choice, const char* states, double log_bayes_factor) {
    if (asked.further_states.*choice == Choice::kAuto) {
      decision.options.further_states.*choice = settle(states, log_bayes_factor) ? Choice::kOn : Choice::kOff;
    }
  };
  choose(&FurtherStateOptions::clock_offset, "clock_offset", everything.clock_offset());
  choose(&FurtherStateOptions::orbital_error, "orbital_error", everything.orbital_error());
  if (asked.drift_model == kAutoDriftModel) {
    const bool outside = settle("drift_outside_eq1", everything.drift_outside());
    decision.options.drift_model = outside ? Esg20::kModelName : Esg7::kModelName;
  }
}

/// Everything on that is on or may be.
CalibrationOptions with_everything(CalibrationOptions options, const CalibrationOptions& asked) {
  for (const auto choice : {&FurtherStateOptions::clock_offset, &FurtherStateOptions::orbital_error}) {
    options.further_states.*choice = asked.further_states.*choice == Choice::kOff ? Choice::kOff : Choice::kOn;
  }
  options.drift_model = asked.drift_model == Esg7::kModelName ? Esg7::kModelName : Esg20::kModelName;
  return options;
}

}  // namespace

Decision decide(const Pass& pass, const CalibrationOptions& asked) {
  Decision decision{asked, {}};
  if (asked.estimator != Full::kName || pass.gyro.gyros != Full::kGyros) {
    decision.options = without_further_states(asked);
    if (asked.drift_model != kAutoDriftModel) {
      decision.options.drift_model = asked.drift_model;
    }
    const bool finds = asked.find_noise && asked.estimator == Full::kName && !pass.settings.prior;
    if (finds && pass.gyro.gyros == 3) {
      decision.options = with_noise_found<InvariantEstimator<Esg7, 3>>(pass, decision.options);
    } else if (finds && pass.gyro.gyros == 4) {
      decision.options = with_noise_found<InvariantEstimator<Esg7, 4>>(pass, decision.options);
    } else {
      decision.options.find_noise = false;
    }
    return decision;
  }
  if (pass.settings.prior) {
    decision.options = as_before(asked, *pass.settings.prior);
    decision.options.find_noise = false;
    return decision;
  }
  CalibrationOptions& options = decision.options;
  options.find_noise = false;
  if (options.further_states.wandering_drift == Choice::kAuto) {
    options.further_states.wandering_drift = Choice::kOff;
  }
  const bool states_are_settled = asked.drift_model != kAutoDriftModel &&
                                  asked.further_states.clock_offset != Choice::kAuto &&
                                  asked.further_states.orbital_error != Choice::kAuto;
  if (states_are_settled && !asked.find_noise) {
    return decision;
  }
  Trial<Full> everything(pass, with_everything(options, asked));
  if (!everything.estimator().started()) {
    decision.options = without_further_states(asked);
    decision.options.find_noise = false;
    return decision;
  }
  if (asked.find_noise && everything.changes() >= kEnough) {
    options.find_noise = true;
    options.star_tracker_noise_rad = other_star_tracker_noise(pass, everything);
    if (options.star_tracker_noise_rad) {
      everything = Trial<Full>(pass, with_everything(options, asked));
    }
    settle_states(States(everything.estimator()), asked, decision);
    options.direction_random_walk_rad_sqrt_s = most_likely_walk(options, [&](const CalibrationOptions& trial) {
      return has_further_states(trial) ? Trial<Full>(pass, trial).log_likelihood()
                                       : Trial<InvariantEstimator<Esg7, 2>>(pass, trial).log_likelihood();
    });
    if (options.direction_random_walk_rad_sqrt_s > asked.direction_random_walk_rad_sqrt_s) {
      everything = Trial<Full>(pass, with_everything(options, asked));
    }
  }
  settle_states(States(everything.estimator()), asked, decision);
  return decision;
}

}  // namespace trihedron::ground
