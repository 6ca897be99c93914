#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "commands.hpp"
#include "steps.hpp"
#include "summary.hpp"
#include "trihedron/io/apart.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/io/quantity.hpp"
#include "trihedron/io/scenario.hpp"
#include "trihedron/sim/attitude.hpp"

namespace trihedron::cli {
namespace {

struct SimulateArguments {
  std::string scenario;
  std::string pass;
};

/// "2 of 3 slews begin after the end of the pass"
template <class Stretch>
void say_begins_after(const std::vector<Stretch>& all, double end_s, const std::string& name,
                      std::vector<std::string>& lines) {
  const auto late = std::ranges::count_if(all, [end_s](const Stretch& its) { return its.begin_s >= end_s; });
  if (late > 0) {
    lines.push_back(fmt::format("{} of {} {} {} after the end of the pass", late, all.size(), name,
                                late == 1 ? "begins" : "begin"));
  }
}

/// "the jump of the coefficients of gyro 1 at 5h is after the end of the pass", of a step that is there.
void say_is_after(bool is_there, double at_s, double end_s, const std::string& name, std::vector<std::string>& lines) {
  if (is_there && at_s >= end_s) {
    lines.push_back(
        fmt::format("the {} at {} is after the end of the pass", name, io::format_duration(from_seconds(at_s))));
  }
}

void say_mounting_is_after(const MountingChange& change, double end_s, const std::string& whose,
                           std::vector<std::string>& lines) {
  say_is_after(!change.step_rad.isZero(0), change.step_at_s, end_s, "step of the mounting of " + whose, lines);
}

void say_steps_after(const Scenario& scenario, double end_s, std::vector<std::string>& lines) {
  for (std::size_t k = 0; k < scenario.gyros.size(); ++k) {
    const GyroScenario& gyro = scenario.gyros[k];
    const std::string whose = fmt::format("gyro {}", k + 1);
    say_is_after(gyro.drift.jump_sigma_rad_s > 0, gyro.drift.jump_at_s, end_s, "jump of the coefficients of " + whose,
                 lines);
    say_mounting_is_after(gyro.mounting_change, end_s, whose, lines);
  }
  const auto say_of_head = [&](const StarTrackerScenario& head, const std::string& whose) {
    say_mounting_is_after(head.mounting_change, end_s, whose, lines);
    say_is_after(!head.inertial_step_rad.isZero(0), head.inertial_step_at_s, end_s,
                 "step of the inertial axes of " + whose, lines);
  };
  say_of_head(scenario.star_tracker, "the star tracker");
  for (std::size_t i = 0; i < scenario.further_star_trackers.size(); ++i) {
    say_of_head(scenario.further_star_trackers[i], fmt::format("star tracker {}", i + 2));
  }
}

/// What the scenario asks for and the pass is too short for.
std::vector<std::string> left_out(const Scenario& scenario) {
  const double end_s = to_seconds(scenario.duration);
  const AttitudeScenario& attitude = scenario.attitude;
  std::vector<std::string> lines;
  if (const auto* slews = std::get_if<std::vector<Slew>>(&attitude.slews)) {
    say_begins_after(*slews, end_s, "slews", lines);
    const sim::SlewPlan plan(*slews, attitude.max_slew_rate_rad_s, attitude.max_slew_acceleration_rad_s2);
    for (const sim::SlewPlan::Turn& turn : plan.turns()) {
      if (turn.begin_s < end_s && turn.end_s > end_s) {
        lines.push_back(fmt::format("the slew that begins at {} is not over by the end of the pass",
                                    io::format_duration(from_seconds(turn.begin_s))));
      }
    }
  }
  say_begins_after(scenario.gyro_gaps, end_s, "gaps of the gyros", lines);
  say_begins_after(scenario.star_tracker.outages, end_s, "outages of the star tracker", lines);
  for (std::size_t i = 0; i < scenario.further_star_trackers.size(); ++i) {
    say_begins_after(scenario.further_star_trackers[i].outages, end_s, fmt::format("outages of star tracker {}", i + 2),
                     lines);
  }
  say_steps_after(scenario, end_s, lines);
  return lines;
}

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
  const std::vector<std::string> missing = left_out(scenario);
  for (const std::string& line : missing) {
    common.log.say("left out: " + line);
  }
  const auto as_json = [&] {
    nlohmann::ordered_json json = pass_json({result.pass, {}});
    if (!missing.empty()) {
      json["left_out"] = missing;
    }
    return json;
  };
  show(common, as_json, [&] {
    std::string text = pass_text({result.pass, {}});
    for (const std::string& line : missing) {
      text += fmt::format("Left out    {}\n", line);
    }
    return text + written_pass_text(pass.string(), was_there);
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
