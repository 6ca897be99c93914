#pragma once
/// Attitude by all gyro samples and fixes of a pass.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "batch/pass_problem.hpp"
#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/optimal_attitude.hpp"

namespace trihedron::ground {

/// UnfollowedMotion axis by axis, c.
struct MisfitOfReadings {
  Eigen::Array3d square_rad2 = Eigen::Array3d::Zero();
  Eigen::Array3d sigma_rad2 = Eigen::Array3d::Zero();

  /// About each axis the same.
  [[nodiscard]] static MisfitOfReadings about_all_axes(const UnfollowedMotion& motion) {
    return {Eigen::Array3d::Constant(motion.square_rad2), Eigen::Array3d::Constant(motion.sigma_rad2)};
  }
};

/// Readings at any time, by a polynomial through the samples around it.
class SmoothReadings {
 public:
  /// `C_c_b`: alignments. Refers to the others.
  SmoothReadings(const ScreenedPass& pass, const CalibrationSetup& setup, const PerGyro<Eigen::Matrix3d>& C_c_b)
      : samples_(pass.samples), gyros_(pass.gyros), setup_(setup), C_c_b_(C_c_b) {}

  /// Polynomials over longer and longer times; the first is over the shortest.
  static constexpr int kReaches = 3;
  static constexpr int kNone = -1;
  struct At {
    Directions h_b;
    GyroMask used{};
    double noise_factor = 1;
    int reach = kNone;  ///< which of the polynomials it is by
  };
  /// By the longest polynomial that fits, and where the readings bend agrees with those over shorter times. Returns
  /// `otherwise` where none fits; only the gyros that it uses are fitted.
  [[nodiscard]] At at(Time t, const At& otherwise) const;
  /// What `attitude`, by a longer polynomial, as of at(), is off that by the one over the shortest time. Nothing where
  /// it is that one, or none.
  [[nodiscard]] std::optional<MisfitOfReadings> off_the_shortest(Time t, const At& longer,
                                                                 const AttitudeByDirections& attitude) const;
  /// What the readings are off that one. Nothing where there is none.
  [[nodiscard]] std::optional<UnfollowedMotion> off_the_readings(Time t, const GyroMask& used) const;

 private:
  /// A polynomial that explains the samples from `first` to `last`.
  struct Fit {
    FittedDirections its;
    UnfollowedMotion unfollowed;
    GyroMask used{};
    std::size_t first = 0;
    std::size_t last = 0;
    int reach = kNone;
  };
  [[nodiscard]] std::optional<Fit> fit(Time t, const GyroMask& used, int reach) const;
  [[nodiscard]] static At at(const Fit& fit) { return {fit.its.h_b, fit.used, fit.its.noise_factor, fit.reach}; }
  /// Whether it leaves the line between the samples at the ends by more than noise.
  [[nodiscard]] bool bends(const Fit& fit, Time t) const;
  /// Variance by which two fits at one time differ by chance, over that of a reading.
  [[nodiscard]] static double variance_apart(const At& longer, const At& shorter);
  /// Whether they differ by no more than three sigmas of the χ² that chance makes.
  [[nodiscard]] bool agree(const At& longer, const At& shorter) const;

  const ScreenedSamples& samples_;
  int gyros_;
  const CalibrationSetup& setup_;
  PerGyro<Eigen::Matrix3d> C_c_b_;
};

/// By how much the smoothed attitude is off beyond what its covariance says. Fixes of about two minutes together tell
/// of drift that changes faster than the process that stands for it, as in a slew; the readings, those of ten minutes
/// together, of a body that moves otherwise than the polynomials through them, as one that shakes.
class LocalMisfit {
 public:
  /// Of the next fix: the rotation from the smoothed attitude to it, and its 1-sigma, rad, c axes. Outliers are left
  /// out.
  void add(Time t, const Eigen::Vector3d& off_rad, const Eigen::Vector3d& sigma_rad);
  /// Of the readings next: what the polynomial `reach` over them is off the one over the shortest time, and this one
  /// off the readings themselves.
  void add_readings(Time t, int reach, const MisfitOfReadings& misfit) {
    readings_[static_cast<std::size_t>(reach)].add(t, misfit);
  }
  /// Square of the error about c x, y, z of the smoothed attitude by the polynomial `reach` that the fixes up to a
  /// minute and the readings up to five minutes from t show, rad²; 0 for each where its mean is within 2.5 of its
  /// sigmas, for the readings also that over the whole pass.
  [[nodiscard]] Eigen::Vector3d square_rad2(Time t, int reach) const;

