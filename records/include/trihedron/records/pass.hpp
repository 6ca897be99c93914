#pragma once
/// One stretch of telemetry in memory, and the truth behind a simulated one. Frames: docs/notation.md.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "trihedron/core/telemetry.hpp"
#include "trihedron/core/time.hpp"
#include "trihedron/records/calibration.hpp"

namespace trihedron {

/// What is known of one gyro before the pass: prior means and 1-sigma.
struct GyroPrior {
  double readout_noise_rad = 0;  ///< per direction cosine
  /// By which its readings are stamped late. Those of a pass in memory are mended by it already.
  double latency_s = 0;
  std::map<DriftCoefficient, double> drift_rad_s;        ///< missing means 0
  std::map<DriftCoefficient, double> drift_sigma_rad_s;  ///< missing means the common sigma
  double drift_common_sigma_rad_s = 0;
  Eigen::Vector3d alignment_rotation_vector_rad{0, 0, 0};
  Eigen::Vector3d alignment_sigma_rad{0, 0, 0};
  /// Of the case in the body, as designed: v_body = exp([m×]) v_b. Where it is given, the alignment follows from it.
  std::optional<Eigen::Vector3d> mounting_rotation_vector_rad{};
};

/// A star-tracker head other than the first. The first head's axes are c; the axes s of this one are turned from them:
/// C_c_s = exp([m×]) exp([mounting×]), m unknown. It is telemetered as q_in_c, C_in_s exp([mounting×])ᵀ.
struct FurtherStarTracker {
  Eigen::Vector3d noise_rad{0, 0, 0};  ///< 1-sigma about s x, y, z
  Eigen::Vector3d mounting_rotation_vector_rad{0, 0, 0};
  double alignment_prior_sigma_rad = 0;  ///< of m, per axis
};

/// What pass.toml says: when and how the telemetry was taken, and what is known before.
struct PassSettings {
  std::string spacecraft;
  Time epoch{};
  Duration duration{};
  Duration gyro_period{};
  Duration star_tracker_period{};
  Eigen::Vector3d star_tracker_noise_rad{0, 0, 0};  ///< of the first head, 1-sigma about c x, y, z
  /// A fix is stamped t in the telemetry where it gives the attitude at t + offset + rate (t − epoch). Stamps of a pass
  /// in memory are mended by it already.
  double star_tracker_clock_offset_s = 0;
  double star_tracker_clock_rate_s_s = 0;
  std::vector<FurtherStarTracker> further_star_trackers;
  std::vector<GyroPrior> gyros;
  /// Of the first head in the body, as designed: v_body = exp([m×]) v_c. Without it the body axes are c.
  std::optional<Eigen::Vector3d> star_tracker_mounting_rotation_vector_rad{};
  std::string inertial_frame{};  ///< name of the axes `in` that the fixes refer to; empty where it is not given
  std::string start_up;          ///< of the rotors, "2009-05-20"; empty where it is not given
  std::optional<Calibration>
      prior;  ///< an earlier calibration: replaces drift and alignment of `gyros`, with its covariance
};

/// Direction cosines as telemetered: not normalised, may hold NaN. Times strictly increase.
struct GyroTelemetry {
  int gyros = 0;
  std::vector<Time> t;
  std::vector<double> h;  ///< sample-major: h[(sample * gyros + gyro) * 3 + axis], case axes of each gyro

  [[nodiscard]] std::size_t size() const { return t.size(); }
  [[nodiscard]] Eigen::Vector3d direction(std::size_t sample, int gyro) const {
    const double* p = &h[(sample * static_cast<std::size_t>(gyros) + static_cast<std::size_t>(gyro)) * 3];
    return {p[0], p[1], p[2]};
  }
};

/// One sample of it.
[[nodiscard]] inline GyroSample sample_of(const GyroTelemetry& telemetry, std::size_t i) {
  GyroSample sample;
  sample.t = telemetry.t[i];
  for (int k = 0; k < std::min(telemetry.gyros, kMaxGyros); ++k) {
    sample.h_b[k] = telemetry.direction(i, k);
  }
  return sample;
}

/// Fixes as telemetered: q_in_c, Hamilton; not normalised, of either sign, may hold NaN. Times strictly increase.
struct StarTrackerTelemetry {
  std::vector<Time> t;
  std::vector<Eigen::Quaterniond> q_in_c;
  std::vector<FixCovariance> covariances{};  ///< of each, told or not; empty where none is told

