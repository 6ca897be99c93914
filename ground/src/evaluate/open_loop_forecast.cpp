#include "trihedron/ground/evaluate/open_loop_forecast.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "linear/gram.hpp"
#include "model/prior.hpp"
#include "trihedron/core/forecast.hpp"
#include "trihedron/core/measurement.hpp"
#include "trihedron/core/precession.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {
namespace {

/// Step of the sensitivities: the body turns by half a degree in orbital flight, the drift by nanoradians.
constexpr Duration kForecastStep = std::chrono::seconds(10);
/// An accuracy is not looked for beyond.
constexpr Duration kForecastDay = std::chrono::hours(24);
/// Between the times at which the error is compared with a limit, and between those that are kept.
constexpr Duration kCompared = std::chrono::minutes(1);
constexpr Duration kKept = std::chrono::minutes(10);
/// Causes that are told.
constexpr std::size_t kToldCauses = 5;

using Rows = StateRows3<kPassCapacity.states>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

PredictedError with_quantiles(Duration after, const Eigen::Matrix3d& covariance_rad2) {
  return {after, covariance_rad2, error_quantile_rad(covariance_rad2, kNormal68),
          error_quantile_rad(covariance_rad2, kNormal95), error_quantile_rad(covariance_rad2, kNormal997)};
}

/// Follows the error until it first passes a limit.
class Accuracy {
 public:
  explicit Accuracy(double limit_rad) { found_.limit_rad = limit_rad; }

  void add(const PredictedError& error) {
    if (passed_) {
      return;
    }
    const double now_rad = error.error_997_rad;
    if (now_rad <= found_.limit_rad) {
      last_ = error;
      found_.within = error.after;
      return;
    }
    passed_ = true;
    if (last_) {
      const double part = (found_.limit_rad - last_->error_997_rad) / (now_rad - last_->error_997_rad);
      found_.within = last_->after + from_seconds(part * to_seconds(error.after - last_->after));
    }
  }
  /// Whether it has passed: later errors change nothing.
  [[nodiscard]] bool passed() const { return passed_; }
  [[nodiscard]] AccuracyForecast found() const {
    AccuracyForecast found = found_;
    found.is_lower_bound = !passed_;
    return found;
  }

 private:
  AccuracyForecast found_;
  std::optional<PredictedError> last_;
  bool passed_ = false;
};

}  // namespace

// ---- Motion

BodyMotion::BodyMotion(const std::vector<Time>& t, const std::vector<Eigen::Quaterniond>& q_in_c)
    : t_(t), q_in_c_(q_in_c) {
  const double span_s = to_seconds(t.back() - t.front());
  if (!(span_s > 0)) {
    return;
  }
  // The mean angular velocity: a slew and the slew back nearly cancel.
  for (std::size_t i = 1; i < q_in_c.size(); ++i) {
    const auto before = Rot<In, C>::assume(q_in_c[i - 1].normalized());
    const auto after = Rot<In, C>::assume(q_in_c[i].normalized());
    rate_in_rad_s_ += (after * before.inverse()).log().raw() / span_s;
  }
  // The whole pass again; of one that is nearly whole orbits less, so that the manoeuvres come at other phases.
  constexpr double kNearlyWhole = 0.15;
  constexpr double kLess = 0.38;
  const double orbits = span_s * rate_in_rad_s_.norm() / (2 * std::numbers::pi);
  const double whole = std::round(orbits);
  const bool is_nearly_whole = whole > 0 && std::abs(orbits - whole) < kNearlyWhole;
  again_ = from_seconds(is_nearly_whole ? span_s * (whole - kLess) / orbits : span_s);
}

