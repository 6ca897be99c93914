#pragma once
/// The paper's filter: 24 states, feedback into the model, quasi-inertial frame re-based at every fix (Odintsov 2009,
/// eqs. 3 and 4).

#include "trihedron/core/calibration.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/core/outlier_gate.hpp"
#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/square_root_information.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// Where each state of the paper's vector stands; Model::kSize = 7 gives the paper's 24.
template <class Model>
struct PaperLayout {
  static constexpr int kGyros = 2;
  static constexpr int kDynamic = 4;  ///< Δh1, Δh3 of gyro 1 and Δh1, Δh2 of gyro 2, in qi
  static constexpr int kParameters = ParameterLayout<Model, kGyros>::kSize;
  static constexpr int kStates = kDynamic + kParameters;
  [[nodiscard]] static constexpr int direction(int gyro) { return 2 * gyro; }
  [[nodiscard]] static constexpr int drift(int gyro) { return kDynamic + ParameterLayout<Model, kGyros>::drift(gyro); }
  [[nodiscard]] static constexpr int alignment(int gyro) {
    return kDynamic + ParameterLayout<Model, kGyros>::alignment(gyro);
  }
};

/// Kalman filter on eq. (3) with the full correlated noise, in square-root information form. Estimates are held in
/// `gyros()`; the filter knows their errors, Δh = h(true) − h(est), κ(true) − κ(est), and δ with C_c_b(true) =
/// exp([δ×]) C_c_b(est). H is taken at the raw star-tracker attitude, as in the paper: in steady flight the filter
/// therefore gains information that does not exist, and its sigmas about the orbit normal are too small.
template <class Model = Esg7>
class PaperEstimator {
 public:
  using BaseModel = Model;
  using DriftModel = Model;
  using Layout = PaperLayout<Model>;
  static constexpr int kGyros = Layout::kGyros;
  static constexpr int kMeasurements = 4;
  static constexpr const char* kName = "paper";
  static constexpr int kHeads = 1;
  /// Readings to both sides of a fix that are taken together: none.
  static constexpr Duration kReach = Duration::zero();
  using Setup = CalibrationSetup<Model, kGyros>;
  using Gyros = PerGyro<GyroModel<Model>, kGyros>;
  using Sensitivities = PerGyro<Sensitivity<Model>, kGyros>;
  using Directions = PerGyro<Eigen::Vector3d, kGyros>;
  using Report = FixReport<kMeasurements>;
  using AngleReport = FixReport<1>;  ///< of the others; here the angle is shown by StepReport::angle_residual only
  using Errors = ErrorLayout<Model, kGyros>;
  using ErrorRoot = Eigen::Matrix<double, Errors::kSize, Layout::kStates>;

  [[nodiscard]] static Result<PaperEstimator, SetupFault> create(const Setup& setup);

