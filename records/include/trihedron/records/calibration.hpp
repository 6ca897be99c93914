#pragma once
/// A calibration in memory: what calibration.json holds.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "trihedron/core/precession.hpp"
#include "trihedron/core/time.hpp"
#include "trihedron/records/clock_correction.hpp"
#include "trihedron/records/drift_models.hpp"
#include "trihedron/records/estimator.hpp"
#include "trihedron/records/finding.hpp"
#include "trihedron/records/open_loop_forecast.hpp"
#include "trihedron/records/parameter_id.hpp"
#include "trihedron/records/statistics.hpp"

namespace trihedron {

/// Drift about the case axes that comes back with each orbit: sine_rad_s sin n(t − zero_at) + cosine_rad_s cos n(t −
/// zero_at).
struct OrbitalDrift {
  Eigen::Vector3d sine_rad_s{0, 0, 0};
  Eigen::Vector3d cosine_rad_s{0, 0, 0};
  double rate_rad_s = 0;  ///< n
  Time zero_at{};         ///< in calibration.json the epoch of the pass

  [[nodiscard]] double phase(Time t) const { return rate_rad_s * to_seconds(t - zero_at); }
  /// The same drift, told from another time on.
  [[nodiscard]] OrbitalDrift from(Time zero) const;
};

/// Coefficients of eq. (1) that come and go with the polhode of a rotor: sine_rad_s sin θ + cosine_rad_s cos θ, θ its
/// angle.
struct PolhodeDrift {
  Polhode polhode;  ///< at zero_at
  Time zero_at{};   ///< where θ = 0; in calibration.json the epoch of the pass
  Esg7::Coefficients<double> sine_rad_s = Esg7::Coefficients<double>::Zero();
  Esg7::Coefficients<double> cosine_rad_s = Esg7::Coefficients<double>::Zero();

  [[nodiscard]] double angle_rad(Time t) const { return polhode.angle_rad(to_seconds(t - zero_at)); }
  /// The same drift, told from another time on.
  [[nodiscard]] PolhodeDrift from(Time zero) const;
};

/// The parameters of one gyro, and its momentum.
struct GyroCalibration {
  DriftModelId drift_model;
  std::vector<double> drift_rad_s;                         ///< by coefficient, in the order of coefficients_of()
  Eigen::Vector3d alignment_rotation_vector_rad{0, 0, 0};  ///< Λ: C_c_b = exp([Λ×])
  Eigen::Vector3d momentum_in{0, 0, 0};                    ///< h_in at `t`, unit
  Eigen::Vector3d readout_bias{0, 0, 0};                   ///< of the direction cosines: h_b is read as h_b + bias
  std::optional<OrbitalDrift> orbital_drift;               ///< where it is estimated
  std::optional<PolhodeDrift> polhode;                     ///< where it is estimated
};

/// A component of a further state.
struct FurtherEstimate {
  ParameterId parameter;
  double value = 0;
  double sigma = 0;
};

/// How much drift outside eq. (1) the members of one potential and degree make, where the drift is estimated as a
/// field.
struct DriftFieldLevel {
  int gyro = 0;                                                       ///< index
  DriftCoefficient::Member potential = DriftCoefficient::Member::kW;  ///< kW or kD
  int degree = 0;
  double rms_rad_s = 0;     ///< root mean square over the sphere, of the most likely spectrum
  double sigma_factor = 1;  ///< its 1-sigma: from rms/factor to rms · factor
};

/// The drift model with which an estimator on board is to fly where the calibration found a drift field.
struct OnBoardDrift {
  DriftModelId drift_model;
  /// Random walk of each momentum, per axis across it, that stands for the drift which this model leaves out and which
  /// neither its coefficients nor the alignments can take up. To be added to the noise of the calibration; 0 where that
  /// noise contains it already, as after an earlier calibration with a field.
  double random_walk_rad_sqrt_s = 0;
};

/// The noise levels that a calibration used.
struct CalibrationNoise {
  double direction_random_walk_rad_sqrt_s = 0;  ///< of each momentum across itself, per axis
  /// About c x, y, z, where it was found to differ from the setting.
  std::optional<Eigen::Vector3d> star_tracker_noise_rad;
  double wandering_drift_rad_s = 0;  ///< 1-sigma per case axis; 0: none
  double wandering_time_s = 0;       ///< its correlation time
};

/// The result of a calibration: parameters of all gyros, their covariance, verdict, statistics.
struct Calibration {
  Estimator estimator = Estimator::kInvariant;
  Time epoch{};          ///< of the pass
  std::string start_up;  ///< of the rotors, as in PassSettings; empty where it is not known
  Time t{};              ///< for which the momenta stand
  std::vector<GyroCalibration> gyros;
  /// Drift coefficients and alignments, one per row of `covariance`.
  std::vector<ParameterId> states;
  /// Of the errors, estimate − truth: rad/s for drift; for alignment rad, δ of C_c_b(est) = exp([δ×]) C_c_b(true), c
  /// axes.
  Eigen::MatrixXd covariance;
  std::vector<FurtherEstimate> further;      ///< empty where none was estimated
  std::optional<double> orbital_rate_rad_s;  ///< by which an error of the star trackers at orbital period is estimated
  /// Of the amplitudes of drift that comes back: at orbital period, gyro by gyro, sine before cosine; then with the
  /// polhode. A row each, columns about `states` and then about these amplitudes. Empty where none is estimated. In
  /// calibration.json it is a part of the covariance.
  Eigen::MatrixXd amplitude_covariance;
  /// Of stamps as they are telemetered, at and since `epoch`; what pass.toml says of them is in it. Empty where they
  /// are right.
  std::optional<ClockCorrection> clocks;
  std::optional<CalibrationNoise> noise;
  std::vector<DriftFieldLevel> drift_field;    ///< empty where the drift is not estimated as a field
  std::optional<OnBoardDrift> on_board_drift;  ///< where it is
  std::optional<Determined> determined;
  std::optional<OpenLoopForecast> forecast;
  Verdict verdict;
  Statistics statistics;
};

/// Of a drift coefficient, rad/s, or an alignment, component of the rotation vector, rad. NaN where the calibration
/// does not have it.
[[nodiscard]] double value_of(const Calibration& calibration, const ParameterId& state);
/// 1-sigma of a state; NaN where the calibration does not have it.
[[nodiscard]] double sigma_of(const Calibration& calibration, const ParameterId& state);
/// Where the states stand in Calibration::states, which must have them.
[[nodiscard]] std::vector<Eigen::Index> rows_of(const Calibration& calibration, const std::vector<ParameterId>& states);

}  // namespace trihedron
