#include "trihedron/sim/orbit.hpp"

#include <cmath>
#include <stdexcept>

namespace trihedron::sim {

double eccentric_anomaly(double mean_anomaly_rad, double eccentricity) {
  const double m = std::remainder(mean_anomaly_rad, 2 * std::numbers::pi);
  // Newton from E = M ± e cannot overshoot: M − E + e sin E is convex on that side of the root. For a nearly round
  // orbit the second-order start saves two of its rounds.
  double e_anomaly = eccentricity < 0.1 ? m + eccentricity * std::sin(m) * (1 + eccentricity * std::cos(m))
                                        : m + std::copysign(eccentricity, m);
  for (int i = 0; i < 30; ++i) {
    const double step = (m - e_anomaly + eccentricity * std::sin(e_anomaly)) / (1 - eccentricity * std::cos(e_anomaly));
    e_anomaly += step;
    // Newton squares its error: after a step below 1e-8 what is left is rounding.
    if (std::abs(step) < 1e-8) {
      break;
    }
  }
  return e_anomaly;
}

KeplerJ2::KeplerJ2(const OrbitScenario& orbit) : start_(orbit) {
  if (!(orbit.perigee_altitude_m > 0 && orbit.perigee_altitude_m <= orbit.apogee_altitude_m)) {
    throw std::invalid_argument("orbit: perigee altitude must be above 0 and not above the apogee's");
  }
  semi_major_axis_m_ = kEarthRadius_m + (orbit.perigee_altitude_m + orbit.apogee_altitude_m) / 2;
  eccentricity_ = (orbit.apogee_altitude_m - orbit.perigee_altitude_m) / (2 * semi_major_axis_m_);
  cos_inclination_ = std::cos(orbit.inclination_rad);
  sin_inclination_ = std::sin(orbit.inclination_rad);
  mean_motion_rad_s_ = std::sqrt(kEarthGravity_m3_s2 / semi_major_axis_m_) / semi_major_axis_m_;

  const double flatness = 1 - eccentricity_ * eccentricity_;
  const double parameter_m = semi_major_axis_m_ * flatness;
  const double factor = 0.75 * mean_motion_rad_s_ * kEarthJ2 * std::pow(kEarthRadius_m / parameter_m, 2);
  const double cos2 = cos_inclination_ * cos_inclination_;
  node_rate_rad_s_ = -2 * factor * cos_inclination_;
  perigee_rate_rad_s_ = factor * (5 * cos2 - 1);
  anomaly_rate_rad_s_ = mean_motion_rad_s_ + factor * std::sqrt(flatness) * (3 * cos2 - 1);
}

OrbitState KeplerJ2::at(double t_s) const {
  const double e_anomaly = eccentric_anomaly(start_.mean_anomaly_rad + anomaly_rate_rad_s_ * t_s, eccentricity_);
  const double perigee = start_.argument_of_perigee_rad + perigee_rate_rad_s_ * t_s;
  const double node = start_.ascending_node_rad + node_rate_rad_s_ * t_s;
  const double cos_e = std::cos(e_anomaly);
  const double sin_e = std::sin(e_anomaly);
  const double cos_w = std::cos(perigee);
  const double sin_w = std::sin(perigee);
  const double cos_n = std::cos(node);
  const double sin_n = std::sin(node);

  // Perifocal axes: towards the ascending node and a right angle further in the plane, turned to the perigee.
  const Eigen::Vector3d to_node(cos_n, sin_n, 0);
  const Eigen::Vector3d beyond_node(-sin_n * cos_inclination_, cos_n * cos_inclination_, sin_inclination_);
  const Eigen::Vector3d p = cos_w * to_node + sin_w * beyond_node;
  const Eigen::Vector3d q = cos_w * beyond_node - sin_w * to_node;

  const double minor = std::sqrt(1 - eccentricity_ * eccentricity_);
  const double speed = semi_major_axis_m_ * mean_motion_rad_s_ / (1 - eccentricity_ * cos_e);
  return {Vec<In>::assume(semi_major_axis_m_ * ((cos_e - eccentricity_) * p + minor * sin_e * q)),
          Vec<In>::assume(speed * (minor * cos_e * q - sin_e * p))};
}

}  // namespace trihedron::sim
