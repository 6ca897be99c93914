#include "summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <system_error>

#include "trihedron/ground/judge/verdict.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {
namespace {

nlohmann::ordered_json axes_json(const Eigen::Vector3d& rad) {
  return {{"roll_rad", rad.x()}, {"pitch_rad", rad.y()}, {"heading_rad", rad.z()}};
}

nlohmann::ordered_json errors_json(const ground::ErrorStatistics& s, Time epoch) {
  nlohmann::ordered_json json = {
      {"from_s", to_seconds(s.from - epoch)}, {"to_s", to_seconds(s.to - epoch)}, {"epochs", s.count},
      {"rms", axes_json(s.rms_rad)},          {"max", axes_json(s.max_rad)},      {"max_total_rad", s.max_total_rad}};
  if (s.normalised_square) {
    json["normalised_square"] = *s.normalised_square;
  }
  return json;
}

nlohmann::ordered_json interval_json(const ground::CorrectionInterval& interval) {
  nlohmann::ordered_json json = {{"observed_s", to_seconds(interval.observed)},
                                 {"max_total_rad", interval.max_total_rad}};
  json["passed_limit_after_s"] = interval.passed ? nlohmann::ordered_json(to_seconds(*interval.passed)) : nullptr;
  return json;
}

}  // namespace

std::string figure(fmt::format_string<const double&> format, double value) {
  return std::isfinite(value) ? fmt::vformat(format, fmt::make_format_args(value)) : std::string(kNoEntry);
}

namespace {

std::string signed_angle_text(double rad, AngleUnit unit) { return (rad > 0 ? "+" : "") + angle_text(rad, unit); }

/// One unit for a column of a table of errors.
template <class Value>
AngleUnit unit_of_column(const ground::AttitudeEvaluation& evaluation, const Value& value) {
  std::vector<double> column;
  for (const ground::ErrorStatistics& stretch : evaluation.stretches) {
    column.push_back(value(stretch));
  }
  return unit_of_angles(column);
}

std::string residuals_text(const Statistics& statistics) {
  if (!statistics.nis_mean) {
    return "Residuals   none: no fix was judged\n";
  }
  std::string text = "Residuals   rms";
  for (const double rms_rad : statistics.innovation_rms_rad) {
    text += " " + angle_text(rms_rad);
  }
  return text + fmt::format("; mean NIS {} ({:.0f} expected)\n", figure("{:.3f}", *statistics.nis_mean),
                            statistics.nis_degrees_of_freedom);
}

}  // namespace

std::string pass_text(const io::LoadedPass& loaded) {
  const PassSettings& settings = loaded.pass.settings;
  std::string text;
  auto out = std::back_inserter(text);
  fmt::format_to(out, "Pass        {}, {} TAI, {:.1f} min\n", printable(settings.spacecraft),
                 io::format_epoch(settings.epoch), minutes(settings.duration));
  fmt::format_to(out, "Telemetry   {} samples of {} gyros, {} fixes{}\n", loaded.pass.gyro.size(),
                 loaded.pass.gyro.gyros, loaded.pass.star_tracker.size(),
                 loaded.pass.further_star_trackers.empty() ? "" : " of the first star tracker");
  for (std::size_t i = 0; i < loaded.pass.further_star_trackers.size(); ++i) {
    fmt::format_to(out, "            {} fixes of star tracker {}\n", loaded.pass.further_star_trackers[i].size(),
                   i + 2);
  }
  for (const io::Defect& defect : loaded.defects) {
    fmt::format_to(out, "            {}\n", printable(defect.text()));
  }
  return text;
}

bool any_is_there(const std::vector<std::filesystem::path>& files_of_pass) {
  return std::ranges::any_of(files_of_pass, [](const std::filesystem::path& file) {
    std::error_code ignored;
    return std::filesystem::exists(file, ignored);
  });
}

std::string written_pass_text(const std::string& path, bool was_there) {
  return fmt::format("Written     {}{}\n", printable(path), was_there ? ", in place of the pass that was there" : "");
}

