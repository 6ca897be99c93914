#include "trihedron/ground/evaluate/open_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "model/prior.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/core/precession.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/core/telemetry.hpp"
#include "trihedron/ground/evaluate/open_loop_forecast.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {
namespace {

constexpr int kPair = 2;

/// Step of the integration. The drift turns by nanoradians over it: the midpoint rule loses nothing even in a slew.
constexpr Duration kIntegrationStep = std::chrono::seconds(3);

/// Directions at any time, interpolated between samples; asked for in ascending order.
class InterpolatedReadings {
 public:
  InterpolatedReadings(const GyroTelemetry& telemetry, Duration max_interpolation)
      : telemetry_(telemetry), max_interpolation_(max_interpolation) {}

  /// Nothing in a gap, or where a sample is no direction.
  [[nodiscard]] std::optional<Directions> at(Time t) {
    const auto& times = telemetry_.t;
    while (next_ < times.size() && times[next_] < t) {
      ++next_;
    }
    if (next_ == times.size()) {
      return std::nullopt;
    }
    const std::size_t before = times[next_] == t || next_ == 0 ? next_ : next_ - 1;
    const Duration apart = times[next_] - times[before];
    if (times[before] > t || apart > max_interpolation_) {
      return std::nullopt;
    }
    const double fraction = apart == Duration::zero() ? 0 : to_seconds(t - times[before]) / to_seconds(apart);
    Directions h_b;
    for (int k = 0; k < kPair; ++k) {
      const Eigen::Vector3d first = telemetry_.direction(before, k);
      const Eigen::Vector3d second = telemetry_.direction(next_, k);
      if (!nearly_unit(first.norm()) || !nearly_unit(second.norm())) {
        return std::nullopt;
      }
      h_b[k] = ((1 - fraction) * first + fraction * second).normalized();
    }
    return h_b;
  }

 private:
  const GyroTelemetry& telemetry_;
  Duration max_interpolation_;
  std::size_t next_ = 0;
};

/// A gyro propagated with given parameters.
struct OpenLoopGyro {
  const GyroCalibration* record;
  Gyro gyro;
  DriftModel drift;
};

struct Pair {
  std::vector<OpenLoopGyro> gyros;
  AttitudeRule rule = AttitudeRule::kTrihedron;

  [[nodiscard]] Result<AttitudeByDirections, DirectionsFault> attitude(const Directions& h_b) const {
    Directions h_in;
    Directions h_c;
    for (int k = 0; k < kPair; ++k) {
      const Gyro& gyro = gyros[static_cast<std::size_t>(k)].gyro;
      h_in[k] = gyro.h_in;
      h_c[k] = gyro.in_c(h_b[k]);
    }
    if (rule == AttitudeRule::kTrihedron) {
      return trihedron_attitude(h_in, h_c);
    }
    GyroMask used{};
    used[0] = used[1] = true;
    return optimal_attitude(h_in, h_c, used);
  }
};

CorrectionInterval interval_of(const AttitudeErrors& errors, double limit_rad) {
  const auto intervals = correction_intervals(errors, limit_rad);
  return intervals.empty() ? CorrectionInterval{} : intervals.front();
}

/// Every ten minutes up to the end of the motion, which is that of the pass.
std::vector<PredictedError> predicted(const Correction& correction, const BodyMotion& motion, AttitudeRule rule) {
  GyroMask used{};
  used[0] = used[1] = true;
  std::vector<Duration> after;
  for (Duration time{}; correction.t + time <= motion.end(); time += std::chrono::minutes(10)) {
    after.push_back(time);
  }
  return predicted_errors({correction.errors, correction.calibrated, correction.t, motion, rule, used}, after);
}

}  // namespace

