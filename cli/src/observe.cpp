#include "trihedron/ground/observe/observe.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "advice.hpp"
#include "commands.hpp"
#include "decisions.hpp"
#include "progress.hpp"
#include "steps.hpp"
#include "summary.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/io/scenario.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {
namespace {

using ground::Observability;

std::string sigma_text(const ParameterId& parameter, double sigma) {
  return parameter.is_alignment() ? angle_text(sigma) : figure("{:.1e}", sigma);
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
    const ParameterId& parameter = observability.parameters[i];
    const auto row = static_cast<Eigen::Index>(i);
    fmt::format_to(out, "  {:<22} {:>11}", name_of(parameter), sigma_text(parameter, observability.prior_sigma(row)));
    for (const std::size_t time : shown) {
      fmt::format_to(out, "   {:>10}", sigma_text(parameter, observability.sigma_until[time](row)));
    }
    if (observability.angle_gain.size() > 0) {
      fmt::format_to(out, "   {:>6}×", figure("{:.2f}", observability.angle_gain(row)));
    }
    text += '\n';
  }
  if (observability.angle_gain.size() > 0) {
    text +=
        "  z1 adds: 1σ by the readings at the fixes alone over 1σ with z1 of eq. (3) as well, the angle between the "
        "momenta at every sample\n";
  }
  return text;
}

/// Of the combinations of parameters those that are not listed as unobservable.
std::ptrdiff_t observable_count(const Observability& observability) {
  return observability.singular_values.size() -
         std::ranges::count_if(observability.weak, &ground::Combination::is_unobservable);
}

std::string combinations_text(const Observability& observability) {
  std::string text;
  auto out = std::back_inserter(text);
  bool said_unobservable = false;
  bool said_weak = false;
  for (const ground::Combination& combination : observability.weak) {
    bool& said = combination.is_unobservable ? said_unobservable : said_weak;
    if (!said) {
      fmt::format_to(out, "\n{}: known from the data alone by less than {:.0f} times what was known before\n",
                     combination.is_unobservable ? "Unobservable" : "Weak",
                     combination.is_unobservable ? Observability::kUnobservable : Observability::kWeak);
      said = true;
    }
    fmt::format_to(out, "  {:>8} times, attitude {:>8}   {}\n", figure("{:.3g}", combination.singular_value),
                   angle_text(combination.attitude_error_rad), combination.text);
  }
  if (observability.is_harmful()) {
    text +=
        "  → Fly slews during the calibration, about other axes than those named; for a scenario --advise finds the "
        "best.\n";
  }
  return text;
}

std::string observability_text(const Observability& observability, Time epoch) {
  const Eigen::VectorXd& s = observability.singular_values;
  const auto times = [](double value) {
    const double unit = value >= 100 ? std::pow(10, std::floor(std::log10(value)) - 1) : 0;
    return unit > 0 ? figure("{:.0f}", unit * std::round(value / unit)) : figure("{:.2g}", value);
  };
  return fmt::format(
      "Observable  {} of {} combinations of parameters: the data alone tell them at least {:.0f} times as well as they "
      "were known before; the best of all {} times, the worst {} times\n"
      "Attitude    {} rms per axis by what the parameters leave, between corrections and slewing\n{}{}",
      observable_count(observability), s.size(), Observability::kUnobservable, times(s(0)), times(s(s.size() - 1)),
      angle_text(observability.attitude_error_rad), sigmas_text(observability, epoch),
      combinations_text(observability));
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
    nlohmann::ordered_json parameter = {{"name", name_of(observability.parameters[i])},
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
                                    {"unobservable", combination.is_unobservable},
                                    {"harmful", combination.is_harmful}});
  }
  return json;
}

bool is_scenario(const std::filesystem::path& path) {
  return (path.extension() == ".toml" && !io::is_telemetry_toml(path)) || path == kStandardStream;
}

/// Calls `work` and reports its errors as errors of this input file.
template <class Work>
auto refusing(const std::string& path, const Work& work) {
  try {
    return work();
  } catch (const ground::SetupError& error) {
    throw io::InputRefused(path, {}, error.what(), error.cure());
  } catch (const std::invalid_argument& error) {
    throw io::InputRefused(path, {}, error.what(), "correct the scenario");
  }
}

ExitStatus observe_pass(const std::string& path, const CalibrationOptions& options, const Common& common) {
  const Pass pass =
      is_scenario(path) ? simulated_by(io::read_scenario(source(path)), path).pass : io::read_pass(path).pass;
  const Observability observability = refusing(path, [&] { return ground::observe(pass, options); });
  const Time epoch = pass.settings.epoch;
  common.log.say(fmt::format("{} of {} combinations of parameters are observable", observable_count(observability),
                             observability.singular_values.size()));
  show(
      common, [&] { return observability_json(observability, epoch); },
      [&] { return observability_text(observability, epoch); });
  return observability.is_harmful() ? kDoNotUse : kTrustworthy;
}

