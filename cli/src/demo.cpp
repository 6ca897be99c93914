#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <string>

#include "commands.hpp"
#include "steps.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/named_pass.hpp"
#include "trihedron/io/staged_directory.hpp"

namespace trihedron::cli {
namespace {

/// Scenario of the demonstration: what it leaves out has its default, and the defaults are the paper's experiment.
constexpr const char* kScenario =
    "# The paper's experiment: nine hours, 30′ of misalignment, unknown drift coefficients, and a drift that eq. (1) "
    "does\n"
    "# not fully contain. What is not said here is as the program has it: trihedron simulate scenario.toml -o pass.nc\n"
    "[scenario]\n"
    "seed = 2009\n";

ExitStatus run_demo(const std::filesystem::path& out, const Common& common) {
  const Common silent{.quiet = true, .json = false};
  io::StagedDirectory staged(out);
  const std::filesystem::path scenario = staged.path() / "scenario.toml";
  const std::filesystem::path pass = staged.path() / "pass.nc";
  io::write_file(scenario, kScenario);
  simulate_pass(scenario, "scenario.toml", pass, silent);
  const Calibrated calibrated = calibrate_into(staged, out, {io::read_named_pass(pass)}, {}, common);
  // The calibration's verdict is the one that counts: this is the same filter on the same pass.
  static_cast<void>(navigate_pass(pass, {staged.path() / "navigation.csv", {}, {}}, {}, silent));
  staged.commit();
  fmt::print("{}", calibrated.summary);
  if (!common.quiet && !common.json) {
    fmt::print("            scenario.toml pass.nc navigation.csv\n\nThe report is {}\n",
               (out / "report.html").string());
  }
  return calibrated.exit_status;
}

}  // namespace

void add_demo(CLI::App& program, const Common& common, int& exit_status) {
  auto out = std::make_shared<std::string>("trihedron-demo");
  CLI::App* command = program.add_subcommand(
      "demo", "The paper's experiment: simulate nine hours, calibrate, navigate, evaluate, report");
  command->add_option("-o,--output", *out, "Directory to write into")->capture_default_str();
  command->callback([&common, &exit_status, out] { exit_status = run_demo(*out, common); });
}

}  // namespace trihedron::cli
