#pragma once
/// The angle between the momenta of two gyros, which tells drift from errors of the star tracker.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "trihedron/records/calibration.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// The gyros alone read it: neither the fixes nor the attitude have a part in it. Drift of two gyros that wanders moves
/// it as it moves the momenta; an error of the star tracker that wanders, and that a calibration takes for such drift,
/// leaves it as it is. Medians over minutes are fitted by drift of esg20 and alignments, any values of them, so that it
/// does not matter what the star tracker has made of those of the calibration; and by eq. (1) and alignments, which
/// leave more of what wanders.
class AngleBetweenMomenta {
 public:
  /// Of two gyros, by their numbers from 0. Nothing where there are not two, or where a fit leaves too little.
  [[nodiscard]] static std::optional<AngleBetweenMomenta> of(const GyroTelemetry& telemetry,
                                                             const std::vector<GyroCalibration>& gyros, int first = 0,
                                                             int second = 1);

  /// Root mean square of what the fit by esg20 leaves.
  [[nodiscard]] double left_rad() const;
  /// Amplitude of a line of this period, of any phase, of which a fit leaves as much as it leaves of the angle: the
  /// less of both fits. No larger one moves the angle.
  [[nodiscard]] double largest_line_rad(double period_s) const;

  /// How it moves, beside how process noise moves it.
  struct Wander {
    /// The largest part of that noise, as a variance, with which the drift of the gyros is taken to be quiet: a third
    /// of what wanders.
    static constexpr double kQuiet = 0.1;

    double part = 0;          ///< the likeliest; over 1 where drift wanders more than told, or otherwise
    double log_odds = 0;      ///< ln of the largest likelihood up to kQuiet, less that of the largest beyond it
    double expected_rad = 0;  ///< root mean square of what the fit leaves of the noise
  };
  /// By that of the two fits that speaks most for quiet gyros: drift that is not in it speaks for what moves.
  [[nodiscard]] Wander wander(const CalibrationNoise& noise) const;

 private:
  /// What no values of the constants that are fitted can make.
  struct Left {
    Eigen::MatrixXd outside;   ///< orthonormal columns
    Eigen::VectorXd left_rad;  ///< of the angle along these
  };

  AngleBetweenMomenta() = default;
  [[nodiscard]] Eigen::MatrixXd covariance(const CalibrationNoise& noise) const;
  [[nodiscard]] static Wander wander(const Left& left, const Eigen::MatrixXd& by_noise);

  double block_s_ = 0;
  std::vector<Eigen::Index> blocks_;  ///< those that have samples, from the begin of the pass on
  Eigen::Matrix3Xd normal_c_;         ///< of the plane of the momenta, at every block
  Left by_all_;                       ///< fitted by esg20 and alignments
  Left by_eq1_;                       ///< by eq. (1) and alignments
};

}  // namespace trihedron::ground
