#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "decisions.hpp"
#include "interchange.hpp"
#include "trihedron/ground/evaluate/equivalent_bias.hpp"
#include "trihedron/io/apart.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/attitude_message.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/calibration_message.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/named_pass.hpp"
#include "trihedron/io/packets.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/io/spice_kernels.hpp"
#include "trihedron/io/time_scale.hpp"

namespace trihedron::cli {
namespace {

constexpr const char* kPackets = "packets";

struct ExportArguments {
  std::string file;
  std::string format;
  std::string output;
  EpochOptions epoch;
  std::string time_system = "TAI";
  std::string object_name;
  std::string inertial_frame;
  std::string body_frame;
  io::MessageDescription description;
  std::string gap;
  std::string attitude;
  std::string at;
  int naif_id = io::SpiceObject{}.naif_id;
  int apid = io::kDefaultApid;
};

struct OptionOfFormats {
  std::string_view option;
  std::vector<std::string_view> formats;  ///< without "-xml", which takes what the other syntax does
};

/// Refuses options that the format that is asked for has no use of.
void expect_of_format(const CLI::App& command, std::string_view format) {
  const std::vector<std::string_view> messages = {"aem", "apm", "acm"};
  const std::vector<OptionOfFormats> options = {{"--pass", {"aem", "apm", "ck", "acm", "fk"}},
                                                {"--epoch", {"aem", "apm", "ck"}},
                                                {"--time-system", messages},
                                                {"--inertial-frame", messages},
                                                {"--body-frame", messages},
                                                {"--object-name", {"aem", "apm", "ck", "acm", "fk"}},
                                                {"--object-id", messages},
                                                {"--originator", messages},
                                                {"--created", messages},
                                                {"--gap", {"aem", "ck", "acm"}},
                                                {"--attitude", {"acm"}},
                                                {"--at", {"apm"}},
                                                {"--naif-id", {"ck", "fk"}},
                                                {"--apid", {kPackets}}};
  const std::string_view kind = format.substr(0, format.find('-'));
  for (const OptionOfFormats& its : options) {
    if (command.count(std::string(its.option)) > 0 && std::ranges::find(its.formats, kind) == its.formats.end()) {
      throw io::UsageError(fmt::format("{} is of no use to --format {}, only to {}: leave it out", its.option, format,
                                       fmt::join(its.formats, ", ")));
    }
  }
  if (kind == "acm" && command.count("--gap") > 0 && command.count("--attitude") == 0) {
    throw io::UsageError("--gap is of the attitude of an acm: give one by --attitude, or leave --gap out");
  }
}

/// What is written beside the output: its name with another ending.
std::string beside_output(const ExportArguments& arguments, const char* ending) {
  return std::filesystem::path(arguments.output).replace_extension(ending).string();
}

std::vector<std::string> files_of(const ExportArguments& arguments) {
  std::vector<std::string> files = {arguments.output};
  if (arguments.format == "ck") {
    files.push_back(beside_output(arguments, ".tsc"));
    files.push_back(beside_output(arguments, ".tf"));
  } else if (arguments.format.starts_with("acm")) {
    files.push_back(beside_output(arguments, ".covariance.nc"));
  } else if (arguments.format == kPackets) {
    files.push_back(beside_output(arguments, ".toml"));
    files.push_back(beside_output(arguments, ".xtce.xml"));
  }
  return files;
}

/// `inputs`: that the outputs are not to replace.
void expect_outputs_apart(const ExportArguments& arguments, const std::vector<std::filesystem::path>& inputs) {
  if (arguments.output == kStandardStream) {
    return;
  }
  const std::vector<std::string> files = files_of(arguments);
  io::expect_apart(inputs, std::vector<std::filesystem::path>(files.begin(), files.end()));
}

void expect_places(const ExportArguments& arguments) {
  const bool several = files_of(arguments).size() > 1;
  if (arguments.output == kStandardStream) {
    if (several) {
      throw io::UsageError(fmt::format("--format {} writes several files: name one by -o", arguments.format));
    }
    return;
  }
  expect_outputs_apart(arguments, {arguments.file, arguments.epoch.pass, arguments.attitude});
  const std::vector<std::string> files = files_of(arguments);
  io::expect_apart_from_each_other(std::vector<std::filesystem::path>(files.begin(), files.end()));
}

/// Each whole, and none where one cannot be written.
void write_all(const std::vector<std::string>& files, const std::vector<std::string>& contents) {
  std::vector<io::AtomicFile> written;
  for (std::size_t i = 0; i < contents.size(); ++i) {
    written.emplace_back(files[i]).write(contents[i]);
  }
  for (io::AtomicFile& file : written) {
    file.commit();
  }
}

io::MessageDescription description_of(const ExportArguments& arguments, const EpochSource& source) {
  io::MessageDescription description = arguments.description;
  const std::optional<io::TimeScale> scale = io::time_scale_named(arguments.time_system);
  if (!scale) {
    throw io::UsageError(
        fmt::format("--time-system {}: give one of {}", arguments.time_system, fmt::join(io::kTimeScales, ", ")));
  }
  description.time_scale = *scale;
  if (!arguments.inertial_frame.empty()) {
    description.inertial_frame = arguments.inertial_frame;
  } else if (!source.inertial_frame.empty()) {
    description.inertial_frame = source.inertial_frame;
  }
  if (!arguments.body_frame.empty()) {
    description.body_frame = arguments.body_frame;
  } else if (source.body_is_told) {
    description.body_frame = "STARTRACKER_1";
  }
  if (!arguments.object_name.empty()) {
    description.object_name = arguments.object_name;
  } else if (!source.spacecraft.empty()) {
    description.object_name = source.spacecraft;
  }
  if (description.created_utc.empty()) {
    description.created_utc = io::utc_now();
  } else {
    io::TimeText::Fault fault;
    if (!io::TimeText(io::TimeScale::kUtc).parse(description.created_utc, fault)) {
      throw io::UsageError(fmt::format("--created {}; {}", fault.reason, fault.cure));
    }
  }
  io::expect_writable_description(description);
  return description;
}

io::SpiceObject spice_object(const ExportArguments& arguments, const io::MessageDescription& description) {
  io::SpiceObject object{arguments.naif_id, description.object_name};
  io::expect_spice_object(object);
  return object;
}

void put_out(const ExportArguments& arguments, const std::string& text) {
  if (arguments.output == kStandardStream) {
    print_data(stdout, text);
  } else {
    io::write_file(arguments.output, text);
  }
}

/// The row that --at names, or the last.
std::size_t row_of(const ExportArguments& arguments, const io::AttitudeMessage& message, io::TimeScale scale) {
  const std::vector<Time>& t = message.attitude.t;
  if (arguments.at.empty()) {
    return t.size() - 1;
  }
  io::TimeText::Fault fault;
  io::TimeText clock(scale);
  const std::optional<Time> at = clock.parse(arguments.at, fault);
  if (!at) {
    throw io::UsageError(fmt::format("--at: {}; {}", fault.reason, fault.cure));
  }
  const auto found = std::ranges::lower_bound(t, *at);
  if (found == t.end() || *found != *at) {
    const auto nearest =
        found == t.end() || (found != t.begin() && *at - *(found - 1) < *found - *at) ? found - 1 : found;
    throw io::UsageError(fmt::format("--at {}: there is no attitude at this epoch; the nearest is at {} {}",
                                     arguments.at, clock.format(*nearest), io::name_of(scale)));
  }
  return static_cast<std::size_t>(found - t.begin());
}

Duration gap_of(const ExportArguments& arguments, const AttitudeHistory& attitude) {
  return arguments.gap.empty() ? io::usual_gap(attitude)
                               : of_option("--gap", [&] { return io::parse_duration(arguments.gap, limits::kGap_s); });
}

void export_attitude(const ExportArguments& arguments, const Common& common) {
  const EpochSource epoch_source = epoch_of(arguments.epoch);
  expect_outputs_apart(arguments, epoch_source.inputs);
  const io::MessageDescription description = description_of(arguments, epoch_source);
  const io::AttitudeMessage read = io::read_attitude_of_any_format(source(arguments.file), epoch_source.epoch);
  const Time epoch = epoch_source.epoch.value_or(read.epoch.value_or(read.attitude.t.front()));
  const Duration gap = gap_of(arguments, read.attitude);
  const std::vector<std::size_t> stretches = io::stretches(read.attitude, gap);
  InterchangeSummary summary{arguments.file,
                             read.format,
                             files_of(arguments),
                             "SPICE CK of type 3, its clock and frames",
                             read.attitude.size(),
                             stretches.size() - 1,
                             read.left_out,
                             epoch,
                             "TDT of SPICE",
                             "J2000",
                             "",
                             description.object_name,
                             description.object_id};
  const bool parameters = arguments.format.starts_with("apm");
  if (arguments.format == "ck") {
    const io::SpiceObject object = spice_object(arguments, description);
    const io::SpiceClock clock = io::SpiceClock::of(read.attitude);
    write_all(summary.written, {io::format_ck(read.attitude, read.rate_rad_s, clock, object, stretches),
                                io::format_sclk(clock, object), io::format_ck_frames(object)});
    summary.body_frame = object.frame_name();
  } else {
    const bool xml = arguments.format.ends_with("-xml");
    const io::MessageSyntax syntax = xml ? io::MessageSyntax::kXml : io::MessageSyntax::kKvn;
    if (parameters) {
      const std::size_t row = row_of(arguments, read, description.time_scale);
      put_out(arguments, io::format_apm(read, row, epoch, description, syntax));
    } else {
      put_out(arguments, io::format_aem(read.attitude, read.rate_rad_s, epoch, description, gap, syntax));
    }
    summary.output_format = fmt::format("CCSDS {} version 2, {}", parameters ? "APM" : "AEM", xml ? "XML" : "KVN");
    summary.time_system = io::name_of(description.time_scale);
    summary.inertial_frame = description.inertial_frame;
    summary.body_frame = description.body_frame;
  }
  show_interchange(beside(arguments.output, common), summary);
}

void export_calibration(const ExportArguments& arguments, const Common& common) {
  std::optional<io::NamedPass> pass;
  EpochSource epoch_source;
  if (!arguments.epoch.pass.empty()) {
    pass = io::read_named_pass(arguments.epoch.pass);
    const PassSettings& settings = pass->pass().settings;
    epoch_source = {settings.epoch, settings.spacecraft, {}, body_is_told(settings)};
    expect_outputs_apart(arguments, io::inputs_of(pass->path, pass->loaded));
  }
  const io::MessageDescription description = description_of(arguments, epoch_source);
  const Calibration calibration = io::read_calibration(source(arguments.file));
  InterchangeSummary summary{arguments.file,
                             "calibration",
                             files_of(arguments),
                             "SPICE FK",
                             0,
                             0,
                             0,
                             calibration.epoch,
                             "TAI",
                             "J2000",
                             "",
                             description.object_name,
                             description.object_id};
  if (arguments.format == "fk") {
    const io::SpiceObject object = spice_object(arguments, description);
    put_out(arguments, io::format_calibration_frames(calibration, object));
    summary.body_frame = object.frame_name();
  } else {
    std::optional<io::AttitudeMessage> attitude;
    if (!arguments.attitude.empty()) {
      attitude = io::read_attitude_of_any_format(arguments.attitude, calibration.epoch);
    }
    const bool xml = arguments.format == "acm-xml";
    io::CalibrationContext context;
    context.attitude = attitude ? &*attitude : nullptr;
    context.pass = pass ? &pass->pass().settings : nullptr;
    if (attitude) {
      const Duration gap = gap_of(arguments, attitude->attitude);
      context.manoeuvres = io::slews_of(attitude->attitude, gap);
      context.gyro_bias_rad_s = ground::equivalent_gyro_bias_rad_s(calibration, attitude->attitude);
    }
    context.covariance_file = std::filesystem::path(summary.written[1]).filename().string();
    const std::string text =
        io::format_acm(calibration, context, description, xml ? io::MessageSyntax::kXml : io::MessageSyntax::kKvn);
    io::AtomicFile message(arguments.output);
    message.write(text);
    io::write_covariance(summary.written[1], calibration);
    message.commit();
    summary.output_format = fmt::format("CCSDS ACM version 2, {}, and its covariance", xml ? "XML" : "KVN");
    summary.epochs = attitude ? attitude->attitude.size() : 0;
    summary.time_system = io::name_of(description.time_scale);
    summary.inertial_frame = description.inertial_frame;
    summary.body_frame = description.body_frame;
  }
  show_interchange(beside(arguments.output, common), summary);
}

void export_pass(const ExportArguments& arguments, const Common& common) {
  const io::LoadedPass loaded = io::read_pass(arguments.file);
  log_pass(common.log, arguments.file, loaded);
  const Pass& pass = loaded.pass;
  const std::string prior = beside_output(arguments, ".prior.json");
  const auto name_of_file = [](const std::string& path) { return std::filesystem::path(path).filename().string(); };
  const io::PacketFiles files =
      io::format_packets(pass, arguments.apid, name_of_file(arguments.output), name_of_file(prior));
  std::vector<std::string> written = files_of(arguments);
  std::vector<std::string> contents = {files.packets, files.toml, files.xtce};
  if (!files.prior.empty()) {
    written.push_back(prior);
    contents.push_back(files.prior);
  }
  std::vector<std::filesystem::path> inputs = io::files_of_pass(arguments.file, 1 + pass.further_star_trackers.size());
  const std::vector<std::filesystem::path> read = io::inputs_of(arguments.file, loaded);
  inputs.insert(inputs.end(), read.begin(), read.end());
  const std::vector<std::filesystem::path> outputs(written.begin(), written.end());
  io::expect_apart(inputs, outputs);
  io::expect_apart_from_each_other(outputs);
  write_all(written, contents);
  InterchangeSummary summary{arguments.file,
                             "pass",
                             written,
                             "CCSDS space packets, PUS-C 3/25, with telemetry.toml and XTCE 1.2",
                             pass.gyro.size() + pass.star_tracker.size(),
                             1,
                             0,
                             pass.settings.epoch,
                             "TAI",
                             pass.settings.inertial_frame.empty() ? "GCRF" : pass.settings.inertial_frame,
                             "c",
                             pass.settings.spacecraft,
                             arguments.description.object_id};
  for (const StarTrackerTelemetry& fixes : pass.further_star_trackers) {
    summary.epochs += fixes.size();
  }
  summary.covariances_left_out = files.covariances_left_out;
  show_interchange(common, summary);
}

}  // namespace

void add_export(CLI::App& program, const Common& common, int& exit_status) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command = program.add_subcommand(
      "export", "Write attitude, calibration or pass for other software: CCSDS messages and packets, SPICE kernels");
  command
      ->add_option(
          "FILE", arguments->file,
          "Attitude file (CSV) or message, for acm and fk calibration.json, - for standard input; for packets a pass")
      ->required();
  const std::vector<std::string> formats = {"aem", "aem-xml", "apm", "apm-xml", "ck", "acm", "acm-xml", "fk", kPackets};
  command
      ->add_option(
          "--format", arguments->format,
          "What to write: of an attitude aem (text), aem-xml, apm or apm-xml (of one epoch) or ck (with .tsc and .tf "
          "beside it), of a "
          "calibration acm (text), acm-xml (with .covariance.nc beside it) or fk, of a pass packets (space packets, "
          "with .toml and .xtce.xml beside it)")
      ->required()
      ->type_name(fmt::format("{}", fmt::join(formats, "|")))
      ->check(CLI::IsMember(formats).description(""));
  command->add_option("-o,--output", arguments->output, "File to write; - for standard output")
      ->required()
      ->type_name("FILE");
  add_epoch_options(*command, arguments->epoch, "that t_s of the attitude file counts from");
  command->add_option("--time-system", arguments->time_system, "Time scale of the epochs")
      ->capture_default_str()
      ->type_name(fmt::format("{}", fmt::join(io::kTimeScales, "|")));
  command
      ->add_option("--inertial-frame", arguments->inertial_frame,
                   "Name of the axes that q_in_c leads to (default: that of the pass, else GCRF)")
      ->type_name("NAME");
  command
      ->add_option(
          "--body-frame", arguments->body_frame,
          "Name of the axes c, of the star tracker; SC_BODY_1, or STARTRACKER_1 where the pass says how that is "
          "mounted")
      ->type_name("NAME");
  command
      ->add_option("--object-name", arguments->object_name,
                   "Name of the spacecraft (default: that of the pass, else UNKNOWN)")
      ->type_name("NAME");
  command->add_option("--object-id", arguments->description.object_id, "Its international designator: 2006-021A")
      ->capture_default_str()
      ->type_name("ID");
  command->add_option("--originator", arguments->description.originator, "Who gives the message")
      ->capture_default_str()
      ->type_name("NAME");
  command
      ->add_option(
          "--gap", arguments->gap,
          "Step above which there is a gap: a new segment or interval begins (default: 1.5 times the median step)")
      ->type_name("DURATION");
  command
      ->add_option("--attitude", arguments->attitude,
                   "For acm: attitude to give as well, with its sigmas as covariance")
      ->type_name("FILE");
  command
      ->add_option("--at", arguments->at,
                   "For apm: its epoch, in the time system of --time-system, at which there must be an attitude "
                   "(default: the last)")
      ->type_name("TIME");
  command->add_option("--naif-id", arguments->naif_id, "For ck and fk: number of the spacecraft in SPICE")
      ->capture_default_str()
      ->type_name("N");
  command->add_option("--apid", arguments->apid, "For packets: APID of the gyros; the star trackers have the following")
      ->capture_default_str()
      ->type_name("N");
  command->add_option("--created", arguments->description.created_utc, "Creation date, UTC (default: now)")
      ->type_name("TIME");
  command->footer(
      "trihedron export attitude.csv --format aem -o attitude.aem --pass pass.nc --time-system UTC\n"
      "trihedron export attitude.csv --format apm -o now.apm --pass pass.nc --at 2009-05-20T00:10:00\n"
      "trihedron export attitude.csv --format ck -o attitude.bc --pass pass.nc --naif-id -28380\n"
      "trihedron export out/calibration.json --format acm -o out.acm --pass pass.nc --attitude a.csv\n"
      "trihedron export out/calibration.json --format fk -o gyros.tf --object-name RESURS-DK1\n"
      "trihedron export pass.nc --format packets -o telemetry.ccsds  # read again by telemetry.toml");
  command->callback([&common, &exit_status, arguments, command] {
    expect_of_format(*command, arguments->format);
    expect_places(*arguments);
    if (arguments->format == kPackets) {
      export_pass(*arguments, common);
    } else if (arguments->format.starts_with("acm") || arguments->format == "fk") {
      export_calibration(*arguments, common);
    } else {
      export_attitude(*arguments, common);
    }
    exit_status = kTrustworthy;
  });
}

}  // namespace trihedron::cli
