#pragma once
/// The on-board step: gyro samples and fixes in, in time order; calibration and attitude out. One object, no heap, no
/// exceptions.

#include <chrono>
#include <cstdint>
#include <optional>

#include "trihedron/core/fix_queue.hpp"
#include "trihedron/core/frozen_fixes.hpp"
#include "trihedron/core/intake.hpp"
#include "trihedron/core/invariant_estimator.hpp"
#include "trihedron/core/navigator.hpp"
#include "trihedron/core/paper_estimator.hpp"
#include "trihedron/core/readings.hpp"
#include "trihedron/core/schedule.hpp"
#include "trihedron/core/step_report.hpp"

namespace trihedron {

/// Intake, readings, schedule, estimator and navigator put together: fed event by event, it reports on each.
template <class Estimator>
class OnBoard {
 public:
  using Gyros = typename Estimator::Gyros;

  /// Makes it ready; as of the estimator's set_up().
  [[nodiscard]] std::optional<SetupFault> set_up(const CalibrationSetup& setup, const Gyros& prior,
                                                 const Eigen::Ref<const Eigen::MatrixXd>& covariance,
                                                 const CorrectionPolicy& policy);

  /// As after set_up().
  void reset();

  /// One gyro sample. The navigator moves to it at once; the calibration follows some samples behind, when those round
  /// a fix are there. At most one fix is dealt with; where its work is spread, a part of one.
  StepReport on_gyro(const GyroSample& sample);

  /// One fix. It waits for the gyro samples round it and is reported with the step that has them; without need for them
  /// at once.
  StepReport on_fix(const StarFix& fix);

  /// Deals with the next of the fixes whose samples are there. Status kNone when there is none.
  StepReport carry_on();

  /// After the last sample: deals with one of the fixes that still wait, with the samples that there are. Status kNone
  /// when none waits; the momenta of the estimator are then those of the latest sample.
  StepReport flush();

  /// The next fix that is used corrects the navigator, whatever the interval.
  void correct_at_next_fix() { correction_wanted_ = true; }
  /// What the navigator takes over at its corrections; at first as the policy of the set-up says.
  void use_parameters(ParametersInUse parameters);
  /// Those that the navigator was last corrected by, maybe at a fix whose report is still to come.
  [[nodiscard]] ParametersInUse corrected_by() const { return corrected_by_; }
  /// Uses these gyros alone, and takes them back where they were isolated.
  void select(const GyroMask& gyros) { intake_.health().select(gyros); }
  /// Whether these gyros give an attitude by the readings of the latest sample.
  [[nodiscard]] bool can_see_with(const GyroMask& gyros) const {
    return readings_.size() > 0 && estimator_.gives_attitude(estimator_.gyros(), readings_.latest_directions(), gyros);
  }
  /// How errors at its beginning have changed the directions at its end, over the stretches between all fixes that have
  /// been dealt with since begin_stretch().
  struct Stretch {
    typename Estimator::Sensitivities sensitivities;
    double duration_s = 0;
  };
  [[nodiscard]] const Stretch& stretch() const { return stretch_; }
  void begin_stretch();

  [[nodiscard]] const Estimator& estimator() const { return estimator_; }
  /// Whether the estimate and its covariance belong together: not between two stages of a fix, where the covariance is
  /// already that after it.
  [[nodiscard]] bool estimate_is_whole() const {
    return work_.stage != Work::Stage::kFix || !work_.correction.awaits_feedback();
  }
  /// Of the fix that the estimate rests on already, while the work that follows goes on; it is reported with the end of
  /// that.
  [[nodiscard]] std::optional<Time> fix_taken_in() const {
    const bool is_in = work_.stage > Work::Stage::kFix && work_.has_fix && work_.outcome.fix.used();
    return is_in ? std::optional(work_.its.fix.t) : std::nullopt;
  }
  [[nodiscard]] const Navigator<Estimator>& navigator() const { return navigator_; }
  [[nodiscard]] const GyroHealth<Estimator::Gyros::capacity()>& health() const { return intake_.health(); }
  /// Time of the latest sample used, or where none has been since the clock was set back, of the sample that said so;
  /// needs one.
  [[nodiscard]] Time t() const { return readings_.latest().value_or(passed_t_); }
  /// The same, if there is one since the start or since the clock was set back.
  [[nodiscard]] std::optional<Time> latest() const { return readings_.latest(); }
  /// Of the navigator's last correction; needs navigator().started().
  [[nodiscard]] Time corrected_t() const { return corrected_t_; }

