#include "tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <set>

#include "innovations.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/core/outlier_gate.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/records/text.hpp"
#include "units.hpp"
#include "wording.hpp"

namespace trihedron::report {
namespace {

using nlohmann::json;

constexpr std::array<const char*, 3> kAxes = {"roll", "pitch", "heading"};

// ---- Parameters

/// Of the alignments of one gyro: one for values and truth, one for sigmas and errors.
struct AlignmentUnits {
  AngleUnit value;
  AngleUnit sigma;
};

AlignmentUnits units_of_alignment(const std::vector<Parameter>& parameters, std::size_t gyro) {
  std::vector<double> values;
  std::vector<double> sigmas;
  for (const Parameter& parameter : parameters) {
    if (parameter.id.gyro() == gyro && parameter.id.is_alignment()) {
      values.push_back(parameter.value);
      sigmas.push_back(parameter.sigma);
    }
  }
  return {unit_of_angles(values), unit_of_angles(sigmas)};
}

json row_of(const Parameter& parameter, const AlignmentUnits& units) {
  json row = {
      {"symbol", parameter.symbol},
      {"name", short_name_of(parameter.id)},
      {"undetermined", !parameter.is_determined},
      {"shrunk", parameter.first_sigma > 0 ? significant(100 * parameter.sigma / parameter.first_sigma, 2) : "—"},
      {"converged", parameter.converged_min ? number(*parameter.converged_min, 0) : "not yet"}};
  if (!parameter.is_determined || !parameter.is_followed) {
    row["converged"] = "—";
  }
  const auto put = [&](const std::string& suffix, double unit, double sigma_unit, double error_unit) {
    const int decimals = decimals_for(parameter.sigma / unit);
    row["value" + suffix] = signed_number(parameter.value / unit, decimals);
    row["sigma" + suffix] = number(parameter.sigma / sigma_unit, decimals_for(parameter.sigma / sigma_unit));
    row["truth" + suffix] = parameter.truth ? signed_number(*parameter.truth / unit, decimals) : "—";
    row["error" + suffix] =
        parameter.error ? signed_number(*parameter.error / error_unit, decimals_for(parameter.sigma / error_unit))
                        : "—";
  };
  if (parameter.id.is_alignment()) {
    put("", units.value.rad, units.sigma.rad, units.sigma.rad);
  } else {
    put("", kMicroradian, kMicroradian, kMicroradian);
    put("_deg_h", kDegreePerHour_rad_s, kDegreePerHour_rad_s, kDegreePerHour_rad_s);
  }
  const double ratio = parameter.error ? *parameter.error / parameter.sigma : 0;
  row["ratio"] = parameter.error ? signed_number(ratio, 1) : "—";
  row["beyond_3_sigma"] = !(std::abs(ratio) <= 3);
  return row;
}

json gyros_of(const ReportInput& input, const std::vector<Parameter>& parameters) {
  json gyros = json::array();
  for (std::size_t k = 0; k < input.run.calibration.gyros.size(); ++k) {
    const AlignmentUnits units = units_of_alignment(parameters, k);
    json gyro = {{"number", k + 1},
                 {"value_unit", units.value.symbol},
                 {"sigma_unit", units.sigma.symbol},
                 {"model", name_of(input.run.calibration.gyros[k].drift_model)},
                 {"drift", json::array()},
                 {"alignment", json::array()},
                 {"unmodelled", ""}};
    for (const Parameter& parameter : parameters) {
      if (parameter.id.gyro() == k) {
        gyro[parameter.id.is_alignment() ? "alignment" : "drift"].push_back(row_of(parameter, units));
      }
    }
    if (input.truth != nullptr && k < input.truth->gyros.size()) {
      std::string list;
      for (const auto& [name, value] : input.truth->gyros[k].unmodelled_rad_s) {
        list += fmt::format("{}{} {}", list.empty() ? "" : ", ", name, signed_number(value / kMicroradian, 4));
      }
      gyro["unmodelled"] = list;
    }
    gyros.push_back(std::move(gyro));
  }
  return gyros;
}

/// The drift coefficients of any gyro, once each, for the choice of figures. Those of the paper's Figs 5–7 are shown
/// first.
json coefficients_of(const std::vector<Parameter>& parameters) {
  const std::map<DriftCoefficient, std::string> in_paper = {{DriftCoefficient::of_eq1(Esg7::kK0), "Fig. 5"},
                                                            {DriftCoefficient::of_eq1(Esg7::kMu31), "Fig. 6"},
                                                            {DriftCoefficient::of_eq1(Esg7::kNu31), "Fig. 7"}};
  const bool any_in_paper = std::ranges::any_of(
      parameters, [&](const Parameter& p) { return p.id.is_drift() && in_paper.contains(p.id.coefficient); });
  json list = json::array();
  std::set<DriftCoefficient> seen;
  for (const Parameter& parameter : parameters) {
    if (!parameter.id.is_drift() || !seen.insert(parameter.id.coefficient).second) {
      continue;
    }
    const auto figure = in_paper.find(parameter.id.coefficient);
    const bool shown = any_in_paper ? figure != in_paper.end() : list.size() < 3;
    list.push_back({{"name", short_name_of(parameter.id)},
                    {"symbol", parameter.symbol},
                    {"paper", figure == in_paper.end() ? "" : figure->second},
                    {"shown", shown}});
  }
  return list;
}

json strongest_correlations(const ReportInput& input, const std::vector<Parameter>& parameters) {
  struct Pair {
    double rho;
    std::string names;
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double rho = input.run.calibration.covariance(static_cast<Eigen::Index>(parameters[i].row),
                                                          static_cast<Eigen::Index>(parameters[j].row)) /
                         (parameters[i].sigma * parameters[j].sigma);
      if (std::abs(rho) >= 0.5) {
        pairs.push_back({rho, parameters[j].full_symbol() + " and " + parameters[i].full_symbol()});
      }
    }
  }
  std::ranges::stable_sort(pairs, [](const Pair& a, const Pair& b) { return std::abs(a.rho) > std::abs(b.rho); });
  pairs.resize(std::min<std::size_t>(pairs.size(), 6));
  json list = json::array();
  for (const Pair& pair : pairs) {
    list.push_back({{"rho", signed_number(pair.rho, 3)}, {"names", pair.names}});
  }
  return list;
}

// ---- Attitude

/// One unit for the rms of a table, one for the greatest errors.
json stretches_of(const ReportInput& input, const ground::AttitudeEvaluation& evaluation) {
  std::vector<double> rms;
  std::vector<double> greatest;
  for (const ground::ErrorStatistics& stretch : evaluation.stretches) {
    rms.insert(rms.end(), stretch.rms_rad.begin(), stretch.rms_rad.end());
    greatest.push_back(stretch.max_total_rad);
  }
  const AngleUnit rms_unit = unit_of_angles(rms);
  const AngleUnit greatest_unit = unit_of_angles(greatest);
  json rows = json::array();
  for (const ground::ErrorStatistics& stretch : evaluation.stretches) {
    if (stretch.to == stretch.from) {  // the pass ends on the first epoch of the next stretch
      continue;
    }
    json row = {{"from", number(to_minutes(stretch.from - input.pass.settings.epoch), 0)},
                {"to", number(to_minutes(stretch.to - input.pass.settings.epoch), 0)},
                {"count", number(static_cast<double>(stretch.count), 0)},
                {"total", significant(stretch.max_total_rad / greatest_unit.rad, 3)}};
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      row[std::string("rms_") + kAxes[axis]] = significant(stretch.rms_rad(i) / rms_unit.rad, 3);
      row[std::string("max_") + kAxes[axis]] = significant(stretch.max_rad(i) / greatest_unit.rad, 3);
    }
    row["honesty"] = stretch.normalised_square ? number(*stretch.normalised_square, 2) : "—";
    rows.push_back(std::move(row));
  }
  return {{"rms_unit", rms_unit.symbol}, {"greatest_unit", greatest_unit.symbol}, {"rows", rows}};
}