  [[nodiscard]] std::size_t size() const { return t.size(); }
  [[nodiscard]] StarFix fix(std::size_t i, int head) const {
    return {t[i], q_in_c[i], head, covariances.empty() ? FixCovariance{} : covariances[i]};
  }
  /// Takes fix i of another, which has covariances as this one has.
  void add(const StarTrackerTelemetry& other, std::size_t i) {
    t.push_back(other.t[i]);
    q_in_c.push_back(other.q_in_c[i]);
    if (!other.covariances.empty()) {
      covariances.push_back(other.covariances[i]);
    }
  }
};

/// Settings and telemetry of one pass.
struct Pass {
  PassSettings settings;
  GyroTelemetry gyro;
  StarTrackerTelemetry star_tracker;                        ///< of the first head
  std::vector<StarTrackerTelemetry> further_star_trackers;  ///< as in PassSettings

  /// Of a head, 0 being the first.
  [[nodiscard]] StarTrackerTelemetry& fixes_of(std::size_t head) {
    return head == 0 ? star_tracker : further_star_trackers.at(head - 1);
  }
  [[nodiscard]] const StarTrackerTelemetry& fixes_of(std::size_t head) const {
    return head == 0 ? star_tracker : further_star_trackers.at(head - 1);
  }
};

/// What a simulator knows. Never part of a Pass, so that no estimator can read it.
struct Truth {
  /// Constants of one gyro.
  struct Gyro {
    std::vector<std::pair<DriftCoefficient, double>> drift_rad_s;  ///< of eq. (1)
    /// Drift outside eq. (1), each by the name that the simulator gave it; those of a DriftCoefficient have its name.
    std::vector<std::pair<std::string, double>> unmodelled_rad_s;
    Eigen::Vector3d alignment_rotation_vector_rad{0, 0, 0};

    /// Of eq. (1) or outside it; nothing where the simulator does not give it.
    [[nodiscard]] std::optional<double> drift(const DriftCoefficient& coefficient) const;
  };
  /// Errors of a head that do not change at random; C_c_s as in FurtherStarTracker.
  struct StarTracker {
    double clock_offset_s = 0;  ///< a fix stamped t gives the attitude at t + offset + rate (t − epoch)
    double clock_rate_s_s = 0;
    Eigen::Vector3d orbital_sine_rad{0, 0, 0};  ///< of the error p_s sin nt + p_c cos nt, head axes
    Eigen::Vector3d orbital_cosine_rad{0, 0, 0};
    Eigen::Vector3d misalignment_rad{0, 0, 0};  ///< m, c axes
  };
  std::vector<Gyro> gyros;
  std::vector<StarTracker> star_trackers;  ///< empty where the simulator does not give it
  double orbital_rate_rad_s = 0;           ///< n; 0 where the simulator does not give it
  std::vector<Time> t;
  std::vector<Eigen::Quaterniond> q_in_c;
  std::vector<double> h_in;  ///< sample-major: h_in[(sample * gyros + gyro) * 3 + axis]
};

/// An attitude solution: q_in_c with 1-sigma of the small rotation about c x, y, z, and what else is known of each
/// epoch.
struct AttitudeHistory {
  std::vector<Time> t;
  std::vector<Eigen::Quaterniond> q_in_c;
  std::vector<Eigen::Vector3d> sigma_rad;  ///< empty where unknown
  std::vector<double> age_s;               ///< time since the last astro-correction; empty where unknown

  [[nodiscard]] std::size_t size() const { return t.size(); }
};

}  // namespace trihedron
