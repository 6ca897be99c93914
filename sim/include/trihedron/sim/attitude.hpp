#pragma once
/// The attitude of the spacecraft over time: a reference attitude, slews away from it and back, jitter on top.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "trihedron/core/frames.hpp"
#include "trihedron/records/scenario.hpp"
#include "trihedron/sim/orbit.hpp"
#include "trihedron/sim/random.hpp"

namespace trihedron::sim {

/// C_in_c of the orbital attitude: z up along the radius, y along r × v, x along track.
[[nodiscard]] Rot<In, C> orbital_attitude(const OrbitState& state);

/// C_in_c with z up along the radius and x along the horizontal velocity over the rotating Earth, so that the ground
/// moves along x in an image. The Earth's axis is taken along in_z: precession since 2000 is left out.
[[nodiscard]] Rot<In, C> yaw_steered_attitude(const OrbitState& state);

/// Offsets from the reference attitude. Each turn is about one fixed axis, begins and ends at rest, and its angle is a
/// polynomial of degree 5 in time: rate and acceleration are continuous.
class SlewPlan {
 public:
  SlewPlan() = default;
  /// Throws std::invalid_argument where a slew begins before the one before has ended, or for limits that are not
  /// positive.
  SlewPlan(const std::vector<Slew>& slews, double max_rate_rad_s, double max_acceleration_rad_s2);

  /// q_reference_c.
  [[nodiscard]] Eigen::Quaterniond at(double t_s) const;

  /// One turn about a fixed axis, at rest at both ends.
  struct Turn {
    double begin_s;
    double end_s;
    Eigen::Quaterniond from;
    Eigen::Quaterniond to;
    Eigen::Vector3d rotation_vector_rad;  ///< to = from exp([v×])
  };
  [[nodiscard]] const std::vector<Turn>& turns() const { return turns_; }

 private:
  std::vector<Turn> turns_;
};

/// Time that a rest-to-rest turn of a SlewPlan takes, s.
[[nodiscard]] double turn_duration_s(double angle_rad, double max_rate_rad_s, double max_acceleration_rad_s2);

/// q_reference_c of Rz(yaw) Ry(pitch) Rx(roll).
[[nodiscard]] Eigen::Quaterniond slew_target(const Slew& slew);

/// Slews of an imaging programme for 0 … duration_s; the last may end after it.
[[nodiscard]] std::vector<Slew> imaging_slews(const ImagingProgramme& programme, double max_rate_rad_s,
                                              double max_acceleration_rad_s2, double duration_s, Stream random);

/// Smooth, band-limited, stationary Gaussian noise in three independent axes, unit variance: a B-spline of degree 5
/// (four times differentiable) with white coefficients. Its power falls as sinc¹²(f Δ), Δ the distance of the knots.
class SmoothNoise {
 public:
  /// For begin_s … end_s. bandwidth_hz: half-power, positive.
  SmoothNoise(double bandwidth_hz, double begin_s, double end_s, Stream random);

  [[nodiscard]] Eigen::Vector3d at(double t_s) const;

  [[nodiscard]] double begin_s() const { return begin_s_; }
  [[nodiscard]] double knots_per_s() const { return knots_per_s_; }
  /// Of the B-spline, as many as there are knots.
  [[nodiscard]] const std::vector<Eigen::Vector3d>& coefficients() const { return coefficients_; }

 private:
  double begin_s_;
  double knots_per_s_;
  std::vector<Eigen::Vector3d> coefficients_;
};

/// Recorded attitude, twice differentiable: a natural cubic spline of the quaternion's components, normalised.
class AttitudeSpline {
 public:
  /// The sign of each sample's quaternion is arbitrary. Throws std::invalid_argument for fewer than two samples, times
  /// that do not increase, or neighbours 90° apart and more.
  explicit AttitudeSpline(const std::vector<AttitudeSample>& samples);

  /// q_in_c. Its sign is continuous in time, beginning with that of the first sample.
  [[nodiscard]] Eigen::Quaterniond at(double t_s) const;
  [[nodiscard]] double begin_s() const { return t_s_.front(); }
  [[nodiscard]] double end_s() const { return t_s_.back(); }
  /// At the samples: x, y, z, w, and their second derivatives, 1/s².
  [[nodiscard]] const std::vector<Eigen::Vector4d>& values() const { return q_; }
  [[nodiscard]] const std::vector<Eigen::Vector4d>& second_derivatives() const { return q_second_; }

 private:
  std::vector<double> t_s_;
  std::vector<Eigen::Vector4d> q_;
  std::vector<Eigen::Vector4d> q_second_;  ///< second derivative at the samples
};

/// The true attitude, at any time between begin_s and end_s, seconds from the start of the pass.
class AttitudeProgramme {
 public:
  /// `ephemeris` is used here only. Throws std::invalid_argument as its parts do, and for a recorded attitude that does
  /// not cover begin_s … end_s up to 0.2 s.
  AttitudeProgramme(const AttitudeScenario& scenario, const Ephemeris& ephemeris, std::uint64_t seed, double begin_s,
                    double end_s);
  /// The same with the reference attitude of another, of the same orbit and time.
  AttitudeProgramme(const AttitudeScenario& scenario, std::shared_ptr<const AttitudeSpline> reference,
                    std::uint64_t seed, double begin_s, double end_s);

  /// C_in_c.
  [[nodiscard]] Rot<In, C> at(double t_s) const;
  /// Angular velocity of c relative to in, rad/s.
  [[nodiscard]] Vec<C> rate(double t_s) const;

  // What it is made of.
  [[nodiscard]] const std::shared_ptr<const AttitudeSpline>& reference() const { return reference_; }
  [[nodiscard]] const SlewPlan& slews() const { return slews_; }
  [[nodiscard]] const std::optional<SmoothNoise>& jitter() const { return jitter_; }
  [[nodiscard]] double jitter_rad() const { return jitter_rad_; }  ///< 1-sigma about each axis

 private:
  std::shared_ptr<const AttitudeSpline> reference_;
  SlewPlan slews_;
  double jitter_rad_;
  std::optional<SmoothNoise> jitter_;
};

}  // namespace trihedron::sim