json open_loop_table(const ReportInput& input) {
  const auto in_words = [](const ground::CorrectionInterval& interval) {
    return interval.passed ? number(to_minutes(*interval.passed), 1) : "> " + number(to_minutes(interval.observed), 0);
  };
  std::vector<double> totals;
  for (const ground::IntervalPair& pair : input.evaluation->extension.pairs) {
    totals.push_back(pair.calibrated.max_total_rad);
  }
  const AngleUnit unit = unit_of_angles(totals);
  json rows = json::array();
  for (const ground::IntervalPair& pair : input.evaluation->extension.pairs) {
    const auto& [before, after] = pair;
    if (after.observed == Duration::zero()) {  // corrected at the end of the pass
      continue;
    }
    const auto extension = pair.extension();
    rows.push_back({{"corrected", number(to_minutes(after.corrected - input.pass.settings.epoch), 0)},
                    {"before", in_words(before)},
                    {"after", in_words(after)},
                    {"extension", extension ? (after.passed ? "" : "≥ ") + significant(*extension, 2) : "—"},
                    {"total", significant(after.max_total_rad / unit.rad, 3)}});
  }
  return {{"unit", unit.symbol}, {"rows", rows}};
}

json evaluation_of(const ReportInput& input) {
  if (input.evaluation == nullptr ||
      (input.evaluation->navigation.errors.t.empty() && input.evaluation->attitude.errors.t.empty())) {
    return nullptr;
  }
  const ground::CalibrationEvaluation& evaluation = *input.evaluation;
  return {{"reference", reference_in_words(evaluation.attitude)},
          {"navigation", stretches_of(input, evaluation.navigation)},
          {"attitude", stretches_of(input, evaluation.attitude)},
          {"open_loops", open_loop_table(input)},
          {"limit", limit_text(evaluation.limit_rad)}};
}