  /// A default one is not started and has no prior; it exists for Result only.
  PaperEstimator() = default;

  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] const Gyros& gyros() const { return gyros_; }
  /// Effect of the errors at the last fix on the present directions.
  [[nodiscard]] const Sensitivities& since_fix() const { return since_fix_; }
  [[nodiscard]] const Setup& setup() const { return setup_; }

  /// The trihedron: gyro 1 is the reference.
  [[nodiscard]] static Result<AttitudeByDirections<kGyros>, DirectionsFault> attitude(
      const Gyros& gyros, const Directions& h_b, const GyroMask<kGyros>& used = all_gyros<kGyros>()) {
    if (count(used) < kGyros) {
      return DirectionsFault::kTooFew;
    }
    return trihedron_attitude(momenta(gyros), in_c(gyros, h_b));
  }
  /// The same, only the attitude itself.
  [[nodiscard]] static Result<Rot<In, C>, DirectionsFault> rotation(const Gyros& gyros, const Directions& h_b,
                                                                    const GyroMask<kGyros>& used) {
    const auto by_directions = attitude(gyros, h_b, used);
    if (!by_directions) {
      return by_directions.fault();
    }
    return by_directions.value().C_in_c;
  }
  /// What was known before.
  [[nodiscard]] const Gyros& prior_gyros() const { return setup_.prior; }
  /// A square root of the prior covariance, rows as the parameters in ErrorLayout.
  [[nodiscard]] Eigen::Matrix<double, Layout::kParameters, Layout::kParameters> prior_parameter_root() const {
    return cholesky_root<Layout::kParameters>(setup_.prior_covariance);
  }

  /// Prediction of both momenta over one step, attitude and readings of its middle. Needs started().
  void predict(const Eigen::Matrix3d& C_in_c, const Directions& h_b, double dt_s);

  /// Widens the directions: `variance_rad2` per axis for what a step too long for its readings may have missed.
  void add_direction_variance(double variance_rad2) { extra_variance_rad2_ += variance_rad2; }

  /// Astro-correction: the first one starts the filter, each further one updates it. C_in_c: the tracker's attitude.
  [[nodiscard]] Report correct(const Eigen::Matrix3d& C_in_c, const Directions& h_b);
  /// The same; the paper takes a single sample and one star tracker.
  [[nodiscard]] Report correct(const StarFix& fix, const FixReadings<kGyros>& readings) {
    return correct(fix.q_in_c.normalized().toRotationMatrix(), readings.h_b);
  }

  /// Square root of the covariance of the errors at the last fix, rows as in ErrorLayout. Needs started().
  [[nodiscard]] ErrorRoot error_root() const;
  /// What depends on these errors: X Xᵀ of the result X is its covariance. Needs started().
  [[nodiscard]] Eigen::Matrix<double, 3, Layout::kStates> through_uncertainty(
      const Eigen::Matrix<double, 3, Errors::kSize>& by_errors) const;

  /// The paper's components of direction errors: tangent bases of both momenta in the quasi-inertial frame, in `in`
  /// components.
  struct QuasiInertial {
    PerGyro<Eigen::Matrix<double, 2, 3>, kGyros> components;  ///< the paper's two components of each Δh
    PerGyro<Eigen::Matrix<double, 3, 2>, kGyros> tangents;  ///< back: Δh = tangents · components · Δh for Δh across h
    double sine = 1;                                        ///< of the angle between the momenta
  };
  [[nodiscard]] static QuasiInertial quasi_inertial(const Trihedron<In>& t);

  using Innovation = Eigen::Matrix<double, kMeasurements, 1>;
  using MeasurementMatrix = Eigen::Matrix<double, kMeasurements, Layout::kStates>;
  using InnovationCovariance = Eigen::Matrix<double, kMeasurements, kMeasurements>;

  /// Eq. (3), components 2–5 with the sign turned: y = h_et − h_R = H x + noise, noise covariance R. The tracker's
  /// error is common to all four components, each readout's to its own two.
  struct Measurement {
    Innovation innovation = Innovation::Zero();
    MeasurementMatrix H = MeasurementMatrix::Zero();
    InnovationCovariance R = InnovationCovariance::Zero();
  };
  [[nodiscard]] static Measurement measure(const Gyros& gyros, const QuasiInertial& qi, const Eigen::Matrix3d& C_in_c,
                                           const Directions& h_b, const Setup& setup);

 private:
  using Information = SquareRootInformation<Layout::kStates, Layout::kDynamic>;

  void update_covariance_to_now(const QuasiInertial& now);
  void feed_back(const typename Information::Vector& correction);

  Setup setup_;
  Gyros gyros_;
  Sensitivities since_fix_;
  QuasiInertial qi_;  ///< basis of the direction errors in information_
  Information information_;
  Information prior_;  ///< of the parameters alone
  OutlierGate gate_;
  double time_since_fix_s_ = 0;
  double extra_variance_rad2_ = 0;
  bool started_ = false;
};

extern template class PaperEstimator<Esg7>;

}  // namespace trihedron
