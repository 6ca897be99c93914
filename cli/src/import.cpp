#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <variant>
#include <vector>

#include "decisions.hpp"
#include "interchange.hpp"
#include "summary.hpp"
#include "trihedron/io/apart.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/attitude_message.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/calibration_message.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/named_pass.hpp"
#include "trihedron/io/time_scale.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {

void add_epoch_options(CLI::App& command, EpochOptions& options, const std::string& use) {
  CLI::Option* pass = command.add_option("--pass", options.pass, "Pass with the epoch " + use)->type_name("PASS");
  command.add_option("--epoch", options.epoch, "Epoch " + use + ", TAI: 2009-05-20T00:00:00")
      ->excludes(pass)
      ->type_name("TIME");
}

bool body_is_told(const PassSettings& settings) {
  const std::optional<Eigen::Vector3d>& mounting = settings.star_tracker_mounting_rotation_vector_rad;
  return mounting && !mounting->isZero(0);
}

EpochSource epoch_of(const EpochOptions& options) {
  if (!options.pass.empty()) {
    const io::NamedPass pass = io::read_named_pass(options.pass);
    const PassSettings& settings = pass.pass().settings;
    return {settings.epoch, settings.spacecraft, settings.inertial_frame, body_is_told(settings),
            io::inputs_of(pass.path, pass.loaded)};
  }
  if (options.epoch.empty()) {
    return {};
  }
  const std::optional<Time> epoch = io::parse_epoch(options.epoch);
  if (!epoch) {
    throw io::UsageError(fmt::format("--epoch {}: give a time of TAI like 2009-05-20T00:00:00", options.epoch));
  }
  return {epoch, ""};
}

void show_interchange(const Common& common, const InterchangeSummary& summary) {
  const auto as_json = [&] {
    return nlohmann::ordered_json{{"input", summary.input},
                                  {"input_format", summary.input_format},
                                  {"written", summary.written},
                                  {"output_format", summary.output_format},
                                  {"epochs", summary.epochs},
                                  {"segments", summary.segments},
                                  {"left_out", summary.left_out},
                                  {"epoch_tai", io::format_epoch(summary.epoch)},
                                  {"time_system", summary.time_system},
                                  {"inertial_frame", summary.inertial_frame},
                                  {"body_frame", summary.body_frame},
                                  {"object_name", summary.object_name},
                                  {"object_id", summary.object_id},
                                  {"covariances_left_out", summary.covariances_left_out}};
  };
  show(common, as_json, [&] {
    std::string text = fmt::format("Read        {}: {}", printable(summary.input), summary.input_format);
    if (summary.segments > 0) {
      text += fmt::format(", {} epochs in {} segment{}", summary.epochs, summary.segments,
                          summary.segments == 1 ? "" : "s");
    }
    text += '\n';
    if (summary.left_out > 0) {
      text += fmt::format("  left out  {} epochs outside the useable spans\n", summary.left_out);
    }
    if (summary.covariances_left_out > 0) {
      text += fmt::format("  left out  covariances of {} fixes, for which packets have no room\n",
                          summary.covariances_left_out);
    }
    text +=
        fmt::format("Spacecraft  {}, {}\nFrames      {} in {}\nTime        {}, epoch {} TAI\n",
                    printable(summary.object_name), printable(summary.object_id), printable(summary.body_frame),
                    printable(summary.inertial_frame), printable(summary.time_system), io::format_epoch(summary.epoch));
    for (const std::string& file : summary.written) {
      text += fmt::format("Written     {}: {}\n", printable(file), printable(summary.output_format));
    }
    return text;
  });
}

