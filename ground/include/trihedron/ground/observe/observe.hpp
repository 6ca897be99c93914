#pragma once
/// What a pass can tell of the parameters, whatever was known before.

#include <Eigen/Core>
#include <chrono>
#include <string>
#include <vector>

#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::ground {

/// How the attitude is used once the gyros are calibrated.
struct Mission {
  Duration correction_interval = std::chrono::minutes(90);
  double max_roll_rad = 30 * kDegree;      ///< of slews from the attitude of the pass, evenly distributed
  double max_pitch_rad = 15 * kDegree;     ///< the same
  double tolerable_rad = 20 * kArcsecond;  ///< attitude error by one combination: two nominal alignment accuracies
};

/// Parameters that only move together.
struct Combination {
  std::string text;               ///< "gyro 1 alignment about the orbit normal, against its initial direction"
  Eigen::VectorXd direction;      ///< of what is named, unit, by parameter, each in its prior sigma
  bool is_alignment = false;      ///< nothing else takes part with a tenth of the square
  double singular_value = 0;      ///< prior sigma over that by the measurements alone
  double attitude_error_rad = 0;  ///< what it adds to Observability::attitude_error_rad, rms
  bool is_unobservable = false;   ///< below Observability::kUnobservable
  /// Unobservable, and its part of the attitude error is larger than the mission tolerates.
  bool is_harmful = false;
};

/// What the measurements say of the constants of the problem, for one linearisation. Matrices have one column or row
/// per parameter.
struct Observability {
  CalibrationOptions options;           ///< as decided
  std::vector<ParameterId> parameters;  ///< as Calibration::states, then further states
  Eigen::VectorXd prior_sigma;          ///< rad/s, rad, or that of the further state
  Eigen::VectorXd sigma;                ///< by prior and measurements
  Eigen::MatrixXd covariance;           ///< the same
  /// sigma by the measurements up to each of some times, equally spaced over the pass.
  std::vector<Time> t;
  std::vector<Eigen::VectorXd> sigma_until;
  /// What z1 of eq. (3), the angle between the momenta, adds at the samples between the fixes: sigma with single
  /// readings at the fixes, over that with z1 as well. Fitting the readings around each fix, as in `sigma`, already
  /// gains most of it. Empty but for pairs.
  Eigen::VectorXd angle_gain;

  /// Of the root of the information by the measurements alone, in units of the prior sigmas: the directions at the
  /// start are free. Largest first.
  Eigen::VectorXd singular_values;
  Eigen::Index rank = 0;  ///< of them above rounding
  /// Those below kWeak: the unobservable ones first, and of both those first that do the most harm.
  std::vector<Combination> weak;

  /// Mean square per axis of the attitude error that the parameters leave is the trace of this times `covariance`. The
  /// momenta are set by an astro-correction, at which alignments do no harm; then the attitude is read through the
  /// gyros over the correction interval, at attitudes as the mission flies them. A combination that does no harm while
  /// the flight is steady does as soon as the satellite slews: therefore these.
  Eigen::MatrixXd attitude_metric;
  double attitude_error_rad = 0;  ///< rms per axis

  [[nodiscard]] bool is_harmful() const;  ///< whether any combination is

  /// Singular value below which a combination is unobservable: the data improve the prior sigma by a factor of less
  /// than ten. The limit is not 1, because the jitter of the body and the turning of the orbit plane show even what
  /// steady flight hides, but with a sigma of minutes of arc.
  static constexpr double kUnobservable = 10;
  /// … less than two digits.
  static constexpr double kWeak = 100;
};

/// Linearised at the most likely solution; what the options leave open is decided as calibrate() does. Throws
/// SetupError.
[[nodiscard]] Observability observe(const Pass& pass, const CalibrationOptions& asked, const Mission& mission = {});

/// 1-sigma of a combination, rad or rad/s, where this is the covariance of the parameters.
[[nodiscard]] double sigma_along(const Combination& combination, const Observability& observability,
                                 const Eigen::MatrixXd& covariance);

/// Covariance of the parameters, as Observability::covariance, that a calibration of a flight will have. `exact`: the
/// flight without noise, with its prior; its settings give the noise that it will have, for the gyros that of the fit
/// at a fix. `options`: nothing is left to decide. Throws SetupError.
[[nodiscard]] Eigen::MatrixXd predicted_covariance(const Pass& exact, const CalibrationOptions& options);

}  // namespace trihedron::ground
