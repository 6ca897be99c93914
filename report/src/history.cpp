#include "trihedron/report/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "assets.hpp"
#include "document.hpp"
#include "parameters.hpp"
#include "trihedron/records/text.hpp"
#include "units.hpp"
#include "verdict.hpp"
#include "wording.hpp"

namespace trihedron::report {
namespace {

using nlohmann::json;
using Catalogue = std::vector<CatalogueEntry>;

/// Reference value that is subtracted from an alignment in the figure, rad: its mean over the start-ups, or the first
/// value.
double reference_of(const ParameterId& state, const Catalogue& catalogue, const ground::History& history) {
  const auto spread = std::ranges::find(history.spreads, state, &ground::Spread::state);
  if (spread != history.spreads.end()) {
    return spread->mean;
  }
  const auto first = std::ranges::find_if(
      catalogue, [&](const auto& entry) { return !std::isnan(value_of(entry.calibration, state)); });
  return value_of(first->calibration, state);
}

/// Drift in 10⁻⁶ rad/s; alignment in ″ from its reference. NaN, in JSON null, where a calibration does not have the
/// state.
json trend_of(const ParameterId& state, const Catalogue& catalogue, const ground::History& history) {
  const double unit = state.is_alignment() ? kArcsecond_rad : kMicroradian;
  const double zero = state.is_alignment() ? reference_of(state, catalogue, history) : 0;
  json value = json::array();
  json sigma = json::array();
  for (const CatalogueEntry& entry : catalogue) {
    value.push_back((value_of(entry.calibration, state) - zero) / unit);
    sigma.push_back(sigma_of(entry.calibration, state) / unit);
  }
  json trend = {{"gyro", state.gyro() + 1},
                {"name", short_name_of(state)},
                {"symbol", symbol_of(state)},
                {"value", value},
                {"sigma", sigma}};
  if (state.is_alignment()) {
    trend["from"] = (zero > 0 ? "+" : "") + angle(zero, 4);
  }
  return trend;
}

json figure_data(const Catalogue& catalogue, const ground::History& history) {
  json calibrations = json::array();
  for (const CatalogueEntry& entry : catalogue) {
    calibrations.push_back({{"epoch", calendar(entry.calibration.epoch)},
                            {"pass", entry.pass},
                            {"passes", entry.passes},
                            {"start_up", entry.start_up},
                            {"trustworthy", entry.calibration.verdict.trustworthy}});
  }
  json trends = json::array();
  for (const ParameterId& state : ground::states_of(catalogue)) {
    trends.push_back(trend_of(state, catalogue, history));
  }
  return {{"calibrations", calibrations}, {"trends", trends}};
}

json calibration_rows(const Catalogue& catalogue) {
  json rows = json::array();
  for (const CatalogueEntry& entry : catalogue) {
    const Verdict& verdict = entry.calibration.verdict;
    json codes = json::array();
    for (const Finding& finding : verdict.findings) {
      codes.push_back(name_of(finding.code));
    }
    rows.push_back({{"number", rows.size() + 1},
                    {"epoch", calendar(entry.calibration.epoch)},
                    {"start_up", entry.start_up},
                    {"pass", entry.pass},
                    {"passes", entry.passes},
                    {"estimator", name_of(entry.calibration.estimator)},
                    {"model", name_of(entry.calibration.gyros.front().drift_model)},
                    {"trustworthy", verdict.trustworthy},
                    {"codes", codes}});
  }
  return rows;
}

/// Once each, for the figures.
json names_of(const Catalogue& catalogue, bool alignments) {
  json names = json::array();
  std::set<std::string> seen;
  for (const ParameterId& state : ground::states_of(catalogue)) {
    if (state.is_alignment() == alignments && seen.insert(short_name_of(state)).second) {
      names.push_back({{"name", short_name_of(state)}, {"symbol", symbol_of(state)}});
    }
  }
  return names;
}

std::string full_symbol_of(const ParameterId& state) {
  return fmt::format("{}, gyro {}", symbol_of(state), state.gyro() + 1);
}

json agreement_of(const ground::Agreement& agreement) {
  return {{"chi_square", significant(agreement.chi_square, 3)},
          {"freedom", agreement.degrees_of_freedom},
          {"limit", significant(agreement.limit, 3)},
          {"changed", !agreement.holds()}};
}

json change_rows(const ground::History& history) {
  json rows = json::array();
  for (const ground::StartUpChange& change : history.changes) {
    const auto greatest = std::ranges::max_element(
        change.parameters, {}, [](const ground::ParameterChange& one) { return std::abs(one.change / one.sigma); });
    rows.push_back({{"from", change.from},
                    {"to", change.to},
                    {"coefficients", agreement_of(change.coefficients)},
                    {"alignments", agreement_of(change.alignments)},
                    {"greatest", greatest == change.parameters.end()
                                     ? "—"
                                     : fmt::format("{}: {} σ", full_symbol_of(greatest->state),
                                                   signed_number(greatest->change / greatest->sigma, 1))}});
  }
  return rows;
}

/// Of values and of sigmas in the table of one kind.
struct ShownUnits {
  AngleUnit value{kMicroradian, "10⁻⁶ rad/s"};
  AngleUnit sigma{kMicroradian, "10⁻⁶ rad/s"};
};

ShownUnits units_of_alignments(const ground::History& history) {
  std::vector<double> means;
  std::vector<double> sigmas;
  for (const ground::Spread& spread : history.spreads) {
    if (spread.state.is_alignment()) {
      means.push_back(spread.mean);
      sigmas.push_back(spread.next_sigma);
    }
  }
  return {unit_of_angles(means), unit_of_angles(sigmas)};
}

/// Coefficients, and alignments in units of their own.
json spread_tables(const ground::History& history) {
  json tables = json::array();
  for (const bool alignments : {false, true}) {
    const ShownUnits units = alignments ? units_of_alignments(history) : ShownUnits{};
    json rows = json::array();
    for (const ground::Spread& spread : history.spreads) {
      if (spread.state.is_alignment() == alignments) {
        rows.push_back(
            {{"symbol", full_symbol_of(spread.state)},
             {"start_ups", spread.start_ups},
             {"mean", signed_number(spread.mean / units.value.rad, decimals_for(spread.next_sigma / units.value.rad))},
             {"deviation", significant(spread.deviation / units.sigma.rad, 2)},
             {"next", significant(spread.next_sigma / units.sigma.rad, 2)}});
      }
    }
    tables.push_back({{"what", alignments ? "Alignment" : "Coefficient"},
                      {"unit", units.value.symbol},
                      {"sigma_unit", units.sigma.symbol},
                      {"rows", rows}});
  }
  return tables;
}

json facts_of(const Catalogue& catalogue, const ground::History& history) {
  const auto fact = [](const char* name, std::string value) -> json {
    return {{"name", name}, {"value", std::move(value)}};
  };
  json facts = {fact("Calibrations", std::to_string(catalogue.size())),
                fact("Start-ups to be compared", std::to_string(history.start_ups.size()))};
  if (!catalogue.empty()) {
    facts.push_back(fact("First pass", calendar(catalogue.front().calibration.epoch)));
    facts.push_back(fact("Last pass", calendar(catalogue.back().calibration.epoch)));
  }
  return facts;
}

}  // namespace

std::string render_history(const Catalogue& catalogue, const ground::History& history) {
  const json changes = change_rows(history);
  json values = {{"spacecraft", catalogue.empty() ? "Empty catalogue" : catalogue.front().spacecraft},
                 {"facts", facts_of(catalogue, history)},
                 {"calibrations", calibration_rows(catalogue)},
                 {"coefficients", names_of(catalogue, false)},
                 {"alignments", names_of(catalogue, true)},
                 {"has_changes", !changes.empty()},
                 {"changes", changes},
                 {"spreads", spread_tables(history)},
                 {"findings", findings_of(history.findings)}};
  return html_of({.title = "History of gyro calibrations",
                  .kind = "History of gyro calibrations",
                  .first_section = "start-ups",
                  .reading_notes = "Sigmas are one standard deviation.",
                  .content = assets::kHistory,
                  .script = std::string(assets::kFigures) + std::string(assets::kTrend) + std::string(assets::kReport),
                  .figures = figure_data(catalogue, history)},
                 std::move(values));
}

}  // namespace trihedron::report