 private:
  std::vector<Time> t_;
  // Of the fixes before each, and of all at the end.
  std::vector<Eigen::Vector3d> weights_{Eigen::Vector3d::Zero()};  ///< 1/rad²
  std::vector<Eigen::Vector3d> weighted_{Eigen::Vector3d::Zero()};
  /// Mean of misfits over some time.
  class Readings {
   public:
    void add(Time t, const MisfitOfReadings& misfit);
    [[nodiscard]] Eigen::Array3d square_rad2(Time t) const;

   private:
    [[nodiscard]] MisfitOfReadings mean(std::size_t from, std::size_t to) const;

    std::vector<Time> t_;
    // Of the readings before each, and of all at the end.
    std::vector<Eigen::Array3d> squares_{Eigen::Array3d::Zero()};    ///< rad²
    std::vector<Eigen::Array3d> variances_{Eigen::Array3d::Zero()};  ///< rad⁴
  };
  std::array<Readings, SmoothReadings::kReaches> readings_;  ///< the first: of the shortest off the readings
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
        readings_(screened, problem.setup().on_board, alignments(solution.gyros, screened.gyros)) {}

  /// At the fixes.
  [[nodiscard]] SmoothedCourse course() const;
  /// At each gyro sample from the first fix on. `misfit`: that of the course.
  [[nodiscard]] AttitudeHistory definitive(const LocalMisfit& misfit) const;

 private:
  [[nodiscard]] static PerGyro<Eigen::Matrix3d> alignments(const Gyros& of, int gyros) {
    PerGyro<Eigen::Matrix3d> C_c_b;
    for (int k = 0; k < gyros; ++k) {
      C_c_b[k] = of[k].C_c_b;
    }
    return C_c_b;
  }
  struct At {
    Rot<In, C> C_in_c;
    Eigen::Vector3d sigma_rad;
    int reach = SmoothReadings::kNone;
  };
  /// An attitude before its sigmas are known.
  struct Rows {
    AttitudeByDirections attitude;
    Eigen::MatrixXd by_states;              ///< its error, c axes, by the states of the arc
    Eigen::Vector3d readout_variance_rad2;  ///< of the noise of the readings
    SmoothReadings::At reading;
  };
  [[nodiscard]] std::optional<Rows> rows_at(const PassProblem::Moment& moment,
                                            const SmoothReadings::At& otherwise) const;
  /// `spread`: of its rows.
  [[nodiscard]] static At with_sigma(const Rows& rows, const Eigen::Ref<const Eigen::MatrixXd>& spread);
  /// `otherwise` as of SmoothReadings. Nothing where the directions give no attitude.
  [[nodiscard]] std::optional<At> at(const PassProblem::Moment& moment, const SmoothReadings::At& otherwise) const;
  /// At the samples after `from`, a node, up to and with `to`, the next one.
  [[nodiscard]] AttitudeHistory between(const PassProblem::Moment& from, const PassProblem::Moment& to,
                                        const LocalMisfit& misfit) const;
  static void append(const At& attitude, Time t, AttitudeHistory& history);

  const ScreenedPass& screened_;
  const PassProblem& problem_;
  const PassSolution& solution_;
  const CovarianceRoots& roots_;
  SmoothReadings readings_;
};

}  // namespace trihedron::ground