std::string clocks_text(const std::optional<Clocks>& clocks, const Pass& pass) {
  const int gyros = pass.gyro.gyros;
  const Time epoch = pass.settings.epoch;
  if (!clocks) {
    return "Clocks      not shown by this pass: the body turns too evenly, or the pass is too short\n";
  }
  std::string text = fmt::format(
      "Clocks      fixes were taken {:+.4f} s ± {:.2f} ms after their stamp in the middle of the pass; {:+.4g} "
      "± "
      "{:.2g} ppm\n",
      clocks->mid_offset_s.value, 1e3 * clocks->mid_offset_s.sigma, 1e6 * clocks->rate_s_s.value,
      1e6 * clocks->rate_s_s.sigma);
  for (int k = 0; k < gyros; ++k) {
    if (k != clocks->reference) {
      text +=
          fmt::format("            gyro {} is stamped {:+.2f} ± {:.2f} ms late against gyro {}; {:+.4g} ± {:.2g} ppm\n",
                      k + 1, 1e3 * clocks->late_s[k].value, 1e3 * clocks->late_s[k].sigma, clocks->reference + 1,
                      1e6 * clocks->late_rate_s_s[k].value, 1e6 * clocks->late_rate_s_s[k].sigma);
    }
  }
  if (clocks->step) {
    const ClockStep& step = *clocks->step;
    text +=
        fmt::format("            between t = {:.0f} s and {:.0f} s {} {:+.2f} ± {:.2f} ms later than over the rest\n",
                    to_seconds(step.from - epoch), to_seconds(step.until - epoch),
                    step.gyro < 0 ? std::string("fixes were taken") : fmt::format("gyro {} is stamped", step.gyro + 1),
                    1e3 * step.change_s.value, 1e3 * step.change_s.sigma);
  }
  return text;
}

std::string finding_text(const Finding& finding) {
  return fmt::format("  {:<19} {}\n{:22}{}\n{:22}→ {}\n", name_of(finding.code), finding.text, "", finding.evidence, "",
                     finding.cure);
}

namespace {

const char* word_of(const Verdict& verdict) { return verdict.trustworthy ? "trustworthy" : "DO NOT USE"; }

std::string need_text(const NeedForecast& need) {
  return fmt::format("{} is {}met", in_words(need.need), need.met ? "" : "not ");
}

}  // namespace

std::string verdict_line(const Calibration& calibration) {
  std::vector<std::string> parts;
  for (const Finding& finding : calibration.verdict.findings) {
    if (finding.severity == Finding::Severity::kDoNotUse) {
      parts.emplace_back(name_of(finding.code));
    }
  }
  if (calibration.forecast) {
    const OpenLoopForecast& forecast = *calibration.forecast;
    if (forecast.need && forecast.need->met) {
      parts.push_back("the need of " + need_text(*forecast.need));
    }
    // What is predicted by a model that is wrong says nothing.
    if (calibration.verdict.trustworthy) {
      parts.push_back(in_words(forecast.usual));
    } else if (forecast.need && parts.size() == 1 && !forecast.need->met) {
      parts.push_back(in_words(forecast.need->accuracy));
    }
  }
  if (const auto& determined = calibration.determined; determined && determined->coefficients < determined->of) {
    parts.push_back(fmt::format("{} of {} drift coefficients not determined", determined->of - determined->coefficients,
                                determined->of));
  }
  if (calibration.verdict.trustworthy && calibration.verdict.has(FindingCode::kWeakAlignmentAxis)) {
    parts.emplace_back("alignment about one axis not determined");
  }
  return fmt::format("Verdict     {}{}{}\n", word_of(calibration.verdict), parts.empty() ? "" : ": ",
                     fmt::join(parts, "; "));
}

std::string forecast_text(const std::optional<OpenLoopForecast>& forecast) {
  if (!forecast) {
    return {};
  }
  std::string text = fmt::format("Readiness   {}\n", in_words(forecast->usual));
  if (forecast->need) {
    text += fmt::format("            the need of {}: predicted {} by then\n", need_text(*forecast->need),
                        angle_text(forecast->need->error_997_rad));
  }
  return text;
}

