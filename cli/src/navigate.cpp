#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "decisions.hpp"
#include "progress.hpp"
#include "steps.hpp"
#include "summary.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/evaluate/attitude_evaluation.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/io/apart.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/named_pass.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {

ExitStatus navigate_pass(const std::filesystem::path& pass, const NavigationFiles& files,
                         const CalibrationOptions& options, const Common& common) {
  io::NamedPass named = io::read_named_pass(pass, io::TruthUse::kToCompare);
  io::LoadedPass& loaded = named.loaded;
  log_pass(common.log, pass.string(), loaded);
  log_settings(common.log, options);
  if (!files.calibration.empty()) {
    common.log.say(fmt::format("the values of {} are held", files.calibration.string()));
    loaded.pass.settings.prior = io::read_calibration(source(files.calibration.string()));
  }
  const bool to_stdout = files.attitude == kStandardStream;
  if (!to_stdout) {
    std::vector<std::filesystem::path> inputs = io::inputs_of(pass, loaded);
    inputs.insert(inputs.end(), {files.calibration, files.config});
    io::expect_apart(inputs, {&files.attitude, 1});
    io::expect_writable(files.attitude);
  }
  NavigationRun result;
  try {
    const ProgressBar bar("navigate", common.quiet);
    result = ground::navigate(loaded.pass, options, bar.meter());
  } catch (const ground::SetupError& error) {
    throw io::InputRefused(pass, {}, error.what(), error.cure());
  }
  correct(loaded.pass, result.clock_correction);  // the fixes that it is compared with
  const Time epoch = loaded.pass.settings.epoch;
  const io::Mounting& mounting = loaded.pass.settings.star_tracker_mounting_rotation_vector_rad;
  const ground::AttitudeEvaluation evaluation = ground::evaluate_navigation(loaded.pass, result, named.truth_or_null());
  if (to_stdout) {
    print_data(stdout, io::format_attitude(epoch, result.attitude, io::AttitudeDigits::kTwelveDecimals, {}, mounting));
  } else {
    io::write_attitude(files.attitude, epoch, result.attitude, mounting);
  }
  log_verdict(common.log, result.verdict);
  common.log.say(fmt::format("written {}: {} epochs", files.attitude.string(), result.attitude.size()));
  const auto as_json = [&] {
    return nlohmann::ordered_json{{"pass", pass_json(loaded)},
                                  {"verdict", verdict_json(result.verdict)},
                                  {"readiness", readiness_json(result.forecast)},
                                  {"statistics", statistics_json(result.statistics)},
                                  {"evaluation", evaluation_json(evaluation, epoch)}};
  };
  show(beside(files.attitude.string(), common), as_json, [&] {
    return fmt::format("{}{}{}\n{}\nWritten     {}: {} epochs\n", pass_text(loaded), verdict_text(result.verdict),
                       forecast_text(result.forecast), evaluation_text(evaluation, epoch, "Attitude error"),
                       printable(files.attitude.string()), result.attitude.size());
  });
  return result.verdict.trustworthy ? kTrustworthy : kDoNotUse;
}

void add_navigate(CLI::App& program, const Common& common, int& exit_status) {
  struct Arguments {
    std::string pass;
    std::string calibration;
    bool online = false;
    bool prior = false;
    std::string interval;
    std::string attitude;
    std::string need;
    std::string config;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("navigate", "Give the attitude at every gyro sample");
  command->add_option("PASS", arguments->pass, "Directory, NetCDF file or telemetry.toml")->required();
  CLI::Option_group* source = command->add_option_group("parameters");
  source
      ->add_option("--calibration", arguments->calibration,
                   "Hold the values of a calibration.json; - for standard input")
      ->type_name("FILE");
  source->add_flag("--online", arguments->online, "Calibrate along, and take over the estimates at each correction");
  source->add_flag("--prior", arguments->prior, "Hold the values known before the pass, those of its pass.toml");
  source->require_option(1);
  command
      ->add_option("--correction-interval", arguments->interval,
                   "Time between astro-corrections: none, only the first; continuous, each fix; 90min unless the "
                   "settings say otherwise")
      ->type_name("DURATION|none|continuous");
  add_need(*command, arguments->need);
  command->add_option("-o,--output", arguments->attitude, "Attitude file to write (CSV); - for standard output")
      ->required()
      ->type_name("FILE");
  const auto settle = [arguments] {
    CalibrationOptions options = settings_of(arguments->config);
    if (!arguments->interval.empty()) {
      options.corrections =
          of_option("--correction-interval", [&] { return io::parse_correction_interval(arguments->interval); });
    }
    if (!arguments->need.empty()) {
      options.need = of_option("--need", [&] { return io::parse_need(arguments->need); });
    }
    return options;
  };
  add_config(*command, arguments->config, settle);
  command->footer(
      "# As on board: calibrate along, correct every 90 min\n"
      "trihedron navigate pass.nc --online -o attitude.csv\n"
      "# With the values of an earlier calibration\n"
      "trihedron navigate pass.nc --calibration calibration.json --correction-interval 3h -o a.csv");
  command->callback([&common, &exit_status, arguments, settle] {
    CalibrationOptions options = settle();
    options.corrections.take_parameters = arguments->online;
    exit_status = navigate_pass(arguments->pass, {arguments->attitude, arguments->calibration, arguments->config},
                                options, common);
  });
}

}  // namespace trihedron::cli