Eigen::Matrix3d BodyMotion::C_in_c(Time t) const {
  if (t > t_.back() && again_ > Duration::zero()) {
    const Duration later = ((t - t_.back() - Duration(1)) / again_ + 1) * again_;
    const Eigen::Vector3d turn = rate_in_rad_s_ * to_seconds(later);
    return Rot<In, In>::exp(Vec<In>::assume(turn)).raw() * C_in_c(t - later);
  }
  const auto after = std::ranges::lower_bound(t_, t);
  if (after == t_.begin() || after == t_.end()) {
    return (after == t_.end() ? q_in_c_.back() : q_in_c_.front()).normalized().toRotationMatrix();
  }
  const auto i = static_cast<std::size_t>(after - t_.begin());
  const double part = to_seconds(t - t_[i - 1]) / to_seconds(t_[i] - t_[i - 1]);
  return q_in_c_[i - 1].normalized().slerp(part, q_in_c_[i].normalized()).toRotationMatrix();
}

// ---- Prediction

struct OpenLoopPrediction::State {
  const OpenLoopStart& start;
  Time t;
  const BodyMotion& motion;
  AttitudeRule rule;
  GyroMask used;
  std::vector<GyroCalibration> records;  ///< for the phases of drift that comes back
  std::vector<ParameterId> parameters;
  DriftModel drift;
  Gyros gyros;
  PerGyro<Sensitivity<kMaxDriftColumns>> since;
  PerGyro<Eigen::Matrix3d> by_first_wandering;  ///< φ by the drift that wanders at the correction
  PerGyro<Matrix6> later_wandering;             ///< covariance of φ and of it by what has come to it since
  Duration now{};

  void step(Duration dt);

  /// An attitude error as a linear function of its causes.
  struct Causes {
    Rows rows;  ///< about the states at the correction
    Eigen::Matrix3d wandering;
    Eigen::Matrix3d walk;
    Eigen::Matrix3d readout;
    [[nodiscard]] Eigen::Matrix3d noise() const { return wandering + walk + readout; }
  };
  [[nodiscard]] std::optional<Causes> causes() const;
};

OpenLoopPrediction::OpenLoopPrediction(const OpenLoopStart& start, const std::vector<GyroCalibration>& gyros, Time t,
                                       const BodyMotion& motion, AttitudeRule rule, const GyroMask& used)
    : state_(std::make_unique<State>(State{start,
                                           t,
                                           motion,
                                           rule,
                                           used,
                                           gyros,
                                           {},
                                           DriftModel(start.layout.drift_model, start.layout.further),
                                           {},
                                           {},
                                           {},
                                           {},
                                           {}})) {
  const Layout& layout = start.layout;
  for (int k = 0; k < layout.gyros; ++k) {
    const GyroCalibration& record = gyros.at(static_cast<std::size_t>(k));
    refuse_incomplete(record);
    state_->gyros[k] = gyro_of(record, layout);
    state_->since[k].begin(layout.drift_columns());
    state_->by_first_wandering[k].setZero();
    state_->later_wandering[k].setZero();
  }
  state_->parameters = drift_and_alignment(layout.drift_model, static_cast<std::size_t>(layout.gyros));
}

OpenLoopPrediction::OpenLoopPrediction(OpenLoopPrediction&&) noexcept = default;
OpenLoopPrediction::~OpenLoopPrediction() = default;