  /// What the angle between two momenta is off by the latest readings, rad: the largest of all pairs of gyros that can
  /// be used and give an attitude. Zero where there is none since the clock was set back; needs a started estimator.
  [[nodiscard]] double largest_angle_off_rad() const;
  /// Open-loop attitude at the latest sample; kTooFew where there is none since the clock was set back. Needs
  /// navigator().started().
  [[nodiscard]] Result<AttitudeSolution, DirectionsFault> navigation_attitude() const {
    if (readings_.size() == 0) {
      return DirectionsFault::kTooFew;
    }
    return navigator_.attitude(estimator_,
                               with_jitter(readings_.now(estimator_.setup(), intake_.health(), estimator_.gyros())),
                               navigator_.state());
  }

 private:
  /// A step between two times, with the middle of its readings.
  struct Step {
    Time from_t{};
    Time to_t{};
    Directions from;
    Directions to;
    Directions middle;
    GyroMask used{};
    [[nodiscard]] double dt_s() const { return to_seconds(to_t - from_t); }
  };
  [[nodiscard]] Step step(Time from_t, const Directions& from, Time to_t, const Directions& to) const;
  /// Attitude in the middle of a step by these gyros; what those that are not used would read is put in.
  [[nodiscard]] std::optional<Eigen::Matrix3d> attitude_of(const Gyros& gyros, Step& step) const;
  [[nodiscard]] double variance_of_long_step(const Step& step) const;

  /// `to_it`: the step from the latest sample, if there is one and this one is of use.
  [[nodiscard]] SampleStatus let_in(GyroSample& sample, std::optional<Step>& to_it, StepReport& report);
  void set_clock(Time t, StepReport& report);
  void calibrate_until(Time limit, StepReport& report);
  void calibrate_at_once(Time limit, StepReport& report);
  enum class Beginnings : std::uint8_t { kAllowed, kPutOff };
  void calibrate_some(Time limit, Beginnings beginnings, StepReport& report);
  void calibrate_in_doubt(StepReport& report);

  /// A fix, or the readings alone, that is being dealt with, and what its stages leave for one another. While there is
  /// one the estimator stays at its time; the navigator goes on as before it, up to kTakingOver.
  struct Work {
    enum class Stage : std::uint8_t {
      kNone,
      kFix,         ///< the stages of the estimator
      kCalibrated,  ///< the attitude that the calibration gives
      kAngles,      ///< the stages of the estimator, by the angles alone
      kCatchingUp,  ///< the state of the corrected navigator follows the samples since the fix
      kTakingOver,  ///< the navigator is corrected
      kNavigated,   ///< the attitude that the navigator gave, or gives now
      kReport,
    };
    Stage stage = Stage::kNone;
    bool has_fix = false;
    bool has_past = false;  ///< `state` is the navigator's at the fix
    bool moved = false;     ///< the covariance has been moved to the present time
    ParametersInUse parameters{};
    Time t{};
    Time state_t{};  ///< of `state`, in kCatchingUp
    ComparedFix its;
    FixOutcome outcome;
    typename Estimator::Correction correction;
    typename Navigator<Estimator>::State state;
  };
  /// What takes how long, about, in 100 instructions on two gyros with eq. (1).
  struct Cost {
    static constexpr int kSample = 28;
    static constexpr int kBeginning = 170;
    static constexpr int kStarting = 300;  ///< the filter, by its first fix
    static constexpr int kCalibrated = 65;
    static constexpr int kNavigatedSample = 16;
    static constexpr int kTakingOver = 250;
    static constexpr int kNavigated = 95;
    static constexpr int kReport = 180;  ///< what is made of the report, such as a forecast
  };
  /// Fixes that have become due wait for the one that is dealt with: with one of them, its work has so many samples
  /// left; with two, half as many; with more than these, all is done at once.
  static constexpr int kHurry = 6;
  /// Samples that a stage of kCatchingUp takes.
  static constexpr int kCaughtUpTogether = 6;

  [[nodiscard]] bool is_working() const { return work_.stage != Work::Stage::kNone; }
  [[nodiscard]] bool spreads() const { return policy_.spread_over > 0; }
  /// Whether something has been dealt with, or refused when it was due.
  [[nodiscard]] static bool has_outcome(const StepReport& report) {
    return (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) ||
           report.angles.status != FixStatus::kNone;
  }
  /// Begins to deal with a fix, or with the angles between the momenta at the time that they are due; false where it
  /// is refused or put off.
  [[nodiscard]] bool begin(const StarFix& fix, StepReport& report);
  [[nodiscard]] bool begin_angles();
  /// Begins with the fix or the angles that are next, as begin() and begin_angles().
  [[nodiscard]] bool begin_next(Schedule::Next next, StepReport& report);
  void prepare(Time t, const FittedReadings& readings, typename Work::Stage stage);
  /// The next stage, up to kReport; all of them, and what they come to.
  void work();
  void finish(StepReport& report);
  void hand_over(StepReport& report);
  template <class Stage>
  void carry_on_with(const FixStatus& status, Stage&& stage);
  void work_on_fix();
  [[nodiscard]] typename Work::Stage after_calibration();
  void work_on_angles();
  [[nodiscard]] bool is_correction_due(Time t) const;
  [[nodiscard]] typename Navigator<Estimator>::Source source() const;
  void catch_up(int samples);
  void take_over();
  void note_navigated();
  void look_back();
  [[nodiscard]] int samples_after(Time t) const { return readings_.size() - readings_.first_after(t); }

