#pragma once
/// The attitude error that an open loop is predicted to have, by the covariance at the astro-correction that it begins
/// with and the motion of the body: docs/mathematics.md, section 14.

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "trihedron/core/telemetry.hpp"
#include "trihedron/ground/evaluate/attitude_evaluation.hpp"
#include "trihedron/ground/evaluate/open_loop.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/open_loop_forecast.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Attitudes of the body at any time from that of the first given on: between those given by the shortest turn. Beyond
/// the last the body goes on turning at its mean rate, and makes the same manoeuvres again, at other phases of the
/// orbit.
class BodyMotion {
 public:
  /// At least one attitude, in ascending order. Refers to them.
  BodyMotion(const std::vector<Time>& t, const std::vector<Eigen::Quaterniond>& q_in_c);

  [[nodiscard]] Time end() const { return t_.back(); }
  [[nodiscard]] Eigen::Matrix3d C_in_c(Time t) const;

 private:
  const std::vector<Time>& t_;
  const std::vector<Eigen::Quaterniond>& q_in_c_;
  Duration again_{};  ///< after which the manoeuvres come again
  Eigen::Vector3d rate_in_rad_s_{0, 0, 0};
};

/// The errors of one open loop, predicted to first order: moved along by the sensitivities of the filter.
class OpenLoopPrediction {
 public:
  /// `gyros`: with the momenta at the correction, `t`, in use; the attitude is by all those `used`. Refers to `start`
  /// and `motion`. Throws SetupError for gyros of an unknown drift model.
  OpenLoopPrediction(const OpenLoopStart& start, const std::vector<GyroCalibration>& gyros, Time t,
                     const BodyMotion& motion, AttitudeRule rule, const GyroMask& used);
  OpenLoopPrediction(OpenLoopPrediction&&) noexcept;
  ~OpenLoopPrediction();

  /// Goes on to this time after the correction, not back.
  void go_on(Duration after);
  /// There. Infinite where the momenta give no attitude.
  [[nodiscard]] PredictedError error() const;
  /// What it is made of, largest first.
  [[nodiscard]] std::vector<ErrorCause> causes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// At these times after the correction, in ascending order.
[[nodiscard]] std::vector<PredictedError> predicted_errors(OpenLoopPrediction prediction,
                                                           const std::vector<Duration>& after);

/// An open loop from a correction at the end of the motion: a day, or as long as is needed.
[[nodiscard]] OpenLoopForecast forecast(const OpenLoopStart& start, const std::vector<GyroCalibration>& gyros,
                                        const BodyMotion& motion, AttitudeRule rule, const std::optional<Need>& need,
                                        double limit_rad = kAttitudeLimit_rad);

}  // namespace trihedron::ground
