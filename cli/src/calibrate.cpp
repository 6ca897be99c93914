#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "decisions.hpp"
#include "progress.hpp"
#include "steps.hpp"
#include "summary.hpp"
#include "trihedron/ground/calibrate/several_passes.hpp"
#include "trihedron/ground/evaluate/calibration_evaluation.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/io/apart.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/catalogue.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/named_pass.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/io/residuals.hpp"
#include "trihedron/io/staged_directory.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/records/text.hpp"
#include "trihedron/report/report.hpp"

namespace trihedron::cli {
namespace {

/// What is free and was not yet given back to the system.
void give_back_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

/// A calibration of a pass with its evaluation. Holds references.
struct Outcome {
  const io::NamedPass& pass;
  const CalibrationRun& run;
  ground::CalibrationEvaluation evaluation;
};

// Names of the files of an outcome.
constexpr std::string_view kCalibrationFile = "calibration.json";
constexpr std::string_view kAttitudeFile = "attitude.csv";
constexpr std::string_view kDefinitiveFile = "definitive-attitude.csv";
constexpr std::string_view kResidualsFile = "residuals.nc";
constexpr std::string_view kConfigFile = "effective-config.toml";
constexpr std::string_view kReportFile = "report.html";
constexpr std::array kOutcomeFiles = {kCalibrationFile, kAttitudeFile, kDefinitiveFile,
                                      kResidualsFile,   kConfigFile,   kReportFile};

/// `below`: the directory in OUT. evaluate() is called beside the writing of what does not depend on it; returns what
/// it gives.
ground::CalibrationEvaluation stage_outcome(io::StagedDirectory& staged, const std::filesystem::path& below,
                                            const io::NamedPass& pass, const CalibrationRun& run,
                                            const CalibrationOptions& options,
                                            const std::function<ground::CalibrationEvaluation()>& evaluate) {
  const Time epoch = run.calibration.epoch;
  const std::filesystem::path out = staged.path() / below;
  const io::MadeDirectory made(out);
  ground::CalibrationEvaluation evaluation;
  ground::side_by_side(
      [&] {
        evaluation = evaluate();
        report::ReportInput input{pass.pass(), run, pass.truth_or_null(), {}, &evaluation};
        for (const io::Defect& defect : pass.loaded.defects) {
          input.telemetry_notes.push_back(defect.text());
        }
        io::write_file(out / kReportFile, report::render(input));
      },
      [&] {
        io::write_calibration(out / kCalibrationFile, run.calibration);
        const io::Mounting& mounting = pass.pass().settings.star_tracker_mounting_rotation_vector_rad;
        io::write_attitude(out / kAttitudeFile, epoch, run.attitude, mounting);
        if (run.definitive_attitude.size() > 0) {
          io::write_attitude(out / kDefinitiveFile, epoch, run.definitive_attitude, mounting);
        } else {
          staged.drop(below / kDefinitiveFile);
        }
        io::write_file(out / kConfigFile, io::format_config(options));
        // Last: the library keeps what it takes.
        give_back_memory();
        io::write_residuals(out / kResidualsFile, epoch, io::residual_tables(run));
      });
  return evaluation;
}

/// The same, evaluated by the truth or the fixes of the pass.
Outcome stage_evaluated(io::StagedDirectory& staged, const std::filesystem::path& below, const io::NamedPass& pass,
                        const CalibrationRun& run, const CalibrationOptions& options) {
  return {pass, run, stage_outcome(staged, below, pass, run, options, [&] {
            return ground::evaluate_calibration(pass.pass(), run, pass.truth_or_null());
          })};
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
      {"pass", pass_json(outcome.pass.loaded)},
      {"calibration", nlohmann::ordered_json::parse(io::format_calibration(outcome.run.calibration))},
      {"fixes", counts_json(named_counts(outcome.run.fix_counts))},
      {"samples", counts_json(named_counts(outcome.run.samples))},
      {"navigation", evaluation_json(outcome.evaluation.navigation, epoch)},
      {"attitude", evaluation_json(outcome.evaluation.attitude, epoch)}};
  json.update(course_json(outcome.run, outcome.evaluation));
  return json;
}

std::string outcome_text(const Outcome& outcome, const CorrectionOptions& corrections) {
  const Time epoch = outcome.run.calibration.epoch;
  return fmt::format(
      "{}{}{}{}{}{}\n{}\n{}\n", verdict_line(outcome.run.calibration), pass_text(outcome.pass.loaded),
      findings_text(outcome.run.calibration.verdict), forecast_text(outcome.run.calibration.forecast),
      calibration_text(outcome.run, outcome.evaluation.estimate_minus_truth),
      course_text(outcome.run, outcome.evaluation),
      evaluation_text(outcome.evaluation.navigation, epoch,
                      "Navigator, correction interval " + io::format_correction_interval(corrections) + ","),
      evaluation_text(outcome.evaluation.attitude, epoch, "Attitude of the calibration itself"));
}

ground::SeveralPasses calibrate_in_order(const std::vector<io::NamedPass>& passes, const CalibrationOptions& options,
                                         const Common& common) {
  ground::SeveralPasses calibrated(options);
  for (const io::NamedPass& pass : passes) {
    try {
      const ProgressBar bar("calibrate", common.quiet);
      log_pass(common.log, pass.path.string(), pass.loaded);
      calibrated.add(pass.name, pass.pass(), bar.meter());
      give_back_memory();
      log_run(common.log, calibrated.passes().back().run);
    } catch (const ground::SetupError& error) {
      throw io::InputRefused(pass.path, {}, error.what(), error.cure());
    }
  }
  return calibrated;
}

/// Names in OUT that a calibration of these passes may write.
std::vector<std::filesystem::path> output_names(const std::vector<io::NamedPass>& passes) {
  std::vector<std::filesystem::path> names(kOutcomeFiles.begin(), kOutcomeFiles.end());
  for (std::size_t i = 0; passes.size() > 1 && i < passes.size(); ++i) {
    for (const std::string_view name : kOutcomeFiles) {
      names.push_back(std::filesystem::path(passes[i].name) / name);
    }
  }
  return names;
}

void expect_apart(const std::vector<io::NamedPass>& passes, const CalibrationFiles& files) {
  std::vector<std::filesystem::path> inputs = {files.config};
  for (const io::NamedPass& pass : passes) {
    const std::vector<std::filesystem::path> its = io::inputs_of(pass.path, pass.loaded);
    inputs.insert(inputs.end(), its.begin(), its.end());
  }
  std::vector<std::filesystem::path> outputs = {files.out};
  for (const std::filesystem::path& name : output_names(passes)) {
    outputs.push_back(files.out / name);
  }
  io::expect_apart({&files.catalogue, 1}, outputs);
  outputs.push_back(files.catalogue);
  io::expect_apart(inputs, outputs);
}

std::string not_one_of(const std::string& given, std::span<const std::string_view> known, const std::string& all) {
  const std::string_view name = nearest(given, known);
  return name.empty() ? fmt::format("{} is not one of {}", given, all)
                      : fmt::format("{} is not one of {}: did you mean {}?", given, all, name);
}

std::vector<std::string> estimator_names() {
  std::vector<std::string> names;
  for (const EstimatorRow& row : kEstimators) {
    names.emplace_back(row.name);
  }
  return names;
}

}  // namespace

