#include <fmt/format.h>

#include <memory>
#include <string>

#include "interchange.hpp"
#include "trihedron/io/apart.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/attitude_message.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/named_pass.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {

void add_epoch_options(CLI::App& command, EpochOptions& options, const std::string& use) {
  CLI::Option* pass = command.add_option("--pass", options.pass, "Pass with the epoch " + use)->type_name("PASS");
  command.add_option("--epoch", options.epoch, "Epoch " + use + ", TAI: 2009-05-20T00:00:00")
      ->excludes(pass)
      ->type_name("TIME");
}

EpochSource epoch_of(const EpochOptions& options) {
  if (!options.pass.empty()) {
    const io::NamedPass pass = io::read_named_pass(options.pass);
    return {pass.pass().settings.epoch, pass.pass().settings.spacecraft};
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
                                  {"object_id", summary.object_id}};
  };
  show(common, as_json, [&] {
    std::string text =
        fmt::format("Read        {}: {}, {} epochs in {} segment{}\n", printable(summary.input), summary.input_format,
                    summary.epochs, summary.segments, summary.segments == 1 ? "" : "s");
    if (summary.left_out > 0) {
      text += fmt::format("  left out  {} epochs outside the useable spans\n", summary.left_out);
    }
    text +=
        fmt::format("Spacecraft  {}, {}\nFrames      {} in {}\nTime        {}, epoch {} TAI\n",
                    printable(summary.object_name), printable(summary.object_id), printable(summary.body_frame),
                    printable(summary.inertial_frame), printable(summary.time_system), io::format_epoch(summary.epoch));
    for (const std::string& file : summary.written) {
      text += fmt::format("Written     {}: {}\n", printable(file), summary.output_format);
    }
    return text;
  });
}

void add_import(CLI::App& program, const Common& common, int& exit_status) {
  struct Arguments {
    std::string file;
    std::string output;
    EpochOptions epoch;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("import", "Read another software's attitude: CCSDS AEM");
  command->add_option("FILE", arguments->file, "Message, as text or XML; - for standard input")->required();
  command->add_option("-o,--output", arguments->output, "Attitude file to write (CSV); - for standard output")
      ->required()
      ->type_name("FILE");
  add_epoch_options(*command, arguments->epoch,
                    "that t_s is to count from (default: the one that export noted, else the first in the file)");
  command->footer(
      "trihedron import attitude.aem -o attitude.csv --pass pass.nc\n"
      "# Other commands read the message itself\n"
      "trihedron evaluate pass.nc --attitude attitude.aem");
  command->callback([&common, &exit_status, arguments] {
    const std::filesystem::path written = arguments->output;
    const bool to_stdout = arguments->output == kStandardStream;
    if (!to_stdout) {
      const std::vector<std::filesystem::path> inputs = {arguments->file, arguments->epoch.pass};
      io::expect_apart(inputs, {&written, 1});
    }
    const std::optional<Time> told = epoch_of(arguments->epoch).epoch;
    const io::AttitudeMessage message = io::read_attitude_message(source(arguments->file));
    const Time epoch = told.value_or(message.epoch.value_or(message.attitude.t.front()));
    const std::string text = io::format_attitude(epoch, message.attitude, io::AttitudeDigits::kAll, message.rate_rad_s);
    if (to_stdout) {
      print_data(stdout, text);
    } else {
      io::write_file(written, text);
    }
    show_interchange(beside(arguments->output, common), {arguments->file,
                                                         message.format,
                                                         {arguments->output},
                                                         "attitude file",
                                                         message.attitude.size(),
                                                         message.segments,
                                                         message.left_out,
                                                         epoch,
                                                         message.time_system,
                                                         message.inertial_frame,
                                                         message.body_frame,
                                                         message.object_name,
                                                         message.object_id});
    exit_status = kTrustworthy;
  });
}

}  // namespace trihedron::cli
