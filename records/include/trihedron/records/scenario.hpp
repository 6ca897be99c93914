#pragma once
/// What a simulated pass is made of. The defaults are the paper's experiment: nine hours of Resurs-DK1, two gyros at 8
/// Hz, a fix every 3 s, 30′ of misalignment, unknown drift coefficients. SI units, angles in radians, sigmas 1-sigma.
/// Frames: docs/notation.md. Probabilities are per sample or per fix; zero switches the fault off.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "trihedron/core/time.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron {

/// A stretch of the pass, seconds from its start; holds begin_s, not end_s.
struct Interval {
  double begin_s = 0;
  double end_s = 0;
};

/// States of an orbit as they are told, about the Earth's centre, axes `in`, and how to interpolate between them. Times
/// are seconds from the start of the pass, and increase; where begin_s ≤ t ≤ end_s they may be used.
struct EphemerisSegment {
  enum class Interpolation {
    kHermite,  ///< through positions and velocities
    kLagrange  ///< of each component of position and velocity by itself
  };
  double begin_s = 0;
  double end_s = 0;
  Interpolation interpolation = Interpolation::kHermite;
  int degree = 7;  ///< of the polynomial
  std::vector<double> t_s{};
  std::vector<Eigen::Vector3d> position_m{};
  std::vector<Eigen::Vector3d> velocity_m_s{};

  /// How many states the polynomial goes through.
  [[nodiscard]] std::size_t nodes() const {
    return static_cast<std::size_t>(interpolation == Interpolation::kHermite ? (degree + 2) / 2 : degree + 1);
  }
};

/// Mean elements at the start of the pass; equator and equinox of `in`. Kepler's motion with the secular rates of J2.
struct OrbitScenario {
  double perigee_altitude_m = 360e3;  ///< above the equatorial radius
  double apogee_altitude_m = 604e3;
  double inclination_rad = 70 * kDegree;
  double ascending_node_rad = 40 * kDegree;
  double argument_of_perigee_rad = 60 * kDegree;
  double mean_anomaly_rad = 0;
  std::vector<EphemerisSegment>
      ephemeris{};  ///< in place of the elements where there is one; in order, not overlapping
};

/// From `begin_s` on, turn about one fixed axis to these angles from the reference attitude, at rest at both ends, and
/// stay there. The offset is C_reference_c = Rz(yaw) Ry(pitch) Rx(roll).
struct Slew {
  double begin_s = 0;
  double roll_rad = 0;
  double pitch_rad = 0;
  double yaw_rad = 0;
};

/// Slews drawn from the seed: to a target uniformly distributed within the limits, a dwell there, back to the reference
/// attitude.
struct ImagingProgramme {
  double max_roll_rad = 30 * kDegree;
  double max_pitch_rad = 15 * kDegree;
  double mean_rest_s = 600;  ///< between slews, exponentially distributed
  double dwell_s = 60;
};

/// Part of a recorded attitude. Neighbours less than 90° apart; times strictly increase.
struct AttitudeSample {
  double t_s = 0;
  Eigen::Quaterniond q_in_c = Eigen::Quaterniond::Identity();
};

/// How the spacecraft is pointed: a reference attitude, slews from it, jitter on top.
struct AttitudeScenario {
  enum class Reference {
    kOrbital,     ///< z up along the radius, y orbit normal (r × v), x along track
    kYawSteered,  ///< z up along the radius, x along the track over the rotating Earth
    kInertial,    ///< `inertial_q_in_c`
    kRecorded     ///< `recorded`, by a natural cubic spline; must cover the pass
  };
  Reference reference = Reference::kOrbital;
  Eigen::Quaterniond inertial_q_in_c = Eigen::Quaterniond::Identity();
  std::vector<AttitudeSample> recorded{};

  std::variant<std::vector<Slew>, ImagingProgramme> slews = ImagingProgramme{};
  double max_slew_rate_rad_s = 0.5 * kDegree;
  double max_slew_acceleration_rad_s2 = 0.02 * kDegree;

  double jitter_rad = 20 * kArcsecond;  ///< 1-sigma about each c axis
  double jitter_bandwidth_hz = 0.02;    ///< half-power; far above it the spectrum is zero
};

/// One member of the drift family ω = −∇W + h × ∇D on the unit sphere of h in case axes, W or D = amplitude × Y(degree,
/// order) with real orthonormal spherical harmonics; order < 0 are the sines.
struct DriftHarmonic {
  enum class Potential { kW, kD };
  Potential potential = Potential::kW;
  int degree = 1;  ///< 1 … 20
  int order = 0;   ///< −degree … degree
  double amplitude_rad_s = 0;
};

