#pragma once
/// The on-board step: gyro samples and fixes in, in time order; calibration and attitude out. One object, no heap, no
/// exceptions.

#include <chrono>
#include <optional>

#include "trihedron/core/fix_queue.hpp"
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
  /// a fix are there. At most one fix is dealt with.
  StepReport on_gyro(const GyroSample& sample);

  /// One fix. It waits for the gyro samples round it and is reported with the step that has them; without need for them
  /// at once.
  StepReport on_fix(const StarFix& fix);

  /// Deals with the next of the fixes whose samples are there. Status kNone when there is none.
  StepReport carry_on();

  /// After the last sample: deals with one of the fixes that still wait, with the samples that there are. Status kNone
  /// when none waits.
  StepReport flush();

  /// The next fix that is used corrects the navigator, whatever the interval.
  void correct_at_next_fix() { correction_wanted_ = true; }
  /// What the navigator takes over at its corrections; at first as the policy of the set-up says.
  void use_parameters(ParametersInUse parameters) { parameters_ = parameters; }
  /// Uses these gyros alone, and takes them back where they were isolated.
  void select(const GyroMask& gyros) { intake_.health().select(gyros); }
  /// Whether these gyros give an attitude by the readings of the latest sample.
  [[nodiscard]] bool can_see_with(const GyroMask& gyros) const {
    return readings_.size() > 0 && estimator_.rotation(estimator_.gyros(), readings_.latest_directions(), gyros).ok();
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
  [[nodiscard]] const Navigator<Estimator>& navigator() const { return navigator_; }
  [[nodiscard]] const GyroHealth& health() const { return intake_.health(); }
  /// Time of the latest sample used; needs one.
  [[nodiscard]] Time t() const { return readings_.latest_t(); }
  /// The same, if there is one since the start or since the clock was set back.
  [[nodiscard]] std::optional<Time> latest() const { return readings_.latest(); }
  /// Of the navigator's last correction; needs navigator().started().
  [[nodiscard]] Time corrected_t() const { return corrected_t_; }

  /// Open-loop attitude at the latest sample. Needs navigator().started().
  [[nodiscard]] Result<AttitudeSolution, DirectionsFault> navigation_attitude() const {
    return navigator_.attitude(estimator_, readings_.now(estimator_.setup(), intake_.health(), estimator_.gyros()));
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

  [[nodiscard]] SampleStatus let_in(GyroSample& sample);
  void set_clock(Time t);
  void calibrate_until(Time limit, StepReport& report);
  void correct(const StarFix& fix, StepReport& report);
  void look_at_angles(StepReport& report);
  void use_angles(Time t, const FixReadings& readings, StepReport& report);
  void judge(int odd_gyro, StepReport& report);
  void correct_navigator(const FixReadings& readings, StepReport& report);
  /// After a fix, with what has passed since the one before it.
  void end_stretch(const typename Estimator::Sensitivities& stretch, double duration_s);
  void navigate(Time from_t, const Directions& from, Time to_t, const Directions& to);
  void follow(Time t, const Directions& h_b);
  void follow_next_sample();
  [[nodiscard]] std::optional<FixReadings> readings_at(Time t) const {
    return readings_.at(t, estimator_.setup(), intake_.health(), estimator_.gyros());
  }
  [[nodiscard]] std::optional<AttitudeSolution> calibrated(const FixReadings& readings) const;
  [[nodiscard]] std::optional<AttitudeSolution> navigated_before(Time t, const FixReadings& readings) const;
  [[nodiscard]] double angle_residual() const;
  [[nodiscard]] int gyros() const { return estimator_.layout().gyros; }
  [[nodiscard]] Duration reach() const {
    return Estimator::kTakesSamplesTogether ? estimator_.setup().reach() : Duration::zero();
  }
  /// Of the oldest sample that the estimator has not yet followed, if any.
  [[nodiscard]] Time next_sample_t() const {
    return behind_ > 0 ? readings_.time(readings_.size() - behind_) : Time::max();
  }

  Intake intake_;
  FixQueue<Estimator::kStarTrackers> fixes_;
  Readings<Gyros::capacity()> readings_;
  Schedule schedule_;
  Estimator estimator_;
  Navigator<Estimator> navigator_;
  CorrectionPolicy policy_;
  ParametersInUse parameters_{};
  bool correction_wanted_ = false;
  Stretch stretch_;
  int behind_ = 0;  ///< samples to which the estimator has not yet been taken
  Time follower_t_{};
  Directions follower_h_b_;
  Time corrected_t_{};
  int fixes_dropped_ = 0;        ///< not yet reported
  bool clock_set_back_ = false;  ///< no sample has been used since
  bool start_unconfirmed_ = false;
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
