#include "trihedron/ground/calibrate/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "summary.hpp"
#include "trihedron/io/apart.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/catalogue.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/scenario.hpp"
#include "trihedron/report/history.hpp"

namespace trihedron::cli {
namespace {

using Catalogue = std::vector<CatalogueEntry>;

constexpr double kMicroradian = 1e-6;

struct ShownUnit {
  double value = kMicroradian;
  double sigma = kMicroradian;
};

/// Drift in 1e-6 rad/s; alignment in ′, its sigma in ″.
ShownUnit unit_of(const ParameterId& state) {
  return state.is_alignment() ? ShownUnit{kArcminute, kArcsecond} : ShownUnit{};
}

/// Rounded so that sigma shows two significant digits.
std::string estimate_text(double value, double sigma, const ShownUnit& unit) {
  const auto decimals = [](double shown) {
    return shown > 0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(shown))), 0, 9) : 3;
  };
  return fmt::format("{:+.{}f} ±{:.{}f}", value / unit.value, decimals(sigma / unit.value), sigma / unit.sigma,
                     decimals(sigma / unit.sigma));
}

std::string calibrations_text(const Catalogue& catalogue) {
  std::string text = fmt::format("  {:>3}  {:<19}  {:<19}  {:<16} {:>6}  {:<10} {:<6} {}\n", "#", "epoch TAI",
                                 "start-up", "pass", "passes", "estimator", "model", "verdict");
  for (std::size_t i = 0; i < catalogue.size(); ++i) {
    const CatalogueEntry& entry = catalogue[i];
    const Calibration& calibration = entry.calibration;
    fmt::format_to(std::back_inserter(text), "  {:>3}  {:<19}  {:<19}  {:<16} {:>6}  {:<10} {:<6} {}\n", i + 1,
                   io::format_epoch(calibration.epoch), entry.start_up, entry.pass, entry.passes,
                   name_of(calibration.estimator), name_of(calibration.gyros.front().drift_model),
                   calibration.verdict.trustworthy ? "trustworthy" : "DO NOT USE");
  }
  return text;
}

/// One row per calibration.
std::string states_text(const Catalogue& catalogue, const std::string& title, const std::vector<ParameterId>& states) {
  std::string text = "\n" + title + "\n    #";
  auto out = std::back_inserter(text);
  for (const ParameterId& state : states) {
    fmt::format_to(out, " {:>17}", short_name_of(state));
  }
  for (std::size_t i = 0; i < catalogue.size(); ++i) {
    const Calibration& calibration = catalogue[i].calibration;
    fmt::format_to(out, "\n  {:>3}", i + 1);
    for (const ParameterId& state : states) {
      const double sigma = sigma_of(calibration, state);
      fmt::format_to(out, " {:>17}",
                     std::isnan(sigma) ? "" : estimate_text(value_of(calibration, state), sigma, unit_of(state)));
    }
  }
  return text + "\n";
}

/// Tables of a gyro, each with no more columns than a line holds.
std::string gyro_text(const Catalogue& catalogue, std::size_t gyro) {
  constexpr std::size_t kColumns = 7;
  std::string text;
  for (const bool alignments : {false, true}) {
    std::vector<ParameterId> states = ground::states_of(catalogue);
    std::erase_if(states,
                  [&](const ParameterId& state) { return state.gyro() != gyro || state.is_alignment() != alignments; });
    for (std::size_t from = 0; from < states.size(); from += kColumns) {
      const std::size_t to = std::min(from + kColumns, states.size());
      text += states_text(
          catalogue,
          fmt::format("Gyro {}, {}", gyro + 1,
                      alignments ? "alignment, ′ ±1σ in ″" : "drift coefficients, 1e-6 rad/s ±1σ"),
          {states.begin() + static_cast<std::ptrdiff_t>(from), states.begin() + static_cast<std::ptrdiff_t>(to)});
    }
  }
  return text;
}

std::string changes_text(const ground::History& history) {
  std::string text;
  auto out = std::back_inserter(text);
  for (const ground::StartUpChange& change : history.changes) {
    fmt::format_to(out, "\nFrom start-up {} to {}\n  coefficients {}: {}\n  alignments   {}: {}\n", change.from,
                   change.to, change.coefficients.holds() ? "the same" : "changed", change.coefficients.text(),
                   change.alignments.holds() ? "the same" : "CHANGED", change.alignments.text());
    for (const ground::ParameterChange& parameter : change.parameters) {
      const ShownUnit unit = unit_of(parameter.state);
      fmt::format_to(out, "  {:<14} {:>20} {:<10} {:>+9.1f} σ\n", name_of(parameter.state),
                     estimate_text(parameter.change, parameter.sigma, {unit.sigma, unit.sigma}),
                     parameter.state.is_alignment() ? "″" : "1e-6 rad/s", parameter.change / parameter.sigma);
    }
  }
  return text;
}