/// "W(2,-1)".
[[nodiscard]] inline std::string name(const DriftHarmonic& member) {
  const char* potential = member.potential == DriftHarmonic::Potential::kW ? "W(" : "D(";
  return potential + std::to_string(member.degree) + "," + std::to_string(member.order) + ")";
}

/// How the momentum of a gyro precesses.
struct DriftScenario {
  /// κ of eq. (1): k0, μ12, μ23, μ31, ν12, ν23, ν31. Without it drawn from the seed, normal, with `prior_sigma_rad_s`.
  std::optional<std::array<double, 7>> kappa_rad_s{};
  double prior_sigma_rad_s = 2e-6;  ///< prior sigma that the estimator is given for each coefficient

  std::vector<DriftHarmonic> harmonics{};  ///< drift that eq. (1) does not contain
  /// Amplitude, 1-sigma, of further members drawn from the seed: all of degree 1 and 2 that eq. (1) does not contain.
  double outside_sigma_rad_s = 1e-8;

  double coefficient_walk_rad_s_sqrt_s = 0;  ///< random walk of each κ: rad/s per √s
  double warm_up_fraction = 0;               ///< κ(t) = κ (1 + fraction exp(−t / warm_up_time_s))
  double warm_up_time_s = 3600;
  double direction_walk_rad_sqrt_s = 0;  ///< random walk of the momentum about each case axis: rad per √s
  double markov_sigma_rad_s = 0;  ///< first-order Gauss–Markov drift about each case axis, stationary from the start
  double markov_time_s = 3600;

  // Drift that no model of an estimator contains (trihedron/sim/unmodelled.hpp); 0 switches each off.

  /// A sharp feature on the sphere of directions: its largest drift; where it is, case axes, any length but 0, without
  /// it drawn from the seed, evenly over the sphere; its radius.
  double bump_rad_s = 0;
  std::optional<Eigen::Vector3d> bump_centre{};
  double bump_radius_rad = 20 * kDegree;
  /// Largest drift that depends on the side from which a direction was reached, and the angle after which it has
  /// turned to the other side.
  double hysteresis_rad_s = 0;
  double hysteresis_width_rad = 5 * kDegree;
  /// All κ larger by this fraction while the body slews, decaying after the slew.
  double slew_fraction = 0;
  double slew_time_s = 900;
  /// Each κ jumps once, by a normal draw of this sigma.
  double jump_sigma_rad_s = 0;
  double jump_at_s = 4.5 * 3600;
  /// All κ modulated by the polhode: fraction × cos φ(t), φ at the start drawn from the seed, its period growing by
  /// polhode_period_rate seconds per second (Gravity Probe B: hours, and changing all the time).
  double polhode_fraction = 0;
  double polhode_period_s = 2 * 3600;
  double polhode_period_rate = 0.02;
  /// All κ larger by this fraction after a long time in sunlight, smaller in the Earth's shadow, following with this
  /// time constant.
  double thermal_fraction = 0;
  double thermal_time_s = 1200;
};

/// How the direction of the momentum is read in case axes: reading = unit((1 + scale) h + bias + noise), then
/// quantised.
struct ReadoutScenario {
  double noise_rad = 2 * kArcsecond;  ///< per direction cosine, white
  Eigen::Vector3d bias_rad{0, 0, 0};
  Eigen::Vector3d scale{0, 0, 0};
  double quantum_rad = 0;
  double latency_s = 0;  ///< a reading stamped t holds the direction at t − latency

  double dropout_probability = 0;  ///< the sample is NaN
  double spike_probability = 0;    ///< one direction cosine is off by up to ± spike_rad
  double spike_rad = 1 * kDegree;
  double stuck_probability = 0;  ///< the readout starts to repeat its last value, for stuck_s
  double stuck_s = 2;
};

/// How a mounting moves during the pass: by a step, and evenly. Small angles: their sum is a rotation vector.
struct MountingChange {
  Eigen::Vector3d step_rad{0, 0, 0};
  double step_at_s = 0;  ///< from this time of the pass on
  Eigen::Vector3d rate_rad_s{0, 0, 0};

  [[nodiscard]] bool is_there() const { return !step_rad.isZero(0) || !rate_rad_s.isZero(0); }
  /// Rotation vector since the start of the pass, rad.
  [[nodiscard]] Eigen::Vector3d at(double t_s) const {
    return t_s * rate_rad_s + (t_s >= step_at_s ? step_rad : Eigen::Vector3d(0, 0, 0));
  }
};

