#include "calibrate/contradicted_fixes.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

#include "batch/pass_setup.hpp"
#include "batch/refine.hpp"
#include "trihedron/ground/onboard/replay.hpp"

namespace trihedron::ground {
namespace {

/// Where more than this part of the fixes is contradicted by the others, it is not the star tracker that was wrong for
/// a while.
constexpr double kFew = 0.2;

long times_set_free(const OnBoardRun& run) {
  Statistics statistics;
  add_statistics(run.recorder.run().fixes, statistics);
  return statistics.reopened;
}

/// Runs of outliers of one star tracker, `fixes` in the order of their times.
std::vector<FixRecord> runs_of_outliers(std::vector<FixRecord> fixes) {
  std::ranges::stable_sort(fixes, {}, &FixRecord::head);
  std::vector<FixRecord> found;
  for (auto begin = fixes.begin(); begin != fixes.end();) {
    const auto end = std::find_if_not(begin, fixes.end(), [&](const FixRecord& fix) {
      return fix.head == begin->head && fix.status == FixStatus::kRejectedByGate;
    });
    if (end - begin >= Statistics::kInARow) {
      found.insert(found.end(), begin, end);
    }
    begin = std::max(end, std::next(begin));
  }
  std::ranges::stable_sort(found, {}, &FixRecord::t);
  return found;
}

/// Empty where least squares cannot tell.
std::vector<FixRecord> contradicted(const Pass& pass, const PassSettings& settings, Decision& decision,
                                    std::vector<FixRecord> fixes) {
  CalibrationOptions options = decision.options;
  options.drift_field = options.definitive_attitude = false;
  if (!decision.screened) {
    decision.screened = screen(pass, options);
  }
  const ScreenedPass& screened = decision.screened->pass;
  if (screened.clock_set_back || screened.fixes.empty()) {
    return {};
  }
  Refinement(*decision.screened, pass_setup(settings, options), options, {}, decision.nearby).judge(fixes);
  std::vector<FixRecord> found = runs_of_outliers(std::move(fixes));
  for (FixRecord& fix : found) {
    fix.jumped = true;
    fix.corrected_navigator = false;
  }
  return found;
}

void leave_out(const std::vector<FixRecord>& fixes, int head, StarTrackerTelemetry& telemetry) {
  StarTrackerTelemetry kept;
  for (std::size_t i = 0; i < telemetry.size(); ++i) {
    const auto same = std::ranges::equal_range(fixes, telemetry.t[i], {}, &FixRecord::t);
    if (std::ranges::any_of(same, [head](const FixRecord& fix) { return fix.head == head; })) {
      continue;
    }
    kept.add(telemetry, i);
  }
  telemetry = std::move(kept);
}

Pass without(const std::vector<FixRecord>& fixes, Pass pass) {
  for (std::size_t head = 0; head <= pass.further_star_trackers.size(); ++head) {
    leave_out(fixes, static_cast<int>(head), pass.fixes_of(head));
  }
  return pass;
}

}  // namespace

std::vector<FixRecord> fly_without_contradicted(const Pass& pass, const PassSettings& settings,
                                                const CalibrationOptions& flown, Decision& decision, OnBoardRun& run) {
  const long set_free = times_set_free(run);
  if (set_free == 0) {
    return {};
  }
  std::vector<FixRecord> fixes = contradicted(pass, settings, decision, run.recorder.run().fixes);
  const auto all = static_cast<double>(run.recorder.run().fixes.size());
  if (fixes.empty() || static_cast<double>(fixes.size()) > kFew * all) {
    return {};
  }
  OnBoardRun again{Pipeline(settings, flown, Pipeline::Steps::kOverSamples), {}};
  replay(without(fixes, pass), again.pipeline,
         [&](const StepReport& report) { again.recorder.add(report, again.pipeline); });
  if (!again.pipeline.started() || times_set_free(again) >= set_free) {
    return {};
  }
  run = std::move(again);
  return fixes;
}

void put_into(std::vector<FixRecord>& fixes, std::vector<FixRecord> others) {
  if (others.empty()) {
    return;
  }
  std::ranges::move(others, std::back_inserter(fixes));
  std::ranges::stable_sort(fixes, {}, &FixRecord::t);
}

}  // namespace trihedron::ground
