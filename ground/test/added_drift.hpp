#pragma once

#include <cmath>
#include <cstddef>

#include "trihedron/core/drift.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

inline constexpr double kOrbitalRate_rad_s = 1.11e-3;

/// Turns the momentum of a gyro in a pass as more drift does: rate_rad_s(time since the begin in s, direction in case
/// axes) about the axes of its case.
template <class Rate>
void add_drift(const Truth& truth, const Rate& rate_rad_s, int gyro, GyroTelemetry& readings) {
  Eigen::Vector3d turned_in(0, 0, 0);
  std::size_t at = 0;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    while (at + 2 < truth.t.size() && truth.t[at + 1] <= readings.t[i]) {
      ++at;
    }
    const double part = to_seconds(readings.t[i] - truth.t[at]) / to_seconds(truth.t[at + 1] - truth.t[at]);
    const Eigen::Quaterniond q_in_c = truth.q_in_c[at].slerp(part, truth.q_in_c[at + 1]);
    Eigen::Map<Eigen::Vector3d> h_b(
        &readings.h[3 * (i * static_cast<std::size_t>(readings.gyros) + static_cast<std::size_t>(gyro))]);
    const Eigen::Vector3d direction = h_b;
    const Eigen::Vector3d rate = rate_rad_s(to_seconds(readings.t[i] - truth.t.front()), direction);
    // Axes of the case are those of the body but for some minutes of arc.
    turned_in += to_seconds(readings.t[i] - readings.t[i - 1]) * (q_in_c * rate);
    h_b = (h_b + (q_in_c.conjugate() * turned_in).cross(h_b)).normalized();
  }
}

/// Drift about each body axis at orbital period.
inline void add_orbital_drift(const Truth& truth, const Eigen::Vector3d& sine_rad_s,
                              const Eigen::Vector3d& cosine_rad_s, int gyro, GyroTelemetry& readings) {
  const auto rate = [&](double since_s, const Eigen::Vector3d&) -> Eigen::Vector3d {
    const double phase = kOrbitalRate_rad_s * since_s;
    return std::sin(phase) * sine_rad_s + std::cos(phase) * cosine_rad_s;
  };
  add_drift(truth, rate, gyro, readings);
}

/// Coefficients of eq. (1) that come and go with a polhode told from the begin of the pass on.
inline void add_polhode(const Truth& truth, const PolhodeDrift& its, int gyro, GyroTelemetry& readings) {
  const auto rate = [&](double since_s, const Eigen::Vector3d& h_b) -> Eigen::Vector3d {
    const double angle = its.polhode.angle_rad(since_s);
    return Esg7::rate<double>(h_b, std::sin(angle) * its.sine_rad_s + std::cos(angle) * its.cosine_rad_s);
  };
  add_drift(truth, rate, gyro, readings);
}

}  // namespace trihedron::ground
