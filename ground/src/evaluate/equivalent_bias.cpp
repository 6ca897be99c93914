#include "trihedron/ground/evaluate/equivalent_bias.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstddef>

#include "model/prior.hpp"
#include "trihedron/core/precession.hpp"
#include "trihedron/ground/evaluate/open_loop_forecast.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {
namespace {

/// Over it the body turns by a third of a degree, and directions of drift with it.
constexpr Duration kPathStep = std::chrono::seconds(5);

/// The gyros of a calibration along an attitude.
class Drifting {
 public:
  Drifting(const Calibration& calibration, const AttitudeHistory& attitude)
      : motion_(attitude.t, attitude.q_in_c), now_(std::clamp(calibration.t, attitude.t.front(), attitude.t.back())) {
    for (const GyroCalibration& record : calibration.gyros) {
      refuse_incomplete(record);
      const Layout layout = layout_of(record);
      gyros_.push_back({record, gyro_of(record, layout), DriftModel(layout.drift_model, layout.further)});
    }
  }

  /// Later or earlier.
  void go_to(Time t) {
    while (now_ != t) {
      check_stop();
      const Duration step = std::clamp<Duration>(t - now_, -kPathStep, kPathStep);
      const Eigen::Matrix3d C_in_c = motion_.C_in_c(now_ + step / 2);
      for (auto& [record, gyro, drift] : gyros_) {
        precess(gyro, drift, C_in_c, reading(gyro, C_in_c), drift_time(record, now_ + step / 2), to_seconds(step));
      }
      now_ += step;
    }
  }

  [[nodiscard]] Eigen::Vector3d bias_rad_s() const {
    const Eigen::Matrix3d C_in_c = motion_.C_in_c(now_);
    Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
    Eigen::Vector3d turned = Eigen::Vector3d::Zero();
    for (const auto& [record, gyro, drift] : gyros_) {
      const Eigen::Vector3d omega_b =
          drift.rate(gyro.corrected(reading(gyro, C_in_c)), drift_time(record, now_), gyro.drift_rad_s.data());
      const Eigen::Matrix3d projector = Eigen::Matrix3d::Identity() - gyro.h_in * gyro.h_in.transpose();
      across += projector;
      turned += projector * (C_in_c * (gyro.C_c_b * omega_b));
    }
    const Eigen::LLT<Eigen::Matrix3d> solver(across);
    constexpr double kNearlyParallel = 1e-6;  // sine² of the angle between two momenta
    if (solver.info() != Eigen::Success || !(solver.rcond() > kNearlyParallel)) {
      throw SetupError("the momenta of the calibration are nearly parallel, and their drift is no turn of the body",
                       "give a calibration of gyros whose momenta differ");
    }
    return -(C_in_c.transpose() * solver.solve(turned));
  }

 private:
  struct One {
    GyroCalibration record;
    Gyro gyro;
    DriftModel drift;
  };

  static Eigen::Vector3d reading(const Gyro& gyro, const Eigen::Matrix3d& C_in_c) {
    return gyro.reading_of(C_in_c.transpose() * gyro.h_in).normalized();
  }

  BodyMotion motion_;
  Time now_;
  std::vector<One> gyros_;
};

}  // namespace

std::vector<Eigen::Vector3d> equivalent_gyro_bias_rad_s(const Calibration& calibration,
                                                        const AttitudeHistory& attitude) {
  std::vector<Eigen::Vector3d> bias_rad_s(attitude.size());
  if (attitude.size() == 0) {
    return bias_rad_s;
  }
  const Drifting at_calibration(calibration, attitude);
  const auto first = static_cast<std::size_t>(std::ranges::lower_bound(attitude.t, calibration.t) - attitude.t.begin());
  Drifting later = at_calibration;
  for (std::size_t i = first; i < attitude.size(); ++i) {
    later.go_to(attitude.t[i]);
    bias_rad_s[i] = later.bias_rad_s();
  }
  Drifting earlier = at_calibration;
  for (std::size_t i = first; i-- > 0;) {
    earlier.go_to(attitude.t[i]);
    bias_rad_s[i] = earlier.bias_rad_s();
  }
  return bias_rad_s;
}

}  // namespace trihedron::ground
