#include "decisions.hpp"

#include <fmt/format.h>

#include "summary.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/records/drift_models.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {

void log_pass(const Log& log, const std::string& path, const io::LoadedPass& loaded) {
  log.say(fmt::format("read {}: {} gyros with {} samples, {} fixes", path, loaded.pass.gyro.gyros,
                      loaded.pass.gyro.size(), loaded.pass.star_tracker.size()));
  for (const io::Defect& defect : loaded.defects) {
    log.say(defect.text());
  }
}

void log_settings(const Log& log, const CalibrationOptions& options) { log.say(io::format_config(options)); }

void log_verdict(const Log& log, const Verdict& verdict) {
  for (const Finding& finding : verdict.findings) {
    log.say(
        fmt::format("{}: {} Evidence: {}. {}", name_of(finding.code), finding.text, finding.evidence, finding.cure));
  }
  log.say(fmt::format("verdict: {}", verdict.trustworthy ? "trustworthy" : "do not use"));
}

void log_run(const Log& log, const CalibrationRun& run) {
  for (const Evidence& evidence : run.evidence) {
    log.say(fmt::format("{} is {}: ln of the Bayes factor for estimating it is {}", evidence.key(), evidence.outcome(),
                        figure("{:+.1f}", evidence.log_bayes_factor)));
  }
  const DriftModelId& used = run.calibration.gyros.front().drift_model;
  for (const DriftModelForecast& model : run.drift_models) {
    log.say(fmt::format("drift model {}: forecast error {}, ln likelihood {}", name_of(model.drift_model),
                        angle_text(model.open_loop_rms_rad), figure("{:+.1f}", model.log_likelihood)));
  }
  log.say(fmt::format("drift model {} is used", name_of(used)));
  log.say(fmt::format("random walk of each momentum {} rad/s^0.5, {}",
                      figure("{:.2e}", run.options.direction_random_walk_rad_sqrt_s),
                      run.options.find_noise ? "found from the pass" : "as given"));
  if (const auto& noise = run.options.star_tracker_noise_rad) {
    log.say(fmt::format("noise of the star tracker {} {} {}, found from the pass", angle_text(noise->x()),
                        angle_text(noise->y()), angle_text(noise->z())));
  }
  for (const NamedCount& its : named_counts(run.fix_counts)) {
    log.say(fmt::format("fixes {}: {}", its.name, its.count));
  }
  for (const NamedCount& its : named_counts(run.samples)) {
    log.say(fmt::format("samples {}: {}", its.name, its.count));
  }
  log_verdict(log, run.calibration.verdict);
}

}  // namespace trihedron::cli
