#pragma once
/// The paper's filter: 24 states, feedback into the model, quasi-inertial frame re-based at every fix (Odintsov 2009,
/// eqs. 3 and 4).

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "trihedron/core/drift.hpp"
#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/fix_report.hpp"
#include "trihedron/core/layout.hpp"
#include "trihedron/core/measurement.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/core/outlier_gate.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/core/square_root_covariance.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// Kalman filter on eq. (3) with the full correlated noise, in square-root form; two gyros, eq. (1), one
/// star tracker. Estimates are held in `gyros()`; the filter knows their errors, Δh = h(true) − h(est), κ(true) −
/// κ(est), and δ with C_c_b(true) = exp([δ×]) C_c_b(est). H is taken at the raw star-tracker attitude, as in the paper:
/// in steady flight the filter therefore gains information that does not exist, and its sigmas about the orbit normal
/// are too small.
class PaperEstimator {
 public:
  /// Where each state stands: Δh1, Δh3 of gyro 1 and Δh1, Δh2 of gyro 2, in qi; then the parameters.
  struct States {
    static constexpr int kDynamic = 4;
    static constexpr int kSize = kDynamic + Layout{}.parameters();
    [[nodiscard]] static constexpr int direction(int gyro) { return 2 * gyro; }
    [[nodiscard]] static constexpr int drift(int gyro) { return kDynamic + Layout{}.drift(gyro) - Layout{}.drift(0); }
    [[nodiscard]] static constexpr int alignment(int gyro) { return drift(gyro) + Esg7::kSize; }
  };
  static constexpr int kGyros = 2;
  static constexpr int kStarTrackers = 1;
  static constexpr bool kFixCovariances = true;
  static constexpr int kMaxStates = States::kSize;
  static constexpr int kMaxErrors = Layout{}.size();
  static constexpr int kMeasurements = 4;
  static constexpr bool kUsesAngles = false;            ///< the angle is shown by StepReport::angle_residual only
  static constexpr bool kTakesSamplesTogether = false;  ///< a fix is compared with a single sample
  using Gyro = GyroModel<Esg7::kSize>;
  using Gyros = PerGyro<Gyro, kGyros>;
  using Since = SensitivitiesOfAll<Esg7::kSize, kGyros>;
  using Sensitivities = Since::All;
  using Rows3 = StateRows3<kMaxErrors>;

  /// As of InvariantEstimator; kTooLarge for any other layout than Layout{}.
  [[nodiscard]] std::optional<SetupFault> set_up(const CalibrationSetup& setup, const Gyros& prior,
                                                 const Eigen::Ref<const Eigen::MatrixXd>& covariance);