std::span<const std::string_view> outcome_files() { return kOutcomeFiles; }

void stage_calibration(io::StagedDirectory& staged, const io::NamedPass& pass, const CalibrationRun& run,
                       ground::CalibrationEvaluation evaluation, const CalibrationOptions& options) {
  static_cast<void>(stage_outcome(staged, {}, pass, run, options, [&] { return std::move(evaluation); }));
}

Calibrated calibrate_into(io::StagedDirectory& staged, const std::filesystem::path& out,
                          const std::vector<io::NamedPass>& passes, const CalibrationOptions& options,
                          const Common& common) {
  const ground::SeveralPasses calibrated = calibrate_in_order(passes, options, common);
  const bool several = passes.size() > 1;
  for (std::size_t i = 0; several && i < passes.size(); ++i) {
    static_cast<void>(stage_evaluated(staged, passes[i].name, passes[i], calibrated.passes()[i].run, options));
  }
  const Outcome outcome = stage_evaluated(staged, {}, passes.back(), calibrated.combined(), options);

  if (several) {
    common.log.say("of all passes together:");
    log_run(common.log, calibrated.combined());
  }
  std::string summary;
  if (common.json) {
    nlohmann::ordered_json json = outcome_json(outcome);
    if (several) {
      json["passes"] = passes_json(calibrated.passes());
    }
    summary = json_text(json) + "\n";
  } else if (!common.quiet) {
    summary = fmt::format(
        "{}{}Written     {}: calibration.json attitude.csv {}residuals.nc report.html effective-config.toml\n",
        several ? passes_text(calibrated.passes()) : "", outcome_text(outcome, options.corrections),
        printable(out.string()), options.definitive_attitude ? "definitive-attitude.csv " : "");
  }
  return {outcome.run.calibration.verdict.trustworthy ? kTrustworthy : kDoNotUse, std::move(summary),
          calibrated.catalogue_entries()};
}

