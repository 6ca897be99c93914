#pragma once
/// Attitude by all gyro samples and fixes of a pass.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "batch/pass_problem.hpp"

namespace trihedron::ground {

/// Readings at any time, by a polynomial through the samples around it.
class SmoothReadings {
 public:
  /// Refers to both.
  SmoothReadings(const ScreenedPass& pass, const CalibrationSetup& setup)
      : samples_(pass.samples), gyros_(pass.gyros), setup_(setup) {}

  struct At {
    Directions h_b;
    GyroMask used{};
    double noise_factor = 1;
    bool bends = false;  ///< whether they leave the line between the samples at the ends by more than noise
  };
  /// By the longest polynomial that fits, and where the readings bend agrees with those over shorter times. Returns
  /// `otherwise` where none fits; only the gyros that it uses are fitted.
  [[nodiscard]] At at(Time t, const At& otherwise) const;
  /// Square of what the polynomial of at() is off one over the shortest time, less what noise makes of that: per gyro
  /// and component, rad²; and its 1-sigma by chance. Nothing where it is that one.
  struct Misfit {
    PerGyro<double> square_rad2{};
    PerGyro<double> sigma_rad2{};
  };
  [[nodiscard]] std::optional<Misfit> misfit(Time t, const At& at) const;

 private:
  [[nodiscard]] std::optional<At> fit(Time t, const GyroMask& used, Duration reach) const;
  [[nodiscard]] bool bends(const At& at, Time t, std::size_t first, std::size_t last) const;
  /// Variance by which two fits at one time differ by chance, over that of a reading.
  [[nodiscard]] static double variance_apart(const At& longer, const At& shorter);
  /// Whether they differ by no more than three sigmas of the χ² that chance makes.
  [[nodiscard]] bool agree(const At& longer, const At& shorter) const;

  const ScreenedSamples& samples_;
  int gyros_;
  const CalibrationSetup& setup_;
};

/// By how much the smoothed attitude is off beyond what its covariance says. Fixes of about two minutes together tell
/// of drift that changes faster than the process that stands for it, as in a slew; shorter polynomials through the
/// readings, those of ten minutes together, of a body that moves otherwise than the longer ones.
class LocalMisfit {
 public:
  /// Of the next fix: the rotation from the smoothed attitude to it, and its 1-sigma, rad, c axes. Outliers are left
  /// out.
  void add(Time t, const Eigen::Vector3d& off_rad, const Eigen::Vector3d& sigma_rad);
  /// Of the readings next: the square of the error of the attitude about c x, y, z that they show, which may be
  /// negative, and its 1-sigma by chance, rad².
  void add_readings(Time t, const Eigen::Vector3d& square_rad2, const Eigen::Vector3d& sigma_rad2);
  /// Square of the error of the smoothed attitude about c x, y, z that the fixes up to a minute and the readings up to
  /// five minutes from t show, rad²; 0 for either where their mean is within 2.5 of its sigmas.
  [[nodiscard]] Eigen::Vector3d square_rad2(Time t) const;

 private:
  std::vector<Time> t_;
  // Of the fixes before each, and of all at the end.
  std::vector<Eigen::Vector3d> weights_{Eigen::Vector3d::Zero()};  ///< 1/rad²
  std::vector<Eigen::Vector3d> weighted_{Eigen::Vector3d::Zero()};
  std::vector<Time> readings_t_;
  // Of the readings before each, and of all at the end.
  std::vector<Eigen::Vector3d> squares_{Eigen::Vector3d::Zero()};    ///< rad²
  std::vector<Eigen::Vector3d> variances_{Eigen::Vector3d::Zero()};  ///< rad⁴
};

/// What the smoothed pass shows at the fixes.
struct SmoothedCourse {
  AttitudeHistory attitude;
  LocalMisfit misfit;      ///< already in the sigmas of the attitude
  GyroTelemetry readings;  ///< of gyros without noise and bias
};

/// Attitude by the smoothed momenta.
class SmoothedAttitude {
 public:
  /// `roots`: of the covariance, arc by arc. Refers to all of them.
  SmoothedAttitude(const ScreenedPass& screened, const PassProblem& problem, const PassSolution& solution,
                   const CovarianceRoots& roots)
      : screened_(screened),
        problem_(problem),
        solution_(solution),
        roots_(roots),
        readings_(screened, problem.setup().on_board) {}

  /// At the fixes.
  [[nodiscard]] SmoothedCourse course() const;
  /// At each gyro sample from the first fix on. `misfit`: that of the course.
  [[nodiscard]] AttitudeHistory definitive(const LocalMisfit& misfit) const;

 private:
  struct At {
    Rot<In, C> C_in_c;
    Eigen::Vector3d sigma_rad;
  };
  /// An attitude before its sigmas are known.
  struct Rows {
    Rot<In, C> C_in_c;
    Eigen::MatrixXd by_states;              ///< its error, c axes, by the states of the arc
    Eigen::Vector3d readout_variance_rad2;  ///< of the noise of the readings
    SmoothReadings::At reading;
    PerGyro<Eigen::Vector3d> by_reading;  ///< squares of what an error of a reading, per component, makes of it
  };
  [[nodiscard]] std::optional<Rows> rows_at(const PassProblem::Moment& moment,
                                            const SmoothReadings::At& otherwise) const;
  /// `spread`: of its rows.
  [[nodiscard]] static At with_sigma(const Rows& rows, const Eigen::Ref<const Eigen::MatrixXd>& spread);
  /// `otherwise` as of SmoothReadings. Nothing where the directions give no attitude.
  [[nodiscard]] std::optional<At> at(const PassProblem::Moment& moment, const SmoothReadings::At& otherwise) const;
  /// At the samples after `from`, a node, up to and with `to`, the next one.
  [[nodiscard]] AttitudeHistory between(const PassProblem::Moment& from, const PassProblem::Moment& to) const;
  static void append(const At& attitude, Time t, AttitudeHistory& history);

  const ScreenedPass& screened_;
  const PassProblem& problem_;
  const PassSolution& solution_;
  const CovarianceRoots& roots_;
  SmoothReadings readings_;
};

}  // namespace trihedron::ground
