#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "commands.hpp"
#include "progress.hpp"
#include "steps.hpp"
#include "summary.hpp"
#include "trihedron/ground/calibrate/several_passes.hpp"
#include "trihedron/ground/evaluate/used_fixes.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/catalogue.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/io/residuals.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/report/report.hpp"

namespace trihedron::cli {
namespace {

std::vector<io::Table> residual_tables(const CalibrationRun& run) {
  io::Table fixes{"fixes", {}, {}};
  const std::size_t components = 2 * run.calibration.gyros.size();
  const char* innovation =
      run.calibration.estimator == Estimator::kBatch
          ? "what the smoothed pass leaves of a fix that it compares, gyro and component across its momentum"
          : "innovation of eq. (3), gyro and component in qi";
  for (std::size_t i = 0; i < components; ++i) {
    // The paper numbers its quasi-inertial axes so.
    const std::string component = fmt::format("gyro{}_{}", i / 2 + 1, components == 4 && i == 1 ? 3 : i % 2 + 1);
    fixes.columns.push_back(
        {fmt::format("innovation_{}", component), "rad", fmt::format("{}: {}", innovation, component), {}});
    fixes.columns.push_back({fmt::format("innovation_{}_sigma", component), "rad", "its 1-sigma", {}});
  }
  fixes.columns.push_back(
      {"nis", "1", fmt::format("normalised innovation squared, {} degrees of freedom", components), {}});
  fixes.columns.push_back({"used", "1", "1 used, 0 rejected", {}});
  for (const FixRecord& fix : run.fixes) {
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
    const ParameterId& state = run.calibration.states[i];
    std::string name = name_of(state);
    std::ranges::replace(name, '.', '_');
    const char* unit = state.is_alignment() ? "rad" : "rad s-1";
    std::vector<double> value;
    std::vector<double> sigma;
    for (std::size_t row = 0; row < run.parameters.t.size(); ++row) {
      value.push_back(run.parameters.value[row][i]);
      sigma.push_back(run.parameters.sigma[row][i]);
    }
    parameters.columns.push_back({name, unit, "estimate of " + name_of(state) + " after the fix", std::move(value)});
    parameters.columns.push_back({name + "_sigma", unit, "its 1-sigma", std::move(sigma)});
  }

  io::Table angle{"angle", run.angle_t, {}};
  angle.columns.push_back({"residual_min", "1", "z1 of eq. (3), least of 3 s", run.angle_residual_min});
  angle.columns.push_back({"residual_max", "1", "z1 of eq. (3), greatest of 3 s", run.angle_residual_max});
  return {fixes, parameters, angle};
}

/// One of the passes of a command.
struct NamedPass {
  std::filesystem::path path;
  std::string name;  ///< of its directory or file; numbered where several have the same
  io::LoadedPass loaded;
};

std::string stem_of(const std::filesystem::path& path) {
  const std::filesystem::path whole = path.lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).stem().string();
}

/// In the order of their epochs.
std::vector<NamedPass> read_passes(const std::vector<std::string>& paths) {
  std::vector<NamedPass> passes;
  std::map<std::string, int> seen;
  for (const std::string& path : paths) {
    const std::string stem = stem_of(path);
    const int same = ++seen[stem];
    passes.push_back({path, same == 1 ? stem : fmt::format("{}-{}", stem, same), io::read_pass(path)});
  }
  std::ranges::stable_sort(passes, {}, [](const NamedPass& pass) { return pass.loaded.pass.settings.epoch; });
  return passes;
}

/// A calibration with its evaluation against the truth or the star tracker. Holds references.
struct Outcome {
  const io::LoadedPass& loaded;
  const CalibrationRun& run;
  std::optional<Truth> truth;
  Evaluation navigation;
  Evaluation attitude;
  Course course;
};

Outcome outcome_of(const NamedPass& pass, const CalibrationRun& run) {
  const double limit_rad = io::parse_angle_rad("5arcmin");
  const Time epoch = pass.loaded.pass.settings.epoch;
  Outcome outcome{pass.loaded, run, read_truth_of(pass.path, pass.loaded.pass), {}, {}, {}};
  const Reference reference =
      reference_of(outcome.truth, ground::used_fixes(pass.loaded.pass, run.fixes), pass.loaded.pass);
  outcome.navigation = evaluate(run.navigation, reference, epoch, limit_rad);
  outcome.attitude = evaluate(run.attitude, reference, epoch, limit_rad);
  outcome.course = {ground::convergence(run, outcome.truth ? &*outcome.truth : nullptr),
                    ground::fly_open_loops(pass.loaded.pass, run, reference.t, reference.q_in_c, limit_rad), limit_rad};
  return outcome;
}

void write_outcome(const std::filesystem::path& out, const Outcome& outcome, const CalibrationOptions& options) {
  const Time epoch = outcome.run.calibration.epoch;
  const io::MadeDirectory made(out);
  io::write_calibration(out / "calibration.json", outcome.run.calibration);
  io::write_attitude(out / "attitude.csv", epoch, outcome.run.attitude);
  if (outcome.run.definitive_attitude.size() > 0) {
    io::write_attitude(out / "definitive-attitude.csv", epoch, outcome.run.definitive_attitude);
  }
  io::write_residuals(out / "residuals.nc", epoch, residual_tables(outcome.run));
  io::write_file(out / "effective-config.toml", io::format_config(options));

  report::ReportInput input{outcome.loaded.pass, outcome.run, outcome.truth ? &*outcome.truth : nullptr, {}, {}};
  input.evaluation = report::Evaluation{"the " + outcome.navigation.reference, outcome.navigation.errors,
                                        outcome.attitude.errors, outcome.course.open_loops, outcome.course.limit_rad};
  for (const io::Defect& defect : outcome.loaded.defects) {
    input.telemetry_notes.push_back(defect.text());
  }
  io::write_file(out / "report.html", report::render(input));
}

nlohmann::ordered_json counts_json(const std::vector<NamedCount>& counts) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const NamedCount& its : counts) {
    json[std::string(its.name)] = its.count;
  }
  return json;
}

