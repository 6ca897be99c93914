#pragma once
/// The on-board application: modes, commands, faults and housekeeping about the on-board step, which it drives. It
/// decides by itself when the calibration is good enough to navigate by. docs/adr/0014-on-board-application.md.

#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>

#include "trihedron/core/forecast.hpp"
#include "trihedron/core/on_board.hpp"
#include "trihedron/core/residuals.hpp"
#include "trihedron/core/tables.hpp"
#include "trihedron/core/transitions.hpp"

namespace trihedron {

/// What the application is to achieve, and when it takes something for a fault.
struct ApplicationPolicy {
  Duration correction_interval = CorrectionPolicy::kEveryFix;
  double required_error_rad = 1.454441e-3;                 ///< of the attitude, 99.7 %; 5′
  Duration required_interval = std::chrono::minutes(270);  ///< without the star tracker
  Duration window = std::chrono::minutes(95);              ///< of the forecast: an orbit
  Duration star_tracker_timeout = std::chrono::minutes(1);
  Duration failed_after = std::chrono::minutes(1);
  int aligned_after_fixes = 20;
  /// As of CorrectionPolicy: the samples between two fixes that are 2.5 s apart, at 8 Hz.
  int spread_over = 20;
};

/// One plain object without pointers, which allocates nothing. Fed with samples and fixes in time order; commands may
/// come between any two of them.
template <class Estimator>
class Application {
 public:
  using Gyros = typename Estimator::Gyros;
  /// For SnapshotStore. To be counted up whenever a member of the state is added, removed or gets another meaning.
  static constexpr std::uint32_t kStateVersion = 15;
  static constexpr std::uint32_t kSnapshotLayout =
      kStateVersion << 16 | static_cast<std::uint32_t>(Estimator::kMaxStates) << 4 | sizeof(void*);

  /// Stretches longer than this without a sample are faults.
  static constexpr Duration kLongGap = std::chrono::seconds(10);

  /// So many samples refused in a row are no readings any more, also where time stands still.
  static constexpr int kStandingStill = 16;

  /// The command load_parameters in full: any layout that the estimator has room for. `prior` and `covariance` as of
  /// the estimator.
  [[nodiscard]] Answer load(const CalibrationSetup& setup, const Gyros& prior,
                            const Eigen::Ref<const Eigen::MatrixXd>& covariance, const ApplicationPolicy& policy);
  /// The command load_parameters.
  [[nodiscard]] Answer load(const Parameters& table);

  /// Every other command. `argument`: of select_gyros the mask; of the others it is not looked at.
  [[nodiscard]] Answer command(Command command, std::uint32_t argument = 0);

  /// One gyro sample, and with it a part of the work of a fix, so that no call takes much longer than another.
  StepReport on_gyro(const GyroSample& sample);
  /// One fix.
  StepReport on_fix(const StarFix& fix);

  [[nodiscard]] Mode mode() const { return mode_; }
  /// Bits of Fault.
  [[nodiscard]] std::uint32_t faults() const { return faults_; }
  [[nodiscard]] bool has(Fault fault) const { return (faults_ & static_cast<std::uint32_t>(fault)) != 0; }
  [[nodiscard]] Housekeeping housekeeping() const;
  /// The attitude at the latest sample; nothing before the first fix, and while there is none.
  [[nodiscard]] std::optional<AttitudeSolution> attitude() const;
  /// What the filter has found. False before the first fix, and between the two steps in which a fix is taken in; then
  /// nothing is written.
  [[nodiscard]] bool get(CalibrationRecord& record) const;
  [[nodiscard]] const OnBoard<Estimator>& on_board() const { return on_board_; }
  [[nodiscard]] const Forecast<Estimator>& forecast() const { return forecast_; }

 private:
  enum class Adoption : std::uint8_t { kNone, kPending, kDone };

  Answer answer(Answer answer);
  [[nodiscard]] Answer answer_to(Command command, std::uint32_t argument);
  [[nodiscard]] Answer select(std::uint32_t bits);
  void begin();
  void happen(Event event);
  void set(Fault fault, bool is_there);

  void note(const StepReport& report);
  void note_contradiction(const StepReport& report);
  void note_sample(const StepReport& report);
  void note_time_of_refused(const StepReport& report);
  void note_gyros(const StepReport& report);
  void note_angles(const StepReport& report);
  void forget_angles();
  void note_fix(const StepReport& report);
  void note_used_fix(const StepReport& report);
  void restart();
  void note_navigated(const StepReport& report);
  [[nodiscard]] double largest_turn_rad(const StepReport& report) const;
  void decide_on_adoption();
  void adopt();
  void hold();
  void withdraw();
  void watch(const StepReport& report);
  void change_mode_by_faults();
  [[nodiscard]] bool is_degraded() const;
  [[nodiscard]] bool is_looking_at_fixes() const { return mode_ != Mode::kStandby && mode_ != Mode::kFailed; }
  [[nodiscard]] int gyros() const { return on_board_.estimator().layout().gyros; }

  OnBoard<Estimator> on_board_;
  Forecast<Estimator> forecast_;
  Residuals calibration_residuals_;  ///< of the fixes used
  Residuals navigation_residuals_;   ///< of the navigator from the fixes
  ApplicationPolicy policy_;
  Housekeeping
      counts_{};   ///< the counters and the last statuses; what else a record holds is put in when it is asked for
  Time now_{};     ///< of the latest sample whose time was accepted
  Time used_t_{};  ///< of the latest sample used
  Time fix_t_{};   ///< of the latest fix used; before the first, of the start
  /// Of the latest sample that gave an attitude, or could have; moved on by gaps since then, which do not count.
  Time attitude_t_{};
  Time unknown_until_ = Time::min();  ///< end of the last gap or jump of the clock
  std::uint32_t faults_ = 0;
  /// Of the angles between the momenta, by the last fix that was compared; infinite where that tells nothing of now.
  double angle_sigma_rad_ = std::numeric_limits<double>::infinity();
  Time angle_t_ = Time::min();      ///< when it was known, or the angles agreed without a fix
  Time angle_off_t_ = Time::min();  ///< of the last sample whose angle was off
  double angle_off_rad_ = 0;        ///< the largest since gyros contradict each other, of the smaller of two samples
  double last_off_rad_ = 0;         ///< of the last sample
  double fixes_off_rad_ = 0;        ///< what fixes that were followed against an adopted calibration were off
  int fixes_to_agree_ = 0;          ///< from now on, until they are believed
  int angle_run_ = 0;               ///< samples in a row whose angle says otherwise than the fault
  GyroMask angle_gyros_{};          ///< that were used at the last sample
  int fixes_since_start_ = 0;
  int refused_in_a_row_ = 0;
  Mode mode_ = Mode::kStandby;
  Adoption adoption_ = Adoption::kNone;
  bool loaded_ = false;
  bool held_ = false;
  bool has_sample_ = false;  ///< that was used
  bool has_time_ = false;    ///< of a sample, used or refused
};

/// The flight computer's: two gyros with eq. (1), one star tracker.
using PairApplication = Application<InvariantEstimator<kPairCapacity>>;
/// The same with a third gyro.
using TrioApplication = Application<InvariantEstimator<kTrioCapacity>>;

// Those that are built.
extern template class Application<InvariantEstimator<kPairCapacity>>;
extern template class Application<InvariantEstimator<kTrioCapacity>>;

}  // namespace trihedron
