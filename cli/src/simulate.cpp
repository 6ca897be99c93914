#include "trihedron/sim/simulate.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>

#include "commands.hpp"
#include "summary.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/io/scenario.hpp"

namespace trihedron::cli {
namespace {

struct SimulateArguments {
  std::string scenario;
  std::string pass;
};

sim::SimulatedPass simulated(const SimulateArguments& arguments, const Scenario& scenario) {
  try {
    return sim::simulate(scenario);
  } catch (const std::invalid_argument& error) {
    throw io::InputRefused(arguments.scenario, {}, error.what(), "correct the scenario");
  }
}

int run_simulate(const SimulateArguments& arguments, const Common& common) {
  const Scenario scenario = io::read_scenario(arguments.scenario);
  const sim::SimulatedPass result = simulated(arguments, scenario);
  // A readout in steps needs no finer ones in the file.
  io::PassFormat format;
  double step = scenario.gyros.front().readout.quantum_rad;
  for (const GyroScenario& gyro : scenario.gyros) {
    step = std::min(step, gyro.readout.quantum_rad);
  }
  format.direction_step = std::max(step, format.direction_step);
  io::write_pass(arguments.pass, result.pass, &result.truth, format);
  if (common.json) {
    fmt::print("{}\n", pass_json({result.pass, {}}).dump(1));
  } else if (!common.quiet) {
    fmt::print("{}Written     {}\n", pass_text({result.pass, {}}), arguments.pass);
  }
  return kTrustworthy;
}

}  // namespace

void add_simulate(CLI::App& program, const Common& common, int& exit_status) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command =
      program.add_subcommand("simulate", "Make the telemetry of a pass, and its truth, from a scenario");
  command->add_option("SCENARIO", arguments->scenario, "Scenario (TOML)")->required();
  command->add_option("-o,--output", arguments->pass, "Pass to write: a directory, or a name in .nc")->required();
  command->callback([&common, &exit_status, arguments] { exit_status = run_simulate(*arguments, common); });
}

}  // namespace trihedron::cli
