#include "trihedron/ground/evaluate/attitude_evaluation.hpp"

#include <utility>

#include "evaluate/reference.hpp"
#include "trihedron/ground/evaluate/used_fixes.hpp"

namespace trihedron::ground {

Reference best_reference(const PassSettings& settings, const Truth* truth, const StarTrackerTelemetry& fixes) {
  return truth != nullptr
             ? Reference{ReferenceKind::kTruth, truth->t, truth->q_in_c, Eigen::Vector3d::Zero()}
             : Reference{ReferenceKind::kStarTracker, fixes.t, fixes.q_in_c, settings.star_tracker_noise_rad};
}

AttitudeEvaluation evaluate_against(const Reference& reference, const AttitudeHistory& attitude, Time epoch,
                                    double limit_rad) {
  AttitudeErrors errors = attitude_errors(attitude, reference.t, reference.q_in_c);
  for (Eigen::Vector3d& sigma : errors.sigma_rad) {
    sigma = (sigma.cwiseAbs2() + reference.sigma_rad.cwiseAbs2()).cwiseSqrt();
  }
  return summed_up(std::move(errors), reference.kind, epoch, limit_rad);
}

AttitudeEvaluation summed_up(AttitudeErrors errors, ReferenceKind reference, Time epoch, double limit_rad) {
  AttitudeEvaluation result;
  result.reference = reference;
  result.errors = std::move(errors);
  result.whole = statistics(result.errors);
  result.stretches = statistics_by_stretch(result.errors, epoch, kEvaluatedStretch);
  result.limit_rad = limit_rad;
  result.intervals = correction_intervals(result.errors, limit_rad);
  return result;
}

AttitudeEvaluation evaluate_attitude(const Pass& pass, const AttitudeHistory& attitude, const Truth* truth,
                                     double limit_rad) {
  return evaluate_against(best_reference(pass.settings, truth, pass.star_tracker), attitude, pass.settings.epoch,
                          limit_rad);
}

AttitudeEvaluation evaluate_navigation(const Pass& pass, const NavigationRun& run, const Truth* truth,
                                       double limit_rad) {
  return evaluate_against(best_reference(pass.settings, truth, used_fixes(pass, run.fixes)), run.attitude,
                          pass.settings.epoch, limit_rad);
}

IntervalExtension extension_between(const AttitudeEvaluation& known_before, const AttitudeEvaluation& calibrated) {
  IntervalExtension extension{paired(known_before.intervals, calibrated.intervals), {}};
  extension.median = median_extension(extension.pairs);
  return extension;
}

}  // namespace trihedron::ground