  /// How the work is spread.
  void plan(int late);
  void hurry(Time limit);
  [[nodiscard]] int share_of_slot(Time limit) const;
  [[nodiscard]] static int cost_of(Schedule::Next next);
  [[nodiscard]] int cost_of_stage() const;
  [[nodiscard]] int cost_to_end() const;
  /// Whether a sample would be lost that is still needed: of a burst of fixes, each of which takes a slot by itself.
  [[nodiscard]] bool is_too_far_behind() const;

  /// After a fix, with what has passed since the one before it.
  void end_stretch(const typename Estimator::Sensitivities& stretch, double duration_s);
  void navigate(Step& step, typename Navigator<Estimator>::State& state) const;
  void follow(Time t, const Directions& h_b);
  void follow_next_sample();
  void follow_all_samples();
  [[nodiscard]] bool can_be_passed_over(int sample) const;
  [[nodiscard]] std::optional<FittedReadings> readings_at(Time t) const {
    return readings_.at(t, estimator_.setup(), intake_.health(), estimator_.gyros());
  }
  /// Readings by a polynomial, with what the latest of them have not followed.
  [[nodiscard]] FixReadings with_jitter(const FixReadings& fitted) const {
    FixReadings readings = fitted;
    readings.jitter_rad2 = readings.noise_factor < 1 ? jitter_.square_rad2() : 0;
    return readings;
  }
  [[nodiscard]] std::optional<AttitudeSolution> calibrated(const FixReadings& readings) const;
  [[nodiscard]] double angle_residual() const;
  [[nodiscard]] int gyros() const { return estimator_.layout().gyros; }
  [[nodiscard]] Duration reach() const {
    return Estimator::kTakesSamplesTogether ? estimator_.setup().reach() : Duration::zero();
  }
  /// Of the oldest sample that the estimator has not yet followed, if any.
  [[nodiscard]] Time next_sample_t() const {
    return behind_ > 0 ? readings_.time(readings_.size() - behind_) : Time::max();
  }

  Intake<Estimator::Gyros::capacity()> intake_;
  FixQueue<Estimator::kStarTrackers, Estimator::kFixCovariances> fixes_;
  FrozenFixes<Estimator::kStarTrackers, Gyros::capacity()> frozen_fixes_;
  Readings<Gyros::capacity()> readings_;
  Schedule schedule_;
  Estimator estimator_;
  Navigator<Estimator> navigator_;
  CorrectionPolicy policy_;
  ParametersInUse parameters_{};
  ParametersInUse corrected_by_{};
  // Short ones together: the state of the flight computer's has no byte to spare.
  bool correction_wanted_ = false;
  bool has_worked_ = false;
  bool clock_set_back_ = false;  ///< no sample has been used since
  bool start_unconfirmed_ = false;
  Stretch stretch_;
  Work work_;
  Jitter jitter_;
  int slots_left_ = 0;     ///< samples over which the work that there is is to be spread; 0: it is done at once
  int behind_ = 0;         ///< samples to which the estimator has not yet been taken
  int fixes_dropped_ = 0;  ///< not yet reported
  Time worked_t_{};        ///< of the last fix, or angles, dealt with
  Time follower_t_{};      ///< to which the estimator has been predicted
  Directions follower_h_b_;
  Time passed_t_{};  ///< of the last sample that was followed or passed over
  Time corrected_t_{};
};

/// The flight computer's: two gyros with eq. (1), one star tracker.
using PairOnBoard = OnBoard<InvariantEstimator<kPairCapacity>>;
/// The ground's: every layout.
using FullOnBoard = OnBoard<InvariantEstimator<kFullCapacity>>;

// Those that are built.
extern template class OnBoard<InvariantEstimator<kPairCapacity>>;
extern template class OnBoard<InvariantEstimator<kTrioCapacity>>;
extern template class OnBoard<InvariantEstimator<kFullCapacity>>;
extern template class OnBoard<PaperEstimator>;

}  // namespace trihedron