void OpenLoopPrediction::State::step(Duration dt) {
  const Layout& layout = start.layout;
  const double dt_s = to_seconds(dt);
  const double middle_s = to_seconds(now) + dt_s / 2;
  const Eigen::Matrix3d C_in_c = motion.C_in_c(t + now + dt / 2);
  for (int k = 0; k < layout.gyros; ++k) {
    Gyro& gyro = gyros[k];
    DriftTime time = drift_time(records[static_cast<std::size_t>(k)], t + now + dt / 2);
    time.part_of_change = start.change.part(start.change.zero_at + now + dt / 2);
    const Eigen::Vector3d h_b = gyro.reading_of(C_in_c.transpose() * gyro.h_in).normalized();
    const Eigen::Vector3d turn = precess(gyro, since[k], drift, C_in_c, h_b, time, dt_s);
    if (layout.further.wandering_drift) {
      const GaussMarkov& wandering = start.wandering_drift;
      const Eigen::Matrix3d C_in_b = C_in_c * gyro.C_c_b;
      const Eigen::Matrix3d turned = Eigen::Matrix3d::Identity() + skew<double>(turn);
      by_first_wandering[k] = turned * by_first_wandering[k] + dt_s * std::exp(-middle_s / wandering.time_s) * C_in_b;
      const double kept = wandering.kept(dt_s);
      Matrix6 on = Matrix6::Zero();
      on.topLeftCorner<3, 3>() = turned;
      on.topRightCorner<3, 3>() = dt_s * C_in_b;
      on.bottomRightCorner<3, 3>() = kept * Eigen::Matrix3d::Identity();
      later_wandering[k] = (on * later_wandering[k] * on.transpose()).eval();
      later_wandering[k].bottomRightCorner<3, 3>().diagonal().array() += std::pow(wandering.noise(kept), 2);
    }
  }
  now += dt;
}

auto OpenLoopPrediction::State::causes() const -> std::optional<Causes> {
  const Layout& layout = start.layout;
  const Eigen::Matrix3d C_in_c = motion.C_in_c(t + now);
  Directions h_b;
  for (int k = 0; k < layout.gyros; ++k) {
    h_b[k] = gyros[k].reading_of(C_in_c.transpose() * gyros[k].h_in).normalized();
  }
  const Directions h_in = momenta(gyros, layout.gyros);
  const Directions h_c = in_c(gyros, layout.gyros, h_b);
  const auto attitude =
      rule == AttitudeRule::kTrihedron ? trihedron_attitude(h_in, h_c) : optimal_attitude(h_in, h_c, used);
  if (!attitude) {
    return std::nullopt;
  }
  Causes causes;
  causes.rows = attitude_by_states_now<kPassCapacity.states>(layout, attitude.value(), gyros, h_b);
  auto sensitivities = since;
  for (int k = 0; k < layout.gyros && layout.further.wandering_drift; ++k) {
    sensitivities[k].by_drift.first(layout.drift_columns()).middleCols<3>(layout.wandering_column()) =
        by_first_wandering[k];
  }
  carry_back(layout, sensitivities, causes.rows);
  causes.wandering.setZero();
  causes.walk.setZero();
  causes.readout.setZero();
  const double walk_rad2 = std::pow(start.direction_random_walk_rad_sqrt_s, 2) * to_seconds(now);
  const Eigen::Matrix3d C_c_in = attitude.value().C_in_c.raw().transpose();
  for (int k = 0; k < layout.gyros; ++k) {
    const Eigen::Matrix3d by_direction = attitude.value().by_direction(k);
    const Eigen::Matrix3d by_phi = by_direction * C_c_in;
    causes.wandering += by_phi * later_wandering[k].topLeftCorner<3, 3>() * by_phi.transpose();
    causes.walk += walk_rad2 * by_direction * by_direction.transpose();
    causes.readout += std::pow(start.readout_noise_rad[k], 2) * by_direction * by_direction.transpose();
  }
  return causes;
}

void OpenLoopPrediction::go_on(Duration after) {
  check_stop();
  while (state_->now < after) {
    state_->step(std::min(kForecastStep, after - state_->now));
  }
}

PredictedError OpenLoopPrediction::error() const {
  const std::optional<State::Causes> causes = state_->causes();
  if (!causes) {
    constexpr double kUnknown = std::numeric_limits<double>::infinity();
    return {state_->now, Eigen::Matrix3d::Constant(kUnknown), kUnknown, kUnknown, kUnknown};
  }
  const Eigen::MatrixXd by_cause = causes->rows.leftCols(state_->start.covariance.rows()).transpose();
  return with_quantiles(state_->now,
                        by_cause.transpose() * multiply(state_->start.covariance, by_cause) + causes->noise());
}