ExitStatus advise_for(const std::string& path, const CalibrationOptions& options, const plan::SlewLimits& limits,
                      int confirming_runs, const Common& common) {
  if (!is_scenario(path)) {
    throw io::UsageError(
        "--advise needs a scenario; for a pass, give its attitude to one: calibrate PASS -o OUT, then "
        "reference = \"recorded\", recorded = \"OUT/attitude.csv\" and slews = \"none\" in [attitude]");
  }
  const Scenario scenario = io::read_scenario(source(path));
  const plan::Advice advice = refusing(path, [&] {
    const ProgressBar bar("advise", common.quiet);
    return plan::advise(scenario, options, limits, {}, bar.meter());
  });
  std::optional<plan::Confirmation> confirmation;
  if (confirming_runs > 0 && !advice.slews().empty()) {
    const ProgressBar bar("confirm", common.quiet);
    confirmation = refusing(path, [&] {
      return plan::confirm(advice.scenario, advice.formerly_weak(), advice.after, confirming_runs, bar.meter());
    });
  }
  const auto as_json = [&] {
    nlohmann::ordered_json json = observability_json(advice.before, scenario.epoch);
    json["advice"] = advice_json(advice, limits, confirmation);
    return json;
  };
  show(common, as_json, [&] {
    return observability_text(advice.before, scenario.epoch) + advice_text(advice, limits) +
           (confirmation ? confirmation_text(*confirmation) : "");
  });
  return advice.after.is_harmful() || (confirmation && confirmation->contradicts()) ? kDoNotUse : kTrustworthy;
}

}  // namespace

void add_observe(CLI::App& program, const Common& common, int& exit_status) {
  struct Arguments {
    std::string path;
    std::string config;
    std::string max_rate;
    std::string max_angle = "30deg";
    std::string manoeuvre_time = "10min";
    int slews = 4;
    bool advise = false;
    int confirming_runs = 0;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("observe", "Say what a pass can tell of the parameters, and what not");
  command
      ->add_option("PASS|SCENARIO.toml", arguments->path,
                   "Directory, NetCDF file or telemetry.toml; or a scenario to be simulated, - for standard input")
      ->required();
  CLI::Option* advise =
      command->add_flag("--advise", arguments->advise, "Search the slews that calibrate best; of a scenario");
  const auto limit = [&](const char* name, auto& value, const char* type, const char* what) {
    return command->add_option(name, value, what)->needs(advise)->type_name(type);
  };
  limit("--max-rate", arguments->max_rate, "RATE", "Of these slews, instead of max_slew_rate of the scenario");
  limit("--max-angle", arguments->max_angle, "ANGLE", "Of these slews")->capture_default_str();
  limit("--slews", arguments->slews, "NUMBER", "Largest number of slews")
      ->check(whole(trihedron::limits::kSlews))
      ->capture_default_str();
  limit("--manoeuvre-time", arguments->manoeuvre_time, "DURATION", "Of all slews together, turns and holds")
      ->capture_default_str();
  limit("--confirm", arguments->confirming_runs, "NUMBER",
        "Number of flights with these slews to simulate and calibrate")
      ->check(whole(trihedron::limits::kFlights));
  add_config(*command, arguments->config, [arguments] { return settings_of(arguments->config); });
  command->footer(
      "trihedron observe pass.nc\n"
      "# The slews that calibrate best, and forty flights with them\n"
      "trihedron observe examples/steady-flight.toml --advise --confirm 40\n"
      "trihedron observe scenario.toml --advise --slews 2 --max-angle 20deg --manoeuvre-time 8min");
  command->callback([&common, &exit_status, arguments] {
    const CalibrationOptions options = settings_of(arguments->config);
    log_settings(common.log, options);
    if (!arguments->advise) {
      exit_status = observe_pass(arguments->path, options, common);
      return;
    }
    plan::SlewLimits limits;
    if (!arguments->max_rate.empty()) {
      limits.max_rate_rad_s = of_option(
          "--max-rate", [&] { return io::parse_rate_rad_s(arguments->max_rate, trihedron::limits::kSlewRate_rad_s); });
    }
    limits.max_angle_rad = of_option(
        "--max-angle", [&] { return io::parse_angle_rad(arguments->max_angle, trihedron::limits::kSlewAngle_rad); });
    limits.slews = arguments->slews;
    limits.manoeuvre_time = of_option("--manoeuvre-time", [&] {
      return io::parse_duration(arguments->manoeuvre_time, trihedron::limits::kManoeuvreTime_s);
    });
    exit_status = advise_for(arguments->path, options, limits, arguments->confirming_runs, common);
  });
}

}  // namespace trihedron::cli