nlohmann::ordered_json readiness_json(const std::optional<OpenLoopForecast>& forecast) {
  if (!forecast) {
    return nullptr;
  }
  nlohmann::ordered_json json = {{"limit_rad", forecast->usual.limit_rad},
                                 {"time_s", to_seconds(forecast->usual.within)},
                                 {"is_lower_bound", forecast->usual.is_lower_bound}};
  if (forecast->need) {
    json["need_met"] = forecast->need->met;
  }
  return json;
}

std::string findings_text(const Verdict& verdict) {
  std::string text;
  for (const Finding& finding : verdict.findings) {
    text += finding_text(finding);
  }
  return text.empty() ? text : "Findings\n" + text;
}

std::string verdict_text(const Verdict& verdict) {
  std::string text = fmt::format("Verdict     {}\n", word_of(verdict));
  for (const Finding& finding : verdict.findings) {
    text += finding_text(finding);
  }
  return text;
}

std::string calibration_text(const CalibrationRun& run, const Eigen::VectorXd& estimate_minus_truth) {
  std::string text;
  auto out = std::back_inserter(text);
  const Calibration& calibration = run.calibration;
  const bool has_truth = estimate_minus_truth.size() > 0;
  Eigen::Index state = 0;
  for (std::size_t k = 0; k < calibration.gyros.size(); ++k) {
    const GyroCalibration& gyro = calibration.gyros[k];
    fmt::format_to(out, "\nGyro {}      {:>18} {:>12}{}\n", k + 1, "value", "1σ", has_truth ? "   est. − true" : "");
    const auto sigma = [&] { return sigma_of(calibration, calibration.states[static_cast<std::size_t>(state)]); };
    const std::vector<std::string> names = coefficient_names(gyro.drift_model);
    const std::vector<DriftCoefficient> coefficients = coefficients_of(gyro.drift_model);
    for (std::size_t i = 0; i < gyro.drift_rad_s.size(); ++i, ++state) {
      if (!calibration.drift_field.empty() && !coefficients[i].is_in_eq1()) {
        continue;
      }
      fmt::format_to(out, "  {:<8} {:>13} rad/s {:>12}", names[i], figure("{:+.4e}", gyro.drift_rad_s[i]),
                     figure("{:.1e}", sigma()));
      if (has_truth && std::isfinite(estimate_minus_truth(state))) {
        fmt::format_to(out, " {:>+13.1e}", estimate_minus_truth(state));
      }
      text += '\n';
    }
    const Eigen::Vector3d lambda = gyro.alignment_rotation_vector_rad;
    const std::array<double, 3> sigmas = {
        sigma_of(calibration, calibration.states[static_cast<std::size_t>(state)]),
        sigma_of(calibration, calibration.states[static_cast<std::size_t>(state) + 1]),
        sigma_of(calibration, calibration.states[static_cast<std::size_t>(state) + 2])};
    const AngleUnit unit = unit_of_angles({lambda.data(), 3});
    const AngleUnit sigma_unit = unit_of_angles(sigmas);
    for (int axis = 0; axis < 3; ++axis, ++state) {
      fmt::format_to(out, "  align_{:<2} {:>13} {}     {:>12}", std::string(1, "xyz"[axis]),
                     figure("{:+.4f}", lambda(axis) / unit.rad), unit.symbol, angle_text(sigma(), sigma_unit));
      if (has_truth) {
        fmt::format_to(out, " {:>13}", signed_angle_text(estimate_minus_truth(state), sigma_unit));
      }
      text += '\n';
    }
  }
  const Statistics& statistics = calibration.statistics;
  std::size_t width = 24;
  for (const FurtherEstimate& estimate : calibration.further) {
    width = std::max(width, name_of(estimate.parameter).size());
  }
  for (const FurtherEstimate& estimate : calibration.further) {
    fmt::format_to(out, "{}  {:<{}} {:>13} {:>12}\n",
                   &estimate == calibration.further.data() ? "\nFurther states\n" : "", name_of(estimate.parameter),
                   width, figure("{:+.4e}", estimate.value), figure("{:.1e}", estimate.sigma));
  }
  for (const DriftFieldLevel& level : calibration.drift_field) {
    fmt::format_to(out, "{}  gyro {} {}, degree {}     {:>13} rad/s, to a factor of {:.2g}\n",
                   &level == calibration.drift_field.data() ? "\nDrift field, rms of each degree\n" : "",
                   level.gyro + 1, level.potential == DriftCoefficient::Member::kW ? 'W' : 'D', level.degree,
                   figure("{:.1e}", level.rms_rad_s), level.sigma_factor);
  }
  for (const Evidence& evidence : run.evidence) {
    fmt::format_to(out, "{}  {:<24} ln Bayes factor {:>9}: {}\n",
                   &evidence == run.evidence.data() ? "\nEvidence\n" : "", evidence.key(),
                   figure("{:+.1f}", evidence.log_bayes_factor), evidence.outcome());
  }
  for (const DriftModelForecast& model : run.drift_models) {
    fmt::format_to(out, "{}  {:<8} {:>4} coefficients, forecast error {:>9}, ln likelihood {:>10}{}\n",
                   &model == run.drift_models.data() ? "\nDrift models, by forecasts of the rest of the pass\n" : "",
                   name_of(model.drift_model), model.drift_model.size(), angle_text(model.open_loop_rms_rad),
                   figure("{:+.1f}", model.log_likelihood),
                   model.drift_model == calibration.gyros[0].drift_model ? ", used" : "");
  }
  text += "\nFixes      ";
  for (const NamedCount& its : named_counts(run.fix_counts)) {
    fmt::format_to(out, " {} {};", its.count, its.name);
  }
  if (run.beside_outages) {
    fmt::format_to(out, " {} beside outages, not used;", run.beside_outages->fixes);
  }
  for (const CorrelatedFixes& its : run.correlated_fixes) {
    fmt::format_to(out, " {} of star tracker {} with errors like those used, not used;", its.left_out, its.head + 1);
  }
  text.back() = '\n';
  text += "Samples    ";
  for (const NamedCount& its : named_counts(run.samples)) {
    fmt::format_to(out, " {} {};", its.count, its.name);
  }
  text.back() = '\n';
  if (!run.gyro_events.empty()) {
    fmt::format_to(out, "Gyros       {}\n", fmt::join(ground::texts_of(run.gyro_events, calibration.epoch), "; "));
  }
  if (const long looks = statistics.angle_looks.value_or(0); looks > 0) {
    fmt::format_to(out, "Angles      between the momenta taken {} times, where no fix could be used\n", looks);
  }
  text += residuals_text(statistics);
  fmt::format_to(out, "Noise       random walk of each momentum {:.1e} rad/√s, {}",
                 run.options.direction_random_walk_rad_sqrt_s, run.options.find_noise ? "the most likely" : "as given");
  const FurtherStateOptions& states = run.options.further_states;
  if (states.is_on(FurtherState::kWanderingDrift)) {
    fmt::format_to(out, "; drift that wanders by {:.1e} rad/s over {:.0f} min", states.wandering_drift_rad_s,
                   to_seconds(states.wandering_time) / 60);
  }
  if (const auto& noise = run.options.star_tracker_noise_rad) {
    fmt::format_to(out, "; star tracker {} {} {}, not as in pass.toml", angle_text(noise->x()), angle_text(noise->y()),
                   angle_text(noise->z()));
  }
  text += '\n';
  return text;
}

