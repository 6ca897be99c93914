#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "progress.hpp"
#include "steps.hpp"
#include "summary.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/io/residuals.hpp"
#include "trihedron/report/report.hpp"

namespace trihedron::cli {
namespace {

std::vector<io::Table> residual_tables(const ground::CalibrationRun& run) {
  io::Table fixes{"fixes", {}, {}};
  const std::size_t components = 2 * run.calibration.gyros.size();
  for (std::size_t i = 0; i < components; ++i) {
    // The paper numbers its quasi-inertial axes so.
    const std::string component = fmt::format("gyro{}_{}", i / 2 + 1, components == 4 && i == 1 ? 3 : i % 2 + 1);
    fixes.columns.push_back({fmt::format("innovation_{}", component),
                             "rad",
                             fmt::format("innovation of eq. (3), gyro and component in qi: {}", component),
                             {}});
    fixes.columns.push_back({fmt::format("innovation_{}_sigma", component), "rad", "its 1-sigma by the filter", {}});
  }
  fixes.columns.push_back(
      {"nis", "1", fmt::format("normalised innovation squared, {} degrees of freedom", components), {}});
  fixes.columns.push_back({"used", "1", "1 used, 0 rejected", {}});
  for (const ground::FixRecord& fix : run.fixes) {
    fixes.t.push_back(fix.t);
    for (std::size_t i = 0; i < fix.innovation.size(); ++i) {
      fixes.columns[2 * i].values.push_back(fix.innovation[i]);
      fixes.columns[2 * i + 1].values.push_back(fix.innovation_sigma[i]);
    }
    fixes.columns[2 * components].values.push_back(fix.nis);
    fixes.columns[2 * components + 1].values.push_back(fix.used() ? 1 : 0);
  }

  io::Table parameters{"parameters", run.parameters.t, {}};
  for (std::size_t i = 0; i < run.calibration.states.size(); ++i) {
    const std::string& state = run.calibration.states[i];
    std::string name = state;
    name[name.find('.')] = '_';
    const char* unit = state.find("align") == std::string::npos ? "rad s-1" : "rad";
    std::vector<double> value;
    std::vector<double> sigma;
    for (std::size_t row = 0; row < run.parameters.t.size(); ++row) {
      value.push_back(run.parameters.value[row][i]);
      sigma.push_back(run.parameters.sigma[row][i]);
    }
    parameters.columns.push_back({name, unit, "estimate of " + state + " after the fix", std::move(value)});
    parameters.columns.push_back({name + "_sigma", unit, "its 1-sigma", std::move(sigma)});
  }

  io::Table angle{"angle", run.angle_t, {}};
  angle.columns.push_back({"residual_min", "1", "z1 of eq. (3), least of 3 s", run.angle_residual_min});
  angle.columns.push_back({"residual_max", "1", "z1 of eq. (3), greatest of 3 s", run.angle_residual_max});
  return {fixes, parameters, angle};
}

}  // namespace

ExitStatus calibrate_pass(const std::filesystem::path& pass, const CalibrationOptions& options,
                          const std::filesystem::path& out, const Common& common) {
  const io::LoadedPass loaded = io::read_pass(pass);
  ground::CalibrationRun result;
  try {
    const ProgressBar bar("calibrate", common.quiet);
    result = ground::calibrate(loaded.pass, options, bar.meter());
  } catch (const ground::SetupError& error) {
    throw io::InputRefused(pass, {}, error.what(), error.cure());
  }
  const Time epoch = loaded.pass.settings.epoch;
  const auto truth = read_truth_of(pass, loaded.pass);
  const double limit_rad = io::parse_angle_rad("5arcmin");
  const Reference reference = reference_of(truth, ground::used_fixes(loaded.pass, result.fixes), loaded.pass);
  const Evaluation navigation = evaluate(result.navigation, reference, epoch, limit_rad);
  const Evaluation attitude = evaluate(result.attitude, reference, epoch, limit_rad);
  const Course course{ground::convergence(result, truth ? &*truth : nullptr),
                      ground::fly_open_loops(loaded.pass, result, reference.t, reference.q_in_c, limit_rad), limit_rad};

  io::make_directory(out);
  io::write_calibration(out / "calibration.json", result.calibration);
  io::write_attitude(out / "attitude.csv", epoch, result.attitude);
  io::write_residuals(out / "residuals.nc", epoch, residual_tables(result));
  io::write_file(out / "effective-config.toml", io::format_config(options));

  report::ReportInput input{loaded.pass, result, truth ? &*truth : nullptr, {}, {}};
  input.evaluation =
      report::Evaluation{"the " + reference.name, navigation.errors, attitude.errors, course.open_loops, limit_rad};
  for (const io::Defect& defect : loaded.defects) {
    input.telemetry_notes.push_back(defect.text());
  }
  io::write_file(out / "report.html", report::render(input));

  if (common.json) {
    nlohmann::ordered_json json = {
        {"pass", pass_json(loaded)},
        {"calibration", nlohmann::ordered_json::parse(io::format_calibration(result.calibration))},
        {"fixes", result.fix_counts},
        {"samples", result.samples},
        {"navigation", evaluation_json(navigation, epoch)},
        {"attitude", evaluation_json(attitude, epoch)}};
    json.update(course_json(result, course));
    fmt::print("{}\n", json.dump(1));
  } else if (!common.quiet) {
    fmt::print(
        "{}{}{}{}\n{}\n{}\nWritten     {}: calibration.json attitude.csv residuals.nc report.html "
        "effective-config.toml\n",
        pass_text(loaded), verdict_text(result.calibration.verdict), calibration_text(result, truth),
        course_text(result, course),
        evaluation_text(navigation, epoch,
                        "Navigator, correction interval " + io::format_correction_interval(options.corrections) + ","),
        evaluation_text(attitude, epoch, "Attitude of the calibration itself"), out.string());
  }
  return result.calibration.verdict.trustworthy ? kTrustworthy : kDoNotUse;
}

void add_calibrate(CLI::App& program, const Common& common, int& exit_status) {
  struct Arguments {
    std::string pass;
    std::string out;
    std::string estimator;
    std::string drift_model;
    std::string config;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      program.add_subcommand("calibrate", "Calibrate drift and alignment of the gyros against the star tracker");
  command->add_option("PASS", arguments->pass, "Directory or NetCDF file")->required();
  command->add_option("-o,--output", arguments->out, "Directory to write into")->required();
  command->add_option("--estimator", arguments->estimator, "Estimator")
      ->check(CLI::IsMember(std::vector<std::string>(ground::kEstimators.begin(), ground::kEstimators.end())));
  command->add_option("--drift-model", arguments->drift_model, "Drift model")->check([](const std::string& name) {
    return ground::is_drift_model(name) ? "" : fmt::format("not one of {}", ground::kDriftModels);
  });
  command->add_option("--config", arguments->config, "Settings (TOML); see effective-config.toml of any run");
  command->callback([&common, &exit_status, arguments] {
    CalibrationOptions options = arguments->config.empty() ? CalibrationOptions{} : io::read_config(arguments->config);
    if (!arguments->estimator.empty()) {
      options.estimator = arguments->estimator;
    }
    if (!arguments->drift_model.empty()) {
      options.drift_model = arguments->drift_model;
    }
    exit_status = calibrate_pass(arguments->pass, options, arguments->out, common);
  });
}

}  // namespace trihedron::cli
