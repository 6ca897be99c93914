#pragma once

#include <cmath>
#include <cstddef>

#include "trihedron/core/frames.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

inline constexpr double kOrbitalRate_rad_s = 1.11e-3;

/// Turns the momenta of a pass as drift about each body axis at orbital period does.
inline void add_orbital_drift(const Truth& truth, const Eigen::Vector3d& sine_rad_s,
                              const Eigen::Vector3d& cosine_rad_s, int gyro, GyroTelemetry& readings) {
  Eigen::Vector3d turned_in(0, 0, 0);
  std::size_t at = 0;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    while (at + 2 < truth.t.size() && truth.t[at + 1] <= readings.t[i]) {
      ++at;
    }
    const double part = to_seconds(readings.t[i] - truth.t[at]) / to_seconds(truth.t[at + 1] - truth.t[at]);
    const Eigen::Quaterniond q_in_c = truth.q_in_c[at].slerp(part, truth.q_in_c[at + 1]);
    const double phase = kOrbitalRate_rad_s * to_seconds(readings.t[i] - truth.t.front());
    turned_in += to_seconds(readings.t[i] - readings.t[i - 1]) *
                 (q_in_c * Eigen::Vector3d(std::sin(phase) * sine_rad_s + std::cos(phase) * cosine_rad_s));
    // Axes of the case are those of the body but for some minutes of arc.
    Eigen::Map<Eigen::Vector3d> h_b(
        &readings.h[3 * (i * static_cast<std::size_t>(readings.gyros) + static_cast<std::size_t>(gyro))]);
    h_b = (h_b + (q_in_c.conjugate() * turned_in).cross(h_b)).normalized();
  }
}

}  // namespace trihedron::ground