std::string extension_text(const std::optional<ground::Extension>& extension) {
  return extension
             ? fmt::format("{}{} times", extension->is_lower_bound ? "≥ " : "", figure("{:.3g}", extension->factor))
             : "none measured";
}

std::string course_text(const CalibrationRun& run, const ground::CalibrationEvaluation& evaluation) {
  const auto settled = [](const std::optional<Duration>& time) {
    return time ? fmt::format("after {:.0f} min", minutes(*time)) : "not yet";
  };
  std::string text = fmt::format("Settled     alignment {}, drift coefficients {} (the paper: 90, 200–300)\n",
                                 settled(evaluation.alignment_settled), settled(evaluation.drift_settled));
  if (evaluation.extension.pairs.empty()) {
    return text;
  }
  auto out = std::back_inserter(text);
  fmt::format_to(out, "\nOpen loop until the error passes {}, from a correction with\n  {:>13} {:>14} {:>14} {:>12}\n",
                 angle_text(evaluation.limit_rad), "at, min", "known before", "calibrated", "extended");
  const auto interval = [](const ground::CorrectionInterval& i) {
    return i.passed ? fmt::format("{:.1f} min", minutes(*i.passed)) : fmt::format("> {:.0f} min", minutes(i.observed));
  };
  for (const ground::IntervalPair& pair : evaluation.extension.pairs) {
    const auto& [before, after] = pair;
    const auto factor = pair.extension();
    if (after.observed > Duration::zero()) {
      fmt::format_to(out, "  {:>13.0f} {:>14} {:>14} {:>12}\n", minutes(after.corrected - run.calibration.epoch),
                     interval(before), interval(after),
                     factor ? fmt::format("{}{}", after.passed ? "" : "≥ ", figure("{:.3g}", *factor)) : "");
    }
  }
  fmt::format_to(out, "  correction interval extended {} (the paper: 3–5)\n",
                 extension_text(evaluation.extension.median));
  return text;
}

