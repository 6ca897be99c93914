#pragma once
/// Calibration filter on the invariant error: φ_k of each momentum in `in`, δ_k of each alignment in c. What no
/// measurement can see stays unseen whatever the estimate is.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <type_traits>

#include "trihedron/core/calibration.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/further_states.hpp"
#include "trihedron/core/innovation.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/core/outlier_gate.hpp"
#include "trihedron/core/square_root_information.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// Where each state stands: those that move, then the constants per gyro, then the shared ones.
template <class Base, int N, FurtherStates F>
struct InvariantLayout {
  static constexpr int kDirections = 3 * N;
  static constexpr int kDynamic = kDirections + (F.wandering_drift ? 3 * N : 0);
  static constexpr int kPerGyro = Base::kSize + 3;
  static constexpr int kBiases = kDynamic + N * kPerGyro;
  static constexpr int kShared = kBiases + (F.readout_bias ? 3 * N : 0);
  static constexpr int kStates = kShared + F.shared();

  [[nodiscard]] static constexpr int direction(int gyro) { return 3 * gyro; }
  [[nodiscard]] static constexpr int wandering(int gyro) { return kDirections + 3 * gyro; }
  [[nodiscard]] static constexpr int drift(int gyro) { return kDynamic + gyro * kPerGyro; }
  [[nodiscard]] static constexpr int alignment(int gyro) { return drift(gyro) + Base::kSize; }
  [[nodiscard]] static constexpr int readout_bias(int gyro) { return kBiases + 3 * gyro; }
  [[nodiscard]] static constexpr int clock_offset() { return kShared; }
  [[nodiscard]] static constexpr int orbital_error() { return kShared + (F.clock_offset ? 1 : 0); }
  /// Of head 1, 2 … beside the first, which is 0.
  [[nodiscard]] static constexpr int head(int number) {
    return kShared + (F.clock_offset ? 1 : 0) + (F.orbital_error ? 6 : 0) + 3 * (number - 1);
  }
};

/// A star tracker as the filter knows it.
struct HeadSetup {
  Eigen::Vector3d noise_rad{1e-4, 1e-4, 1e-4};          ///< 1-sigma about its own axes s
  Eigen::Matrix3d C_c_s = Eigen::Matrix3d::Identity();  ///< as designed
  double alignment_sigma_rad = 1e-2;                    ///< per axis
};

template <class Base, int N, FurtherStates F>
struct InvariantSetup : CalibrationSetup<Base, N> {
  std::array<HeadSetup, static_cast<std::size_t>(F.further_heads)> further_heads{};
  double clock_offset_sigma_s = 0.1;
  double orbital_error_sigma_rad = 1e-4;  ///< of each component of p_s and p_c
  double orbital_rate_rad_s = 1.1e-3;     ///< n
  Time orbital_phase_zero{};              ///< where nt = 0
  double wandering_sigma_rad_s = 0;       ///< stationary, per axis
  double wandering_time_s = 3600;
  double readout_bias_sigma = 1e-4;  ///< of each component
};

/// y_k = h_k × h_et,k = (φ_k − C_in_c δ_k + h_k × C_in_b Δb_k)⊥ + noise; dφ_k/dt = ω × φ_k + C_in_b B Δκ_k + (C_in_c
/// δ_k) × ω. The attitude in H is not the tracker's but the fused one, so that noise does not pass for information. The
/// terms of second order, ½ C_in_c δ_k × (φ_k − C_in_c δ_k) and ½ C_in_c δ_k × C_in_b B Δκ_k, count as noise of the
/// size that the present covariance gives them (docs/adr/0004): early readings do not claim more than the first, wrong
/// values allow.
template <class Base, int N, FurtherStates F = FurtherStates{}>
class InvariantEstimator {
 public:
  using BaseModel = Base;
  static constexpr FurtherStates kFurther = F;
  using DriftModel = std::conditional_t<F.wandering_drift, WithCaseDrift<Base>, Base>;
  using Layout = InvariantLayout<Base, N, F>;
  static constexpr int kGyros = N;
  static constexpr int kMeasurements = 2 * N;
  static constexpr const char* kName = "invariant";
  using Setup = InvariantSetup<Base, N, F>;
  using Gyros = PerGyro<GyroModel<DriftModel>, N>;
  using Sensitivities = PerGyro<Sensitivity<DriftModel>, N>;
  using Directions = PerGyro<Eigen::Vector3d, N>;
  using Report = FixReport<kMeasurements>;
  static constexpr int kAngles = 2 * N - 3;  ///< of the components at a fix, those that no common rotation changes
  using AngleReport = FixReport<kAngles>;    ///< its innovation in 1-sigmas of the readings
  using Errors = ErrorLayout<DriftModel, N, F.readout_bias>;
  using ErrorRoot = Eigen::Matrix<double, Errors::kSize, Layout::kStates>;
  static constexpr int kHeads = 1 + F.further_heads;
  /// Readings to both sides of a fix that are taken together: fixes every 3 s do not share any.
  static constexpr Duration kReach = std::chrono::milliseconds(1400);
  using Information = SquareRootInformation<Layout::kStates, Layout::kDynamic>;
  using SharedStates = Eigen::Matrix<double, F.shared(), 1>;

