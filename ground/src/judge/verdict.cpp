#include "trihedron/ground/judge/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "judge/changes.hpp"
#include "judge/clocks.hpp"
#include "judge/contradictions.hpp"
#include "judge/drift.hpp"
#include "judge/drift_left.hpp"
#include "judge/findings.hpp"
#include "judge/fixes.hpp"
#include "judge/gyros.hpp"
#include "judge/need.hpp"
#include "judge/noise_by_rate.hpp"
#include "judge/not_shown.hpp"
#include "judge/parameters.hpp"

namespace trihedron::ground {
namespace {

/// The paper: alignment settles within one orbit.
constexpr double kOneOrbit_s = 90 * 60;

void judge_length(const Pass& pass, std::vector<Finding>& findings) {
  const double span_s = to_seconds(pass.gyro.t.back() - pass.gyro.t.front());
  if (span_s < kOneOrbit_s) {
    add(findings, FindingCode::kShortPass,
        "The pass is shorter than one orbit: alignment and drift coefficients are not yet separated.",
        fmt::format("{:.1f} min of telemetry", span_s / 60),
        "Calibrate by a pass of three orbits: alignment takes about one, drift coefficients two to three.");
  }
}

void judge_batch(const Statistics& statistics, std::vector<Finding>& findings) {
  if (!statistics.batch_converged.value_or(true)) {
    add(findings, FindingCode::kBatchNotConverged,
        "Least squares over the whole pass did not settle: its values are those of the last step.",
        fmt::format("{} iterations", statistics.batch_iterations.value_or(0)),
        "Use estimator invariant, and look for a model that does not hold over the whole pass.");
  }
}

void judge_unused_sensors(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  const auto used = static_cast<int>(run.calibration.gyros.size());
  if (pass.gyro.gyros > used) {
    add(findings, FindingCode::kGyrosNotUsed,
        fmt::format("Estimator {} works on a pair: gyros beyond the first {} were not used.",
                    name_of(run.options.estimator), used),
        fmt::format("{} gyros in the telemetry", pass.gyro.gyros), "Put the pair you want first.");
  }
  const bool second = std::ranges::any_of(run.calibration.further, [](const FurtherEstimate& state) {
    return state.parameter.is_further(FurtherState::kStarTrackerAlignment);
  });
  const std::size_t heads = second ? 2 : 1;
  if (1 + pass.further_star_trackers.size() > heads) {
    add(findings, FindingCode::kStarTrackersNotUsed,
        fmt::format("Estimator {} of {} gyros works with {} star tracker{}: those beyond were not used.",
                    name_of(run.options.estimator), used, heads, second ? "s" : ""),
        fmt::format("{} star trackers in the telemetry", 1 + pass.further_star_trackers.size()),
        "Put those that you want first.");
  }
}

}  // namespace

Verdict judge(const Pass& pass, const CalibrationRun& run) {
  std::vector<Finding> findings;
  const Statistics& statistics = run.calibration.statistics;
  judge_number_of_fixes(statistics, findings);
  judge_length(pass, findings);
  judge_rejections(statistics, findings);
  judge_nis(statistics, "its model is incomplete or the noise is understated", findings);
  judge_noise(pass, run, findings);
  judge_told_covariances(run.fixes, pass.settings.epoch, findings);
  judge_bursts(run.bursts, findings);
  judge_readout_noise(run.readout_noise, findings);
  judge_correlated_fixes(run.correlated_fixes, findings);
  judge_whiteness(pass, run, findings);
  judge_shape_of_errors(pass, run, findings);
  judge_drift_left(pass, run, findings);
  judge_drift_model(run, findings);
  judge_change(run, findings);
  judge_changes(run, findings);
  judge_halves(run, findings);
  judge_clocks(pass, run, findings);
  judge_at_orbital_period(run, findings);
  judge_field_or_error(run, findings);
  judge_polhodes(run, findings);
  judge_beside_outages(run.beside_outages, findings);
  judge_determination(run, findings);
  judge_priors(pass, run, findings);
  judge_steadiness(pass, run, findings);
  judge_pair(run, findings);
  judge_star_tracker(statistics, findings);
  judge_contradictions(run.fixes, run.gyro_events, pass.settings.epoch, findings);
  judge_noise_by_rate(pass, run, findings);
  judge_what_is_not_shown(run, findings);
  judge_batch(statistics, findings);
  judge_gyros(pass, run.gyro_events, static_cast<int>(run.calibration.gyros.size()),
              " Without it there is no pair at the end of the pass, and no attitude but at fixes.", findings);
  judge_gyro_rate(pass, run, findings);
  judge_unused_sensors(pass, run, findings);
  judge_need(run.calibration.forecast, findings);
  return verdict_of(std::move(findings));
}

Verdict judge_use_of_fixes(const Statistics& statistics) {
  std::vector<Finding> findings;
  judge_number_of_fixes(statistics, findings);
  judge_rejections(statistics, findings);
  return verdict_of(std::move(findings));
}

}  // namespace trihedron::ground
