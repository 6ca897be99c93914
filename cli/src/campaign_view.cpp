#include "campaign_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "summary.hpp"
#include "trihedron/records/finding.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {
namespace {

using campaign::CampaignSummary;
using campaign::Consistency;
using campaign::Measure;
using campaign::MeasureStatistics;
using nlohmann::ordered_json;

constexpr std::size_t kShownInfluences = 10;
constexpr std::size_t kShownCells = 60;

std::string measure_text(const Measure& measure, double value) {
  if (!std::isfinite(value)) {
    return std::string(kNoEntry);
  }
  switch (measure.unit) {
    case Measure::Unit::kRadian:
      return angle_text(value);
    case Measure::Unit::kSecond:
      return fmt::format("{:.0f} min", value / 60);
    case Measure::Unit::kRatio:
    case Measure::Unit::kNone:
      return three_digits(value);
  }
  return {};
}

std::size_t characters_of(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](unsigned char c) { return (c & 0xC0U) != 0x80U; }));
}

/// Fills the columns by characters, not by bytes.
std::string right(const std::string& text, std::size_t columns) {
  return std::string(columns - std::min(columns, characters_of(text)), ' ') + text;
}

std::string consistency_text(const char* name, const std::optional<Consistency>& consistency, int digits) {
  if (!consistency) {
    return "";
  }
  const Consistency& its = *consistency;
  return fmt::format(
      "{:<12}{:.{}f} of {:.{}f}, mean over {} trustworthy runs; 95 % of consistent campaigns: {:.{}f} … "
      "{:.{}f}; {:.1f} % of the runs in their own 95 %\n",
      name, its.mean, digits, its.freedom, digits == 1 ? 0 : 2, its.runs, its.usual.low * its.freedom, digits,
      its.usual.high * its.freedom, digits, 100 * its.within);
}

/// Each quantile, and below it its upper bound.
std::string measures_text(const std::vector<MeasureStatistics>& statistics, const char* whose) {
  const bool some_are_reached = std::ranges::any_of(
      statistics, [](const MeasureStatistics& its) { return !its.quantiles.empty() && !its.measure->large_is_bad; });
  std::string text = fmt::format("\nOver the {} runs, not exceeded{} by a share of\n{:<50}", whose,
                                 some_are_reached ? " (intervals and extension: reached)" : "", "");
  for (const double p : campaign::kReportedQuantiles) {
    text += right(fmt::format("{:g} %", 100 * p), 11);
  }
  text += "   runs\n";
  for (const MeasureStatistics& its : statistics) {
    if (its.quantiles.empty()) {
      continue;
    }
    std::string row = fmt::format("  {:<48}", its.measure->label);
    std::string bound = fmt::format("  {:<48}", "  with 90 % confidence");
    for (const campaign::QuantileBounds& quantile : its.quantiles) {
      row += right(measure_text(*its.measure, quantile.estimate), 11);
      const std::optional<double>& worst = its.measure->large_is_bad ? quantile.upper : quantile.lower;
      bound +=
          right(worst ? (its.measure->large_is_bad ? "≤ " : "≥ ") + measure_text(*its.measure, *worst) : "too few", 11);
    }
    text += fmt::format("{} {:>6}\n{}\n", row, its.runs, bound);
  }
  return text;
}

/// An arrow where the mean is outside of what 95 % of consistent campaigns have.
std::string marked(const std::optional<Consistency>& consistency, int digits) {
  return consistency ? fmt::format("{:.{}f} {}", consistency->mean, digits,
                                   consistency->side() < 0   ? "↓"
                                   : consistency->side() > 0 ? "↑"
                                                             : " ")
                     : std::string(kNoEntry) + "  ";
}

