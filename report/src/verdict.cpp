#include "verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "trihedron/records/run.hpp"
#include "units.hpp"
#include "wording.hpp"

namespace trihedron::report {
namespace {

using nlohmann::json;
using Severity = Finding::Severity;

const char* word_of(Severity severity) {
  switch (severity) {
    case Severity::kNote:
      return "Note";
    case Severity::kWarning:
      return "Warning";
    case Severity::kDoNotUse:
      return "Do not use";
  }
  return "Warning";
}

const char* style_of(Severity severity) {
  switch (severity) {
    case Severity::kNote:
      return "note";
    case Severity::kWarning:
      return "caution";
    case Severity::kDoNotUse:
      return "bad";
  }
  return "caution";
}

json verdict_of(const Verdict& verdict) {
  std::vector<Finding> findings = verdict.findings;
  std::ranges::stable_sort(findings, [](const Finding& a, const Finding& b) { return a.severity > b.severity; });
  const long warnings = std::count_if(findings.begin(), findings.end(),
                                      [](const Finding& f) { return f.severity == Severity::kWarning; });
  json result = {{"findings", findings_of(findings)}, {"to_do", json::array()}};
  std::set<std::string> cures;
  for (const Finding& finding : findings) {
    if (!finding.cure.empty() && cures.insert(finding.cure).second) {
      result["to_do"].push_back(finding.cure);
    }
  }
  if (!verdict.trustworthy) {
    result["style"] = "bad";
    result["word"] = "Do not use";
    result["lead"] = findings.empty() ? "The calibration was judged untrustworthy." : findings.front().text;
  } else if (warnings > 0) {
    result["style"] = "caution";
    result["word"] = "Trustworthy, with " + counted(warnings, "warning", "warnings");
    result["lead"] = "The result can be used as it is. What to keep in mind: " + findings.front().text;
  } else {
    result["style"] = "good";
    result["word"] = "Trustworthy";
    result["lead"] =
        "The result can be used as it is: what was found in the telemetry is in the calibration, and the fixes scatter "
        "as much as the noise figures say.";
  }
  return result;
}

json figure_of_merit(const std::string& name, const std::string& value, const std::string& unit,
                     const std::string& note) {
  return {{"name", name}, {"value", value}, {"unit", unit}, {"note", note}};
}

/// Statistics per 90 min; an incomplete last interval is left out.
std::vector<ground::ErrorStatistics> whole_stretches(const ground::AttitudeEvaluation& evaluation) {
  auto stretches = evaluation.stretches;
  while (stretches.size() > 1 && stretches.back().to - stretches.back().from < ground::kEvaluatedStretch / 2) {
    stretches.pop_back();
  }
  return stretches;
}

/// "minutes 450–540"
std::string minutes_of(const ReportInput& input, const ground::ErrorStatistics& stretch) {
  const auto minute = [&](Time t) { return number(to_minutes(t - input.pass.settings.epoch), 0); };
  return "minutes " + minute(stretch.from) + "–" + minute(stretch.to);
}

json attitude_number(const ReportInput& input) {
  if (input.evaluation != nullptr && !input.evaluation->attitude.errors.t.empty()) {
    const auto stretches = whole_stretches(input.evaluation->attitude);
    return figure_of_merit("Attitude error while calibrating", of_axes(stretches.back().rms_rad), "",
                           "roll / pitch / heading, rms in " + minutes_of(input, stretches.back()) + " against " +
                               reference_in_words(input.evaluation->attitude));
  }
  if (!input.run.attitude.sigma_rad.empty()) {
    return figure_of_merit("Attitude at the end", of_axes(input.run.attitude.sigma_rad.back()), "",
                           "roll / pitch / heading, 1σ as claimed; there is nothing to compare it with");
  }
  return nullptr;
}

json navigation_number(const ReportInput& input) {
  if (input.evaluation == nullptr || input.evaluation->navigation.errors.t.empty()) {
    return nullptr;
  }
  const auto stretches = whole_stretches(input.evaluation->navigation);
  const auto greatest = [](const ground::ErrorStatistics& stretch) { return angle(stretch.max_total_rad, 2); };
  // Until the first correction after that of the start there is nothing else to fly by.
  const auto& intervals = input.evaluation->navigation.intervals;
  const auto by_what = [&](const ground::ErrorStatistics& stretch) {
    return !intervals.empty() && intervals.front().max_total_rad >= stretch.max_total_rad
               ? ", by the parameters known before the calibration"
               : "";
  };
  const std::string name = "Greatest error between corrections";
  if (stretches.size() == 1) {
    const ground::ErrorStatistics& whole = input.evaluation->navigation.whole;
    return figure_of_merit(name, greatest(whole), "", std::string("open loop, total angle") + by_what(whole));
  }
  return figure_of_merit(name, greatest(stretches.front()) + " → " + greatest(stretches.back()), "",
                         fmt::format("open loop, total angle: in {}{}, and in {}", minutes_of(input, stretches.front()),
                                     by_what(stretches.front()), minutes_of(input, stretches.back())));
}

json alignment_number(const std::vector<Parameter>& parameters) {
  double worst_sigma = 0;
  double worst_error = 0;
  bool has_error = false;
  for (const Parameter& parameter : parameters) {
    if (parameter.id.is_alignment()) {
      worst_sigma = std::max(worst_sigma, parameter.sigma);
      has_error = has_error || parameter.error;
      worst_error = std::max(worst_error, std::abs(parameter.error.value_or(0)));
    }
  }
  if (worst_sigma == 0) {
    return nullptr;
  }
  const std::string sigma = angle(worst_sigma, 2);
  return has_error ? figure_of_merit("Alignment error, worst axis", angle(worst_error, 2), "",
                                     "against the truth; claimed 1σ " + sigma)
                   : figure_of_merit("Alignment known to", sigma, "", "1σ as claimed, worst axis");
}

/// When the last of the chosen parameters settled. Those that the data do not determine have nothing to settle to.
json convergence_number(const std::vector<Parameter>& parameters, bool alignment) {
  const Parameter* last = nullptr;
  std::vector<std::string> off;
  std::size_t count = 0;
  for (const Parameter& parameter : parameters) {
    if (parameter.id.is_alignment() != alignment || !parameter.is_determined || !parameter.is_followed) {
      continue;
    }
    ++count;
    if (!parameter.converged_min) {
      off.push_back(parameter.full_symbol());
    } else if (last == nullptr || *parameter.converged_min > *last->converged_min) {
      last = &parameter;
    }
  }
  if (count == 0) {
    return nullptr;
  }
  const std::string name = alignment ? "Alignment settled after" : "Drift coefficients settled after";
  const std::string paper = alignment ? "; the paper: one orbit, 90 min" : "; the paper: 200–300 min";
  if (!off.empty()) {
    const std::string which =
        off.size() <= 3 ? fmt::format("{}", fmt::join(off, ", ")) : fmt::format("{} of {}", off.size(), count);
    return figure_of_merit(name, "not yet", "", "off by more than 3σ and 10 % at the end: " + which + paper);
  }
  return figure_of_merit(
      name, number(*last->converged_min, 0), " min",
      fmt::format("last to reach {}: {}{}", last->truth ? "the truth" : "its final value", last->full_symbol(), paper));
}

json extension_number(const ReportInput& input) {
  if (input.evaluation == nullptr) {
    return nullptr;
  }
  const auto& extension = input.evaluation->extension.median;
  if (!extension) {
    return nullptr;
  }
  return figure_of_merit(
      "Correction interval extended", (extension->is_lower_bound ? "≥ " : "") + significant(extension->factor, 2), " ×",
      fmt::format("time until the error passes {}, with the calibrated values over those known before; median over "
                  "the corrections; the paper: 3–5 times{}",
                  limit_text(input.evaluation->limit_rad),
                  extension->is_lower_bound ? "; the pass ended before the limit was passed" : ""));
}

json forecast_number(const ReportInput& input) {
  const std::optional<OpenLoopForecast>& forecast = input.run.calibration.forecast;
  if (!forecast) {
    return nullptr;
  }
  const AccuracyForecast& accuracy = forecast->need ? forecast->need->accuracy : forecast->usual;
  const std::string limit = limit_text(accuracy.limit_rad);
  return figure_of_merit("Holds " + limit + " without the star tracker",
                         (accuracy.is_lower_bound ? "≥ " : "") + time_in_words(accuracy.within), "",
                         forecast->need
                             ? fmt::format("predicted, 99.7 %, after a correction; needed: {}, which is {}met",
                                           in_words(forecast->need->need), forecast->need->met ? "" : "not ")
                             : "predicted, 99.7 %, after a correction at the end of the pass");
}

json nis_number(const ReportInput& input) {
  double sum = 0;
  double count = 0;
  for (const FixRecord& fix : input.run.fixes) {
    if (fix.status == FixStatus::kUsed) {
      sum += fix.nis;
      ++count;
    }
  }
  return count == 0
             ? json(nullptr)
             : figure_of_merit("Mean NIS of the fixes", number(sum / count, 2), "",
                               fmt::format("{:.3g} is expected: below, the noise is overstated; above, the model "
                                           "is incomplete",
                                           input.run.calibration.statistics.nis_degrees_of_freedom));
}

json undetermined_of(const std::vector<Parameter>& parameters) {
  json list = json::array();
  for (const Parameter& parameter : parameters) {
    if (!parameter.is_determined) {
      list.push_back(
          {{"symbol", parameter.full_symbol()}, {"percent", number(100 * parameter.sigma / parameter.first_sigma, 0)}});
    }
  }
  return list;
}

json rejected_of(const std::vector<NamedCount>& counts, const std::string& one, const std::string& many) {
  json list = json::array();
  for (const NamedCount& its : counts) {
    if (its.is_rejected) {
      list.push_back(fmt::format("{} {}", counted(its.count, one, many), its.name));
    }
  }
  return list;
}

}  // namespace

json findings_of(const std::vector<Finding>& findings) {
  json list = json::array();
  for (const Finding& finding : findings) {
    list.push_back({{"style", style_of(finding.severity)},
                    {"word", word_of(finding.severity)},
                    {"code", name_of(finding.code)},
                    {"text", finding.text},
                    {"evidence", finding.evidence},
                    {"cure", finding.cure}});
  }
  return list;
}

json verdict_values(const ReportInput& input, const std::vector<Parameter>& parameters) {
  json numbers = json::array();
  for (json& merit :
       std::vector<json>{attitude_number(input), alignment_number(parameters), convergence_number(parameters, true),
                         convergence_number(parameters, false), navigation_number(input), forecast_number(input),
                         extension_number(input), nis_number(input)}) {
    if (!merit.is_null()) {
      numbers.push_back(std::move(merit));
    }
  }
  json rejected = rejected_of(named_counts(input.run.fix_counts), "fix", "fixes");
  if (input.run.beside_outages) {
    rejected.push_back(counted(input.run.beside_outages->fixes, "fix", "fixes") + " beside outages, not used");
  }
  for (const CorrelatedFixes& its : input.run.correlated_fixes) {
    rejected.push_back(counted(its.left_out, "fix", "fixes") +
                       fmt::format(" of star tracker {} with errors like those used, not used", its.head + 1));
  }
  for (json& line : rejected_of(named_counts(input.run.samples), "gyro sample", "gyro samples")) {
    rejected.push_back(std::move(line));
  }
  json undetermined = undetermined_of(parameters);
  // Of which no parameter alone is the place.
  const bool has_weak_axis = input.run.calibration.verdict.has(FindingCode::kWeakAlignmentAxis);
  const bool is_all_determined = undetermined.empty() && !has_weak_axis;
  return {{"verdict", verdict_of(input.run.calibration.verdict)},
          {"numbers", numbers},
          {"undetermined", std::move(undetermined)},
          {"has_weak_axis", has_weak_axis},
          {"is_all_determined", is_all_determined},
          {"rejected", rejected}};
}

}  // namespace trihedron::report
