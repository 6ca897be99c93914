#include <fmt/core.h>

#include <memory>
#include <string>

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
    std::string limit = "5arcmin";
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      program.add_subcommand("evaluate", "Measure an attitude against the truth, or else the star tracker");
  command->add_option("PASS", arguments->pass, "Directory or NetCDF file")->required();
  command->add_option("--attitude", arguments->attitude, "Attitude file (CSV)")->required();
  command->add_option("--limit", arguments->limit, "Error that ends a correction interval")->capture_default_str();
  command->callback([&common, &exit_status, arguments] {
    const double limit_rad = io::parse_angle_rad(arguments->limit);
    const io::LoadedPass loaded = io::read_pass(arguments->pass);
    const auto truth = read_truth_of(arguments->pass, loaded.pass);
    const Time epoch = loaded.pass.settings.epoch;
    const Evaluation evaluation =
        evaluate(io::read_attitude(arguments->attitude, epoch), loaded.pass, truth, limit_rad);
    if (evaluation.errors.t.empty()) {
      throw io::InputRefused(arguments->attitude, {},
                             "it has no epoch in common with the " + evaluation.reference + " of " + arguments->pass,
                             "give an attitude of this pass");
    }
    if (common.json) {
      fmt::print("{}\n", evaluation_json(evaluation, epoch).dump(1));
    } else if (!common.quiet) {
      fmt::print("{}", evaluation_text(evaluation, epoch, "Attitude error"));
    }
    exit_status = kTrustworthy;
  });
}

}  // namespace trihedron::cli
