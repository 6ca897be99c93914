#pragma once
/// Evaluation of a calibration: the errors of its attitudes and parameters, when its parameters settled, and how long
/// the attitude stays within a limit without corrections.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "trihedron/ground/evaluate/attitude_evaluation.hpp"
#include "trihedron/ground/evaluate/convergence.hpp"
#include "trihedron/ground/evaluate/open_loop.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// How a calibration compares with the truth, or with the star tracker.
struct CalibrationEvaluation {
  AttitudeEvaluation navigation;          ///< of CalibrationRun::navigation
  AttitudeEvaluation attitude;            ///< of CalibrationRun::attitude
  Eigen::VectorXd estimate_minus_truth;   ///< by row of Calibration::states; empty without a truth
  std::vector<Convergence> convergence;   ///< by row of Calibration::states
  std::optional<Duration> drift_settled;  ///< as settled() has it
  std::optional<Duration> alignment_settled;
  double limit_rad = kAttitudeLimit_rad;  ///< error limit of the correction intervals
  std::vector<OpenLoops> open_loops;      ///< from each of the run's corrections
  IntervalExtension extension;            ///< by the open loops; the median from the second correction on
};

/// `run`: a calibration of this pass. Without a truth, which may be null, the reference is the fixes that the
/// calibration used, and parameters are compared with their final values.
[[nodiscard]] CalibrationEvaluation evaluate_calibration(const Pass& pass, const CalibrationRun& run,
                                                         const Truth* truth, double limit_rad = kAttitudeLimit_rad,
                                                         OpenLoopScope scope = OpenLoopScope::kAll);

}  // namespace trihedron::ground