std::string evaluation_text(const ground::AttitudeEvaluation& evaluation, Time epoch, const std::string& title) {
  std::string text =
      fmt::format("{} against the {}{}\n", title, name_of(evaluation.reference),
                  evaluation.reference == ground::ReferenceKind::kTruth ? "" : ", whose errors are in the figures");
  auto out = std::back_inserter(text);
  if (evaluation.errors.t.empty()) {
    return text + "  no common epochs\n";
  }
  fmt::format_to(out, "  {:>13} {:>10} {:>10} {:>10} {:>12} {:>13}\n", "minutes", "roll rms", "pitch rms", "head. rms",
                 "largest", "(error/σ)²");
  const auto rms_unit = unit_of_column(evaluation, [](const auto& s) { return s.rms_rad.maxCoeff(); });
  const auto largest_unit = unit_of_column(evaluation, [](const auto& s) { return s.max_total_rad; });
  const auto row = [&](const std::string& name, const ground::ErrorStatistics& s) {
    fmt::format_to(out, "  {:>13} {:>10} {:>10} {:>10} {:>12} {:>13}\n", name, angle_text(s.rms_rad.x(), rms_unit),
                   angle_text(s.rms_rad.y(), rms_unit), angle_text(s.rms_rad.z(), rms_unit),
                   angle_text(s.max_total_rad, largest_unit),
                   s.normalised_square ? figure("{:.2f}", *s.normalised_square) : "");
  };
  for (const auto& s : evaluation.stretches) {
    row(fmt::format("{:.0f} … {:.0f}", minutes(s.from - epoch), minutes(s.to - epoch)), s);
  }
  row("all", evaluation.whole);
  constexpr std::size_t kListed = 20;
  if (evaluation.intervals.size() > kListed) {
    fmt::format_to(out, "  corrected {} times\n", evaluation.intervals.size());
    return text;
  }
  for (const auto& interval : evaluation.intervals) {
    fmt::format_to(out, "  corrected at {:>6.1f} min: {}, largest {}\n", minutes(interval.corrected - epoch),
                   interval.passed ? fmt::format("passed {} after {:.1f} min", angle_text(evaluation.limit_rad),
                                                 minutes(*interval.passed))
                                   : fmt::format("within {} for all of {:.1f} min", angle_text(evaluation.limit_rad),
                                                 minutes(interval.observed)),
                   angle_text(interval.max_total_rad));
  }
  return text;
}

std::string passes_text(const std::vector<ground::PassAlone>& passes) {
  std::string text =
      fmt::format("Passes      {}, taken for one start-up; each compared with those before:\n", passes.size());
  for (const ground::PassAlone& pass : passes) {
    const Calibration& calibration = pass.run.calibration;
    auto out = std::back_inserter(text);
    fmt::format_to(out, "  {:<16} {}  {}\n", printable(pass.name), io::format_epoch(calibration.epoch),
                   calibration.verdict.trustworthy ? "trustworthy alone" : "alone not to be used");
    if (&pass != passes.data()) {
      fmt::format_to(out, "    coefficients   {}\n    alignments     {}\n", pass.coefficients.text(),
                     pass.alignments.text());
    }
  }
  return text + "The last pass, from those before:\n";
}

