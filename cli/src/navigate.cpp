#include <fmt/core.h>

#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
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
#include "trihedron/records/run.hpp"

namespace trihedron::cli {

ExitStatus navigate_pass(const std::filesystem::path& pass, const NavigationFiles& files,
                         const CalibrationOptions& options, const Common& common) {
  io::NamedPass named = io::read_named_pass(pass);
  io::LoadedPass& loaded = named.loaded;
  const std::vector<std::filesystem::path> inputs = {pass, loaded.prior_file, files.calibration, files.config};
  io::expect_apart(inputs, {&files.attitude, 1});
  if (!files.calibration.empty()) {
    loaded.pass.settings.prior = io::read_calibration(files.calibration);
  }
  io::expect_writable(files.attitude);
  NavigationRun result;
  try {
    const ProgressBar bar("navigate", common.quiet);
    result = ground::navigate(loaded.pass, options, bar.meter());
  } catch (const ground::SetupError& error) {
    throw io::InputRefused(pass, {}, error.what(), error.cure());
  }
  const Time epoch = loaded.pass.settings.epoch;
  const ground::AttitudeEvaluation evaluation = ground::evaluate_navigation(loaded.pass, result, named.truth_or_null());
  io::write_attitude(files.attitude, epoch, result.attitude);
  if (common.json) {
    nlohmann::ordered_json json = {{"pass", pass_json(loaded)},
                                   {"verdict", verdict_json(result.verdict)},
                                   {"statistics", statistics_json(result.statistics)},
                                   {"evaluation", evaluation_json(evaluation, epoch)}};
    fmt::print("{}\n", json.dump(1));
  } else if (!common.quiet) {
    fmt::print("{}{}\n{}\nWritten     {}: {} epochs\n", pass_text(loaded), verdict_text(result.verdict),
               evaluation_text(evaluation, epoch, "Attitude error"), files.attitude.string(), result.attitude.size());
  }
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
    std::string config;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("navigate", "Give the attitude at every gyro sample");
  command->add_option("PASS", arguments->pass, "Directory or NetCDF file")->required();
  CLI::Option_group* source = command->add_option_group("parameters");
  source->add_option("--calibration", arguments->calibration, "Hold the values of a calibration.json");
  source->add_flag("--online", arguments->online, "Calibrate along, and take over the estimates at each correction");
  source->add_flag("--prior", arguments->prior, "Hold the values known before the pass, those of its pass.toml");
  source->require_option(1);
  command->add_option(
      "--correction-interval", arguments->interval,
      "Time between astro-corrections: a duration, none or continuous (90min unless the settings say otherwise)");
  command->add_option("--config", arguments->config, "Estimator settings (TOML)");
  command->add_option("-o,--output", arguments->attitude, "Attitude file to write (CSV)")->required();
  command->callback([&common, &exit_status, arguments] {
    CalibrationOptions options = arguments->config.empty() ? CalibrationOptions{} : io::read_config(arguments->config);
    if (!arguments->interval.empty()) {
      options.corrections = io::parse_correction_interval(arguments->interval);
    }
    options.corrections.take_parameters = arguments->online;
    exit_status = navigate_pass(arguments->pass, {arguments->attitude, arguments->calibration, arguments->config},
                                options, common);
  });
}

}  // namespace trihedron::cli