std::string cells_text(const CampaignPlan& plan, const CampaignSummary& summary) {
  if (summary.cells.empty()) {
    return "";
  }
  std::vector<std::vector<std::string>> rows = {{}};
  for (const std::size_t input : summary.grid) {
    rows.front().push_back(printable(plan.inputs[input].key));
  }
  for (const char* const head : {"runs", "trust", "NEES  ", "NIS  "}) {
    rows.front().emplace_back(head);
  }
  for (const std::string_view key : campaign::cell_measures(plan.work)) {
    std::string& head = rows.front().emplace_back(key);
    std::ranges::replace(head, '_', ' ');
  }
  for (const campaign::GridCell& cell : summary.cells) {
    if (rows.size() > kShownCells) {
      break;
    }
    std::vector<std::string>& row = rows.emplace_back();
    for (std::size_t i = 0; i < summary.grid.size(); ++i) {
      row.push_back(printable(campaign::text_of_draw(plan.inputs[summary.grid[i]], cell.point[i])));
    }
    row.push_back(std::to_string(cell.finished + cell.failed));
    row.push_back(std::to_string(cell.trustworthy));
    row.push_back(marked(cell.nees, 1));
    row.push_back(marked(cell.nis, 3));
    for (const MeasureStatistics& its : cell.measures) {
      const std::optional<double> value = campaign::quantile_of(its, campaign::kCellQuantile);
      row.push_back(value ? measure_text(*its.measure, *value) : std::string(kNoEntry));
    }
  }
  std::vector<std::size_t> widths(rows.front().size());
  for (const std::vector<std::string>& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], characters_of(row[i]));
    }
  }
  std::string text = fmt::format(
      "\nBy the grid: means over the trustworthy runs, ↑ ↓ outside of what 95 % of consistent estimators have; errors "
      "that {0:g} % of the runs do not exceed{1}\n",
      100 * campaign::kCellQuantile,
      plan.work == CampaignWork::kFilter
          ? ""
          : fmt::format(", extensions that {:g} % reach", 100 * campaign::kCellQuantile));
  for (const std::vector<std::string>& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      text += "  " + right(row[i], widths[i]);
    }
    text += '\n';
  }
  return text + (summary.cells.size() > kShownCells ? fmt::format("  … and {} more, in report.html and with --json\n",
                                                                  summary.cells.size() - kShownCells)
                                                    : "");
}

std::string influences_text(const CampaignPlan& plan, const CampaignSummary& summary) {
  std::string text;
  std::size_t shown = 0;
  std::size_t significant = 0;
  for (const campaign::Influence& influence : summary.influences) {
    if (!influence.is_significant) {
      continue;
    }
    ++significant;
    if (shown < kShownInfluences) {
      ++shown;
      text += fmt::format("  {:+.2f}  {:<40} {}\n", influence.correlation.rho,
                          campaign::influential(plan.inputs[influence.input]), influence.measure->label);
    }
  }
  if (summary.pairs == 0) {
    return "";
  }
  return fmt::format("\nWhat matters: rank correlations that chance does not make, {} of {}{}\n", significant,
                     summary.pairs, significant > shown ? fmt::format("; the strongest {}", shown) : "") +
         text;
}

std::string worst_text(const CampaignSummary& summary, const std::string& command) {
  if (summary.worst.empty()) {
    return "";
  }
  std::string text = "\nWorst runs\n";
  for (const campaign::WorstRun& worst : summary.worst) {
    text += fmt::format("  {:>7}  {}{}\n", worst.run, worst.why,
                        worst.measure != nullptr ? ": " + measure_text(*worst.measure, worst.value) : "");
  }
  return text + fmt::format("  each again by: {} --only {}\n", command, summary.worst.front().run);
}

std::string finding_lines(const campaign::CampaignFinding& finding) {
  return fmt::format("  {}: {}\n    {}\n    → {}\n", finding.code, finding.text, finding.evidence, finding.cure);
}

ordered_json consistency_json(const std::optional<Consistency>& consistency) {
  if (!consistency) {
    return nullptr;
  }
  return {{"runs", consistency->runs},
          {"mean", consistency->mean},
          {"degrees_of_freedom", consistency->freedom},
          {"usual_low", consistency->usual.low * consistency->freedom},
          {"usual_high", consistency->usual.high * consistency->freedom},
          {"limit_low", consistency->limit.low * consistency->freedom},
          {"limit_high", consistency->limit.high * consistency->freedom},
          {"share_of_runs_within_95_percent", consistency->within},
          {"sigma_factor", consistency->sigma_factor()}};
}