nlohmann::ordered_json agreement_json(const ground::Agreement& agreement) {
  return {{"chi_square", agreement.chi_square},
          {"degrees_of_freedom", agreement.degrees_of_freedom},
          {"limit", agreement.limit},
          {"holds", agreement.holds()}};
}

nlohmann::ordered_json passes_json(const std::vector<ground::PassAlone>& passes) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const ground::PassAlone& pass : passes) {
    const Calibration& calibration = pass.run.calibration;
    json.push_back({{"name", pass.name},
                    {"epoch_tai", io::format_epoch(calibration.epoch)},
                    {"verdict", verdict_json(calibration.verdict)}});
    if (&pass != passes.data()) {
      json.back()["coefficients"] = agreement_json(pass.coefficients);
      json.back()["alignments"] = agreement_json(pass.alignments);
    }
  }
  return json;
}

nlohmann::ordered_json statistics_json(const Statistics& statistics) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const auto& [name, value] : named_values(statistics)) {
    json[name] = value;
  }
  return json;
}

nlohmann::ordered_json pass_json(const io::LoadedPass& loaded) {
  const PassSettings& settings = loaded.pass.settings;
  nlohmann::ordered_json json = {
      {"spacecraft", settings.spacecraft},           {"epoch_tai", io::format_epoch(settings.epoch)},
      {"duration_s", to_seconds(settings.duration)}, {"gyros", loaded.pass.gyro.gyros},
      {"gyro_samples", loaded.pass.gyro.size()},     {"fixes", loaded.pass.star_tracker.size()},
      {"defects", nlohmann::ordered_json::array()}};
  for (const StarTrackerTelemetry& fixes : loaded.pass.further_star_trackers) {
    json["fixes_of_further_star_trackers"].push_back(fixes.size());
  }
  for (const io::Defect& defect : loaded.defects) {
    nlohmann::ordered_json item = {
        {"kind", io::name_of(defect.kind)}, {"where", defect.where}, {"count", defect.count}};
    item["text"] = defect.text();
    json["defects"].push_back(item);
  }
  return json;
}

nlohmann::ordered_json clocks_json(const std::optional<Clocks>& clocks, const Pass& pass) {
  const int gyros = pass.gyro.gyros;
  if (!clocks) {
    return nullptr;
  }
  nlohmann::ordered_json late_s = nlohmann::ordered_json::array();
  nlohmann::ordered_json late_sigma_s = nlohmann::ordered_json::array();
  nlohmann::ordered_json late_rate_s_s = nlohmann::ordered_json::array();
  nlohmann::ordered_json late_rate_sigma_s_s = nlohmann::ordered_json::array();
  for (int k = 0; k < gyros; ++k) {
    late_s.push_back(clocks->late_s[k].value);
    late_sigma_s.push_back(clocks->late_s[k].sigma);
    late_rate_s_s.push_back(clocks->late_rate_s_s[k].value);
    late_rate_sigma_s_s.push_back(clocks->late_rate_s_s[k].sigma);
  }
  nlohmann::ordered_json json = {{"mid_offset_s", clocks->mid_offset_s.value},
                                 {"mid_offset_sigma_s", clocks->mid_offset_s.sigma},
                                 {"offset_s", clocks->offset_s.value},
                                 {"offset_sigma_s", clocks->offset_s.sigma},
                                 {"rate_s_s", clocks->rate_s_s.value},
                                 {"rate_sigma_s_s", clocks->rate_s_s.sigma},
                                 {"reference_gyro", clocks->reference + 1},
                                 {"gyros_late_s", late_s},
                                 {"gyros_late_sigma_s", late_sigma_s},
                                 {"gyros_late_rate_s_s", late_rate_s_s},
                                 {"gyros_late_rate_sigma_s_s", late_rate_sigma_s_s},
                                 {"step", nullptr}};
  if (clocks->step) {
    const ClockStep& step = *clocks->step;
    json["step"] = {{"gyro", step.gyro + 1},
                    {"from_s", to_seconds(step.from - pass.settings.epoch)},
                    {"until_s", to_seconds(step.until - pass.settings.epoch)},
                    {"change_s", step.change_s.value},
                    {"change_sigma_s", step.change_s.sigma}};
  }
  return json;
}