namespace {

struct ImportArguments {
  std::string file;
  std::string output;
  EpochOptions epoch;
  std::string time_system;
  std::string from;
  std::string to;
  std::vector<std::string> exclude;
};

/// Whether a pass is to be written: from a telemetry.toml, or another pass.
bool is_pass(const std::filesystem::path& file) {
  std::error_code ignored;
  return std::filesystem::is_directory(file, ignored) || file.extension() == ".toml" || file.extension() == ".nc";
}

io::Selection selection_of(const ImportArguments& arguments) {
  const std::optional<io::TimeScale> scale = io::time_scale_named(arguments.time_system);
  if (!scale) {
    throw io::UsageError(
        fmt::format("--time-system {}: give one of {}", arguments.time_system, fmt::join(io::kTimeScales, ", ")));
  }
  const auto instant = [&](const char* option, const std::string& given) -> std::optional<Time> {
    if (given.empty()) {
      return std::nullopt;
    }
    io::TimeText::Fault fault;
    const std::optional<Time> t = io::TimeText(*scale).parse(given, fault);
    if (!t) {
      throw io::UsageError(fmt::format("{}: {}; {}", option, fault.reason, fault.cure));
    }
    return t;
  };
  io::Selection selection{instant("--from", arguments.from), instant("--to", arguments.to), {}};
  for (const std::string& file : arguments.exclude) {
    const std::vector<io::LeftOut> intervals = io::read_intervals(source(file), *scale);
    selection.exclude.insert(selection.exclude.end(), intervals.begin(), intervals.end());
  }
  return selection;
}

void import_pass(const ImportArguments& arguments, const Common& common) {
  if (!arguments.epoch.pass.empty() || !arguments.epoch.epoch.empty()) {
    throw io::UsageError("--pass and --epoch are for an attitude; the epoch of a pass is in its own files");
  }
  const io::NamedPass named = io::read_named_pass(arguments.file, io::TruthUse::kToCompare, selection_of(arguments));
  const io::LoadedPass& loaded = named.loaded;
  log_pass(common.log, arguments.file, loaded);
  std::vector<std::filesystem::path> inputs = io::inputs_of(arguments.file, loaded);
  inputs.insert(inputs.end(), arguments.exclude.begin(), arguments.exclude.end());
  std::vector<std::filesystem::path> outputs =
      io::files_of_pass(arguments.output, 1 + loaded.pass.further_star_trackers.size());
  const bool was_there = any_is_there(outputs);
  outputs.emplace_back(arguments.output);
  io::expect_apart(inputs, outputs);
  io::write_pass(arguments.output, loaded.pass, named.truth_or_null());
  show(
      common,
      [&] {
        nlohmann::ordered_json json = pass_json(loaded);
        json["written"] = arguments.output;
        return json;
      },
      [&] { return pass_text(loaded) + written_pass_text(arguments.output, was_there); });
}

void expect_output_apart(const ImportArguments& arguments, const std::vector<std::filesystem::path>& inputs) {
  if (arguments.output != kStandardStream) {
    const std::filesystem::path output = arguments.output;
    io::expect_apart(inputs, {&output, 1});
  }
}

void put_imported(const ImportArguments& arguments, const std::string& text) {
  if (arguments.output == kStandardStream) {
    print_data(stdout, text);
  } else {
    io::write_file(arguments.output, text);
  }
}

void import_attitude(const ImportArguments& arguments, const Common& common, const io::AttitudeMessage& message) {
  const EpochSource epoch_source = epoch_of(arguments.epoch);
  expect_output_apart(arguments, epoch_source.inputs);
  const std::optional<Time> told = epoch_source.epoch;
  const Time epoch = told.value_or(message.epoch.value_or(message.attitude.t.front()));
  put_imported(arguments, io::format_attitude(epoch, message.attitude, io::AttitudeDigits::kAll, message.rate_rad_s));
  show_interchange(beside(arguments.output, common),
                   {arguments.file,
                    message.format,
                    {arguments.output},
                    told || message.epoch ? "attitude file"
                                          : "attitude file, whose t_s counts from its first attitude; "
                                            "--pass or --epoch make it count from another time",
                    message.attitude.size(),
                    message.segments,
                    message.left_out,
                    epoch,
                    message.time_system,
                    message.inertial_frame,
                    message.body_frame,
                    message.object_name,
                    message.object_id});
}

void import_calibration(const ImportArguments& arguments, const Common& common, const io::CalibrationMessage& message) {
  if (!arguments.epoch.pass.empty() || !arguments.epoch.epoch.empty()) {
    throw io::UsageError("--pass and --epoch are for an attitude; the epoch of a calibration is in its message");
  }
  expect_output_apart(arguments, {message.covariance_file});
  std::string written = "calibration";
  if (!message.has_full_covariance) {
    written +=
        fmt::format(", its covariance diagonal, of the 1-sigma values: {}",
                    message.covariance_file.empty() ? "the message names no covariance file"
                                                    : fmt::format("{} is not there", message.covariance_file.string()));
  }
  if (!message.manoeuvres.empty()) {
    written += fmt::format("; of its {} manoeuvre{} a calibration says nothing", message.manoeuvres.size(),
                           message.manoeuvres.size() == 1 ? "" : "s");
  }
  put_imported(arguments, io::format_calibration(message.calibration));
  show_interchange(beside(arguments.output, common), {arguments.file,
                                                      message.format,
                                                      {arguments.output},
                                                      written,
                                                      0,
                                                      0,
                                                      0,
                                                      message.calibration.epoch,
                                                      message.time_system,
                                                      message.inertial_frame,
                                                      message.body_frame,
                                                      message.object_name,
                                                      message.object_id});
}

void import_message(const ImportArguments& arguments, const Common& common) {
  if (!arguments.from.empty() || !arguments.to.empty() || !arguments.exclude.empty()) {
    throw io::UsageError("--from, --to and --exclude are for a pass, and this is taken for a message");
  }
  expect_output_apart(arguments, {arguments.file, arguments.epoch.pass});
  const auto message = io::read_message(source(arguments.file));
  if (const auto* const calibration = std::get_if<io::CalibrationMessage>(&message)) {
    import_calibration(arguments, common, *calibration);
  } else {
    import_attitude(arguments, common, std::get<io::AttitudeMessage>(message));
  }
}

}  // namespace

