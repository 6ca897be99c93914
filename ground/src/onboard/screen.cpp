#include "onboard/screen.hpp"

#include <algorithm>

#include "trihedron/ground/onboard/replay.hpp"

namespace trihedron::ground {
namespace {

/// Whether the prior of a gyro names a coefficient that eq. (1) does not have.
bool knows_of_drift_outside(const PassSettings& settings) {
  return std::ranges::any_of(settings.gyros, [](const GyroPrior& prior) {
    const auto outside = [](const auto& coefficient) { return !coefficient.first.is_in_eq1(); };
    return std::ranges::any_of(prior.drift_rad_s, outside) || std::ranges::any_of(prior.drift_sigma_rad_s, outside);
  });
}

}  // namespace

CalibrationOptions without_further_states(CalibrationOptions options) {
  options.drift_model = kEsg7;
  options.further_states = FurtherStateOptions::none();
  return options;
}

Screened screen(const Pass& pass, const CalibrationOptions& asked) {
  CalibrationOptions options = without_further_states(asked);
  const bool prior_has_more = pass.settings.prior && asked.drift_model && asked.drift_model != kEsg7;
  if (prior_has_more || (asked.drift_model != kEsg7 && knows_of_drift_outside(pass.settings))) {
    options.drift_model = asked.drift_model.value_or(kEsg20);
  }
  Pipeline pipeline(pass.settings, options, false);
  Screened screened{ScreenedPass(pass.gyro, pipeline.layout().gyros), {}};
  replay(pass, pipeline, [&](const StepReport& report) {
    screened.pass.add_fix(report);
    if (report.sample != SampleStatus::kNone) {
      screened.pass.add_sample(report);
    }
  });
  screened.pass.keep_longest();
  screened.first = pipeline.gyros();
  return screened;
}

}  // namespace trihedron::ground