nlohmann::ordered_json outcome_json(const Outcome& outcome) {
  const Time epoch = outcome.run.calibration.epoch;
  nlohmann::ordered_json json = {
      {"pass", pass_json(outcome.loaded)},
      {"calibration", nlohmann::ordered_json::parse(io::format_calibration(outcome.run.calibration))},
      {"fixes", counts_json(named_counts(outcome.run.fix_counts))},
      {"samples", counts_json(named_counts(outcome.run.samples))},
      {"navigation", evaluation_json(outcome.navigation, epoch)},
      {"attitude", evaluation_json(outcome.attitude, epoch)}};
  json.update(course_json(outcome.run, outcome.course));
  return json;
}

std::string outcome_text(const Outcome& outcome, const CorrectionOptions& corrections) {
  const Time epoch = outcome.run.calibration.epoch;
  return fmt::format(
      "{}{}{}{}\n{}\n{}\n", pass_text(outcome.loaded), verdict_text(outcome.run.calibration.verdict),
      calibration_text(outcome.run, outcome.truth), course_text(outcome.run, outcome.course),
      evaluation_text(outcome.navigation, epoch,
                      "Navigator, correction interval " + io::format_correction_interval(corrections) + ","),
      evaluation_text(outcome.attitude, epoch, "Attitude of the calibration itself"));
}

/// Each pass, and then the combination where there are several.
std::vector<CatalogueEntry> catalogue_entries(const std::vector<NamedPass>& passes,
                                              const ground::SeveralPasses& calibrated) {
  const PassSettings& first = passes.front().loaded.pass.settings;
  const std::string start_up = calibrated.start_up().empty() ? io::format_epoch(first.epoch) : calibrated.start_up();
  std::vector<CatalogueEntry> entries;
  for (const ground::PassAlone& pass : calibrated.passes()) {
    entries.push_back({first.spacecraft, pass.name, start_up, 1, pass.run.calibration});
  }
  if (passes.size() > 1) {
    entries.push_back({first.spacecraft, passes.back().name, start_up, static_cast<int>(passes.size()),
                       calibrated.combined().calibration});
  }
  return entries;
}

ground::SeveralPasses calibrate_in_order(const std::vector<NamedPass>& passes, const CalibrationOptions& options,
                                         bool quiet) {
  ground::SeveralPasses calibrated(options);
  for (const NamedPass& pass : passes) {
    try {
      const ProgressBar bar("calibrate", quiet);
      calibrated.add(pass.name, pass.loaded.pass, bar.meter());
    } catch (const ground::SetupError& error) {
      throw io::InputRefused(pass.path, {}, error.what(), error.cure());
    }
  }
  return calibrated;
}