nlohmann::ordered_json finding_json(std::string_view code, const std::string& text, const std::string& evidence,
                                    const std::string& cure, FindingSeverity severity) {
  return {{"code", code}, {"text", text}, {"evidence", evidence}, {"cure", cure}, {"severity", name_of(severity)}};
}

nlohmann::ordered_json findings_json(const std::vector<Finding>& findings) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const Finding& finding : findings) {
    json.push_back(finding_json(name_of(finding.code), finding.text, finding.evidence, finding.cure, finding.severity));
  }
  return json;
}

nlohmann::ordered_json verdict_json(const Verdict& verdict) {
  return {{"trustworthy", verdict.trustworthy}, {"findings", findings_json(verdict.findings)}};
}

nlohmann::ordered_json extension_json(const ground::IntervalExtension& extension, Time epoch) {
  nlohmann::ordered_json json = {{"corrections", nlohmann::ordered_json::array()}, {"factor", nullptr}};
  for (const ground::IntervalPair& pair : extension.pairs) {
    json["corrections"].push_back({{"t_s", to_seconds(pair.calibrated.corrected - epoch)},
                                   {"known_before", interval_json(pair.known_before)},
                                   {"calibrated", interval_json(pair.calibrated)}});
  }
  if (extension.median) {
    json["factor"] = extension.median->factor;
    json["is_lower_bound"] = extension.median->is_lower_bound;
  }
  return json;
}

nlohmann::ordered_json course_json(const CalibrationRun& run, const ground::CalibrationEvaluation& evaluation) {
  const auto seconds = [](const std::optional<Duration>& time) {
    return time ? nlohmann::ordered_json(to_seconds(*time)) : nlohmann::ordered_json(nullptr);
  };
  nlohmann::ordered_json states = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < evaluation.convergence.size(); ++i) {
    states[name_of(run.calibration.states[i])] = {{"determined", evaluation.convergence[i].determined},
                                                  {"settled_s", seconds(evaluation.convergence[i].settled)}};
  }
  nlohmann::ordered_json models = nlohmann::ordered_json::array();
  for (const DriftModelForecast& model : run.drift_models) {
    models.push_back({{"drift_model", name_of(model.drift_model)},
                      {"coefficients", model.drift_model.size()},
                      {"log_likelihood", model.log_likelihood},
                      {"open_loop_rms_rad", model.open_loop_rms_rad}});
  }
  nlohmann::ordered_json evidence = nlohmann::ordered_json::array();
  for (const Evidence& its : run.evidence) {
    evidence.push_back({{"states", its.key()},
                        {"log_bayes_factor", its.log_bayes_factor},
                        {"accepted", its.accepted},
                        {"open_sigma", its.open_sigma ? nlohmann::ordered_json(*its.open_sigma) : nullptr}});
  }
  return {{"evidence", evidence},
          {"drift_models", models},
          {"convergence",
           {{"alignment_s", seconds(evaluation.alignment_settled)},
            {"drift_s", seconds(evaluation.drift_settled)},
            {"states", states}}},
          {"extension", extension_json(evaluation.extension, run.calibration.epoch)}};
}

nlohmann::ordered_json evaluation_json(const ground::AttitudeEvaluation& evaluation, Time epoch) {
  nlohmann::ordered_json json = {{"reference", name_of(evaluation.reference)},
                                 {"whole", errors_json(evaluation.whole, epoch)},
                                 {"per_90_min", nlohmann::ordered_json::array()},
                                 {"limit_rad", evaluation.limit_rad},
                                 {"corrections", nlohmann::ordered_json::array()}};
  for (const auto& s : evaluation.stretches) {
    json["per_90_min"].push_back(errors_json(s, epoch));
  }
  for (const auto& interval : evaluation.intervals) {
    nlohmann::ordered_json item = {{"t_s", to_seconds(interval.corrected - epoch)}};
    item.update(interval_json(interval));
    json["corrections"].push_back(item);
  }
  return json;
}

}  // namespace trihedron::cli
