#pragma once
/// Calibration filter on the invariant error: φ_k of each momentum in `in`, δ_k of each alignment in c. Directions that
/// no measurement observes gain no information, wherever the estimate stands.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "trihedron/core/drift.hpp"
#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/fix_report.hpp"
#include "trihedron/core/innovation_correlation.hpp"
#include "trihedron/core/layout.hpp"
#include "trihedron/core/measurement.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/core/outlier_gate.hpp"
#include "trihedron/core/precession.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/core/square_root_covariance.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// Shared states, as many as there is room for. Written out in the estimator, by a condition on its capacity, GCC 12
/// leaves the function that returns it out of an explicit instantiation.
template <int kMost>
struct SharedVector {
  using Type = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost, 1>;
};
/// Eigen's vector of a size up to none has no column either.
template <>
struct SharedVector<0> {
  using Type = Eigen::Matrix<double, 0, 1>;
};

/// y_k = h_k × h_et,k = (φ_k − C_in_c δ_k + h_k × C_in_b Δb_k)⊥ + noise; dφ_k/dt = ω × φ_k + C_in_b B Δκ_k + (C_in_c
/// δ_k) × ω. The attitude in H is not the tracker's but the fused one, so that noise does not pass for information. The
/// terms of second order, ½ C_in_c δ_k × (φ_k − C_in_c δ_k) and ½ C_in_c δ_k × C_in_b B Δκ_k, count as noise of the
/// size that the covariance gives them (docs/adr/0004), so that early measurements are not weighted more than
/// their linearisation about the first, wrong values allows.
///
/// Which states there are is given by the layout of the set-up; kCapacity is the room for them. One plain object, no
/// heap.
template <Capacity kCapacity>
class InvariantEstimator {
 public:
  static constexpr int kMaxStates = kCapacity.states;
  static constexpr int kMaxDynamic = kCapacity.dynamic;
  static constexpr int kMaxErrors = kMaxStates;
  static constexpr int kStarTrackers = kCapacity.star_trackers;  ///< at most
  static constexpr bool kFixCovariances = kCapacity.fix_covariances;
  static constexpr bool kUsesAngles = true;
  static constexpr bool kTakesSamplesTogether = true;
  using Gyro = GyroModel<kCapacity.drift_columns>;
  using Gyros = PerGyro<Gyro, kCapacity.gyros>;
  using Since = SensitivitiesOfAll<kCapacity.drift_columns, kCapacity.gyros>;
  using Sensitivities = typename Since::All;
  using Errors = SquareRootCovariance<kMaxStates, kMaxDynamic>;
  using Vector = typename Errors::Vector;
  using Rows3 = StateRows3<kMaxStates>;
  using Shared = typename SharedVector<kCapacity.shared_states>::Type;

  /// Makes it ready. `prior`: means of drift coefficients, alignments, biases; the momenta come from the first fix.
  /// `covariance`: of κ and δ, gyro by gyro, rad/s and rad, positive definite; only its lower triangle is used. Behind
  /// them it may have the amplitudes of the drift at orbital period, whose prior is then this and not that of the
  /// set-up. Nothing is changed where there is a fault.
  [[nodiscard]] std::optional<SetupFault> set_up(const CalibrationSetup& setup, const Gyros& prior,
                                                 const Eigen::Ref<const Eigen::MatrixXd>& covariance);

