#include "decide.hpp"

#include <fmt/format.h>

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
#include <utility>
#include <vector>

#include "trihedron/ground/replay.hpp"
#include "with_estimator.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;
using Full = InvariantEstimator<Esg20, 2, kAllFurtherStates>;

/// Odds of 20 to 1.
constexpr double kStrong = 3;
/// Pairs of fixes that give the noise of the star tracker within some percent.
constexpr std::size_t kEnough = 1000;
/// Below it, process noise is lost in the readout: where a search for more begins.
constexpr double kLeastWalk_rad_sqrt_s = 3e-9;
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
  Trial(const Pass& pass, const CalibrationOptions& options)
      : cycle_(make_cycle<Estimator>(pass, options, {.navigate = false})) {
    const auto ignore = [](const auto&) {};
    const double gate_nis = options.gate_nis;
    std::optional<Eigen::Quaterniond> last;
    Time last_t{};
    const auto on_fix = [&](const typename Cycle<Estimator>::Report& report) {
      if (report.fix.status != FixStatus::kUsed && report.fix.status != FixStatus::kRejectedByGate) {
        return;
      }
      // An outlier counts as one, however far out it is.
      log_likelihood_ -= std::min(report.fix.nis, gate_nis) / 2 +
                         report.fix.innovation_covariance.llt().matrixLLT().diagonal().array().log().sum();
      if (report.fix.head != 0 || !report.calibrated || !report.compared) {
        return;
      }
      const Eigen::Quaterniond apart =
          report.calibrated->C_in_c.quaternion().conjugate() * report.compared->fix.q_in_c.normalized();
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
  [[nodiscard]] double readout_bias() const {
    constexpr int kBiases = 3 * Full::kGyros;
    Eigen::VectorXd estimate(kBiases);
    for (int k = 0; k < Full::kGyros; ++k) {
      const int row = 3 * k;
      estimate.segment<3>(row) = estimator_.gyros()[k].readout_bias;
    }
    return log_evidence(estimate, root_.middleRows(Full::Layout::readout_bias(0), kBiases),
                        Eigen::VectorXd::Constant(kBiases, setup().readout_bias_sigma));
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

/// Options, and how likely they make the pass.
struct Likely {
  CalibrationOptions options;
  double log_likelihood = 0;
  double gain = 0;  ///< over that of (0, 0)
};

/// Goes uphill over options on a grid, each by two numbers.
class Search {
 public:
  using Point = std::pair<int, int>;
  using At = std::function<CalibrationOptions(double, int)>;

  /// From the best of `starts`, (0, 0) among them, to the best of its neighbours, and so on, within the bounds; all
  /// included.
  Search(const Pass& pass, At at, const std::vector<Point>& starts, const Point& lowest, const Point& highest)
      : pass_(pass), at_(std::move(at)) {
    look_at(starts);
    for (std::optional<Point> last; last != best_;) {
      last = best_;
      const auto [i, j] = best_;
      look_at({{std::max(i - 1, lowest.first), j},
               {std::min(i + 1, highest.first), j},
               {i, std::max(j - 1, lowest.second)},
               {i, std::min(j + 1, highest.second)}});
    }
  }

  /// The best point, its first number by a parabola through its neighbours where it has two.
  [[nodiscard]] Likely best() const {
    const auto [i, j] = best_;
    const double peak = tried_.at(best_);
    const auto below = tried_.find({i - 1, j});
    const auto above = tried_.find({i + 1, j});
    double beside = 0;
    if (below != tried_.end() && above != tried_.end()) {
      beside = (above->second - below->second) / (4 * peak - 2 * below->second - 2 * above->second);
    }
    return {at_(i + beside, j), peak, peak - tried_.at({0, 0})};
  }

 private:
  void look_at(const std::vector<Point>& points) {
    std::map<Point, std::future<double>> runs;
    for (const Point& point : points) {
      if (!tried_.contains(point) && !runs.contains(point)) {
        runs.emplace(point, std::async(std::launch::async, [this, options = at_(point.first, point.second)] {
                       return with_estimator(pass_, options, [&]<class Estimator>() {
                         return Trial<Estimator>(pass_, options).log_likelihood();
                       });
                     }));
      }
    }
    for (auto& [point, run] : runs) {
      tried_[point] = run.get();
    }
    best_ = std::max_element(tried_.begin(), tried_.end(), [](const auto& a, const auto& b) {
              return a.second < b.second;
            })->first;
  }

  const Pass& pass_;
  At at_;
  std::map<Point, double> tried_;
  Point best_;
};

/// The process noise that makes the pass most likely, by factors of two above that of the options, and from as many of
/// them as `starts` says.
Likely with_most_likely_walk(const Pass& pass, const CalibrationOptions& options,
                             const std::vector<Search::Point>& starts) {
  const auto at = [&](double level, int) {
    CalibrationOptions trial = options;
    trial.direction_random_walk_rad_sqrt_s = std::max(trial.direction_random_walk_rad_sqrt_s, kLeastWalk_rad_sqrt_s);
    trial.direction_random_walk_rad_sqrt_s *= std::pow(2, level);
    return trial;
  };
  return Search(pass, at, starts, {0, 0}, {9, 0}).best();
}

/// Where the model is wrong and the filter has to reopen there is more than one maximum.
const std::vector<Search::Point> kAllLevels = {{0, 0}, {3, 0}, {6, 0}, {9, 0}};

/// Level and correlation time of the drift that wanders which make the pass most likely, by factors of two and three
/// from those of the options.
Likely with_most_likely_wandering(const Pass& pass, const CalibrationOptions& options,
                                  const std::vector<Search::Point>& starts) {
  const auto at = [&](double level, int time) {
    CalibrationOptions trial = options;
    FurtherStateOptions& states = trial.further_states;
    states.wandering_drift = Choice::kOn;
    states.wandering_drift_rad_s *= std::pow(2, level);
    states.wandering_time = from_seconds(to_seconds(states.wandering_time) * std::pow(3, time));
    return trial;
  };
  return Search(pass, at, starts, {-3, -2}, {9, 1}).best();
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
CalibrationOptions with_noise_found(const Pass& pass, CalibrationOptions options) {
  return with_estimator(pass, options, [&]<class Estimator>() {
    const Trial<Estimator> trial(pass, options);
    options.find_noise = trial.changes() >= kEnough;
    if (!options.find_noise) {
      return options;
    }
    options.star_tracker_noise_rad = other_star_tracker_noise(pass, trial);
    return with_most_likely_walk(pass, options, kAllLevels).options;
  });
}

CalibrationOptions without_further_states(CalibrationOptions options) {
  options.drift_model = Esg7::kModelName;
  for (Choice* choice : {&options.further_states.clock_offset, &options.further_states.orbital_error,
                         &options.further_states.wandering_drift, &options.further_states.readout_bias}) {
    *choice = Choice::kOff;
  }
  return options;
}

/// What was asked for must be there.
void refuse_further_states(const Pass& pass, const CalibrationOptions& asked) {
  const FurtherStateOptions& states = asked.further_states;
  for (const auto& [name, choice] :
       {std::pair{"clock_offset", states.clock_offset}, std::pair{"orbital_error", states.orbital_error},
        std::pair{"readout_bias", states.readout_bias}, std::pair{"wandering_drift", states.wandering_drift}}) {
    if (choice == Choice::kOn) {
      throw SetupError(
          fmt::format("estimator {} of {} gyros has no state '{}'", asked.estimator, pass.gyro.gyros, name),
          "set it to off or auto, or use estimator invariant with two gyros");
    }
  }
}

/// The noise that an earlier calibration went by, but for the least that is told.
void use_noise(const CalibrationNoise& noise, CalibrationOptions& options) {
  options.direction_random_walk_rad_sqrt_s =
      std::max(options.direction_random_walk_rad_sqrt_s, noise.direction_random_walk_rad_sqrt_s);
  options.star_tracker_noise_rad = noise.star_tracker_noise_rad;
  FurtherStateOptions& states = options.further_states;
  if (noise.wandering_drift_rad_s > 0 && states.wandering_drift == Choice::kAuto) {
    states.wandering_drift = Choice::kOn;
    states.wandering_drift_rad_s = noise.wandering_drift_rad_s;
    states.wandering_time = from_seconds(noise.wandering_time_s);
  }
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
  settle(states.readout_bias, had("gyro1_readout_bias"));
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
  choose(&FurtherStateOptions::readout_bias, "readout_bias", everything.readout_bias());
  if (asked.drift_model == kAutoDriftModel) {
    const bool outside = settle("drift_outside_eq1", everything.drift_outside());
    decision.options.drift_model = outside ? Esg20::kModelName : Esg7::kModelName;
  }
}

/// Everything on that is on or may be.
CalibrationOptions with_everything(CalibrationOptions options, const CalibrationOptions& asked) {
  for (const auto choice :
       {&FurtherStateOptions::clock_offset, &FurtherStateOptions::orbital_error, &FurtherStateOptions::readout_bias}) {
    options.further_states.*choice = asked.further_states.*choice == Choice::kOff ? Choice::kOff : Choice::kOn;
  }
  options.drift_model = asked.drift_model == Esg7::kModelName ? Esg7::kModelName : Esg20::kModelName;
  return options;
}

/// Where the noise is more than was told the states were settled by one that is too small: again, by what it is when
/// they are all free, and whether it wanders.
void decide_beside_noise(const Pass& pass, const CalibrationOptions& asked, bool wandering_is_open,
                         Decision& decision) {
  CalibrationOptions& options = decision.options;
  CalibrationOptions free = with_everything(options, asked);
  const Likely walking = with_most_likely_walk(pass, free, kAllLevels);
  const double walk_rad_sqrt_s = walking.options.direction_random_walk_rad_sqrt_s;
  std::optional<Evidence> wandering;
  if (wandering_is_open && walking.gain > kStrong) {
    // What wanders fast is a random walk of walk² = 2 σ² τ.
    free.further_states.wandering_drift_rad_s =
        walk_rad_sqrt_s / std::sqrt(2 * to_seconds(free.further_states.wandering_time));
    const Likely wanders = with_most_likely_wandering(pass, free, {{0, 0}, {2, 0}, {4, 0}, {6, 0}});
    const double gain = wanders.log_likelihood - walking.log_likelihood;
    wandering = Evidence{"wandering_drift", gain, gain > kStrong};
    free = wandering->accepted ? wanders.options : walking.options;
  } else {
    free = walking.options;
  }
  settle_states(States(Trial<Full>(pass, free).estimator()), asked, decision);
  if (wandering && wandering->accepted) {
    options.further_states.wandering_drift_rad_s = free.further_states.wandering_drift_rad_s;
    options.further_states.wandering_time = free.further_states.wandering_time;
    options = with_most_likely_wandering(pass, options, {{0, 0}}).options;
  } else {
    const double level =
        std::log2(walk_rad_sqrt_s / std::max(options.direction_random_walk_rad_sqrt_s, kLeastWalk_rad_sqrt_s));
    options = with_most_likely_walk(pass, options, {{0, 0}, {static_cast<int>(std::lround(level)), 0}}).options;
  }
  if (wandering) {
    decision.evidence.push_back(*wandering);
  }
}

}  // namespace

Decision decide(const Pass& pass, const CalibrationOptions& asked) {
  Decision decision{asked, {}};
  CalibrationOptions& options = decision.options;
  options.find_noise = false;
  const bool invariant = asked.estimator != "paper";
  const std::optional<Calibration>& prior = pass.settings.prior;
  if (prior && prior->noise && asked.find_noise && invariant) {
    use_noise(*prior->noise, options);
  }
  if (!invariant || pass.gyro.gyros > Full::kGyros) {
    refuse_further_states(pass, asked);
    options = without_further_states(options);
    if (asked.drift_model != kAutoDriftModel) {
      options.drift_model = asked.drift_model;
    }
    if (asked.find_noise && invariant && !prior) {
      options = with_noise_found(pass, options);
    }
    return decision;
  }
  if (prior) {
    options = as_before(options, *prior);
    return decision;
  }
  const bool wandering_is_open = options.further_states.wandering_drift == Choice::kAuto;
  if (wandering_is_open) {
    options.further_states.wandering_drift = Choice::kOff;
  }
  const FurtherStateOptions& states = asked.further_states;
  const bool states_are_settled = asked.drift_model != kAutoDriftModel && states.clock_offset != Choice::kAuto &&
                                  states.orbital_error != Choice::kAuto && states.readout_bias != Choice::kAuto;
  if (states_are_settled && !asked.find_noise) {
    return decision;
  }
  Trial<Full> everything(pass, with_everything(options, asked));
  if (!everything.estimator().started()) {
    options = without_further_states(options);
    return decision;
  }
  options.find_noise = asked.find_noise && everything.changes() >= kEnough;
  if (!options.find_noise) {
    settle_states(States(everything.estimator()), asked, decision);
    return decision;
  }
  options.star_tracker_noise_rad = other_star_tracker_noise(pass, everything);
  if (options.star_tracker_noise_rad) {
    everything = Trial<Full>(pass, with_everything(options, asked));
  }
  settle_states(States(everything.estimator()), asked, decision);
  const Likely little = with_most_likely_walk(pass, options, kAllLevels);
  if (!(little.gain > kStrong)) {
    options = little.options;
    return decision;
  }
  decide_beside_noise(pass, asked, wandering_is_open, decision);
  return decision;
}

}  // namespace trihedron::ground
