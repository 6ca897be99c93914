#pragma once
/// The on-board step on the ground: events in, one by one, in the order in which they came; reports out.

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "trihedron/core/invariant_estimator.hpp"
#include "trihedron/core/layout.hpp"
#include "trihedron/core/status.hpp"
#include "trihedron/core/step_report.hpp"
#include "trihedron/core/telemetry.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// The estimator of a Pipeline of two gyros with eq. (1) and nothing further, set up as that would. Throws SetupError,
/// and std::invalid_argument for any other layout.
[[nodiscard]] std::unique_ptr<InvariantEstimator<kPairCapacity>> pair_estimator(const PassSettings& settings,
                                                                                const CalibrationOptions& options);

/// Everything that it does is in its reports. Its results depend on nothing but the events that it was given. Where
/// something is estimated at orbital period and the options do not tell the rate of the orbit, that of an earlier
/// calibration is taken at first, and then that of the fixes so far: from time to time, as it becomes better known,
/// what came before is flown again with it, without reports. After some hours it stays as it is.
class Pipeline {
 public:
  /// Whether the calibration predicts to each sample, as on board, or may pass over some
  /// (CorrectionPolicy::steps_over_samples).
  enum class Steps { kEachSample, kOverSamples };
  /// Needs options in which nothing is left to decide. `navigate`: whether a navigator runs as well. Throws SetupError.
  Pipeline(const PassSettings& settings, const CalibrationOptions& options, Steps steps = Steps::kEachSample,
           bool navigate = true);
  Pipeline(Pipeline&&) noexcept;
  Pipeline& operator=(Pipeline&&) noexcept;
  ~Pipeline();

  /// What was done at this event; valid until the next one. A fix is reported when it is dealt with, which for a good
  /// one is some samples later.
  std::span<const StepReport> feed(const GyroSample& sample);
  std::span<const StepReport> feed(const StarFix& fix);
  /// After the last event: deals with the fixes that still wait.
  std::span<const StepReport> finish();

  [[nodiscard]] const PassSettings& settings() const { return settings_; }
  [[nodiscard]] const CalibrationOptions& options() const { return options_; }
  [[nodiscard]] const Layout& layout() const;
  /// As of CorrectionPolicy.
  [[nodiscard]] Duration correction_interval() const;

  /// Whether a fix has started the calibration.
  [[nodiscard]] bool started() const;
  /// Values and covariance as of the latest sample; without verdict and statistics. Needs started().
  [[nodiscard]] Calibration calibration() const;
  /// The gyros of calibration(), and those of before the pass; momenta as of the latest sample.
  [[nodiscard]] std::vector<GyroCalibration> gyros() const;
  [[nodiscard]] std::vector<GyroCalibration> gyros_before() const;
  /// 1-sigma of each state of calibration(). Needs started().
  [[nodiscard]] Eigen::VectorXd state_sigmas() const;
  /// What is known of the errors of gyros() at the last fix. Needs started().
  [[nodiscard]] OpenLoopStart errors() const;
  /// The same of the parameters known before the pass with momenta read through them at an attitude of this covariance,
  /// c axes, and those gyros.
  struct Held {
    std::vector<GyroCalibration> gyros;
    OpenLoopStart errors;
  };
  [[nodiscard]] Held held_at(const Rot<In, C>& C_in_c, const Eigen::Matrix3d& covariance_rad2) const;
  /// (estimated − prior)ᵀ P⁻¹ (estimated − prior), P the covariance of the prior.
  struct DistanceFromPrior {
    std::string_view of;  ///< in words
    double square = 0;
    int degrees_of_freedom = 0;
  };
  /// Of κ and δ; of δ alone; of the coefficients of eq. (1) alone.
  [[nodiscard]] std::array<DistanceFromPrior, 3> distances_from_prior() const;

  /// Of the latest sample used; needs one.
  [[nodiscard]] Time t() const;
  /// Open-loop attitude at the latest sample; nothing where there is none yet.
  [[nodiscard]] std::optional<AttitudeSolution> navigation_attitude() const;
  /// Rotation vector from an attitude at the time of a fix to that of the fix, c axes, rad; the fix as the states that
  /// the gyros share correct it.
  [[nodiscard]] Eigen::Vector3d apart_rad(const AttitudeSolution& attitude, const ComparedFix& its) const;
  /// How far an attitude at the time of a fix of the first star tracker is off that fix, by the angle and by both
  /// covariances.
  [[nodiscard]] OpenLoopEnd compare(const AttitudeSolution& attitude, const ComparedFix& its) const;

 private:
  struct Program;
  template <class Step>
  [[nodiscard]] std::span<const StepReport> report_all(const Step& step);
  [[nodiscard]] double part_of_change() const;
  void set_up();
  void look_at_orbit();
  [[nodiscard]] bool is_another_rate(double rate_rad_s, Duration passed) const;
  void keep(const GyroSample& sample, SampleStatus status);
  void keep(const StarFix& fix);

  /// The events of the beginning, by which the rate of the orbit is told.
  struct Orbit {
    std::vector<std::variant<GyroSample, StarFix>> events;
    std::optional<Time> first;   ///< sample whose stamp was believed
    std::optional<Time> latest;  ///< the same
    StarTrackerTelemetry fixes;  ///< of the first star tracker
    Duration next;               ///< since its first fix: when to look again
  };

  PassSettings settings_;
  CalibrationOptions options_;
  CorrectionPolicy policy_;
  std::unique_ptr<Program> program_;
  std::vector<StepReport> reports_;
  std::optional<Orbit> orbit_;  ///< until the rate is known well enough
};

}  // namespace trihedron::ground