std::vector<std::string> estimator_names() {
  std::vector<std::string> names;
  for (const EstimatorRow& row : kEstimators) {
    names.emplace_back(row.name);
  }
  return names;
}

}  // namespace

ExitStatus calibrate_passes(const std::vector<std::string>& paths, const CalibrationOptions& options,
                            const std::filesystem::path& out, const std::optional<std::filesystem::path>& catalogue,
                            const Common& common) {
  const std::vector<NamedPass> passes = read_passes(paths);
  if (catalogue) {
    io::expect_catalogue_of(passes.front().loaded.pass.settings.spacecraft, *catalogue);
  }
  const ground::SeveralPasses calibrated = calibrate_in_order(passes, options, common.quiet);
  const bool several = passes.size() > 1;
  io::StagedDirectory staged(out);
  for (std::size_t i = 0; several && i < passes.size(); ++i) {
    write_outcome(staged.path() / passes[i].name, outcome_of(passes[i], calibrated.passes()[i].run), options);
  }
  const Outcome outcome = outcome_of(passes.back(), calibrated.combined());
  write_outcome(staged.path(), outcome, options);
  staged.commit();
  if (catalogue) {
    io::add_to_catalogue(*catalogue, catalogue_entries(passes, calibrated));
  }

  if (common.json) {
    nlohmann::ordered_json json = outcome_json(outcome);
    if (several) {
      json["passes"] = passes_json(calibrated.passes());
    }
    fmt::print("{}\n", json.dump(1));
  } else if (!common.quiet) {
    fmt::print("{}{}Written     {}: calibration.json attitude.csv {}residuals.nc report.html effective-config.toml\n",
               several ? passes_text(calibrated.passes()) : "", outcome_text(outcome, options.corrections),
               out.string(), options.definitive_attitude ? "definitive-attitude.csv " : "");
  }
  return outcome.run.calibration.verdict.trustworthy ? kTrustworthy : kDoNotUse;
}

void add_calibrate(CLI::App& program, const Common& common, int& exit_status) {
  struct Arguments {
    std::vector<std::string> passes;
    std::string out;
    std::string estimator;
    std::string drift_model;
    std::string config;
    std::string catalogue;
    bool definitive = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      program.add_subcommand("calibrate", "Calibrate drift and alignment of the gyros against the star tracker");
  command->add_option("PASS", arguments->passes, "Directory or NetCDF file; several of one start of the rotors")
      ->required();
  command->add_option("-o,--output", arguments->out, "Directory to write into")->required();
  command->add_option("--estimator", arguments->estimator, "Estimator")->check(CLI::IsMember(estimator_names()));
  command->add_option("--drift-model", arguments->drift_model, "Drift model")->check([](const std::string& name) {
    return name == kAutoDriftModel || drift_model_named(name)
               ? ""
               : fmt::format("not one of {}, {}", kAutoDriftModel, drift_model_choices());
  });
  command->add_option("--config", arguments->config, "Settings (TOML); see effective-config.toml of any run");
  command->add_flag("--definitive", arguments->definitive,
                    "Write definitive-attitude.csv as well: at each gyro sample, by estimator batch");
  command->add_option("--catalogue", arguments->catalogue, "Database to add the calibrations to; see history");
  command->callback([&common, &exit_status, arguments] {
    CalibrationOptions options = arguments->config.empty() ? CalibrationOptions{} : io::read_config(arguments->config);
    if (!arguments->estimator.empty()) {
      options.estimator = estimator_named(arguments->estimator).value();
    }
    if (!arguments->drift_model.empty()) {
      options.drift_model = drift_model_named(arguments->drift_model);
    }
    if (arguments->definitive) {
      options.estimator = Estimator::kBatch;
      options.definitive_attitude = true;
    }
    const auto catalogue =
        arguments->catalogue.empty() ? std::nullopt : std::optional(std::filesystem::path(arguments->catalogue));
    exit_status = calibrate_passes(arguments->passes, options, arguments->out, catalogue, common);
  });
}

}  // namespace trihedron::cli
