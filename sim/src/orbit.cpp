#include "trihedron/sim/orbit.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <stdexcept>
#include <string>

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

namespace {

using Eigen::Vector3d;

OrbitState state_of(const Vector3d& position_m, const Vector3d& velocity_m_s) {
  return {Vec<In>::assume(position_m), Vec<In>::assume(velocity_m_s)};
}

/// The first of the states that the polynomial at `t_s` goes through: as many before as after it, where there are.
std::size_t first_node(const EphemerisSegment& its, double t_s) {
  const auto after = static_cast<std::size_t>(std::ranges::upper_bound(its.t_s, t_s) - its.t_s.begin());
  const std::size_t half = its.nodes() / 2;
  return std::min(after > half ? after - half : 0, its.t_s.size() - its.nodes());
}

/// Each value of a component by its Lagrange polynomial.
OrbitState by_lagrange(const EphemerisSegment& its, double t_s) {
  const std::size_t first = first_node(its, t_s);
  Vector3d position = Vector3d::Zero();
  Vector3d velocity = Vector3d::Zero();
  for (std::size_t i = first; i < first + its.nodes(); ++i) {
    double weight = 1;
    for (std::size_t j = first; j < first + its.nodes(); ++j) {
      weight *= i == j ? 1 : (t_s - its.t_s[j]) / (its.t_s[i] - its.t_s[j]);
    }
    position += weight * its.position_m[i];
    velocity += weight * its.velocity_m_s[i];
  }
  return state_of(position, velocity);
}

/// Newton's form of the polynomial that has positions and velocities at its nodes, each of which counts twice, and its
/// derivative. One of even degree leaves out the last velocity.
OrbitState by_hermite(const EphemerisSegment& its, double t_s) {
  const std::size_t first = first_node(its, t_s);
  const auto size = static_cast<std::size_t>(its.degree) + 1;
  const auto node = [&](std::size_t i) { return first + i / 2; };
  std::vector<Vector3d> differences(size);  // divided
  for (std::size_t i = 0; i < size; ++i) {
    differences[i] = its.position_m[node(i)];
  }
  for (std::size_t order = 1; order < size; ++order) {
    for (std::size_t i = size - 1; i >= order; --i) {
      const double apart_s = its.t_s[node(i)] - its.t_s[node(i - order)];
      differences[i] =
          apart_s == 0 ? its.velocity_m_s[node(i)] : Vector3d((differences[i] - differences[i - 1]) / apart_s);
    }
  }
  Vector3d position = differences[size - 1];
  Vector3d velocity = Vector3d::Zero();
  for (std::size_t i = size - 1; i-- > 0;) {
    const double since_s = t_s - its.t_s[node(i)];
    velocity = position + since_s * velocity;
    position = differences[i] + since_s * position;
  }
  return state_of(position, velocity);
}

/// From the ascending node, or where the orbit has none from x; −π … π.
double argument_of_latitude(const OrbitState& state) {
  const Vector3d& r = state.position_m.raw();
  const Vector3d normal = r.cross(state.velocity_m_s.raw()).normalized();
  const Vector3d node = Vector3d::UnitZ().cross(normal);
  const Vector3d from = node.norm() > 1e-6 ? node.normalized() : Vector3d(Vector3d::UnitX());
  return std::atan2(r.dot(normal.cross(from)), r.dot(from));
}

/// By the energy.
double osculating_rate_rad_s(const OrbitState& state) {
  const double r = state.position_m.raw().norm();
  const double inverse_axis = 2 / r - state.velocity_m_s.raw().squaredNorm() / kEarthGravity_m3_s2;
  if (!(inverse_axis > 0)) {
    throw std::invalid_argument("orbit: the ephemeris is of no ellipse; give that of a satellite of the Earth");
  }
  return std::sqrt(kEarthGravity_m3_s2 * inverse_axis) * inverse_axis;
}

}  // namespace

ToldEphemeris::ToldEphemeris(const std::vector<EphemerisSegment>& segments, double begin_s, double end_s)
    : segments_(segments) {
  double reached_s = begin_s;
  for (const EphemerisSegment& its : segments_) {
    reached_s = its.begin_s <= reached_s ? std::max(reached_s, its.end_s) : reached_s;
  }
  if (segments_.empty() || segments_.front().begin_s > begin_s || reached_s < end_s) {
    throw std::invalid_argument("orbit: the ephemeris is not known all the way from " + std::to_string(begin_s) +
                                " s to " + std::to_string(end_s) +
                                " s of the pass; give a longer one, or correct epoch_tai and duration");
  }
  // Whole revolutions by the argument of latitude, in steps in which it turns by little.
  mean_rate_rad_s_ = osculating_rate_rad_s(at(begin_s));
  const double step_s = 0.1 / mean_rate_rad_s_;
  const double first = argument_of_latitude(at(begin_s));
  double swept = 0;
  double last = first;
  const auto steps = static_cast<int>((end_s - begin_s) / step_s);
  for (int i = 1; i <= steps; ++i) {
    const double t_s = begin_s + i * step_s;
    const double now = argument_of_latitude(at(t_s));
    const double turned = std::remainder(now - last, 2 * std::numbers::pi);
    const double before = swept;
    swept += turned;
    last = now;
    const double revolutions = std::floor(swept / (2 * std::numbers::pi));
    if (revolutions >= 1 && before < revolutions * 2 * std::numbers::pi) {
      const double whole = revolutions * 2 * std::numbers::pi;
      mean_rate_rad_s_ = whole / (t_s - step_s * (swept - whole) / turned - begin_s);
    }
  }
}

OrbitState ToldEphemeris::at(double t_s) const {
  const auto after = std::ranges::upper_bound(segments_, t_s, {}, &EphemerisSegment::begin_s);
  const EphemerisSegment& its = after == segments_.begin() ? *after : *std::prev(after);
  const double within_s = std::clamp(t_s, its.begin_s, its.end_s);
  return its.interpolation == EphemerisSegment::Interpolation::kHermite ? by_hermite(its, within_s)
                                                                        : by_lagrange(its, within_s);
}

std::unique_ptr<Ephemeris> ephemeris_of(const OrbitScenario& orbit, double begin_s, double end_s) {
  if (orbit.ephemeris.empty()) {
    return std::make_unique<KeplerJ2>(orbit);
  }
  return std::make_unique<ToldEphemeris>(orbit.ephemeris, begin_s, end_s);
}

}  // namespace trihedron::sim
