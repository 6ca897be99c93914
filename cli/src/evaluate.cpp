#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>

#include "commands.hpp"
#include "decisions.hpp"
#include "summary.hpp"
#include "trihedron/ground/evaluate/attitude_evaluation.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/named_pass.hpp"
#include "trihedron/io/quantity.hpp"

namespace trihedron::cli {

void add_evaluate(CLI::App& program, const Common& common, int& exit_status) {
  struct Arguments {
    std::string pass;
    std::string attitude;
    std::string before;
    std::string truth;
    std::string limit = io::format_angle(ground::kAttitudeLimit_rad);
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      program.add_subcommand("evaluate", "Measure an attitude against the truth, or else the star tracker");
  command->add_option("PASS", arguments->pass, "Directory, NetCDF file or telemetry.toml")->required();
  command
      ->add_option("--attitude", arguments->attitude,
                   "Attitude file (CSV), CCSDS AEM or SPICE CK; - for standard input")
      ->required()
      ->type_name("FILE");
  command
      ->add_option("--before", arguments->before,
                   "Attitude file made with the values known before: gives the extension of the correction interval")
      ->type_name("FILE");
  command
      ->add_option("--truth", arguments->truth,
                   "Attitude, in any of these forms, that is taken for the truth at the epochs that both have "
                   "(default: the truth of the pass, else the star tracker)")
      ->type_name("FILE");
  command->add_option("--limit", arguments->limit, "Error that ends a correction interval")
      ->capture_default_str()
      ->type_name("ANGLE");
  command->footer(
      "trihedron evaluate pass.nc --attitude attitude.csv --limit 5arcmin\n"
      "# How much longer the attitude holds with a calibration\n"
      "trihedron navigate pass.nc --prior -o before.csv\n"
      "trihedron navigate pass.nc --calibration out/calibration.json -o - |\n"
      "  trihedron evaluate pass.nc --attitude - --before before.csv");
  command->callback([&common, &exit_status, arguments] {
    const double limit_rad =
        of_option("--limit", [&] { return io::parse_angle_rad(arguments->limit, limits::kAttitudeLimit_rad); });
    if (std::ranges::count(std::array{arguments->attitude, arguments->before, arguments->truth}, kStandardStream) > 1) {
      throw io::UsageError(
          "of --attitude, --before and --truth only one can be standard input: name a file for the others");
    }
    const io::NamedPass pass = io::read_named_pass(arguments->pass);
    const Time epoch = pass.pass().settings.epoch;
    Truth told;
    if (!arguments->truth.empty()) {
      const AttitudeHistory truth = io::read_attitude(source(arguments->truth), epoch);
      told.t = truth.t;
      told.q_in_c = truth.q_in_c;
    }
    const Truth* const truth = arguments->truth.empty() ? pass.truth_or_null() : &told;
    const auto evaluation_of = [&](const std::string& file) {
      ground::AttitudeEvaluation evaluation =
          ground::evaluate_attitude(pass.pass(), io::read_attitude(source(file), epoch), truth, limit_rad);
      if (evaluation.errors.t.empty()) {
        throw io::InputRefused(file, {},
                               arguments->truth.empty()
                                   ? fmt::format("it has no epoch in common with the {} of {}",
                                                 name_of(evaluation.reference), arguments->pass)
                                   : fmt::format("it has no epoch in common with {}", arguments->truth),
                               "give an attitude of this pass");
      }
      return evaluation;
    };
    const ground::AttitudeEvaluation evaluation = evaluation_of(arguments->attitude);
    std::optional<ground::IntervalExtension> extension;
    if (!arguments->before.empty()) {
      extension = ground::extension_between(evaluation_of(arguments->before), evaluation);
    }
    log_pass(common.log, arguments->pass, pass.loaded);
    common.log.say(fmt::format("{} is compared with the {}", arguments->attitude, name_of(evaluation.reference)));
    const auto as_json = [&] {
      nlohmann::ordered_json json = evaluation_json(evaluation, epoch);
      if (extension) {
        json["extension"] = extension_json(*extension, epoch);
      }
      return json;
    };
    show(common, as_json, [&] {
      return evaluation_text(evaluation, epoch, "Attitude error") +
             (extension ? fmt::format("  correction interval extended {}\n", extension_text(extension->median)) : "");
    });
    exit_status = kTrustworthy;
  });
}

}  // namespace trihedron::cli