// ---- Innovations

json innovation_rows(const ReportInput& input) {
  struct Sums {
    double count = 0, sum = 0, squares = 0, beyond = 0;
  };
  std::vector<Sums> sums(innovations_of(input.run));
  for_each_normalised(input.run.fixes, [&](std::size_t i, double value) {
    ++sums[i].count;
    sums[i].sum += value;
    sums[i].squares += value * value;
    sums[i].beyond += std::abs(value) > 3 ? 1 : 0;
  });
  json rows = json::array();
  for (std::size_t i = 0; i < sums.size() && sums[i].count > 0; ++i) {
    const double mean = sums[i].sum / sums[i].count;
    rows.push_back({{"name", fmt::format("gyro {}, {}", i / 2 + 1, i % 2 == 0 ? "first" : "second")},
                    {"mean", signed_number(mean, 3)},
                    {"deviation", number(std::sqrt(sums[i].squares / sums[i].count - mean * mean), 3)},
                    {"beyond", number(100 * sums[i].beyond / sums[i].count, 2)}});
  }
  return rows;
}

// ---- Telemetry

json counts_of(const std::vector<NamedCount>& counts) {
  json rows = json::array();
  long total = 0;
  for (const NamedCount& its : counts) {
    total += its.count;
  }
  for (const auto& [name, count, is_rejected] : counts) {
    const double percent = 100 * static_cast<double>(count) / static_cast<double>(total);
    rows.push_back({{"name", name}, {"count", number(static_cast<double>(count), 0)}, {"percent", number(percent, 2)}});
  }
  return rows;
}

struct Gap {
  const char* sensor;
  Time from;
  Duration length;
};

void find_gaps(const char* sensor, const std::vector<Time>& t, Duration longest_step, const PassSettings& settings,
               std::vector<Gap>& gaps) {
  Time last = settings.epoch;
  const auto step_to = [&](Time next) {
    if (next - last > longest_step) {
      gaps.push_back({sensor, last, next - last});
    }
    last = next;
  };
  std::ranges::for_each(t, step_to);
  step_to(settings.epoch + settings.duration);
}

void put_gaps(const ReportInput& input, json& values) {
  const PassSettings& settings = input.pass.settings;
  std::vector<Gap> gaps;
  find_gaps("gyros", input.pass.gyro.t, std::max<Duration>(8 * settings.gyro_period, std::chrono::seconds(1)), settings,
            gaps);
  find_gaps("star tracker", input.pass.star_tracker.t, 10 * settings.star_tracker_period, settings, gaps);
  std::ranges::stable_sort(gaps, [](const Gap& a, const Gap& b) { return a.length > b.length; });
  constexpr std::size_t kShown = 12;
  values["gaps"] = json::array();
  for (const Gap& gap : gaps) {
    if (values["gaps"].size() < kShown) {
      values["gaps"].push_back({{"sensor", gap.sensor},
                                {"from", number(to_minutes(gap.from - settings.epoch), 1)},
                                {"length", span(gap.length)}});
    }
  }
  values["more_gaps"] = gaps.size() > kShown ? std::to_string(gaps.size() - kShown) : "";
}

