#include "trihedron/ground/observe.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>

#include "commands.hpp"
#include "steps.hpp"
#include "summary.hpp"
#include "trihedron/ground/calibrate.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/io/scenario.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::cli {
namespace {

using ground::Observability;

bool is_alignment(const std::string& parameter) { return parameter.find(".align_") != std::string::npos; }

std::string sigma_text(const std::string& parameter, double sigma) {
  return is_alignment(parameter) ? angle_text(sigma) : fmt::format("{:.1e}", sigma);
}

/// Rows: sigma of each parameter before the pass, after parts of it, after all.
std::string sigmas_text(const Observability& observability, Time epoch) {
  const std::size_t times = observability.t.size();
  const std::array<std::size_t, 4> shown = {0, times / 4, times / 2, times - 1};
  std::string text = fmt::format("\n1σ after     {:>14}", "known before");
  auto out = std::back_inserter(text);
  for (const std::size_t i : shown) {
    fmt::format_to(out, " {:>9.0f} min", to_seconds(observability.t[i] - epoch) / 60);
  }
  text += observability.angle_gain.size() > 0 ? "   z1 adds\n" : "\n";
  for (std::size_t i = 0; i < observability.parameters.size(); ++i) {
    const std::string& name = observability.parameters[i];
    const auto row = static_cast<Eigen::Index>(i);
    fmt::format_to(out, "  {:<22} {:>11}", name, sigma_text(name, observability.prior_sigma(row)));
    for (const std::size_t time : shown) {
      fmt::format_to(out, "   {:>10}", sigma_text(name, observability.sigma_until[time](row)));
    }
    if (observability.angle_gain.size() > 0) {
      fmt::format_to(out, "   {:>6.2f}×", observability.angle_gain(row));
    }
    text += '\n';
  }
  return text;
}

std::string combinations_text(const Observability& observability) {
  std::string text;
  auto out = std::back_inserter(text);
  bool said_unobservable = false;
  bool said_weak = false;
  for (const ground::Combination& combination : observability.weak) {
    const bool unobservable = combination.singular_value < Observability::kUnobservable;
    bool& said = unobservable ? said_unobservable : said_weak;
    if (!said) {
      fmt::format_to(out, "\n{}: known from the data alone by less than {:.0f} times what was known before\n",
                     unobservable ? "Unobservable" : "Weak",
                     unobservable ? Observability::kUnobservable : Observability::kWeak);
      said = true;
    }
    fmt::format_to(out, "  {:>8.3g} times, attitude {:>8}   {}\n", combination.singular_value,
                   angle_text(combination.attitude_error_rad), combination.text);
  }
  if (observability.is_harmful()) {
    text += "  → Fly slews during the calibration, about other axes than those named: ten minutes of 10° suffice.\n";
  }
  return text;
}

std::string observability_text(const Observability& observability, Time epoch) {
  const Eigen::VectorXd& s = observability.singular_values;
  return fmt::format(
      "Observable  {} of {} parameters, priors removed; prior 1σ over that by the data alone: {:.2g} … {:.2g}\n"
      "Attitude    {} rms per axis by what the parameters leave, between corrections and slewing\n{}{}",
      observability.rank, s.size(), s(0), s(s.size() - 1), angle_text(observability.attitude_error_rad),
      sigmas_text(observability, epoch), combinations_text(observability));
}

nlohmann::ordered_json observability_json(const Observability& observability, Time epoch) {
  nlohmann::ordered_json json = {{"rank", observability.rank},
                                 {"singular_values", std::vector<double>(observability.singular_values.begin(),
                                                                         observability.singular_values.end())},
                                 {"attitude_error_rad", observability.attitude_error_rad},
                                 {"t_s", nlohmann::ordered_json::array()}};
  for (const Time t : observability.t) {
    json["t_s"].push_back(to_seconds(t - epoch));
  }
  for (std::size_t i = 0; i < observability.parameters.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    nlohmann::ordered_json parameter = {{"name", observability.parameters[i]},
                                        {"prior_sigma", observability.prior_sigma(row)},
                                        {"sigma", observability.sigma(row)}};
    for (const Eigen::VectorXd& sigma : observability.sigma_until) {
      parameter["sigma_until"].push_back(sigma(row));
    }
    if (observability.angle_gain.size() > 0) {
      parameter["angle_gain"] = observability.angle_gain(row);
    }
    json["parameters"].push_back(parameter);
  }
  json["combinations"] = nlohmann::ordered_json::array();
  for (const ground::Combination& combination : observability.weak) {
    json["combinations"].push_back({{"text", combination.text},
                                    {"singular_value", combination.singular_value},
                                    {"attitude_error_rad", combination.attitude_error_rad},
                                    {"unobservable", combination.singular_value < Observability::kUnobservable},
                                    {"harmful", combination.is_harmful}});
  }
  return json;
}

bool is_scenario(const std::filesystem::path& path) { return path.extension() == ".toml"; }

Pass read_or_simulate(const std::string& path) {
  return is_scenario(path) ? simulated_by(io::read_scenario(path), path).pass : io::read_pass(path).pass;
}

ExitStatus observe_pass(const std::string& path, const CalibrationOptions& options, const Common& common) {
  const Pass pass = read_or_simulate(path);
  Observability observability;
  try {
    observability = ground::observe(pass, options);
  } catch (const ground::SetupError& error) {
    throw io::InputRefused(path, {}, error.what(), error.cure());
  }
  if (common.json) {
    fmt::print("{}\n", observability_json(observability, pass.settings.epoch).dump(1));
  } else if (!common.quiet) {
    fmt::print("{}", observability_text(observability, pass.settings.epoch));
  }
  return observability.is_harmful() ? kDoNotUse : kTrustworthy;
}

}  // namespace

void add_observe(CLI::App& program, const Common& common, int& exit_status) {
  struct Arguments {
    std::string path;
    std::string config;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("observe", "Say what a pass can tell of the parameters, and what not");
  command->add_option("PASS|SCENARIO.toml", arguments->path, "Directory or NetCDF file; or a scenario to be simulated")
      ->required();
  command->add_option("--config", arguments->config, "Settings (TOML); see effective-config.toml of any run");
  command->callback([&common, &exit_status, arguments] {
    const CalibrationOptions options =
        arguments->config.empty() ? CalibrationOptions{} : io::read_config(arguments->config);
    exit_status = observe_pass(arguments->path, options, common);
  });
}

}  // namespace trihedron::cli
