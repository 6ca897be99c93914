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
#include "trihedron/records/text.hpp"
#include "trihedron/report/history.hpp"

namespace trihedron::cli {
namespace {

using Catalogue = std::vector<CatalogueEntry>;

constexpr double kMicroradian = 1e-6;

struct ShownUnit {
  double value = kMicroradian;
  double sigma = kMicroradian;
};

/// One for the alignments of a table, by the sizes of values and of sigmas; drift is in 1e-6 rad/s.
struct AlignmentUnits {
  AngleUnit value = unit_of_angle(0);
  AngleUnit sigma = unit_of_angle(0);

  [[nodiscard]] ShownUnit of(const ParameterId& state) const {
    return state.is_alignment() ? ShownUnit{value.rad, sigma.rad} : ShownUnit{};
  }
};

AlignmentUnits units_of(const Catalogue& catalogue, const std::vector<ParameterId>& states) {
  std::vector<double> values;
  std::vector<double> sigmas;
  for (const CatalogueEntry& entry : catalogue) {
    for (const ParameterId& state : states) {
      if (state.is_alignment()) {
        values.push_back(value_of(entry.calibration, state));
        sigmas.push_back(sigma_of(entry.calibration, state));
      }
    }
  }
  return {unit_of_angles(values), unit_of_angles(sigmas)};
}

/// Rounded so that sigma shows two significant digits.
std::string estimate_text(double value, double sigma, const ShownUnit& unit) {
  if (!std::isfinite(value) || !std::isfinite(sigma)) {
    return std::string(kNoEntry);
  }
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
                   io::format_epoch(calibration.epoch), printable(entry.start_up), printable(entry.pass), entry.passes,
                   name_of(calibration.estimator), name_of(calibration.gyros.front().drift_model),
                   calibration.verdict.trustworthy ? "trustworthy" : "DO NOT USE");
  }
  return text;
}

/// One row per calibration.
std::string states_text(const Catalogue& catalogue, const std::string& title, const std::vector<ParameterId>& states) {
  const AlignmentUnits units = units_of(catalogue, states);
  std::string text =
      fmt::format("\n{}, {}\n    #", title,
                  states.front().is_alignment() ? fmt::format("{} ±1σ in {}", units.value.symbol, units.sigma.symbol)
                                                : "1e-6 rad/s ±1σ");
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
                     std::isnan(sigma) ? "" : estimate_text(value_of(calibration, state), sigma, units.of(state)));
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
          catalogue, fmt::format("Gyro {}, {}", gyro + 1, alignments ? "alignment" : "drift coefficients"),
          {states.begin() + static_cast<std::ptrdiff_t>(from), states.begin() + static_cast<std::ptrdiff_t>(to)});
    }
  }
  return text;
}

std::string changes_text(const ground::History& history) {
  std::string text;
  auto out = std::back_inserter(text);
  for (const ground::StartUpChange& change : history.changes) {
    fmt::format_to(out, "\nFrom start-up {} to {}\n  coefficients {}: {}\n  alignments   {}: {}\n",
                   printable(change.from), printable(change.to), change.coefficients.holds() ? "the same" : "changed",
                   change.coefficients.text(), change.alignments.holds() ? "the same" : "CHANGED",
                   change.alignments.text());
    for (const ground::ParameterChange& parameter : change.parameters) {
      const AngleUnit angle = unit_of_angle(parameter.sigma);
      const double unit = parameter.state.is_alignment() ? angle.rad : kMicroradian;
      fmt::format_to(out, "  {:<14} {:>20} {:<10} {:>9} σ\n", name_of(parameter.state),
                     estimate_text(parameter.change, parameter.sigma, {unit, unit}),
                     parameter.state.is_alignment() ? angle.symbol : "1e-6 rad/s",
                     figure("{:+.1f}", parameter.change / parameter.sigma));
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
    const AlignmentUnits units{unit_of_angle(spread.mean), unit_of_angle(spread.next_sigma)};
    const ShownUnit unit = units.of(spread.state);
    fmt::format_to(std::back_inserter(text), "  {:<14} {:>14} {:>14} {:>14}  {}\n", name_of(spread.state),
                   figure("{:+.4f}", spread.mean / unit.value), figure("{:.4f}", spread.deviation / unit.sigma),
                   figure("{:.4f}", spread.next_sigma / unit.sigma),
                   spread.state.is_alignment() ? fmt::format("{}, 1σ in {}", units.value.symbol, units.sigma.symbol)
                                               : "1e-6 rad/s");
  }
  return text;
}

std::string history_text(const std::string& file, const Catalogue& catalogue, const ground::History& history) {
  if (catalogue.empty()) {
    return fmt::format("Catalogue   {}: empty\n", file);
  }
  std::string text = fmt::format("Catalogue   {}: {} of {}, {} start-up{} that can be trusted\n", file,
                                 catalogue.size(), printable(catalogue.front().spacecraft), history.start_ups.size(),
                                 history.start_ups.size() == 1 ? "" : "s");
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
    nlohmann::ordered_json parameters = nlohmann::ordered_json::object();
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
  command
      ->add_option("-o,--output", arguments->report,
                   "Report with the trend of each parameter to write (HTML); - for standard output")
      ->type_name("FILE");
  command->footer(
      "trihedron calibrate pass.nc -o out --catalogue resurs.db\n"
      "trihedron history resurs.db -o history.html");
  command->callback([&common, &exit_status, arguments] {
    const std::filesystem::path file = arguments->catalogue;
    const std::filesystem::path written = arguments->report;
    const bool to_stdout = arguments->report == kStandardStream;
    if (!to_stdout) {
      io::expect_apart({&file, 1}, {&written, 1});
    }
    const Catalogue catalogue = io::read_catalogue(file);
    const ground::History history = ground::compare_start_ups(catalogue);
    common.log.say(fmt::format("read {}: {} calibrations, {} start-ups that can be trusted", arguments->catalogue,
                               catalogue.size(), history.start_ups.size()));
    if (to_stdout) {
      print_data(stdout, report::render_history(catalogue, history));
    } else if (!written.empty()) {
      io::write_file(written, report::render_history(catalogue, history));
    }
    show(
        beside(arguments->report, common), [&] { return history_json(catalogue, history); },
        [&] {
          return history_text(printable(arguments->catalogue), catalogue, history) +
                 (arguments->report.empty() ? "" : fmt::format("\nWritten     {}\n", printable(arguments->report)));
        });
    exit_status = kTrustworthy;
  });
}

}  // namespace trihedron::cli