std::string spreads_text(const ground::History& history) {
  if (history.spreads.empty()) {
    return "\nSpread over start-ups: known from two trustworthy start-ups on\n";
  }
  std::string text =
      fmt::format("\nSpread over {} start-ups, and what is known before the next\n  {:<14} {:>14} {:>14} {:>14}\n",
                  history.start_ups.size(), "", "mean", "spread 1σ", "next 1σ");
  for (const ground::Spread& spread : history.spreads) {
    const ShownUnit unit = unit_of(spread.state);
    fmt::format_to(std::back_inserter(text), "  {:<14} {:>+14.4f} {:>14.4f} {:>14.4f}  {}\n", name_of(spread.state),
                   spread.mean / unit.value, spread.deviation / unit.sigma, spread.next_sigma / unit.sigma,
                   spread.state.is_alignment() ? "′, 1σ in ″" : "1e-6 rad/s");
  }
  return text;
}

std::string history_text(const std::string& file, const Catalogue& catalogue, const ground::History& history) {
  if (catalogue.empty()) {
    return fmt::format("Catalogue   {}: empty\n", file);
  }
  std::string text =
      fmt::format("Catalogue   {}: {} of {}, {} start-up{} that can be trusted\n", file, catalogue.size(),
                  catalogue.front().spacecraft, history.start_ups.size(), history.start_ups.size() == 1 ? "" : "s");
  text += calibrations_text(catalogue);
  std::size_t gyros = 0;
  for (const CatalogueEntry& entry : catalogue) {
    gyros = std::max(gyros, entry.calibration.gyros.size());
  }
  for (std::size_t gyro = 0; gyro < gyros; ++gyro) {
    text += gyro_text(catalogue, gyro);
  }
  text += changes_text(history) + spreads_text(history);
  for (const Finding& finding : history.findings) {
    text += "\n" + finding_text(finding);
  }
  return text;
}

nlohmann::ordered_json history_json(const Catalogue& catalogue, const ground::History& history) {
  nlohmann::ordered_json json = {{"calibrations", nlohmann::ordered_json::array()},
                                 {"changes", nlohmann::ordered_json::array()},
                                 {"spreads", nlohmann::ordered_json::array()}};
  for (const CatalogueEntry& entry : catalogue) {
    json["calibrations"].push_back(
        {{"spacecraft", entry.spacecraft},
         {"pass", entry.pass},
         {"start_up", entry.start_up},
         {"passes", entry.passes},
         {"calibration", nlohmann::ordered_json::parse(io::format_calibration(entry.calibration))}});
  }
  for (const ground::StartUpChange& change : history.changes) {
    nlohmann::ordered_json parameters;
    for (const ground::ParameterChange& parameter : change.parameters) {
      parameters[name_of(parameter.state)] = {{"change", parameter.change}, {"sigma", parameter.sigma}};
    }
    json["changes"].push_back({{"from", change.from},
                               {"to", change.to},
                               {"coefficients", agreement_json(change.coefficients)},
                               {"alignments", agreement_json(change.alignments)},
                               {"parameters", parameters}});
  }
  for (const ground::Spread& spread : history.spreads) {
    json["spreads"].push_back({{"state", name_of(spread.state)},
                               {"start_ups", spread.start_ups},
                               {"mean", spread.mean},
                               {"deviation", spread.deviation},
                               {"next_sigma", spread.next_sigma}});
  }
  json["findings"] = findings_json(history.findings);
  return json;
}

}  // namespace

void add_history(CLI::App& program, const Common& common, int& exit_status) {
  struct Arguments {
    std::string catalogue;
    std::string report;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("history", "Compare the calibrations of a catalogue over the start-ups");
  command->add_option("CATALOGUE", arguments->catalogue, "Database that calibrate --catalogue wrote")->required();
  command->add_option("-o,--output", arguments->report, "Report with the trend of each parameter to write (HTML)");
  command->callback([&common, &exit_status, arguments] {
    const std::filesystem::path file = arguments->catalogue;
    const std::filesystem::path written = arguments->report;
    io::expect_apart({&file, 1}, {&written, 1});
    const Catalogue catalogue = io::read_catalogue(file);
    const ground::History history = ground::compare_start_ups(catalogue);
    if (!written.empty()) {
      io::write_file(written, report::render_history(catalogue, history));
    }
    if (common.json) {
      fmt::print("{}\n", history_json(catalogue, history).dump(1));
    } else if (!common.quiet) {
      fmt::print("{}{}", history_text(arguments->catalogue, catalogue, history),
                 arguments->report.empty() ? "" : fmt::format("\nWritten     {}\n", arguments->report));
    }
    exit_status = kTrustworthy;
  });
}

}  // namespace trihedron::cli