  /// Returns to the prior, not started: as after set_up().
  void forget();

  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] const CalibrationSetup& setup() const { return setup_; }
  [[nodiscard]] const Layout& layout() const { return setup_.layout; }
  [[nodiscard]] int states() const { return layout().size(); }
  /// The states in which errors are given: those before layout().shared().
  [[nodiscard]] Layout error_layout() const { return setup_.layout; }
  [[nodiscard]] const DriftModel& drift() const { return drift_; }
  [[nodiscard]] const Gyros& gyros() const { return gyros_; }
  /// Estimates of the shared states, in the order of the layout.
  [[nodiscard]] const Shared& shared() const { return shared_; }
  /// How errors at the last fix have changed the present directions.
  [[nodiscard]] Sensitivities since_fix() const { return since_fix_.at_present(); }
  [[nodiscard]] double time_since_fix_s() const { return time_since_fix_s_; }
  /// Errors of the estimates at the last fix.
  [[nodiscard]] const Errors& errors() const { return errors_; }
  /// Prior means.
  [[nodiscard]] const Gyros& prior_gyros() const { return prior_gyros_; }

  /// Least squares, all gyros that are used weighted equally.
  [[nodiscard]] Result<AttitudeByDirections, DirectionsFault> attitude(const Gyros& gyros, const Directions& h_b,
                                                                       const GyroMask& used) const {
    return optimal_attitude(momenta(gyros, layout().gyros), in_c(gyros, layout().gyros, h_b), used);
  }
  /// The same, only the attitude itself.
  [[nodiscard]] Result<Rot<In, C>, DirectionsFault> rotation(const Gyros& gyros, const Directions& h_b,
                                                             const GyroMask& used) const {
    return optimal_rotation(momenta(gyros, layout().gyros), in_c(gyros, layout().gyros, h_b), used);
  }
  /// Whether there is one.
  [[nodiscard]] bool gives_attitude(const Gyros& gyros, const Directions& h_b, const GyroMask& used) const {
    return !fault_of_directions(momenta(gyros, layout().gyros), in_c(gyros, layout().gyros, h_b), used);
  }

  /// Square root of the covariance of all states, or of the first of them, at the last fix. Needs started().
  void error_root(RowsView root) const { errors_.put_root(root); }
  /// The same of the prior, rows and columns from the first that is no direction up to the first shared one, into
  /// zeros.
  void prior_error_root(RowsView root) const;
  /// Covariance of what depends so on the states at the last fix. Needs started().
  [[nodiscard]] Eigen::Matrix3d covariance_of_errors(const Rows3& by_states) const { return covariance_of(by_states); }

  /// Prediction of all momenta over one step that ends at t, attitude and readings of its middle. Needs started().
  void predict(const Eigen::Matrix3d& C_in_c, const Directions& h_b, Time t, double dt_s);
  /// Widens the directions: `variance_rad2` per axis for what a step too long for its readings may have missed.
  void add_direction_variance(double variance_rad2) {
    extra_variance_rad2_ += variance_rad2;
    second_order_.hold_s = 0;
  }

  /// A correction of the estimate, and what its stages leave for one another. Between two of them the estimate is not
  /// predicted; all else may be asked, and is that of the stages that have been carried out.
  struct Correction {
    static constexpr int kWideningParts = 10;
    enum class Stage : std::uint8_t {
      kBegin,        ///< starts the filter, or sees whether the readings give an attitude
      kSecondOrder,  ///< how much the linear model of the prediction leaves out
      kPropagation,  ///< the covariance to the present time
      kAttitude,     ///< the one to linearise at
      kNoise,        ///< of the readings
      kJudgement,    ///< innovation and gate; of the angles, and of a fix at_once, also the update
      kFault,        ///< which gyro is at fault
      kRestart,
      kWidening,  ///< of all sigmas
      kUpdate,    ///< of the covariance
      kFeedback,  ///< of the correction to the estimate
      kDone,
    };
    Stage stage = Stage::kBegin;
    /// The judgement may do the update as well, which saves work; the bits are the same.
    bool at_once = false;
    bool reopened = false;
    int widening_left = kWideningParts;                     ///< parts of the prior that widened sigmas have yet to take
    PerGyro<double, kCapacity.gyros> prediction_noise_rad;  ///< 1-sigma per axis of the directions
    PerGyro<double> reading_noise_rad;
    Eigen::Matrix3d C_linear = Eigen::Matrix3d::Identity();

    [[nodiscard]] bool done() const { return stage == Stage::kDone; }
    /// The covariance is already that after the fix, the estimate not yet.
    [[nodiscard]] bool awaits_feedback() const { return stage == Stage::kFeedback; }
  };
  /// Stages of a correction, at most; those of a reopening come twice, and a widening has ten.
  static constexpr int kMostStages = 23;
  /// What the next stage takes, about, in 100 instructions on two gyros with eq. (1), where no term of second order is
  /// held; and all from it on, as it usually goes.
  [[nodiscard]] static int cost(const Correction& correction);
  [[nodiscard]] static int cost_to_end(const Correction& correction);

  /// The next stage of a correction by a fix: the first fix starts the filter, each further one updates it. Where the
  /// estimate is not finite in the end, or has no covariance, it is forgotten: kEstimateLost, and no longer started().
  void carry_on(Correction& correction, const StarFix& fix, const FixReadings& readings, FixReport& report);
  /// The next stage of a correction without a fix: by the angles between the momenta, which the readings give without
  /// the attitude. It gives no information about the attitude or anything that rotates all momenta alike, and never
  /// reopens the filter. The estimate may be forgotten as with a fix. Needs started().
  void carry_on(Correction& correction, Time t, const FixReadings& readings, AngleReport& report);
  /// All stages of it.
  [[nodiscard]] FixReport correct(const StarFix& fix, const FixReadings& readings);
  [[nodiscard]] AngleReport check_angles(Time t, const FixReadings& readings);

 private:
  static constexpr int kMaxStatesOfPrior = kMaxStates - 3 * kCapacity.gyros;  ///< all but the directions
  static constexpr int kMaxCompared = 2 * kCapacity.gyros;                    ///< components of a comparison
  using Compared = ComparedRows<kMaxStates, kMaxCompared>;
  /// A comparison as whitened rows about the states, with its innovation covariance and NIS.
  struct White {
    Compared seen;                   ///< H seen through the uncertainty, and y, of unit white noise
    ComponentCovariance L;           ///< y of the comparison itself is L times that of `seen`
    ComponentCovariance covariance;  ///< of y in `seen`: 1 + H P Hᵀ
    FixReport::Innovation y;         ///< that of `seen`, of unit variance
    double nis = 0;
  };

  /// 1-sigma of a direction of which nothing is known.
  static constexpr double kUnknown_rad = 1;
  /// NIS above this multiple of the gate indicates a gyro fault; errors of the drift model lead to a reopening well
  /// before that.
  static constexpr double kFaultGateRatio = 4;
  /// With only two gyros, isolating one loses the attitude: done only after a restart from the prior has not helped,
  /// and for a misfit larger than an alignment wrong by 5° in a body that turns at orbital rate adds to the misfit in
  /// the minute until a run of rejections reopens the filter.
  static constexpr double kFaultMisfitOfPair_rad = 5.8e-3;  // 20′
  /// Of sigmas: with less it takes longer until they are honest, with more more is forgotten (docs/mathematics.md, 11).
  static constexpr double kWidening = 3;

  /// Whether the estimate is finite and has a covariance.
  [[nodiscard]] bool sound() const;
  /// carry_on() before sound() is asked.
  void take(Correction& correction, const StarFix& fix, const FixReadings& readings, FixReport& report);
  void take_angles(Correction& correction, const FixReadings& readings, AngleReport& report);
  /// The terms of second order as they were last worked out: a third of all that a fix does. Where they are small they
  /// hold for a while, as long as fixes come and the body turns as they did then (docs/mathematics.md, section 8).
  struct SecondOrder {
    PerGyro<double, kCapacity.gyros> prediction_rad_s{};  ///< 1-sigma per axis, of each second without a fix
    PerGyro<double, kCapacity.gyros> reading_rad{};       ///< 1-sigma per axis
    // As floats the object of a pair stays within 32 KiB.
    float hold_s = 0;                 ///< how long they still hold; zero: to be worked out
    float interval_s = 0;             ///< they stand for a fix so long after the one before,
    Eigen::Vector3f rate_c{0, 0, 0};  ///< and for this rate of the body, rad/s
  };
  static constexpr float kHoldSecondOrder_s = 30;
  static constexpr double kSmallSecondOrder = 0.1;  ///< of the noise of a reading
  /// A fix as it is compared.
  struct Seen {
    FixBySharedStates by_shared;
    Rot<In, C> C_in_c;
    Eigen::Matrix3d R_c;  ///< of the fix, and of what the readings do not follow
  };
  [[nodiscard]] Seen seen(const StarFix& fix, const FixReadings& readings) const;
  [[nodiscard]] FixComparison compared(const Seen& its, const Correction& correction,
                                       const FixReadings& readings) const;
  /// The stages of take(), as they are named.
  void begin(Correction& correction, const StarFix& fix, const FixReadings& readings, FixReport& report);
  void judge(Correction& correction, const Seen& its, const StarFix& fix, const FixReadings& readings,
             FixReport& report);
  /// Of a fix within the gate: whether its innovation goes along with those before it.
  void look_for_correlation(Correction& correction, const White& white, FixReport& report);
  /// Makes all sigmas kWidening times as large, but no larger than those of the prior. The estimates stay, and with
  /// them what they are off by.
  void widen(Correction& correction);
  /// Of a fix above the gate: whether a lower weight takes it.
  static void use_all_the_same(Correction& correction, FixReport& report);
  void look_for_fault(Correction& correction, const Seen& its, const FixReadings& readings, FixReport& report) const;
  void update(Correction& correction, const Seen& its, const StarFix& fix, const FixReadings& readings,
              const FixReport& report);
  /// The update by rows seen through the uncertainty, which are used up.
  void use(Correction& correction, const StarFix& fix, Compared& seen, double weight);
  void judge_angles(Correction& correction, const FixReadings& readings, AngleReport& report);
  [[nodiscard]] Eigen::Matrix3d covariance_of(Rows3 by_states) const;
  /// Of what depends on the states from the `first` on alone, by these columns and no further ones.
  template <class Rows>
  [[nodiscard]] Eigen::Matrix3d covariance_from(int first, const Rows& some) const;
  /// The attitude by gyros and fix together, weighted by what is known of both. Needs the covariance at the fix.
  [[nodiscard]] Eigen::Matrix3d fused_attitude(const AttitudeByDirections& by_gyros, const Seen& its,
                                               const StarFix& fix, const FixReadings& readings) const;
  void start(const Seen& its, const FixReadings& readings);
  void restart(const Seen& its, const FixReadings& readings);
  /// 1-sigma per axis of the second-order term ½ a × b, which the linear model leaves out, by the covariances of a and
  /// b.
  [[nodiscard]] static double second_order_rad(const Eigen::Matrix3d& A, const Eigen::Matrix3d& B);
  /// 1-sigma per axis of the second-order term of a reading, of each gyro.
  [[nodiscard]] PerGyro<double, kCapacity.gyros> second_order_of_reading(const Eigen::Matrix3d& C_linear) const;
  /// 1-sigma of the readings, `noise_factor` times that of a single one.
  [[nodiscard]] PerGyro<double> readout_noise(double noise_factor) const;
  /// The same with the second-order term; n: consecutive measurements without a fix between them.
  [[nodiscard]] PerGyro<double> reading_noise(const Eigen::Matrix3d& C_linear, double noise_factor, int n) const;
  /// The same for a fix, of whose error this is not known, noise apart.
  [[nodiscard]] PerGyro<double> fix_reading_noise(const Eigen::Matrix3d& C_linear, double noise_factor,
                                                  const Eigen::Matrix3d& misalignment);
  /// Covariance of what is not known of the error of a further star tracker's fix, noise apart: its first fix finds its
  /// alignment, and until then it is no attitude to linearise at.
  [[nodiscard]] Eigen::Matrix3d misalignment_of(const StarFix& fix, const FixReadings& readings) const;
  [[nodiscard]] White whitened(const FixComparison& comparison, const Eigen::Matrix3d& R_c,
                               const PerGyro<double>& noise_rad) const;
  /// The rows of whitened() for the update by a fix that shares its samples with others, `sharing` of them with itself,
  /// whose readout noise is `noise_factor` times that of a single reading.
  [[nodiscard]] Compared rows_to_use(const FixComparison& comparison, const Eigen::Matrix3d& R_c,
                                     PerGyro<double> noise_rad, double noise_factor, double sharing) const;
  /// A comparison with the attitude eliminated and the noise of the readings alone: what the angles between the momenta
  /// show.
  [[nodiscard]] White angles_of(const FixComparison& comparison, const PerGyro<double>& noise_rad) const;
  void put_innovation(White& white) const;
  /// Reports the innovation and what the gate says of it.
  void ask_gate(const FixComparison& comparison, const White& white, double misfit_rad, const Directions& h_b,
                FixReport& report);
  /// Whether a rejected misfit is so large that only a gyro fault explains it.
  [[nodiscard]] bool is_fault(double nis, double misfit_rad, int used) const;
  /// The one gyro whose removal makes a disagreeing comparison agree; kNoGyro where none or several do.
  /// `comparison` is used for the trials, and in the end as it was.
  template <class Agrees>
  [[nodiscard]] static int odd_gyro(FixComparison& comparison, Agrees&& agrees);
  /// Whether the prior allows the drift coefficients and alignments that are estimated.
  [[nodiscard]] bool prior_allows_estimates() const;
  /// The attitude of these readings by the estimate, which has been found to exist.
  [[nodiscard]] AttitudeByDirections attitude_now(const FixReadings& readings) const {
    return attitude(gyros_, readings.h_b, readings.used).value();
  }
  [[nodiscard]] Eigen::Matrix3d rotation_now(const FixReadings& readings) const {
    return rotation(gyros_, readings.h_b, readings.used).value().raw();
  }
  /// Whether the terms of second order still hold at the time of these readings; where they do not, they are to be
  /// worked out.
  void look_at_second_order(const FixReadings& readings);
  /// Noise of the prediction since the last fix, the second-order term with it.
  [[nodiscard]] PerGyro<double, kCapacity.gyros> prediction_noise(const Eigen::Matrix3d& C_in_c);
  void propagate(const PerGyro<double, kCapacity.gyros>& noise_rad);
  /// Makes φ_k along h_k follow C_in_c δ_k, in the sensitivities since the last fix. Along a momentum an error moves
  /// nothing and may be chosen; this choice keeps φ_k − C_in_c δ_k small in all three axes, so that what is known
  /// of it across h_k stays true when the estimate of h_k moves (docs/mathematics.md, section 8).
  void follow_alignments(const FixReadings& readings);
  /// Corrects the estimate by the update that its errors have taken.
  void feed_back();
  /// Whether the gyros agree among themselves. Not inline, so that its stack is free again when a fault is looked for.
  [[nodiscard, gnu::noinline]] bool angles_agree(const Eigen::Matrix3d& C_by_gyros, const FixReadings& readings) const;
  /// The gyro whose fault explains a fix that was rejected; kNoGyro where none does.
  [[nodiscard]] int gyro_at_fault(FixComparison& comparison, const Eigen::Matrix3d& C_by_gyros,
                                  const FixReadings& readings, const Eigen::Matrix3d& R_c,
                                  const PerGyro<double>& noise_rad) const;
  void begin_stretch();
  /// As CalibrationSetup::fixes_sharing_a_sample() (docs/mathematics.md, section 2).
  [[nodiscard]] double fixes_sharing_samples_of(const StarFix& fix) const;

  CalibrationSetup setup_;
  DriftModel drift_;
  Gyros prior_gyros_;
  Gyros gyros_;
  Shared shared_;
  Since since_fix_;
  Errors errors_;
  PackedTriangle<kMaxStatesOfPrior> prior_;  ///< root of the covariance, behind the directions
  OutlierGate gate_;
  InnovationCorrelation<kMaxCompared> correlation_;
  std::array<std::optional<Time>, kStarTrackers> used_fix_t_;
  /// 1-sigma of the second-order terms left out of the prediction since the start.
  PerGyro<double, kCapacity.gyros> second_order_rad_{};
  SecondOrder second_order_;
  double time_since_fix_s_ = 0;
  double extra_variance_rad2_ = 0;
  int angles_since_fix_ = 0;
  int angle_rejections_in_a_row_ = 0;
  PerGyro<Eigen::Vector3f, kCapacity.gyros> h_b_at_fix_{};  ///< readings for which φ_k along h_k was chosen
  bool restarted_from_estimates_ = false;                   ///< at the last restart
  bool started_ = false;
};

// Those that are built.
extern template class InvariantEstimator<kPairCapacity>;
extern template class InvariantEstimator<kTrioCapacity>;
extern template class InvariantEstimator<kFullCapacity>;

}  // namespace trihedron