AttitudeHistory fly_open_loop(const Pass& pass, Time t, const std::vector<GyroCalibration>& gyros,
                              const std::vector<Time>& epochs, AttitudeRule rule) {
  if (gyros.size() < kPair) {
    throw SetupError("an open loop needs two gyros", "give a calibration of a pair");
  }
  Pair flown;
  flown.rule = rule;
  for (int k = 0; k < kPair; ++k) {
    const GyroCalibration& record = gyros[static_cast<std::size_t>(k)];
    refuse_incomplete(record);
    const Layout layout = layout_of(record);
    flown.gyros.push_back({&record, gyro_of(record, layout), DriftModel(layout.drift_model, layout.further)});
  }
  AttitudeHistory history;
  InterpolatedReadings readings(pass.gyro, max_interpolation(pass.settings.gyro_period));
  std::optional<Directions> last = readings.at(t);
  Time last_t = t;
  auto epoch = std::ranges::lower_bound(epochs, t);
  for (Time now = t; epoch != epochs.end(); now = std::min(now + kIntegrationStep, *epoch)) {
    check_stop();
    if (const std::optional<Directions> h_b = readings.at(now)) {
      Directions middle = *h_b;
      for (int k = 0; k < kPair && last; ++k) {
        middle[k] = ((*last)[k] + (*h_b)[k]).normalized();
      }
      if (const auto attitude = flown.attitude(middle)) {
        for (int k = 0; k < kPair; ++k) {
          auto& [record, gyro, drift] = flown.gyros[static_cast<std::size_t>(k)];
          precess(gyro, drift, attitude.value().C_in_c.raw(), middle[k],
                  drift_time(*record, last_t + (now - last_t) / 2), to_seconds(now - last_t));
        }
        last = h_b;
        last_t = now;
      }
      if (now == *epoch) {
        if (const auto attitude = flown.attitude(*h_b)) {
          history.t.push_back(now);
          history.q_in_c.push_back(attitude.value().C_in_c.quaternion());
          history.age_s.push_back(to_seconds(now - t));
        }
      }
    }
    if (now == *epoch) {
      ++epoch;
    }
    if (epoch == epochs.end()) {
      break;
    }
  }
  return history;
}

AttitudeRule attitude_rule_of(Estimator estimator) {
  return estimator == Estimator::kPaper ? AttitudeRule::kTrihedron : AttitudeRule::kAllAlike;
}

std::vector<OpenLoops> fly_open_loops(const Pass& pass, const CalibrationRun& run, const std::vector<Time>& reference_t,
                                      const std::vector<Eigen::Quaterniond>& reference_q_in_c, double limit_rad,
                                      OpenLoopScope scope) {
  const AttitudeRule rule = attitude_rule_of(run.calibration.estimator);
  const auto errors_of = [&](Time t, const std::vector<GyroCalibration>& gyros) {
    return attitude_errors(fly_open_loop(pass, t, gyros, reference_t, rule), reference_t, reference_q_in_c);
  };
  std::optional<BodyMotion> motion;
  if (scope == OpenLoopScope::kAll && run.attitude.size() > 0) {
    motion.emplace(run.attitude.t, run.attitude.q_in_c);
  }
  return on_all_cores(run.corrections.size(), [&](std::size_t i) {
    OpenLoops loops;
    if (scope == OpenLoopScope::kExtension && i == 0) {
      return loops;
    }
    const Correction& correction = run.corrections[i];
    loops.known_before = errors_of(correction.t, correction.known_before);
    loops.calibrated = errors_of(correction.t, correction.calibrated);
    if (motion && correction.errors.is_known()) {
      loops.predicted = predicted(correction, *motion, rule);
    }
    loops.intervals = {interval_of(loops.known_before, limit_rad), interval_of(loops.calibrated, limit_rad)};
    return loops;
  });
}

std::optional<Extension> median_extension(const std::vector<OpenLoops>& loops) {
  std::vector<IntervalPair> pairs;
  for (std::size_t i = 1; i < loops.size(); ++i) {
    pairs.push_back(loops[i].intervals);
  }
  return median_extension(pairs);
}

}  // namespace trihedron::ground