ordered_json measures_json(const std::vector<MeasureStatistics>& statistics) {
  ordered_json json = ordered_json::object();
  for (const MeasureStatistics& its : statistics) {
    ordered_json quantiles = ordered_json::array();
    for (const campaign::QuantileBounds& quantile : its.quantiles) {
      ordered_json one = {{"share", quantile.p}, {"value", quantile.estimate}, {"lower", nullptr}, {"upper", nullptr}};
      if (quantile.lower) {
        one["lower"] = *quantile.lower;
      }
      if (quantile.upper) {
        one["upper"] = *quantile.upper;
      }
      quantiles.push_back(std::move(one));
    }
    const Measure::Unit unit = its.measure->unit;
    json[std::string(its.measure->key)] = {{"unit", unit == Measure::Unit::kRadian   ? "rad"
                                                    : unit == Measure::Unit::kSecond ? "s"
                                                                                     : "1"},
                                           {"runs", its.runs},
                                           {"quantiles", std::move(quantiles)}};
  }
  return json;
}

ordered_json counts_json(const std::map<std::string, std::size_t>& counts) {
  ordered_json json = ordered_json::object();
  for (const auto& [name, count] : counts) {
    json[name] = count;
  }
  return json;
}

ordered_json cells_json(const CampaignPlan& plan, const CampaignSummary& summary) {
  ordered_json cells = ordered_json::array();
  for (const campaign::GridCell& cell : summary.cells) {
    ordered_json values = ordered_json::object();
    for (std::size_t i = 0; i < summary.grid.size(); ++i) {
      const CampaignInput& input = plan.inputs[summary.grid[i]];
      values[input.key] = campaign::text_of_draw(input, cell.point[i]);
    }
    cells.push_back({{"values", values},
                     {"outcomes",
                      {{"trustworthy", cell.trustworthy},
                       {"do_not_use", cell.finished - cell.trustworthy},
                       {"failed", cell.failed}}},
                     {"nees", consistency_json(cell.nees)},
                     {"nis", consistency_json(cell.nis)},
                     {"measures", measures_json(cell.measures)}});
  }
  return cells;
}

}  // namespace

std::string campaign_text(const CampaignPlan& plan, const CampaignSummary& summary, const std::string& command) {
  std::string text = fmt::format(
      "Campaign    {}: {} runs, seed {}, {} over {} value{}\n"
      "Verdict     {}\n"
      "Runs        {} trustworthy, {} do not use, {} failed\n",
      printable(plan.name), plan.runs, plan.seed, plan.latin_hypercube ? "Latin hypercube" : "drawn",
      plan.inputs.size(), plan.inputs.size() == 1 ? "" : "s",
      summary.trustworthy_campaign() ? "trustworthy" : "DO NOT USE", summary.count(RunOutcome::kTrustworthy),
      summary.count(RunOutcome::kDoNotUse), summary.count(RunOutcome::kFailed));
  for (const campaign::CampaignFinding& finding : summary.campaign_findings) {
    text += finding_lines(finding);
  }
  text += consistency_text("NEES", summary.nees, 1) + consistency_text("NIS", summary.nis, 3);
  if (summary.count(RunOutcome::kTrustworthy) > 0) {
    text += measures_text(summary.trustworthy, "trustworthy");
  } else if (summary.count(RunOutcome::kDoNotUse) > 0) {
    text += measures_text(summary.all, "finished");
  }
  return text + cells_text(plan, summary) + influences_text(plan, summary) + worst_text(summary, command) + "\n";
}

