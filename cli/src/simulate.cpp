#include <fmt/core.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "commands.hpp"
#include "steps.hpp"
#include "summary.hpp"
#include "trihedron/io/apart.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/io/scenario.hpp"

namespace trihedron::cli {
namespace {

struct SimulateArguments {
  std::string scenario;
  std::string pass;
};

}  // namespace

sim::SimulatedPass simulated_by(const Scenario& scenario, const std::string& name) {
  try {
    return sim::simulate(scenario);
  } catch (const std::invalid_argument& error) {
    throw io::InputRefused(name, {}, error.what(), "correct the scenario");
  }
}

void simulate_pass(const std::filesystem::path& scenario_file, const std::string& name,
                   const std::filesystem::path& pass, const Common& common) {
  const Scenario scenario = io::read_scenario(scenario_file);
  std::vector<std::filesystem::path> inputs = io::files_of_scenario(scenario_file);
  inputs.push_back(scenario_file);
  std::vector<std::filesystem::path> outputs = io::files_of_pass(pass, 1 + scenario.further_star_trackers.size());
  const bool was_there = any_is_there(outputs);
  outputs.push_back(pass);
  io::expect_apart(inputs, outputs);
  io::PassWriter writer(pass);
  const sim::SimulatedPass result = simulated_by(scenario, name);
  writer.write(result.pass, &result.truth, io::format_for(scenario));
  common.log.say(fmt::format("simulated {}: {} samples, {} fixes; written {}", name, result.pass.gyro.size(),
                             result.pass.star_tracker.size(), pass.string()));
  show(
      common,
      [&] {
        return pass_json({result.pass, {}});
      },
      [&] {
        return pass_text({result.pass, {}}) + written_pass_text(pass.string(), was_there);
      });
}

void add_simulate(CLI::App& program, const Common& common, int& exit_status) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command =
      program.add_subcommand("simulate", "Make the telemetry of a pass, and its truth, from a scenario");
  command->add_option("SCENARIO", arguments->scenario, "Scenario (TOML); - for standard input")->required();
  command->add_option("-o,--output", arguments->pass, "Pass to write: a directory, or a NetCDF file by a name in .nc")
      ->required()
      ->type_name("PASS");
  command->footer(
      "# The paper's experiment\n"
      "trihedron simulate examples/paper.toml -o pass.nc\n"
      "# Two hours of it, without a file of its own\n"
      "echo 'scenario.duration = \"2h\"' | trihedron simulate - -o pass");
  command->callback([&common, &exit_status, arguments] {
    simulate_pass(source(arguments->scenario), arguments->scenario, arguments->pass, common);
    exit_status = kTrustworthy;
  });
}

}  // namespace trihedron::cli
