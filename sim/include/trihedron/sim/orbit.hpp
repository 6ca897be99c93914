#pragma once
/// Where the spacecraft is.

#include <memory>
#include <vector>

#include "trihedron/core/frames.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::sim {

// WGS 84 / EGM96.
inline constexpr double kEarthGravity_m3_s2 = 3.986004418e14;  ///< gravitational parameter
inline constexpr double kEarthRadius_m = 6378137.0;            ///< equatorial
inline constexpr double kEarthJ2 = 1.08262668e-3;              ///< oblateness of the gravity field, 1
inline constexpr double kEarthRate_rad_s = 7.292115e-5;        ///< rotation

/// Position and velocity at one time.
struct OrbitState {
  Vec<In> position_m;    ///< from the Earth's centre
  Vec<In> velocity_m_s;  ///< relative to the Earth's centre
};

/// Interface to a source of position. Times are seconds from the start of the pass.
class Ephemeris {
 public:
  virtual ~Ephemeris() = default;
  [[nodiscard]] virtual OrbitState at(double t_s) const = 0;
  /// Mean rate n of the argument of latitude: the rate of everything that repeats every revolution.
  [[nodiscard]] virtual double mean_rate_rad_s() const = 0;
};

/// Kepler's motion on an ellipse whose node, perigee and mean anomaly run at the secular rates of J2, first order
/// (Vallado, Fundamentals of Astrodynamics, 9.6). The velocity is that on the osculating ellipse, so that r × v is its
/// normal.
class KeplerJ2 final : public Ephemeris {
 public:
  /// Throws std::invalid_argument unless 0 < perigee ≤ apogee.
  explicit KeplerJ2(const OrbitScenario& orbit);

  [[nodiscard]] OrbitState at(double t_s) const override;
  [[nodiscard]] double mean_rate_rad_s() const override { return anomaly_rate_rad_s_ + perigee_rate_rad_s_; }

  [[nodiscard]] double semi_major_axis_m() const { return semi_major_axis_m_; }
  [[nodiscard]] double eccentricity() const { return eccentricity_; }
  [[nodiscard]] double node_rate_rad_s() const { return node_rate_rad_s_; }
  [[nodiscard]] double perigee_rate_rad_s() const { return perigee_rate_rad_s_; }
  [[nodiscard]] double anomaly_rate_rad_s() const { return anomaly_rate_rad_s_; }

 private:
  OrbitScenario start_;
  double semi_major_axis_m_;
  double eccentricity_;
  double mean_motion_rad_s_;  ///< of the ellipse, without J2
  double anomaly_rate_rad_s_;
  double perigee_rate_rad_s_;
  double node_rate_rad_s_;
  double cos_inclination_;
  double sin_inclination_;
};

/// States that are told, interpolated.
class ToldEphemeris final : public Ephemeris {
 public:
  /// Throws std::invalid_argument unless they reach from begin_s to end_s.
  ToldEphemeris(const std::vector<EphemerisSegment>& segments, double begin_s, double end_s);

  /// At a time outside what is told that of the nearest end is taken.
  [[nodiscard]] OrbitState at(double t_s) const override;
  /// Over whole revolutions, or where there is none by the size of the orbit.
  [[nodiscard]] double mean_rate_rad_s() const override { return mean_rate_rad_s_; }

 private:
  std::vector<EphemerisSegment> segments_;
  double mean_rate_rad_s_;
};

/// That of a scenario, which is to be known from begin_s to end_s. Throws std::invalid_argument.
[[nodiscard]] std::unique_ptr<Ephemeris> ephemeris_of(const OrbitScenario& orbit, double begin_s, double end_s);

/// E with E − e sin E = M, |error| < 1e-14 rad for 0 ≤ e < 1.
[[nodiscard]] double eccentric_anomaly(double mean_anomaly_rad, double eccentricity);

}  // namespace trihedron::sim