ordered_json campaign_json(const CampaignPlan& plan, const CampaignSummary& summary, const std::string& command) {
  ordered_json findings = ordered_json::array();
  for (const campaign::CampaignFinding& finding : summary.campaign_findings) {
    findings.push_back(finding_json(finding.code, finding.text, finding.evidence, finding.cure, finding.severity));
  }
  ordered_json parameters = ordered_json::object();
  for (const campaign::ParameterErrors& its : summary.parameters) {
    parameters[its.name] = {{"runs", its.runs},           {"rms", its.rms},
                            {"sigma", its.sigma},         {"normalised_rms", its.normalised},
                            {"usual_low", its.usual.low}, {"usual_high", its.usual.high}};
  }
  ordered_json influences = ordered_json::array();
  for (const campaign::Influence& influence : summary.influences) {
    const CampaignInput& input = plan.inputs[influence.input];
    influences.push_back({{"key", input.key},
                          {"word", input.is_number() ? ordered_json() : ordered_json(input.options.back())},
                          {"measure", influence.measure->key},
                          {"runs", influence.correlation.count},
                          {"rank_correlation", influence.correlation.rho},
                          {"p_value", influence.correlation.p_value},
                          {"significant", influence.is_significant}});
  }
  ordered_json worst = ordered_json::array();
  for (const campaign::WorstRun& run : summary.worst) {
    ordered_json one = {{"run", run.run}, {"why", run.why}, {"command", fmt::format("{} --only {}", command, run.run)}};
    if (run.measure != nullptr) {
      one["measure"] = run.measure->key;
      one["value"] = run.value;
    }
    worst.push_back(std::move(one));
  }
  return {{"campaign", plan.name},
          {"seed", plan.seed},
          {"runs", plan.runs},
          {"trustworthy", summary.trustworthy_campaign()},
          {"outcomes",
           {{"trustworthy", summary.count(RunOutcome::kTrustworthy)},
            {"do_not_use", summary.count(RunOutcome::kDoNotUse)},
            {"failed", summary.count(RunOutcome::kFailed)}}},
          {"findings", findings},
          {"findings_of_runs", counts_json(summary.findings)},
          {"reasons_of_failures", counts_json(summary.reasons)},
          {"nees", consistency_json(summary.nees)},
          {"nees_of_all", consistency_json(summary.nees_of_all)},
          {"nis", consistency_json(summary.nis)},
          {"confidence", campaign::kConfidence},
          {"measures", measures_json(summary.trustworthy)},
          {"measures_of_all", measures_json(summary.all)},
          {"parameters", parameters},
          {"cells", cells_json(plan, summary)},
          {"influences", influences},
          {"worst", worst}};
}

std::string run_text(const CampaignPlan& plan, const RunRecord& record) {
  std::string text =
      fmt::format("Run         {} of {}, {}; seed of its scenario {}\n", record.run, printable(plan.name),
                  record.outcome == RunOutcome::kTrustworthy ? "trustworthy"
                  : record.outcome == RunOutcome::kDoNotUse  ? "DO NOT USE"
                                                             : "FAILED",
                  record.seed);
  if (!record.reason.empty()) {
    text += fmt::format("  {}\n", printable(record.reason));
  }
  for (const std::string& code : record.findings) {
    text += fmt::format("  finding {}\n", code);
  }
  for (std::size_t i = 0; i < plan.inputs.size(); ++i) {
    const CampaignInput& input = plan.inputs[i];
    text += fmt::format("  {} = {}\n", input.key, printable(campaign::text_of_draw(input, record.draws[i])));
  }
  if (record.outcome != RunOutcome::kFailed) {
    text += fmt::format("NEES        {} of {:.0f}; NIS {:.3f}\n", three_digits(record.at(RunQuantity::kNees)),
                        record.at(RunQuantity::kNeesFreedom), record.at(RunQuantity::kNisMean));
    for (const Measure& measure : campaign::measures()) {
      if (const double value = measure.of(record); plan.work == CampaignWork::kCalibrate || !std::isnan(value)) {
        text += fmt::format("  {:<48}{}\n", measure.label, right(measure_text(measure, value), 11));
      }
    }
  }
  return text;
}

ordered_json run_json(const CampaignPlan& plan, const RunRecord& record) {
  ordered_json draws = ordered_json::object();
  for (std::size_t i = 0; i < plan.inputs.size(); ++i) {
    const CampaignInput& input = plan.inputs[i];
    draws[input.key] = input.is_number() ? fmt::format("{}{}", input.shown(record.draws[i]), input.unit)
                                         : input.options[static_cast<std::size_t>(record.draws[i])];
  }
  ordered_json values = ordered_json::object();
  for (const RunQuantityRow& row : kRunQuantityRows) {
    values[std::string(row.name)] = record[row.quantity];
  }
  return {{"run", record.run},
          {"seed", record.seed},
          {"draws", draws},
          {"outcome", name_of(record.outcome)},
          {"reason", record.reason},
          {"drift_model", record.drift_model},
          {"findings", record.findings},
          {"values", values}};
}

}  // namespace trihedron::cli