/// One gyro: where its momentum points at the start, how it is mounted, how it drifts, how it is read.
struct GyroScenario {
  Eigen::Vector3d start_direction_c{0.995, 0.087, 0.045};  ///< of the momentum, c axes, at the start; any length but 0
  Eigen::Vector3d mounting_rotation_vector_rad{0, 0, 0};  ///< as designed and known: C_c_b = exp([m×]) exp([mounting×])
  /// m, c axes. Without it drawn from the seed: uniformly distributed direction, of the length
  /// `misalignment_magnitude_rad`.
  std::optional<Eigen::Vector3d> misalignment_rad{};
  double misalignment_magnitude_rad = 30 * kArcminute;
  double alignment_prior_sigma_rad = 30 * kArcminute;  ///< given to the estimator, per axis
  MountingChange mounting_change{};                    ///< of the case against the body, c axes
  DriftScenario drift{};
  ReadoutScenario readout{};
};

/// A star-tracker head with axes s; those of the first are c. A fix stamped t holds C_in_s(t + clock_offset +
/// clock_rate (t − epoch) − latency) exp([e×]), e in s axes the sum of the errors below, and is given as q_in_c by the
/// mounting as designed.
struct StarTrackerScenario {
  // Of further heads only: C_c_s = exp([misalignment×]) exp([mounting×]).
  Eigen::Vector3d mounting_rotation_vector_rad{0, 0, 0};
  Eigen::Vector3d misalignment_rad{0, 0, 0};      ///< c axes
  double alignment_prior_sigma_rad = kArcminute;  ///< given to the estimator, per axis

  Eigen::Vector3d noise_rad{3 * kArcsecond, 3 * kArcsecond, 20 * kArcsecond};  ///< white, about s x, y, z
  double clock_offset_s = 0;
  double clock_rate = 0;  ///< s/s
  double latency_s = 0;

  MountingChange mounting_change{};  ///< of the head against the body, s axes
  /// Turn of what the head takes for `in`, in axes, from inertial_step_at_s on: as by another catalogue or equinox.
  Eigen::Vector3d inertial_step_rad{0, 0, 0};
  double inertial_step_at_s = 0;

  /// p_s, p_c of the error p_s sin nt + p_c cos nt; n the mean rate of the argument of latitude, t from the start of
  /// the pass.
  Eigen::Vector3d orbital_sine_rad{0, 0, 0};
  Eigen::Vector3d orbital_cosine_rad{0, 0, 0};

  /// Error that depends on where the stars stand in the field of view: decorrelates as the field moves over the sky by
  /// `field_correlation_rad`, frozen when the attitude is inertial.
  Eigen::Vector3d field_error_rad{0, 0, 0};
  double field_correlation_rad = 2 * kDegree;

  enum class Aberration { kCorrected, kUncorrected };
  Aberration aberration = Aberration::kCorrected;

  /// No fix with the boresight nearer to the Sun's centre, or to the Earth's limb, than this.
  std::optional<double> sun_exclusion_rad{};
  std::optional<double> earth_exclusion_rad{};
  double max_rate_rad_s = std::numeric_limits<double>::infinity();  ///< no fix above this body rate

  std::vector<Interval> outages{};
  double dropout_probability = 0;  ///< the fix is missing
  double outlier_probability = 0;  ///< rotated about a random axis by an angle uniform in 0 … outlier_rad
  double outlier_rad = 2 * kDegree;
  double wrong_sign_probability = 0;  ///< −q in place of q
};

/// A whole pass to be simulated.
struct Scenario {
  std::string spacecraft = "Resurs-DK1";
  std::uint64_t seed = 0;
  Time epoch{std::chrono::sys_days{std::chrono::year{2009} / 5 / 20} -
             std::chrono::sys_days{std::chrono::year{1958} / 1 / 1}};
  Duration duration = std::chrono::hours{9};
  Duration gyro_period = std::chrono::milliseconds{125};
  Duration star_tracker_period = std::chrono::seconds{3};  ///< a multiple of gyro_period
  std::vector<Interval> gyro_gaps{};                       ///< no gyro sample at all

  OrbitScenario orbit{};
  AttitudeScenario attitude{};
  std::vector<GyroScenario> gyros{GyroScenario{}, GyroScenario{.start_direction_c = {0.14, 0.985, 0.094}}};
  StarTrackerScenario star_tracker{};  ///< the first head
  std::vector<StarTrackerScenario> further_star_trackers{};
};

}  // namespace trihedron
