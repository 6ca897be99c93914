#include "trihedron/report/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "assets.hpp"
#include "document.hpp"
#include "trihedron/records/text.hpp"
#include "units.hpp"
#include "wording.hpp"

namespace trihedron::report {
namespace {

using campaign::CampaignSummary;
using campaign::Consistency;
using campaign::Measure;
using campaign::MeasureStatistics;
using nlohmann::json;

/// Of a distribution over runs that is drawn; more are not told apart on a screen.
constexpr std::size_t kDrawnSteps = 400;
constexpr std::size_t kDrawnPoints = 1500;
constexpr std::size_t kScatters = 6;
constexpr std::size_t kShownReasons = 10;
constexpr std::size_t kShownCells = 500;
/// Errors of coefficients are shown in it: they are a thousandth of the coefficients.
constexpr double kNanoradianPerSecond = 1e-9;

const char* word_of_severity(FindingSeverity severity) {
  return severity == FindingSeverity::kNote ? "Note" : severity == FindingSeverity::kWarning ? "Warning" : "Do not use";
}

const char* style_of_severity(FindingSeverity severity) {
  return severity == FindingSeverity::kNote ? "note" : severity == FindingSeverity::kWarning ? "caution" : "bad";
}

std::string shown(const Measure& measure, double value) {
  if (!std::isfinite(value)) {
    return std::isinf(value) ? "not in the pass" : std::string(kNoEntry);
  }
  switch (measure.unit) {
    case Measure::Unit::kRadian:
      return angle(value, 3);
    case Measure::Unit::kSecond:
      return number(value / 60, 0) + " min";
    case Measure::Unit::kRatio:
      return "×" + significant(value, 3);
    case Measure::Unit::kNone:
      return significant(value, 3);
  }
  return {};
}

/// Of the true quantile: that side which matters.
std::string bound_text(const Measure& measure, const campaign::QuantileBounds& quantile) {
  const std::optional<double>& bound = measure.large_is_bad ? quantile.upper : quantile.lower;
  return !bound                  ? "too few runs"
         : std::isfinite(*bound) ? (measure.large_is_bad ? "≤ " : "≥ ") + shown(measure, *bound)
                                 : "no bound";
}

json finding_rows(const std::vector<campaign::CampaignFinding>& findings) {
  std::vector<campaign::CampaignFinding> sorted = findings;
  std::ranges::stable_sort(sorted, std::ranges::greater{}, &campaign::CampaignFinding::severity);
  json rows = json::array();
  for (const campaign::CampaignFinding& finding : sorted) {
    rows.push_back({{"word", word_of_severity(finding.severity)},
                    {"style", style_of_severity(finding.severity)},
                    {"code", finding.code},
                    {"text", finding.text},
                    {"evidence", finding.evidence},
                    {"cure", finding.cure}});
  }
  return rows;
}

json verdict_of_campaign(const CampaignSummary& summary) {
  const auto worst = std::ranges::max_element(summary.campaign_findings, {}, &campaign::CampaignFinding::severity);
  if (worst == summary.campaign_findings.end() || worst->severity == FindingSeverity::kNote) {
    std::string lead = "All runs came to their end.";
    const auto larger =
        std::ranges::find(summary.campaign_findings, "nees-below-bounds", &campaign::CampaignFinding::code);
    if (larger != summary.campaign_findings.end()) {
      lead += " " + larger->text;
    } else if (summary.nees) {
      lead += " The sigmas of the parameters are as large as the errors.";
    }
    return {{"style", "good"}, {"word", "Trustworthy"}, {"lead", lead}};
  }
  if (worst->severity == FindingSeverity::kWarning) {
    return {{"style", "caution"}, {"word", "Trustworthy, with warnings"}, {"lead", worst->text}};
  }
  return {{"style", "bad"}, {"word", "Do not use"}, {"lead", worst->text}};
}

json consistency_number(const char* name, const std::optional<Consistency>& consistency, int digits) {
  if (!consistency) {
    return {{"name", name}, {"value", "—"}, {"unit", ""}, {"note", "no trustworthy run"}};
  }
  const Consistency& its = *consistency;
  return {
      {"name", name},
      {"value", number(its.mean, digits)},
      {"unit", fmt::format(" of {}", significant(its.freedom, 3))},
      {"note", fmt::format("mean of {} trustworthy runs; of a consistent estimator {} … {} in 95\u00a0%", its.runs,
                           number(its.usual.low * its.freedom, digits), number(its.usual.high * its.freedom, digits))}};
}

json quantile_number(const MeasureStatistics& statistics, double p) {
  const auto quantile = std::ranges::find(statistics.quantiles, p, &campaign::QuantileBounds::p);
  const Measure& measure = *statistics.measure;
  json row = {{"name", fmt::format("{}, {}\u00a0% of the runs", measure.label, 100 * p)},
              {"value", "—"},
              {"unit", ""},
              {"note", "in no run"}};
  if (quantile != statistics.quantiles.end()) {
    const std::optional<double>& bound = measure.large_is_bad ? quantile->upper : quantile->lower;
    row["value"] = shown(measure, quantile->estimate);
    row["note"] = bound ? fmt::format("{} {} with 90\u00a0% confidence", measure.large_is_bad ? "at most" : "at least",
                                      shown(measure, *bound))
                        : fmt::format("too few runs for a bound: {} are needed", campaign::runs_needed(p));
  }
  return row;
}

const MeasureStatistics& of_measure(const std::vector<MeasureStatistics>& all, std::string_view key) {
  return *std::ranges::find_if(all, [&](const MeasureStatistics& its) { return its.measure->key == key; });
}

json numbers_of_campaign(const CampaignReportInput& input) {
  const CampaignSummary& summary = input.summary;
  const auto share = [&](RunOutcome outcome) {
    return fmt::format("{} %", significant(100.0 * static_cast<double>(summary.count(outcome)) /
                                               static_cast<double>(std::max<std::size_t>(input.records.size(), 1)),
                                           3));
  };
  const bool are_filters = input.plan.work == CampaignWork::kFilter;
  const auto quantile_of_trustworthy = [&](std::string_view key, double p) {
    return quantile_number(of_measure(summary.trustworthy, key), p);
  };
  json rows = {
      {{"name", "Trustworthy"},
       {"value", number(static_cast<double>(summary.count(RunOutcome::kTrustworthy)), 0)},
       {"unit", fmt::format(" of {} runs", number(static_cast<double>(input.records.size()), 0))},
       {"note", share(RunOutcome::kTrustworthy)}},
      {{"name", "Do not use"},
       {"value", number(static_cast<double>(summary.count(RunOutcome::kDoNotUse)), 0)},
       {"unit", " runs"},
       {"note", share(RunOutcome::kDoNotUse) + (are_filters ? ", whose filter began anew or used too few of the fixes"
                                                            : ", as the calibrations say themselves")}},
      {{"name", "Failed"},
       {"value", number(static_cast<double>(summary.count(RunOutcome::kFailed)), 0)},
       {"unit", " runs"},
       {"note", share(RunOutcome::kFailed) + ", in no statistic"}},
      consistency_number("NEES of the parameters", summary.nees, 1),
      consistency_number("NIS of the fixes", summary.nis, 3)};
  if (are_filters) {
    rows.push_back(quantile_of_trustworthy("attitude_rms", 0.95));
  } else {
    rows.push_back(quantile_of_trustworthy("open_loop_error", 0.997));
  }
  rows.push_back(quantile_of_trustworthy("alignment_error", 0.95));
  if (!are_filters) {
    rows.push_back(quantile_of_trustworthy("extension", 0.95));
  }
  return rows;
}

json measure_rows(const std::vector<MeasureStatistics>& statistics) {
  json rows = json::array();
  for (const MeasureStatistics& its : statistics) {
    if (its.quantiles.empty()) {
      continue;
    }
    json cells = json::array();
    for (const campaign::QuantileBounds& quantile : its.quantiles) {
      cells.push_back(
          {{"value", shown(*its.measure, quantile.estimate)}, {"bound", bound_text(*its.measure, quantile)}});
    }
    rows.push_back({{"label", its.measure->label}, {"runs", its.runs}, {"cells", cells}});
  }
  return rows;
}

/// What correction intervals cannot show; empty where they show all.
std::string watched_text(const CampaignReportInput& input) {
  const auto count = std::ranges::count_if(input.records, [](const RunRecord& record) {
    return record.outcome == RunOutcome::kTrustworthy && record.at(RunQuantity::kIntervalAfterIsLowerBound) == 1;
  });
  return count == 0 ? ""
                    : fmt::format(
                          "In {} of the {} trustworthy runs the attitude error was within {} for as long as the "
                          "pass let it be watched: their correction intervals and extensions are lower bounds.",
                          number(static_cast<double>(count), 0),
                          number(static_cast<double>(input.summary.count(RunOutcome::kTrustworthy)), 0),
                          limit_text(input.plan.limit_rad));
}

json quantile_heads() {
  json heads = json::array();
  for (const double p : campaign::kReportedQuantiles) {
    heads.push_back(fmt::format("{} %", 100 * p));
  }
  return heads;
}

json parameter_rows(const CampaignSummary& summary) {
  json rows = json::array();
  for (const campaign::ParameterErrors& its : summary.parameters) {
    if (its.runs == 0) {
      continue;
    }
    const auto as_shown = [](double ratio) { return std::round(1000 * ratio); };
    const bool off =
        as_shown(its.normalised) > as_shown(its.usual.high) || as_shown(its.normalised) < as_shown(its.usual.low);
    const auto sized = [&](double value) {
      return its.is_alignment ? angle(value, 3) : significant(value / kNanoradianPerSecond, 3) + " · 10⁻⁹ rad/s";
    };
    rows.push_back({{"name", its.name},
                    {"rms", sized(its.rms)},
                    {"sigma", sized(its.sigma)},
                    {"normalised", number(its.normalised, 3)},
                    {"low", number(its.usual.low, 3)},
                    {"high", number(its.usual.high, 3)},
                    {"off", off}});
  }
  return rows;
}

std::string mean_text(const std::optional<Consistency>& consistency, int digits) {
  return consistency ? number(consistency->mean, digits) : std::string(kNoEntry);
}

json cell_heads(const CampaignReportInput& input) {
  json heads = json::array();
  for (const std::size_t i : input.summary.grid) {
    heads.push_back(input.plan.inputs[i].key);
  }
  return heads;
}

json labels_of_cells(CampaignWork work) {
  json labels = json::array();
  for (const std::string_view key : campaign::cell_measures(work)) {
    labels.push_back(std::ranges::find(campaign::measures(), key, &Measure::key)->label);
  }
  return labels;
}

json cell_rows(const CampaignReportInput& input) {
  const CampaignSummary& summary = input.summary;
  json rows = json::array();
  for (std::size_t i = 0; i < std::min(kShownCells, summary.cells.size()); ++i) {
    const campaign::GridCell& cell = summary.cells[i];
    json point = json::array();
    for (std::size_t k = 0; k < summary.grid.size(); ++k) {
      point.push_back(campaign::text_of_draw(input.plan.inputs[summary.grid[k]], cell.point[k]));
    }
    json measures = json::array();
    for (const MeasureStatistics& its : cell.measures) {
      const std::optional<double> value = campaign::quantile_of(its, campaign::kCellQuantile);
      measures.push_back(value ? shown(*its.measure, *value) : std::string(kNoEntry));
    }
    rows.push_back(
        {{"point", point},
         {"trustworthy", fmt::format("{} of {}", cell.trustworthy, cell.finished + cell.failed)},
         {"nees", mean_text(cell.nees, 1)},
         {"nees_off", cell.nees && cell.nees->side() != 0},
         {"nees_band", cell.nees ? fmt::format("{} … {}", number(cell.nees->usual.low * cell.nees->freedom, 1),
                                               number(cell.nees->usual.high * cell.nees->freedom, 1))
                                 : ""},
         {"nis", mean_text(cell.nis, 3)},
         {"nis_off", cell.nis && cell.nis->side() != 0},
         {"measures", measures}});
  }
  return rows;
}

json influence_rows(const CampaignReportInput& input) {
  json rows = json::array();
  for (const campaign::Influence& influence : input.summary.influences) {
    if (influence.is_significant) {
      rows.push_back(
          {{"key", campaign::influential(input.plan.inputs[influence.input])},
           {"measure", influence.measure->label},
           {"rho", signed_number(influence.correlation.rho, 2)},
           {"p", influence.correlation.p_value < 1e-12 ? std::string("< 10⁻¹²")
                                                       : fmt::format("{:.1e}", influence.correlation.p_value)},
           {"runs", influence.correlation.count}});
    }
  }
  return rows;
}

json worst_rows(const CampaignReportInput& input) {
  json rows = json::array();
  for (const campaign::WorstRun& worst : input.summary.worst) {
    rows.push_back({{"run", worst.run},
                    {"why", worst.why},
                    {"value", worst.measure != nullptr ? shown(*worst.measure, worst.value) : ""},
                    {"command", fmt::format("{} --only {}", input.command, worst.run)}});
  }
  return rows;
}

std::string amount(double value, const std::string& unit) { return fmt::format("{:.6g}{}", value, unit); }

std::string distribution_text(const CampaignPlan& plan, const CampaignInput& input) {
  const Distribution& its = input.distribution;
  std::string options;
  for (std::size_t i = 0; i < input.options.size(); ++i) {
    options += (i == 0 ? "" : ", ") + (input.is_number() ? amount(input.numbers[i], input.unit) : input.options[i]);
  }
  switch (its.kind) {
    case Distribution::Kind::kUniform:
      return fmt::format("uniform from {} to {}", amount(its.a, input.unit), amount(its.b, input.unit));
    case Distribution::Kind::kLoguniform:
      return fmt::format("log-uniform from {} to {}", amount(its.a, input.unit), amount(its.b, input.unit));
    case Distribution::Kind::kNormal:
      return fmt::format("normal, mean {}, 1σ {}, within {} … {}", amount(its.a, input.unit), amount(its.b, input.unit),
                         amount(its.least, input.unit), amount(its.most, input.unit));
    case Distribution::Kind::kLognormal:
      return fmt::format("log-normal, median {}, 1σ a factor of {}", amount(its.a, input.unit), amount(its.b, ""));
    case Distribution::Kind::kChoice:
      return "one of " + options;
    case Distribution::Kind::kGrid:
      return "each of " + options;
    case Distribution::Kind::kFollows:
      return (its.a == 1 ? "" : amount(its.a, "") + " times ") + plan.inputs[input.followed].key;
  }
  return {};
}

json input_rows(const CampaignPlan& plan) {
  json rows = json::array();
  for (const CampaignInput& input : plan.inputs) {
    rows.push_back({{"key", input.key}, {"distribution", distribution_text(plan, input)}});
  }
  return rows;
}

json count_rows(const std::map<std::string, std::size_t>& counts) {
  std::vector<std::pair<std::string, std::size_t>> sorted(counts.begin(), counts.end());
  std::ranges::stable_sort(sorted, std::ranges::greater{}, [](const auto& row) { return row.second; });
  json rows = json::array();
  for (std::size_t i = 0; i < std::min(kShownReasons, sorted.size()); ++i) {
    rows.push_back({{"name", sorted[i].first}, {"count", sorted[i].second}});
  }
  return rows;
}

/// Angles in ″, times in minutes.
double drawn(const Measure& measure, double value) {
  switch (measure.unit) {
    case Measure::Unit::kRadian:
      return value / kArcsecond_rad;
    case Measure::Unit::kSecond:
      return value / 60;
    case Measure::Unit::kRatio:
    case Measure::Unit::kNone:
      return value;
  }
  return value;
}

const char* drawn_unit(const Measure& measure) {
  return measure.unit == Measure::Unit::kRadian ? "angle" : measure.unit == Measure::Unit::kSecond ? "min" : "";
}

/// Share of the trustworthy runs that do not exceed a value; infinite values only count.
json cumulative(const Measure& measure, const CampaignReportInput& input) {
  std::vector<double> values;
  std::size_t all = 0;
  for (const RunRecord& record : input.records) {
    const double value = measure.of(record);
    if (record.outcome == RunOutcome::kTrustworthy && !std::isnan(value)) {
      ++all;
      if (std::isfinite(value)) {
        values.push_back(drawn(measure, value));
      }
    }
  }
  if (values.empty()) {
    return nullptr;
  }
  std::ranges::sort(values);
  json x = json::array();
  json y = json::array();
  const std::size_t steps = std::min(kDrawnSteps, values.size());
  for (std::size_t i = 0; i < steps; ++i) {
    const std::size_t at = steps == 1 ? 0 : i * (values.size() - 1) / (steps - 1);
    x.push_back(values[at]);
    y.push_back(static_cast<double>(at + 1) / static_cast<double>(all));
  }
  json bounds = json::array();
  for (const campaign::QuantileBounds& quantile : of_measure(input.summary.trustworthy, measure.key).quantiles) {
    const double share = measure.large_is_bad ? quantile.p : 1 - quantile.p;
    const auto finite = [&](const std::optional<double>& value) -> json {
      return value && std::isfinite(*value) ? json(drawn(measure, *value)) : json(nullptr);
    };
    bounds.push_back({{"share", share}, {"lower", finite(quantile.lower)}, {"upper", finite(quantile.upper)}});
  }
  return {{"label", measure.label}, {"unit", drawn_unit(measure)}, {"x", x}, {"y", y}, {"bounds", bounds}};
}

/// The distribution that the NEES of a consistent estimator has.
json expected_nees(const CampaignSummary& summary) {
  json x = json::array();
  json y = json::array();
  const double freedom = summary.nees->freedom;
  constexpr int kSteps = 120;
  for (int i = 1; i < kSteps; ++i) {
    const double share = static_cast<double>(i) / kSteps;
    x.push_back(campaign::chi_square_quantile(share, freedom));
    y.push_back(share);
  }
  return {{"x", x}, {"y", y}};
}

json heatmap_of(const CampaignReportInput& input) {
  json keys = json::array();
  json rows = json::array();
  json significant_rows = json::array();
  json labels = json::array();
  for (const Measure& measure : campaign::measures()) {
    labels.push_back(measure.label);
  }
  for (std::size_t i = 0; i < input.plan.inputs.size(); ++i) {
    json row = json::array();
    json marks = json::array();
    bool any = false;
    for (const Measure& measure : campaign::measures()) {
      const auto found = std::ranges::find_if(input.summary.influences, [&](const campaign::Influence& influence) {
        return influence.input == i && influence.measure->key == measure.key;
      });
      const bool is_there = found != input.summary.influences.end();
      any = any || is_there;
      row.push_back(is_there ? json(found->correlation.rho) : json(nullptr));
      marks.push_back(is_there && found->is_significant ? signed_number(found->correlation.rho, 2) : "");
    }
    if (any) {
      keys.push_back(campaign::influential(input.plan.inputs[i]));
      rows.push_back(row);
      significant_rows.push_back(marks);
    }
  }
  if (keys.empty()) {
    return nullptr;
  }
  return {{"keys", keys}, {"measures", labels}, {"rho", rows}, {"marks", significant_rows}};
}

json scatters_of(const CampaignReportInput& input) {
  json all = json::array();
  for (const campaign::Influence& influence : input.summary.influences) {
    if (!influence.is_significant || all.size() == kScatters) {
      continue;
    }
    const CampaignInput& varied = input.plan.inputs[influence.input];
    json x = json::array();
    json y = json::array();
    json run = json::array();
    const std::size_t every = (input.records.size() + kDrawnPoints - 1) / kDrawnPoints;
    for (std::size_t i = 0; i < input.records.size(); i += every) {
      const RunRecord& record = input.records[i];
      const double value = influence.measure->of(record);
      if (record.outcome != RunOutcome::kFailed && std::isfinite(value)) {
        x.push_back(varied.shown(record.draws[influence.input]));
        y.push_back(drawn(*influence.measure, value));
        run.push_back(record.run);
      }
    }
    const auto kind = varied.distribution.kind;
    all.push_back({{"key", varied.key},
                   {"key_unit", varied.unit},
                   {"words", varied.is_number() ? json(nullptr) : json(varied.options)},
                   {"log", kind == Distribution::Kind::kLoguniform || kind == Distribution::Kind::kLognormal},
                   {"label", influence.measure->label},
                   {"unit", drawn_unit(*influence.measure)},
                   {"rho", influence.correlation.rho},
                   {"x", x},
                   {"y", y},
                   {"run", run}});
  }
  return all;
}

json facts_of_campaign(const CampaignPlan& plan) {
  const auto fact = [](const char* name, std::string value) -> json {
    return {{"name", name}, {"value", std::move(value)}};
  };
  return {fact("Runs", number(static_cast<double>(plan.runs), 0)), fact("Seed", std::to_string(plan.seed)),
          fact("Sampling", plan.latin_hypercube ? "Latin hypercube" : "random"),
          fact("Values drawn", std::to_string(plan.inputs.size())),
          plan.work == CampaignWork::kFilter ? fact("Work", "the filter alone")
                                             : fact("Error limit", limit_text(plan.limit_rad))};
}

}  // namespace

std::string render_campaign(const CampaignReportInput& input) {
  const CampaignSummary& summary = input.summary;
  json figures = {{"ecdf", json::object()}, {"scatters", scatters_of(input)}};
  json drawn_measures = json::array();
  for (const Measure& measure : campaign::measures()) {
    json data = cumulative(measure, input);
    if (!data.is_null() && measure.key == "nees" && summary.nees) {
      data["expected"] = expected_nees(summary);
    }
    if (!data.is_null()) {
      drawn_measures.push_back({{"key", measure.key},
                                {"label", measure.label},
                                {"about", measure.about},
                                {"is_nees", measure.key == "nees"}});
      figures["ecdf"][std::string(measure.key)] = std::move(data);
    }
  }
  if (json heatmap = heatmap_of(input); !heatmap.is_null()) {
    figures["influences"] = std::move(heatmap);
  }
  json scatters = json::array();
  for (const json& scatter : figures["scatters"]) {
    scatters.push_back({{"number", scatters.size()}, {"key", scatter["key"]}, {"label", scatter["label"]}});
  }
  json values = {{"spacecraft", input.plan.name},
                 {"facts", facts_of_campaign(input.plan)},
                 {"verdict", verdict_of_campaign(summary)},
                 {"numbers", numbers_of_campaign(input)},
                 {"findings", finding_rows(summary.campaign_findings)},
                 {"quantiles", quantile_heads()},
                 {"measures", measure_rows(summary.trustworthy)},
                 {"has_extension", input.plan.work != CampaignWork::kFilter},
                 {"has_all", summary.count(RunOutcome::kDoNotUse) > 0},
                 {"all", measure_rows(summary.all)},
                 {"watched", watched_text(input)},
                 {"needed", campaign::runs_needed(campaign::kReportedQuantiles.back())},
                 {"parameters", parameter_rows(summary)},
                 {"has_cells", !summary.cells.empty()},
                 {"cell_heads", cell_heads(input)},
                 {"cell_measures", labels_of_cells(input.plan.work)},
                 {"cells", cell_rows(input)},
                 {"more_cells", summary.cells.size() > kShownCells
                                    ? fmt::format("The first {} of {} points are here; --json has all.", kShownCells,
                                                  summary.cells.size())
                                    : ""},
                 {"drawn", drawn_measures},
                 {"draws_influences", figures.contains("influences")},
                 {"influences", influence_rows(input)},
                 {"pairs", summary.pairs},
                 {"scatters", scatters},
                 {"worst", worst_rows(input)},
                 {"codes", count_rows(summary.findings)},
                 {"reasons", count_rows(summary.reasons)},
                 {"inputs", input_rows(input.plan)}};
  return html_of(
      {.title = "Campaign",
       .kind = "Monte Carlo campaign of gyro calibrations",
       .first_section = "verdict",
       .reading_notes = "Errors are estimate − truth; sigmas are one standard deviation.",
       .content = assets::kCampaign,
       .script = std::string(assets::kFigures) + std::string(assets::kCampaignFigures) + std::string(assets::kReport),
       .figures = std::move(figures)},
      std::move(values));
}

}  // namespace trihedron::report
