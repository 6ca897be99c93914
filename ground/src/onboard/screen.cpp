#include "onboard/screen.hpp"

#include "model/drift_on_board.hpp"
#include "trihedron/ground/onboard/replay.hpp"

namespace trihedron::ground {

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
    // Of a larger one the rest would not be seen by the gates.
    if (options.drift_model->degree > DriftModelId::kMaxDegreeOnBoard) {
      options.drift_model = vsh(DriftModelId::kMaxDegreeOnBoard);
    }
  }
  options.drift_field = false;
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