ExitStatus calibrate_passes(const std::vector<std::string>& paths, const CalibrationOptions& options,
                            const CalibrationFiles& files, const Common& common) {
  log_settings(common.log, options);
  const std::vector<io::NamedPass> passes = io::read_passes(paths, kOutcomeFiles);
  expect_apart(passes, files);
  if (!files.catalogue.empty()) {
    io::expect_catalogue_of(passes.front().pass().settings.spacecraft, files.catalogue);
  }
  io::StagedDirectory staged(files.out);
  staged.expect_places(output_names(passes));
  const Calibrated calibrated = calibrate_into(staged, files.out, passes, options, common);
  if (files.catalogue.empty()) {
    staged.commit();
  } else {
    io::CatalogueUpdate update(files.catalogue, calibrated.catalogue_entries);
    staged.put_in_place();
    update.commit();
    staged.keep();
  }
  common.log.say(fmt::format("written {}", files.out.string()));
  print_summary(common, calibrated.summary);
  return calibrated.exit_status;
}

void add_calibrate(CLI::App& program, const Common& common, int& exit_status) {
  struct Arguments {
    std::vector<std::string> passes;
    std::string out;
    std::string estimator;
    std::string drift_model;
    std::string config;
    std::string catalogue;
    std::string need;
    bool definitive = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      program.add_subcommand("calibrate", "Calibrate drift and alignment of the gyros against the star tracker");
  command
      ->add_option("PASS", arguments->passes,
                   "Directory, NetCDF file or telemetry.toml; several of one start of the rotors")
      ->required();
  command->add_option("-o,--output", arguments->out, "Directory to write into")->required()->type_name("DIRECTORY");
  command
      ->add_option("--estimator", arguments->estimator,
                   "How the calibration is made: the one that flies, the paper's, least squares over the whole pass; "
                   "invariant unless the settings say otherwise")
      ->check([](const std::string& name) {
        const std::vector<std::string> names = estimator_names();
        const std::vector<std::string_view> known(names.begin(), names.end());
        return estimator_named(name) ? "" : not_one_of(name, known, fmt::format("{}", fmt::join(known, ", ")));
      })
      ->type_name(fmt::format("{}", fmt::join(estimator_names(), "|")));
  command
      ->add_option(
          "--drift-model", arguments->drift_model,
          "Drift model. auto: the one that the pass gives evidence of; field: all members of the drift field, each "
          "degree "
          "as large as the pass shows, of estimator batch alone. Unless the settings say otherwise auto, of estimator "
          "batch field")
      ->check([](const std::string& name) {
        CalibrationOptions options;
        return set_drift_model(name, options) ? "" : not_one_of(name, {}, drift_model_word_choices());
      })
      ->type_name(fmt::format("{}", fmt::join(trihedron::drift_model_words(), "|")));
  add_need(*command, arguments->need);
  command->add_flag("--definitive", arguments->definitive,
                    "Write definitive-attitude.csv as well: at each gyro sample, by estimator batch");
  command->add_option("--catalogue", arguments->catalogue, "Database to add the calibrations to; see history")
      ->type_name("FILE");
  const auto settle = [arguments] {
    CalibrationOptions options = settings_of(arguments->config);
    if (!arguments->estimator.empty()) {
      options.estimator = estimator_named(arguments->estimator).value();
    }
    if (!arguments->drift_model.empty()) {
      static_cast<void>(set_drift_model(arguments->drift_model, options));
    }
    if (!arguments->need.empty()) {
      options.need = of_option("--need", [&] { return io::parse_need(arguments->need); });
    }
    if (arguments->definitive) {
      if (!arguments->estimator.empty() && options.estimator != Estimator::kBatch) {
        throw io::UsageError("--definitive is of estimator batch: leave out --estimator, or give batch");
      }
      options.estimator = Estimator::kBatch;
      options.definitive_attitude = true;
    }
    return options;
  };
  add_config(*command, arguments->config, settle);
  command->footer(
      "trihedron calibrate pass.nc -o out\n"
      "# Passes of one start of the rotors, combined and kept\n"
      "trihedron calibrate monday.nc tuesday.nc -o out --catalogue resurs.db\n"
      "# Exit status 1 where the attitude is not known well enough for long enough\n"
      "trihedron calibrate pass.nc -o out --need '5arcmin for 270min'\n"
      "# With another gate\n"
      "trihedron calibrate --print-config > settings.toml\n"
      "sed -i 's/^gate_nis.*/gate_nis = 40/' settings.toml\n"
      "trihedron calibrate pass.nc -o out --config settings.toml --log-file calibrate.log");
  command->callback([&common, &exit_status, arguments, settle] {
    const CalibrationOptions options = settle();
    exit_status =
        calibrate_passes(arguments->passes, options, {arguments->out, arguments->config, arguments->catalogue}, common);
  });
}

}  // namespace trihedron::cli