/// The drift model of the calibration; where an estimator on board flies a smaller one, both.
std::string drift_model_of(const CalibrationRun& run) {
  const DriftModelId its = run.calibration.gyros.front().drift_model;
  const std::optional<OnBoardDrift>& on_board = run.calibration.on_board_drift;
  return !on_board || on_board->drift_model == its
             ? drift_model_word(run.options)
             : fmt::format(
                   "{}; on board {}, whose coefficients and alignments make up for the members that it leaves out",
                   name_of(its), name_of(on_board->drift_model));
}

json settings_of(const ReportInput& input) {
  const CalibrationOptions& options = input.run.options;
  json rows = json::array();
  const auto put = [&](const std::string& name, const std::string& value) {
    rows.push_back({{"name", name}, {"value", value}});
  };
  put("Estimator", std::string(name_of(input.run.calibration.estimator)));
  put("Drift model", drift_model_of(input.run));
  put("Noise", options.find_noise ? "found from the pass" : "given, by settings or an earlier calibration");
  put("Process noise of each momentum",
      fmt::format("{}″ per √h", significant(options.direction_random_walk_rad_sqrt_s * 60 / kArcsecond_rad, 2)));
  if (options.further_states.is_on(FurtherState::kWanderingDrift)) {
    put(std::string(row_of(FurtherState::kWanderingDrift).label),
        fmt::format("{}″/h about each case axis, 1σ, over {}",
                    significant(options.further_states.wandering_drift_rad_s * 3600 / kArcsecond_rad, 2),
                    span(options.further_states.wandering_time)));
  }
  put("Gate", fmt::format("fixes with a NIS above {:.4g} are rejected",
                          gate_of_freedom(static_cast<int>(innovations_of(input.run)), options.gate_nis)));
  if (options.student_t_freedom > 0) {
    put("Weight of fixes above the gate",
        fmt::format("Student's t with {:.3g} degrees of freedom", options.student_t_freedom));
  }
  put("Reopening", fmt::format("after {} rejections in a row, {} where they began with a jump",
                               options.reopen_after_rejections, options.reopen_after_jump_rejections));
  using When = CorrectionOptions::When;
  const CorrectionOptions& corrections = options.corrections;
  put("Navigator corrected", corrections.when == When::kEachFix     ? "at every fix"
                             : corrections.when == When::kOnlyFirst ? "at the first fix only"
                                                                    : "every " + span(corrections.interval));
  put("Parameters at a correction", corrections.take_parameters ? "taken from the calibration" : "held");
  for (std::size_t k = 0; k < input.pass.settings.gyros.size(); ++k) {
    put(fmt::format("Readout noise of gyro {}", k + 1),
        angle(input.pass.settings.gyros[k].readout_noise_rad, 3) + " per direction cosine, 1σ");
  }
  if (options.star_tracker_noise_rad) {
    put("Star-tracker noise found", of_axes(*options.star_tracker_noise_rad) + " about roll / pitch / heading, 1σ");
  }
  put(options.star_tracker_noise_rad ? "Star-tracker noise by pass.toml" : "Star-tracker noise",
      of_axes(input.pass.settings.star_tracker_noise_rad) + " about roll / pitch / heading, 1σ");
  return rows;
}

/// How a further state is shown.
struct ShownUnit {
  std::string_view ending;  ///< of its name
  double size;
  const char* text;
};
ShownUnit shown_unit(const FurtherEstimate& estimate) {
  const AngleUnit angle_unit = unit_of_angle(std::max(std::abs(estimate.value), estimate.sigma));
  switch (estimate.parameter.unit()) {
    case Unit::kSecond:
      return {"_s", 1e-3, "ms"};
    case Unit::kSecondPerSecond:
      return {"_s_s", 1e-6, "ppm"};
    case Unit::kRadian:
      return {"_rad", angle_unit.rad, angle_unit.symbol};
    case Unit::kRadianPerSecond:
      break;
  }
  return {"_rad_s", 1e-9, "10⁻⁹ rad/s"};
}

/// The states other than alignment and drift.
json further_of(const ReportInput& input) {
  json rows = json::array();
  for (const FurtherEstimate& estimate : input.run.calibration.further) {
    const ShownUnit unit = shown_unit(estimate);
    std::string name = name_of(estimate.parameter);
    name.resize(name.size() - (name.ends_with(unit.ending) ? unit.ending.size() : 0));
    std::ranges::replace(name, '_', ' ');
    rows.push_back({{"name", name},
                    {"value", number(estimate.value / unit.size, 2)},
                    {"sigma", significant(estimate.sigma / unit.size, 2)},
                    {"unit", unit.text}});
  }
  return rows;
}