  /// Returns to the prior, not started: as after set_up().
  void forget();

  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] const CalibrationSetup& setup() const { return setup_; }
  [[nodiscard]] const Layout& layout() const { return setup_.layout; }
  [[nodiscard]] static constexpr int states() { return States::kSize; }
  /// All three components of each direction's error, and then the parameters.
  [[nodiscard]] static constexpr Layout error_layout() { return {}; }
  [[nodiscard]] const DriftModel& drift() const { return drift_; }
  [[nodiscard]] const Gyros& gyros() const { return gyros_; }
  /// As of InvariantEstimator.
  [[nodiscard]] Sensitivities since_fix() const { return since_fix_.at_present(); }
  [[nodiscard]] double time_since_fix_s() const { return time_since_fix_s_; }
  /// What was known before.
  [[nodiscard]] const Gyros& prior_gyros() const { return prior_gyros_; }

  /// The trihedron: gyro 1 is the reference.
  [[nodiscard]] static Result<AttitudeByDirections, DirectionsFault> attitude(const Gyros& gyros, const Directions& h_b,
                                                                              const GyroMask& used);
  /// The same, only the attitude itself.
  [[nodiscard]] static Result<Rot<In, C>, DirectionsFault> rotation(const Gyros& gyros, const Directions& h_b,
                                                                    const GyroMask& used);

  /// As of InvariantEstimator.
  void error_root(RowsView root) const;
  void prior_error_root(RowsView root) const;
  [[nodiscard]] Eigen::Matrix3d covariance_of_errors(const Rows3& by_errors) const;

  /// Whether there is one.
  [[nodiscard]] static bool gives_attitude(const Gyros& gyros, const Directions& h_b, const GyroMask& used) {
    return rotation(gyros, h_b, used).ok();
  }

  /// Prediction of both momenta over one step that ends at t, attitude and readings of its middle. Needs started().
  void predict(const Eigen::Matrix3d& C_in_c, const Directions& h_b, Time t, double dt_s);

  /// Widens the directions: `variance_rad2` per axis for what a step too long for its readings may have missed.
  void add_direction_variance(double variance_rad2) { extra_variance_rad2_ += variance_rad2; }

  /// As of InvariantEstimator, of a single stage.
  struct Correction {
    enum class Stage : std::uint8_t { kPropagation, kDone };
    Stage stage = Stage::kPropagation;
    bool at_once = false;  ///< not looked at, since there is one stage
    static constexpr bool reopened = false;

    [[nodiscard]] bool done() const { return stage == Stage::kDone; }
    [[nodiscard]] static constexpr bool awaits_feedback() { return false; }
  };
  static constexpr int kMostStages = 1;
  [[nodiscard]] static int cost(const Correction& /*not done*/) { return 600; }
  [[nodiscard]] static int cost_to_end(const Correction& correction) { return cost(correction); }
  void carry_on(Correction& correction, const StarFix& fix, const FixReadings& readings, FixReport& report) {
    report = correct(fix, readings);
    correction.stage = Correction::Stage::kDone;
  }

  /// Astro-correction: the first one starts the filter, each further one updates it. Where the estimate is not finite
  /// after that, or has no covariance, it is forgotten: kEstimateLost, and no longer started().
  [[nodiscard]] FixReport correct(const StarFix& fix, const FixReadings& readings);

  /// The paper's components of direction errors: tangent bases of both momenta in the quasi-inertial frame, in `in`
  /// components.
  struct QuasiInertial {
    PerGyro<Eigen::Matrix<double, 2, 3>, kGyros> components;  ///< the paper's two components of each Δh
    PerGyro<Eigen::Matrix<double, 3, 2>, kGyros> tangents;  ///< back: Δh = tangents · components · Δh for Δh across h
    double sine = 1;                                        ///< of the angle between the momenta
  };
  [[nodiscard]] static QuasiInertial quasi_inertial(const Trihedron<In>& t);

  /// Eq. (3), components 2–5 with the sign turned: y = h_et − h_R = H x + noise, noise covariance R. The tracker's
  /// error is common to all four components, each readout's to its own two. `covariance`: of the fix.
  struct Measurement {
    Eigen::Matrix<double, kMeasurements, 1> innovation = Eigen::Matrix<double, kMeasurements, 1>::Zero();
    Eigen::Matrix<double, kMeasurements, kMaxStates> H = Eigen::Matrix<double, kMeasurements, kMaxStates>::Zero();
    Eigen::Matrix<double, kMeasurements, kMeasurements> R = Eigen::Matrix<double, kMeasurements, kMeasurements>::Zero();
  };
  [[nodiscard]] static Measurement measure(const Gyros& gyros, const QuasiInertial& qi, const Eigen::Matrix3d& C_in_c,
                                           const Directions& h_b, const CalibrationSetup& setup,
                                           const FixCovariance& covariance = {});

 private:
  using Errors = SquareRootCovariance<kMaxStates, States::kDynamic>;

  /// Whether the estimate is finite and has a covariance.
  [[nodiscard]] bool sound() const { return errors_.regular() && estimates_are_finite(gyros_, layout()); }
  /// correct() before sound() is asked.
  [[nodiscard]] FixReport take(const StarFix& fix, const FixReadings& readings);
  /// The momenta are those of the fix, all else is as before it.
  /// The momenta as the readings show them at a fix, with the covariance of the prior. False, and nothing is done,
  /// where they are nearly parallel.
  [[nodiscard]] bool start(const Eigen::Matrix3d& C_in_c, const Directions& h_b, const FixCovariance& covariance);
  void update_covariance_to_now(const QuasiInertial& now);
  /// The measurement whitened, by the root L of its noise, and seen through the uncertainty, with what it shows.
  [[nodiscard]] ComparedRows<kMaxStates> seen(const Measurement& measurement, ComponentCovariance& L) const;
  /// Innovation, its covariance and NIS; `seen`: the measurement whitened and seen through the uncertainty, L: the root
  /// of its noise.
  static void report_innovation(const Measurement& measurement, const ComparedRows<kMaxStates>& seen,
                                const ComponentCovariance& L, FixReport& report);
  void feed_back(const Errors::Vector& correction);

  CalibrationSetup setup_;
  DriftModel drift_;
  Gyros prior_gyros_;
  Gyros gyros_;
  Since since_fix_;
  QuasiInertial qi_;  ///< basis of the direction errors in errors_
  Errors errors_;
  Errors prior_;  ///< of the parameters alone
  OutlierGate gate_;
  double time_since_fix_s_ = 0;
  double extra_variance_rad2_ = 0;
  bool started_ = false;
};

}  // namespace trihedron
