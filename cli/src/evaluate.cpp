#include <fmt/core.h>

#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "summary.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/quantity.hpp"

namespace trihedron::cli {

void add_evaluate(CLI::App& program, const Common& common, int& exit_status) {
  struct Arguments {
    std::string pass;
    std::string attitude;
    std::string before;
    std::string limit = "5arcmin";
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      program.add_subcommand("evaluate", "Measure an attitude against the truth, or else the star tracker");
  command->add_option("PASS", arguments->pass, "Directory or NetCDF file")->required();
  command->add_option("--attitude", arguments->attitude, "Attitude file (CSV)")->required();
  command->add_option(
      "--before", arguments->before,
      "Attitude file made with the values known before: gives the extension of the correction interval");
  command->add_option("--limit", arguments->limit, "Error that ends a correction interval")->capture_default_str();
  command->callback([&common, &exit_status, arguments] {
    const double limit_rad = io::parse_angle_rad(arguments->limit);
    const io::LoadedPass loaded = io::read_pass(arguments->pass);
    const auto truth = read_truth_of(arguments->pass, loaded.pass);
    const Time epoch = loaded.pass.settings.epoch;
    const Reference reference = reference_of(truth, loaded.pass.star_tracker, loaded.pass);
    const auto evaluation_of = [&](const std::string& file) {
      Evaluation evaluation = evaluate(io::read_attitude(file, epoch), reference, epoch, limit_rad);
      if (evaluation.errors.t.empty()) {
        throw io::InputRefused(file, {},
                               "it has no epoch in common with the " + reference.name + " of " + arguments->pass,
                               "give an attitude of this pass");
      }
      return evaluation;
    };
    const Evaluation evaluation = evaluation_of(arguments->attitude);
    std::vector<ground::IntervalPair> pairs;
    if (!arguments->before.empty()) {
      pairs = ground::paired(evaluation_of(arguments->before).intervals, evaluation.intervals);
    }
    const auto extension = ground::median_extension(pairs);
    if (common.json) {
      nlohmann::ordered_json json = evaluation_json(evaluation, epoch);
      if (!arguments->before.empty()) {
        json["extension"] = extension_json(pairs, extension, epoch);
      }
      fmt::print("{}\n", json.dump(1));
    } else if (!common.quiet) {
      fmt::print("{}", evaluation_text(evaluation, epoch, "Attitude error"));
      if (!arguments->before.empty()) {
        fmt::print("  correction interval extended {}\n", extension_text(extension));
      }
    }
    exit_status = kTrustworthy;
  });
}

}  // namespace trihedron::cli
