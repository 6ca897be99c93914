#include "trihedron/ground/evaluate/calibration_evaluation.hpp"

#include "evaluate/reference.hpp"
#include "trihedron/ground/evaluate/used_fixes.hpp"

namespace trihedron::ground {

CalibrationEvaluation evaluate_calibration(const Pass& pass, const CalibrationRun& run, const Truth* truth,
                                           double limit_rad, OpenLoopScope scope) {
  const Reference reference = best_reference(pass.settings, truth, used_fixes(pass, run.fixes));
  CalibrationEvaluation result;
  result.navigation = evaluate_against(reference, run.navigation, pass.settings.epoch, limit_rad);
  result.attitude = evaluate_against(reference, run.attitude, pass.settings.epoch, limit_rad);
  if (truth != nullptr) {
    result.estimate_minus_truth = estimate_minus_truth(run.calibration, *truth);
  }
  result.convergence = convergence(run, truth);
  result.drift_settled = settled(run, result.convergence, false);
  result.alignment_settled = settled(run, result.convergence, true);
  result.limit_rad = limit_rad;
  result.open_loops = fly_open_loops(pass, run, reference.t, reference.q_in_c, limit_rad, scope);
  for (const OpenLoops& loops : result.open_loops) {
    result.extension.pairs.push_back(loops.intervals);
  }
  result.extension.median = median_extension(result.open_loops);
  return result;
}

}  // namespace trihedron::ground