std::vector<ErrorCause> OpenLoopPrediction::causes() const {
  const std::optional<State::Causes> causes = state_->causes();
  if (!causes) {
    return {};
  }
  const Layout& layout = state_->start.layout;
  const Eigen::MatrixXd& P = state_->start.covariance;
  const Eigen::Matrix<double, 3, Eigen::Dynamic> known = causes->rows.leftCols(P.rows()) * P;
  const double all = (known * causes->rows.leftCols(P.rows()).transpose() + causes->noise()).trace();
  std::vector<ErrorCause> found;
  for (std::size_t i = 0; i < state_->parameters.size(); ++i) {
    const Eigen::Index state = layout.drift(0) + static_cast<Eigen::Index>(i);
    // What the mean square becomes smaller by when this state becomes known, and with it what is correlated.
    if (P(state, state) > 0) {
      found.push_back({name_of(state_->parameters[i]), true, known.col(state).squaredNorm() / P(state, state) / all});
    }
  }
  double wandering = causes->wandering.trace();
  for (int k = 0; k < layout.gyros && layout.further.wandering_drift; ++k) {
    const auto by = causes->rows.middleCols<3>(layout.wandering(k));
    wandering += (by * P.block<3, 3>(layout.wandering(k), layout.wandering(k)) * by.transpose()).trace();
  }
  found.push_back({"drift that wanders", false, wandering / all});
  found.push_back({"random walk of the momenta", false, causes->walk.trace() / all});
  found.push_back({"readout noise", false, causes->readout.trace() / all});
  std::ranges::sort(found, std::ranges::greater{}, &ErrorCause::share);
  return found;
}

std::vector<PredictedError> predicted_errors(OpenLoopPrediction prediction, const std::vector<Duration>& after) {
  std::vector<PredictedError> errors;
  errors.reserve(after.size());
  for (const Duration time : after) {
    prediction.go_on(time);
    errors.push_back(prediction.error());
  }
  return errors;
}

OpenLoopForecast forecast(const OpenLoopStart& start, const std::vector<GyroCalibration>& gyros,
                          const BodyMotion& motion, AttitudeRule rule, const std::optional<Need>& need,
                          double limit_rad) {
  GyroMask used{};
  for (int k = 0; k < start.layout.gyros; ++k) {
    used[k] = true;
  }
  OpenLoopPrediction prediction(start, gyros, motion.end(), motion, rule, used);
  OpenLoopForecast result;
  Accuracy usual(limit_rad);
  std::optional<Accuracy> needed;
  if (need) {
    result.need = NeedForecast{*need, true, 0, {}, {}};
    needed.emplace(need->error_rad);
  }
  const auto look = [&](Duration after) {
    prediction.go_on(after);
    const bool kept = after % kKept == Duration::zero();
    if (!kept && usual.passed() && (!needed || (needed->passed() && after > need->interval))) {
      return;
    }
    const PredictedError error = prediction.error();
    usual.add(error);
    if (needed) {
      needed->add(error);
      if (after <= need->interval) {
        result.need->error_997_rad = std::max(result.need->error_997_rad, error.error_997_rad);
      }
      if (after == need->interval) {
        result.need->causes = prediction.causes();
        result.need->causes.resize(std::min(result.need->causes.size(), kToldCauses));
      }
    }
    if (kept) {
      result.errors.push_back(error);
    }
  };
  const Duration until = std::max(kForecastDay, need ? need->interval : Duration::zero());
  for (Duration after{}; after <= until; after += kCompared) {
    look(after);
    if (need && need->interval > after && need->interval < after + kCompared) {
      look(need->interval);
    }
  }
  result.usual = usual.found();
  if (need) {
    result.need->accuracy = needed->found();
    result.need->met = result.need->error_997_rad <= need->error_rad;
  }
  return result;
}

}  // namespace trihedron::ground