  [[nodiscard]] static Result<InvariantEstimator, SetupFault> create(const Setup& setup);
  InvariantEstimator() = default;

  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] const Gyros& gyros() const { return gyros_; }
  /// Estimates of the shared states, in the order of Layout.
  [[nodiscard]] const SharedStates& shared() const { return shared_; }
  [[nodiscard]] const Sensitivities& since_fix() const { return since_fix_; }
  [[nodiscard]] const Setup& setup() const { return setup_; }
  [[nodiscard]] const Information& information() const { return information_; }

  /// Least squares, all gyros used alike.
  [[nodiscard]] static Result<AttitudeByDirections<N>, DirectionsFault> attitude(
      const Gyros& gyros, const Directions& h_b, const GyroMask<N>& used = all_gyros<N>());
  /// The same, only the attitude itself.
  [[nodiscard]] static Result<Rot<In, C>, DirectionsFault> rotation(const Gyros& gyros, const Directions& h_b,
                                                                    const GyroMask<N>& used);
  /// What was known before.
  [[nodiscard]] Gyros prior_gyros() const;
  /// A square root of the prior covariance, rows as the parameters in ErrorLayout.
  [[nodiscard]] Eigen::Matrix<double, Errors::kSize - Errors::kDirections, Errors::kSize - Errors::kDirections>
  prior_parameter_root() const;

  /// Square root of the covariance of the errors at the last fix, rows as in ErrorLayout. Needs started().
  [[nodiscard]] ErrorRoot error_root() const;

  /// What depends on the errors at the last fix, columns as in ErrorLayout: X Xᵀ of the result X is its covariance.
  /// Needs started().
  [[nodiscard]] Eigen::Matrix<double, 3, Layout::kStates> through_uncertainty(
      const Eigen::Matrix<double, 3, Errors::kSize>& by_errors) const;

  /// Prediction of all momenta over one step, attitude and readings of its middle. Needs started().
  void predict(const Eigen::Matrix3d& C_in_c, const Directions& h_b, double dt_s);
  /// Widens the directions: `variance_rad2` per axis for what a step too long for its readings may have missed.
  void add_direction_variance(double variance_rad2) { extra_variance_rad2_ += variance_rad2; }

  /// The first fix starts the filter, each further one updates it.
  [[nodiscard]] Report correct(const StarFix& fix, const FixReadings<N>& readings);
  /// Update without a fix: by the angles between the momenta, which the readings give without the attitude. Says
  /// nothing of it, nor of anything that turns all momenta alike. Never reopens: that is for the fixes. Needs
  /// started().
  [[nodiscard]] AngleReport check_angles(Time t, const FixReadings<N>& readings);

  using Innovation = Eigen::Matrix<double, kMeasurements, 1>;
  using MeasurementRows = Eigen::Matrix<double, kMeasurements, Layout::kStates>;
  using InnovationCovariance = Eigen::Matrix<double, kMeasurements, kMeasurements>;
  using FixBySharedStates = Eigen::Matrix<double, 3, F.shared()>;

  /// Per gyro the two components of y_k = h_k × h_et,k across h_k, first along h_k × h_k+1: y = H x + noise of
  /// covariance R. The fix's error is common to all components, each readout's to its own two.
  struct Measurement {
    Innovation y = Innovation::Zero();
    MeasurementRows H = MeasurementRows::Zero();
    InnovationCovariance R = InnovationCovariance::Zero();
  };
  /// C_in_c: the fix, for y; C_linear: the attitude to linearise at; R_c: covariance of the fix's noise, c axes;
  /// readout_noise_rad: of these readings.
  [[nodiscard]] static Measurement measure(const Gyros& gyros, const Eigen::Matrix3d& C_in_c,
                                           const Eigen::Matrix3d& C_linear, const Directions& h_b,
                                           const Eigen::Matrix3d& R_c, const FixBySharedStates& by_shared,
                                           const PerGyro<double, N>& readout_noise_rad);

  using WhiteAngles = WhiteMeasurement<Information, kAngles>;
  /// What is left of a measurement, its R that of the readings alone, when the attitude is eliminated.
  [[nodiscard]] static WhiteAngles angles_of(const Measurement& m);

  /// Takes a gyro out of a measurement: its components say nothing and have to do with no others.
  static void leave_out(int gyro, Measurement& m);
  static void leave_out_unused(const GyroMask<N>& used, Measurement& m);

 private:
  /// 1-sigma of a direction of which nothing is known.
  static constexpr double kUnknown_rad = 1;
  /// So many times above the gate a misfit is a fault of a gyro, not of its drift model: that is noticed sooner.
  static constexpr double kPlain = 4;
  /// Of two gyros the loss of one is that of the attitude: only when no way of beginning anew has helped, and for more
  /// than an alignment wrong by 5° in a body that turns at orbital rate adds to the misfit in the minute until a run of
  /// rejections reopens the filter.
  static constexpr double kPlainOfTwo_rad = 5.8e-3;  // 20′
  using Rows3 = Eigen::Matrix<double, 3, Layout::kStates>;
  /// Error of a fix by the shared states, c axes: as given = true · exp([e×]).
  [[nodiscard]] FixBySharedStates fix_by_shared(Time t, int head, const Eigen::Vector3d& rate_c) const;
  /// Covariance of a fix's noise, c axes.
  [[nodiscard]] Eigen::Matrix3d fix_noise(int head) const;
  /// The attitude by gyros and fix together, weighted by what is known of both. Needs the covariance at the fix.
  [[nodiscard]] Eigen::Matrix3d fused_attitude(const AttitudeByDirections<N>& by_gyros, const Rot<In, C>& by_fix,
                                               const Eigen::Matrix3d& R_c, const FixReadings<N>& readings) const;
  void start(const Eigen::Matrix3d& C_in_c, const FixReadings<N>& readings, const Eigen::Matrix3d& R_c,
             const FixBySharedStates& by_shared);
  /// 1-sigma per axis of ½ a × b, what the linear model leaves out; a, b: rows of independent errors.
  [[nodiscard]] double second_order_rad(const Rows3& a, const Rows3& b) const;
  /// 1-sigma of the readings with what the linear model leaves out, here for the n-th time in a row.
  [[nodiscard]] PerGyro<double, N> reading_noise(const Eigen::Matrix3d& C_linear, double noise_factor, int n) const;
  /// By readings alone, at the attitude that they give; for the n-th time in a row.
  [[nodiscard]] Measurement measure_angles(const Eigen::Matrix3d& C_in_c, const FixReadings<N>& readings, int n) const;
  [[nodiscard]] bool angles_agree(const Measurement& m, const GyroMask<N>& used) const;
  /// Whether a misfit that was rejected is too large for anything but a fault.
  [[nodiscard]] bool is_fault(double nis, double misfit_rad, const GyroMask<N>& used) const;
  [[nodiscard]] bool agrees(const Measurement& m, const GyroMask<N>& used) const;
  /// The one gyro without which a measurement that does not agree does.
  template <class Agrees>
  [[nodiscard]] static int odd_gyro(const Measurement& m, const GyroMask<N>& used, Agrees&& agrees);
  /// Whether the prior allows the drift coefficients and alignments that are estimated.
  [[nodiscard]] bool prior_allows_estimates() const;
  void update_to_now(const Eigen::Matrix3d& C_in_c);
  void feed_back(const typename Information::Vector& x);

  Setup setup_;
  Gyros gyros_;
  SharedStates shared_ = SharedStates::Zero();
  Sensitivities since_fix_;
  Information information_;
  Information prior_;  ///< without anything of the directions
  OutlierGate gate_;
  PerGyro<double, N> second_order_rad_{};  ///< 1-sigma of what the linear model has left out since the start
  double time_since_fix_s_ = 0;
  double extra_variance_rad2_ = 0;
  int angles_since_fix_ = 0;
  int angle_rejections_in_a_row_ = 0;
  bool begun_from_estimates_ = false;  ///< at the last restart
  bool started_ = false;
};

// The set that is built; see cycles.hpp.
extern template class InvariantEstimator<Esg7, 2>;
extern template class InvariantEstimator<Esg7, 2, kAllFurtherStates>;
extern template class InvariantEstimator<Esg20, 2, kAllFurtherStates>;
extern template class InvariantEstimator<Esg7, 3>;
extern template class InvariantEstimator<Esg7, 4>;

}  // namespace trihedron
