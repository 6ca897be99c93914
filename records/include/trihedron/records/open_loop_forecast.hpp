#pragma once
/// What attitude error a calibration predicts for an open loop from an astro-correction on, and what a user needs of
/// it.

#include <Eigen/Core>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "trihedron/core/layout.hpp"
#include "trihedron/core/precession.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron {

/// An accuracy that must hold in an open loop: "5arcmin for 270min".
struct Need {
  double error_rad = 0;  ///< total attitude error that may be exceeded in 3 of 1000 cases
  Duration interval{};   ///< since the astro-correction

  friend constexpr bool operator==(const Need&, const Need&) = default;
};

/// What is known at an astro-correction of the errors that an open loop from there on has. The values that belong to it
/// are those of a calibration.
struct OpenLoopStart {
  Layout layout;  ///< directions of three components; as many coefficients as the calibration has
  /// Of the errors of the momenta, of the drift that wanders, of the parameters: the states of the layout before those
  /// that the gyros share. Drift that wanders is not carried on from the pass, so that it has its stationary variance.
  /// Empty where nothing is known.
  Eigen::MatrixXd covariance;
  PerGyro<double> readout_noise_rad{};
  double direction_random_walk_rad_sqrt_s = 0;
  GaussMarkov wandering_drift;
  CourseOfChange change;  ///< of the coefficients, which stand for its zero_at, the time of the correction

  [[nodiscard]] bool is_known() const { return covariance.size() > 0; }
};

/// The error of the attitude some time after the correction.
struct PredictedError {
  Duration after{};
  Eigen::Matrix3d covariance_rad2 = Eigen::Matrix3d::Zero();  ///< c axes: roll, pitch, heading
  // Angles that the total error is below in so many cases.
  double error_68_rad = 0;
  double error_95_rad = 0;
  double error_997_rad = 0;
};

/// One of the causes of an error.
struct ErrorCause {
  std::string name;  ///< of a parameter as in calibration.json; or what it is, for people
  bool is_parameter = true;
  double share = 0;  ///< of the mean square of the error that would not be there without it; they overlap
};

/// How long an accuracy is predicted to be kept.
struct AccuracyForecast {
  double limit_rad = 0;
  Duration within{};            ///< until the 99.7 % error first passes the limit, or the end of the forecast
  bool is_lower_bound = false;  ///< it did not
};

/// A need, and whether it is predicted to be met.
struct NeedForecast {
  Need need;
  bool met = false;
  double error_997_rad = 0;        ///< the largest until then
  AccuracyForecast accuracy;       ///< how long the needed accuracy is kept
  std::vector<ErrorCause> causes;  ///< of the error at the end of the interval, largest first; not all
};

/// Of an open loop from an astro-correction at the end of the pass.
struct OpenLoopForecast {
  std::vector<PredictedError> errors;  ///< from zero on, evenly
  AccuracyForecast usual;              ///< the usual limit
  std::optional<NeedForecast> need;    ///< where one is stated
};

/// How many drift coefficients of eq. (1) a pass determines.
struct Determined {
  int coefficients = 0;
  int of = 0;
};

/// "5 h 20 min", "45 min"; whole minutes, rounded down.
[[nodiscard]] std::string time_in_words(Duration time);
/// "attitude within 5′ for 6 h 20 min after a correction (99.7 %)"
[[nodiscard]] std::string in_words(const AccuracyForecast& accuracy);
/// "5′ for 270 min"
[[nodiscard]] std::string in_words(const Need& need);

}  // namespace trihedron
