#pragma once

#include <algorithm>
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

/// Drift about the magnetic field of a dipole in the plane of the orbit, so much of it at the equator, of a body that
/// faces the Earth but for its slews.
inline void add_magnetic_drift(const Truth& truth, double rate_rad_s, int gyro, GyroTelemetry& readings) {
  const Eigen::Vector3d up_at_start = truth.q_in_c.front() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d dipole = truth.q_in_c.front() * Eigen::Vector3d::UnitX();
  const double step_s = to_seconds(truth.t[1] - truth.t[0]);
  const auto rate = [&](double since_s, const Eigen::Vector3d&) -> Eigen::Vector3d {
    const double phase = kOrbitalRate_rad_s * since_s;
    const Eigen::Vector3d up = std::cos(phase) * up_at_start + std::sin(phase) * dipole;
    const auto at = std::min(static_cast<std::size_t>(since_s / step_s), truth.q_in_c.size() - 1);
    return rate_rad_s * (truth.q_in_c[at].conjugate() * (3 * up.dot(dipole) * up - dipole));
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
