#include "onboard/screen.hpp"

#include <utility>

#include "model/drift_on_board.hpp"
#include "model/prior.hpp"
#include "model/setup.hpp"
#include "trihedron/ground/onboard/replay.hpp"

namespace trihedron::ground {

CalibrationOptions without_further_states(CalibrationOptions options) {
  options.drift_model = kEsg7;
  options.further_states = FurtherStateOptions::none();
  return options;
}

bool OnBoardRun::is_of(const PassSettings& settings, const CalibrationOptions& options) const {
  const CalibrationOptions& its = pipeline.options();
  const Layout layout = layout_of(settings, options);
  return options.estimator == its.estimator && layout == pipeline.layout() &&
         options.direction_random_walk_rad_sqrt_s == its.direction_random_walk_rad_sqrt_s &&
         options.star_tracker_noise_rad == its.star_tracker_noise_rad &&
         prior_of(settings, layout).covariance == prior_of(pipeline.settings(), layout).covariance;
}

Screened screen(const Pass& pass, const CalibrationOptions& asked, bool keep_run) {
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
  if (options.estimator == Estimator::kBatch) {
    options.estimator = Estimator::kInvariant;
  }
  Pipeline pipeline(pass.settings, options, Pipeline::Steps::kOverSamples, keep_run);
  Recorder recorder;
  Screened screened{ScreenedPass(pass.gyro, pipeline.layout().gyros), {}, {}};
  replay(pass, pipeline, [&](const StepReport& report) {
    screened.pass.add_fix(report);
    if (report.sample != SampleStatus::kNone) {
      screened.pass.add_sample(report);
    }
    if (keep_run) {
      recorder.add(report, pipeline);
    }
  });
  screened.pass.keep_longest();
  screened.first = pipeline.gyros();
  if (keep_run) {
    screened.run.emplace(OnBoardRun{std::move(pipeline), std::move(recorder)});
  }
  return screened;
}

}  // namespace trihedron::ground