json states_decided(const ReportInput& input) {
  json sentences = json::array();
  for (const Evidence& evidence : input.run.evidence) {
    sentences.push_back(
        fmt::format("{}: {} ({}).", evidence.label(), evidence.outcome(), signed_number(evidence.log_bayes_factor, 1)));
  }
  return sentences;
}

json drift_model_table(const CalibrationRun& run) {
  std::vector<double> errors;
  for (const DriftModelForecast& model : run.drift_models) {
    errors.push_back(model.open_loop_rms_rad);
  }
  const AngleUnit unit = unit_of_angles(errors);
  json rows = json::array();
  for (const DriftModelForecast& model : run.drift_models) {
    rows.push_back({{"name", name_of(model.drift_model)},
                    {"used", model.drift_model == run.calibration.gyros[0].drift_model},
                    {"coefficients", model.drift_model.size()},
                    {"error", significant(model.open_loop_rms_rad / unit.rad, 3)},
                    {"gain", signed_number(model.log_likelihood, 1)}});
  }
  return {{"unit", unit.symbol}, {"rows", rows}};
}

/// A row for each gyro and degree, both potentials in it.
json drift_field_rows(const Calibration& calibration) {
  json rows = json::array();
  const auto text = [](const DriftFieldLevel& level) {
    return fmt::format("{:.2g} ({:.2g} … {:.2g})", level.rms_rad_s / kMicroradian,
                       level.rms_rad_s / level.sigma_factor / kMicroradian,
                       level.rms_rad_s * level.sigma_factor / kMicroradian);
  };
  for (const DriftFieldLevel& level : calibration.drift_field) {
    const std::string name = fmt::format("Gyro {}, degree {}", level.gyro + 1, level.degree);
    if (rows.empty() || rows.back()["name"] != name) {
      rows.push_back({{"name", name}});
    }
    rows.back()[level.potential == DriftCoefficient::Member::kW ? "W" : "D"] = text(level);
  }
  return rows;
}

json statistics_rows(const Statistics& statistics) {
  json rows = json::array();
  for (const auto& [name, value] : named_values(statistics)) {
    rows.push_back({{"name", name}, {"value", std::isfinite(value) ? fmt::format("{:.6g}", value) : "—"}});
  }
  return rows;
}

json facts_of(const ReportInput& input) {
  const PassSettings& settings = input.pass.settings;
  const auto fact = [](const std::string& name, const std::string& value) -> json {
    return {{"name", name}, {"value", value}};
  };
  return {fact("Start", calendar(settings.epoch)), fact("Length", span(settings.duration)),
          fact("Gyros", fmt::format("{}, {} samples", input.pass.gyro.gyros,
                                    number(static_cast<double>(input.pass.gyro.size()), 0))),
          fact("Star tracker", counted(static_cast<long>(input.pass.star_tracker.size()), "fix", "fixes")),
          fact("Estimator",
               fmt::format("{}, drift model {}", name_of(input.run.calibration.estimator), drift_model_of(input.run)))};
}

}  // namespace

json table_values(const ReportInput& input, const std::vector<Parameter>& parameters) {
  const std::string& spacecraft = input.pass.settings.spacecraft;
  json values = {{"spacecraft", spacecraft.empty() ? "Unnamed spacecraft" : spacecraft},
                 {"facts", facts_of(input)},
                 {"gyros", gyros_of(input, parameters)},
                 {"has_truth", input.truth != nullptr},
                 {"coefficients", coefficients_of(parameters)},
                 {"drift_models", drift_model_table(input.run)},
                 {"drift_field", drift_field_rows(input.run.calibration)},
                 {"correlations", strongest_correlations(input, parameters)},
                 {"evaluation", evaluation_of(input)},
                 {"innovation_rows", innovation_rows(input)},
                 {"fix_counts", counts_of(named_counts(input.run.fix_counts))},
                 {"sample_counts", counts_of(named_counts(input.run.samples))},
                 {"telemetry_notes", input.telemetry_notes},
                 {"further", further_of(input)},
                 {"states_decided", states_decided(input)},
                 {"settings", settings_of(input)},
                 {"statistics", statistics_rows(input.run.calibration.statistics)}};
  put_gaps(input, values);
  for (const char* list : {"correlations", "drift_field", "gaps", "telemetry_notes", "further", "states_decided"}) {
    values[std::string("has_") + list] = !values[list].empty();
  }
  return values;
}

}  // namespace trihedron::report