void add_import(CLI::App& program, const Common& common, int& exit_status) {
  auto arguments = std::make_shared<ImportArguments>();
  arguments->time_system = "TAI";
  CLI::App* command = program.add_subcommand("import",
                                             "Read others' telemetry by a telemetry.toml, another software's attitude "
                                             "(CCSDS AEM, APM, SPICE CK), or a calibration (ACM)");
  command
      ->add_option("FILE", arguments->file, "telemetry.toml or pass; or message, as text or XML, - for standard input")
      ->required();
  command
      ->add_option(
          "-o,--output", arguments->output,
          "Pass to write: a directory, or a NetCDF file by a name in .nc; of a message the attitude file (CSV) "
          "or calibration.json, - for standard output")
      ->required()
      ->type_name("OUTPUT");
  command->add_option("--from", arguments->from, "Leave out what is earlier: 2009-05-20T00:00:00")->type_name("TIME");
  command->add_option("--to", arguments->to, "Leave out what is later")->type_name("TIME");
  command
      ->add_option("--exclude", arguments->exclude,
                   "Leave out the intervals of this CSV file, columns begin and end; may be given several times")
      ->type_name("FILE");
  command->add_option("--time-system", arguments->time_system, "Of --from, --to and --exclude: TAI, UTC, GPS, TT, TDB")
      ->capture_default_str()
      ->type_name("NAME");
  add_epoch_options(*command, arguments->epoch,
                    "that t_s is to count from (default: the one that export noted, else the first in the file)");
  command->footer(
      "# Columns of others' CSV or NetCDF files, by a map of them: docs/telemetry.md\n"
      "trihedron import examples/telemetry/telemetry.toml -o pass.nc\n"
      "# A part of it, without manoeuvres\n"
      "trihedron import telemetry.toml -o pass.nc --from 2009-05-20T00:10:00 --exclude left-out.csv\n"
      "trihedron import attitude.aem -o attitude.csv --pass pass.nc\n"
      "# A calibration that export wrote, with its covariance file beside it\n"
      "trihedron import calibration.acm -o calibration.json\n"
      "# Other commands read telemetry.toml and messages themselves\n"
      "trihedron inspect telemetry.toml\n"
      "trihedron evaluate pass.nc --attitude attitude.aem");
  command->callback([&common, &exit_status, arguments] {
    if (is_pass(arguments->file)) {
      import_pass(*arguments, common);
    } else {
      import_message(*arguments, common);
    }
    exit_status = kTrustworthy;
  });
}

}  // namespace trihedron::cli
