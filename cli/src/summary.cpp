#include "summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <iterator>

#include "trihedron/core/frames.hpp"
#include "trihedron/ground/judge/verdict.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::cli {
namespace {

constexpr Duration kStretch = std::chrono::minutes(90);

double minutes(Duration d) { return to_seconds(d) / 60; }

nlohmann::ordered_json axes_json(const Eigen::Vector3d& rad) {
  return {{"roll_rad", rad.x()}, {"pitch_rad", rad.y()}, {"heading_rad", rad.z()}};
}

nlohmann::ordered_json statistics_json(const ground::ErrorStatistics& s, Time epoch) {
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

std::string angle_text(double rad) {
  return std::abs(rad) < 100 * kArcsecond ? fmt::format("{:.2f}″", rad / kArcsecond)
                                          : fmt::format("{:.2f}′", rad / kArcminute);
}

std::optional<Truth> read_truth_of(const std::filesystem::path& path, const Pass& pass) {
  std::optional<Truth> truth = io::read_truth(path);
  if (truth && truth->gyros.size() != static_cast<std::size_t>(pass.gyro.gyros)) {
    throw io::InputRefused(
        path, {}, fmt::format("the truth has {} gyros, the telemetry {}", truth->gyros.size(), pass.gyro.gyros),
        "give the truth of this pass, or none");
  }
  return truth;
}

Reference reference_of(const std::optional<Truth>& truth, const StarTrackerTelemetry& fixes, const Pass& pass) {
  return truth ? Reference{"truth", truth->t, truth->q_in_c, Eigen::Vector3d::Zero()}
               : Reference{"star tracker", fixes.t, fixes.q_in_c, pass.settings.star_tracker_noise_rad};
}

Evaluation evaluate(const AttitudeHistory& attitude, const Reference& reference, Time epoch, double limit_rad) {
  Evaluation result;
  result.reference = reference.name;
  result.errors = ground::attitude_errors(attitude, reference.t, reference.q_in_c);
  for (Eigen::Vector3d& sigma : result.errors.sigma_rad) {
    sigma = (sigma.cwiseAbs2() + reference.sigma_rad.cwiseAbs2()).cwiseSqrt();
  }
  result.whole = ground::statistics(result.errors);
  result.stretches = ground::statistics_by_stretch(result.errors, epoch, kStretch);
  result.limit_rad = limit_rad;
  result.intervals = ground::correction_intervals(result.errors, limit_rad);
  return result;
}

std::string pass_text(const io::LoadedPass& loaded) {
  const PassSettings& settings = loaded.pass.settings;
  std::string text;
  auto out = std::back_inserter(text);
  fmt::format_to(out, "Pass        {}, {} TAI, {:.1f} min\n", settings.spacecraft, io::format_epoch(settings.epoch),
                 minutes(settings.duration));
  fmt::format_to(out, "Telemetry   {} samples of {} gyros, {} fixes{}\n", loaded.pass.gyro.size(),
                 loaded.pass.gyro.gyros, loaded.pass.star_tracker.size(),
                 loaded.pass.further_star_trackers.empty() ? "" : " of the first star tracker");
  for (std::size_t i = 0; i < loaded.pass.further_star_trackers.size(); ++i) {
    fmt::format_to(out, "            {} fixes of star tracker {}\n", loaded.pass.further_star_trackers[i].size(),
                   i + 2);
  }
  for (const io::Defect& defect : loaded.defects) {
    fmt::format_to(out, "            {}\n", defect.text());
  }
  return text;
}

std::string finding_text(const Finding& finding) {
  return fmt::format("  {:<20}{}\n{:22}{}\n{:22}→ {}\n", finding.code, finding.text, "", finding.evidence, "",
                     finding.cure);
}

std::string verdict_text(const Verdict& verdict) {
  std::string text = fmt::format("Verdict     {}\n", verdict.trustworthy ? "trustworthy" : "DO NOT USE");
  for (const Finding& finding : verdict.findings) {
    text += finding_text(finding);
  }
  return text;
}

std::string calibration_text(const CalibrationRun& run, const std::optional<Truth>& truth) {
  std::string text;
  auto out = std::back_inserter(text);
  const Calibration& calibration = run.calibration;
  Eigen::Index state = 0;
  for (std::size_t k = 0; k < calibration.gyros.size(); ++k) {
    const GyroCalibration& gyro = calibration.gyros[k];
    fmt::format_to(out, "\nGyro {}      {:>18} {:>12}{}\n", k + 1, "value", "1σ", truth ? "         error" : "");
    const auto sigma = [&] { return std::sqrt(calibration.covariance(state, state)); };
    for (std::size_t i = 0; i < gyro.drift_rad_s.size(); ++i, ++state) {
      const auto& [name, value] = gyro.drift_rad_s[i];
      fmt::format_to(out, "  {:<8} {:>+13.4e} rad/s {:>12.1e}", name, value, sigma());
      if (const auto true_value = truth ? truth->gyros[k].drift(name) : std::nullopt) {
        fmt::format_to(out, " {:>+13.1e}", *true_value - value);
      }
      text += '\n';
    }
    const Eigen::Vector3d lambda = gyro.alignment_rotation_vector_rad;
    Eigen::Vector3d error = Eigen::Vector3d::Zero();
    if (truth) {
      // C_c_b(true) = exp([δ×]) C_c_b(est)
      error = (Rot<C, B<1>>::exp(Vec<C>::assume(truth->gyros[k].alignment_rotation_vector_rad)) *
               Rot<C, B<1>>::exp(Vec<C>::assume(lambda)).inverse())
                  .log()
                  .raw();
    }
    for (int axis = 0; axis < 3; ++axis, ++state) {
      fmt::format_to(out, "  align_{:<2} {:>+13.4f} ′     {:>11.2f}″", std::string(1, "xyz"[axis]),
                     lambda(axis) / kArcminute, sigma() / kArcsecond);
      if (truth) {
        fmt::format_to(out, " {:>+12.2f}″", error(axis) / kArcsecond);
      }
      text += '\n';
    }
  }
  const auto statistic = [&](const std::string& name) {
    const auto found = calibration.statistics.find(name);
    return found == calibration.statistics.end() ? std::nan("") : found->second;
  };
  for (const FurtherEstimate& estimate : calibration.further) {
    fmt::format_to(out, "{}  {:<24} {:>+13.4e} {:>12.1e}\n",
                   &estimate == calibration.further.data() ? "\nFurther states\n" : "", estimate.name, estimate.value,
                   estimate.sigma);
  }
  for (const Evidence& evidence : run.evidence) {
    fmt::format_to(out, "{}  {:<24} ln Bayes factor {:>+9.1f}: {}\n",
                   &evidence == run.evidence.data() ? "\nEvidence\n" : "", evidence.states, evidence.log_bayes_factor,
                   evidence.accepted ? "estimated" : "taken as zero");
  }
  for (const DriftModelForecast& model : run.drift_models) {
    fmt::format_to(out, "{}  {:<8} {:>4} coefficients, forecast error {:>9}, ln likelihood {:>+10.1f}{}\n",
                   &model == run.drift_models.data() ? "\nDrift models, by forecasts of the rest of the pass\n" : "",
                   model.drift_model, model.coefficients, angle_text(model.open_loop_rms_rad), model.log_likelihood,
                   model.drift_model == calibration.gyros[0].drift_model ? ", used" : "");
  }
  text += "\nFixes      ";
  for (const auto& [name, count] : run.fix_counts) {
    fmt::format_to(out, " {} {};", count, name);
  }
  text.back() = '\n';
  text += "Samples    ";
  for (const auto& [name, count] : run.samples) {
    fmt::format_to(out, " {} {};", count, name);
  }
  text.back() = '\n';
  if (!run.gyro_events.empty()) {
    fmt::format_to(out, "Gyros       {}\n", fmt::join(ground::texts_of(run.gyro_events, calibration.epoch), "; "));
  }
  if (const double looks = statistic("angle_looks"); looks > 0) {
    fmt::format_to(out, "Angles      between the momenta taken {:.0f} times, where no fix could be used\n", looks);
  }
  fmt::format_to(out, "Residuals   rms");
  for (std::size_t i = 1; i <= 2 * calibration.gyros.size(); ++i) {
    fmt::format_to(out, " {:.2f}″", statistic(fmt::format("innovation_{}_rms_rad", i)) / kArcsecond);
  }
  fmt::format_to(out, "; mean NIS {:.3f} ({:.0f} expected)\n", statistic("nis_mean"),
                 statistic("nis_degrees_of_freedom"));
  fmt::format_to(out, "Noise       random walk of each momentum {:.1e} rad/√s, {}",
                 run.options.direction_random_walk_rad_sqrt_s, run.options.find_noise ? "the most likely" : "as given");
  const FurtherStateOptions& states = run.options.further_states;
  if (states.wandering_drift == FurtherStateOptions::Choice::kOn) {
    fmt::format_to(out, "; drift that wanders by {:.1e} rad/s over {:.0f} min", states.wandering_drift_rad_s,
                   to_seconds(states.wandering_time) / 60);
  }
  if (const auto& noise = run.options.star_tracker_noise_rad) {
    fmt::format_to(out, "; star tracker {:.1f}″ {:.1f}″ {:.1f}″, which is not what was told", noise->x() / kArcsecond,
                   noise->y() / kArcsecond, noise->z() / kArcsecond);
  }
  text += '\n';
  return text;
}

std::string extension_text(const std::optional<ground::Extension>& extension) {
  return extension ? fmt::format("{}{:.3g} times", extension->is_lower_bound ? "≥ " : "", extension->factor)
                   : "none measured";
}

std::string course_text(const CalibrationRun& run, const Course& course) {
  const auto settled = [&](bool alignments) {
    const auto time = ground::settled(run, course.convergence, alignments);
    return time ? fmt::format("after {:.0f} min", minutes(*time)) : "not yet";
  };
  std::string text = fmt::format("Settled     alignment {}, drift coefficients {} (the paper: 90, 200–300)\n",
                                 settled(true), settled(false));
  if (course.open_loops.empty()) {
    return text;
  }
  auto out = std::back_inserter(text);
  fmt::format_to(out, "\nOpen loop until the error passes {}, from a correction with\n  {:>13} {:>14} {:>14} {:>12}\n",
                 angle_text(course.limit_rad), "at, min", "known before", "calibrated", "extended");
  const auto interval = [](const ground::CorrectionInterval& i) {
    return i.passed ? fmt::format("{:.1f} min", minutes(*i.passed)) : fmt::format("> {:.0f} min", minutes(i.observed));
  };
  for (const ground::OpenLoops& loops : course.open_loops) {
    const auto& [before, after] = loops.intervals;
    const auto factor = loops.intervals.extension();
    if (after.observed > Duration::zero()) {
      fmt::format_to(out, "  {:>13.0f} {:>14} {:>14} {:>12}\n", minutes(after.corrected - run.calibration.epoch),
                     interval(before), interval(after),
                     factor ? fmt::format("{}{:.3g}", after.passed ? "" : "≥ ", *factor) : "");
    }
  }
  fmt::format_to(out, "  correction interval extended {} (the paper: 3–5)\n",
                 extension_text(ground::median_extension(course.open_loops)));
  return text;
}

std::string evaluation_text(const Evaluation& evaluation, Time epoch, const std::string& title) {
  std::string text = fmt::format("{} against the {}{}\n", title, evaluation.reference,
                                 evaluation.reference == "truth" ? "" : ", whose errors are in the figures");
  auto out = std::back_inserter(text);
  if (evaluation.errors.t.empty()) {
    return text + "  no common epochs\n";
  }
  fmt::format_to(out, "  {:>13} {:>10} {:>10} {:>10} {:>12} {:>13}\n", "minutes", "roll rms", "pitch rms", "head. rms",
                 "largest", "(error/σ)²");
  const auto row = [&](const std::string& name, const ground::ErrorStatistics& s) {
    fmt::format_to(out, "  {:>13} {:>10} {:>10} {:>10} {:>12} {:>13}\n", name, angle_text(s.rms_rad.x()),
                   angle_text(s.rms_rad.y()), angle_text(s.rms_rad.z()), angle_text(s.max_total_rad),
                   s.normalised_square ? fmt::format("{:.2f}", *s.normalised_square) : "");
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
  std::string text = fmt::format("Passes      {}, taken for one start-up; each beside those before:\n", passes.size());
  for (const ground::PassAlone& pass : passes) {
    const Calibration& calibration = pass.run.calibration;
    auto out = std::back_inserter(text);
    fmt::format_to(out, "  {:<16} {}  {}\n", pass.name, io::format_epoch(calibration.epoch),
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

nlohmann::ordered_json findings_json(const std::vector<Finding>& findings) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const Finding& finding : findings) {
    json.push_back(
        {{"code", finding.code}, {"text", finding.text}, {"evidence", finding.evidence}, {"cure", finding.cure}});
  }
  return json;
}

nlohmann::ordered_json verdict_json(const Verdict& verdict) {
  return {{"trustworthy", verdict.trustworthy}, {"findings", findings_json(verdict.findings)}};
}

nlohmann::ordered_json extension_json(const std::vector<ground::IntervalPair>& pairs,
                                      const std::optional<ground::Extension>& median, Time epoch) {
  nlohmann::ordered_json json = {{"corrections", nlohmann::ordered_json::array()}, {"factor", nullptr}};
  for (const ground::IntervalPair& pair : pairs) {
    json["corrections"].push_back({{"t_s", to_seconds(pair.calibrated.corrected - epoch)},
                                   {"known_before", interval_json(pair.known_before)},
                                   {"calibrated", interval_json(pair.calibrated)}});
  }
  if (median) {
    json["factor"] = median->factor;
    json["is_lower_bound"] = median->is_lower_bound;
  }
  return json;
}

nlohmann::ordered_json course_json(const CalibrationRun& run, const Course& course) {
  const auto seconds = [](const std::optional<Duration>& time) {
    return time ? nlohmann::ordered_json(to_seconds(*time)) : nlohmann::ordered_json(nullptr);
  };
  nlohmann::ordered_json states;
  for (std::size_t i = 0; i < course.convergence.size(); ++i) {
    states[run.calibration.states[i]] = {{"determined", course.convergence[i].determined},
                                         {"settled_s", seconds(course.convergence[i].settled)}};
  }
  std::vector<ground::IntervalPair> pairs;
  for (const ground::OpenLoops& loops : course.open_loops) {
    pairs.push_back(loops.intervals);
  }
  nlohmann::ordered_json models = nlohmann::ordered_json::array();
  for (const DriftModelForecast& model : run.drift_models) {
    models.push_back({{"drift_model", model.drift_model},
                      {"coefficients", model.coefficients},
                      {"log_likelihood", model.log_likelihood},
                      {"open_loop_rms_rad", model.open_loop_rms_rad}});
  }
  nlohmann::ordered_json evidence = nlohmann::ordered_json::array();
  for (const Evidence& its : run.evidence) {
    evidence.push_back(
        {{"states", its.states}, {"log_bayes_factor", its.log_bayes_factor}, {"accepted", its.accepted}});
  }
  return {{"evidence", evidence},
          {"drift_models", models},
          {"convergence",
           {{"alignment_s", seconds(ground::settled(run, course.convergence, true))},
            {"drift_s", seconds(ground::settled(run, course.convergence, false))},
            {"states", states}}},
          {"extension", extension_json(pairs, ground::median_extension(course.open_loops), run.calibration.epoch)}};
}

nlohmann::ordered_json evaluation_json(const Evaluation& evaluation, Time epoch) {
  nlohmann::ordered_json json = {{"reference", evaluation.reference},
                                 {"whole", statistics_json(evaluation.whole, epoch)},
                                 {"per_90_min", nlohmann::ordered_json::array()},
                                 {"limit_rad", evaluation.limit_rad},
                                 {"corrections", nlohmann::ordered_json::array()}};
  for (const auto& s : evaluation.stretches) {
    json["per_90_min"].push_back(statistics_json(s, epoch));
  }
  for (const auto& interval : evaluation.intervals) {
    nlohmann::ordered_json item = {{"t_s", to_seconds(interval.corrected - epoch)}};
    item.update(interval_json(interval));
    json["corrections"].push_back(item);
  }
  return json;
}

}  // namespace trihedron::cli
