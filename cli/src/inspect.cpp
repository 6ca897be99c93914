#include <fmt/core.h>

#include <memory>
#include <optional>
#include <string>

#include "commands.hpp"
#include "decisions.hpp"
#include "proposals.hpp"
#include "summary.hpp"
#include "trihedron/ground/clocks/clocks.hpp"
#include "trihedron/ground/inspect/mistakes.hpp"

namespace trihedron::cli {

void add_inspect(CLI::App& program, const Common& common, int& exit_status) {
  auto pass = std::make_shared<std::string>();
  CLI::App* command = program.add_subcommand(
      "inspect", "Say what a pass holds, what is wrong with its telemetry, and which usual mistake would explain it");
  command->add_option("PASS", *pass, "Directory, NetCDF file or telemetry.toml")->required();
  command->footer(
      "trihedron inspect pass-a\n"
      "# Columns of others' files, before they are imported\n"
      "trihedron inspect examples/telemetry/telemetry.toml\n"
      "# For a program\n"
      "trihedron --json inspect pass-a.nc");
  command->callback([&common, &exit_status, pass] {
    const io::LoadedPass loaded = io::read_pass(*pass);
    log_pass(common.log, *pass, loaded);
    const Periods periods = periods_of(loaded.pass);
    const std::optional<Clocks> clocks = ground::clocks_of(loaded.pass);
    const std::optional<ground::Consistency> consistency = ground::consistency_of(loaded.pass, clocks);
    show(
        common,
        [&] {
          nlohmann::ordered_json json = pass_json(loaded);
          json["periods"] = periods_json(periods);
          json["clocks"] = clocks_json(clocks, loaded.pass);
          json["consistency"] = consistency_json(consistency, loaded);
          return json;
        },
        [&] {
          return pass_text(loaded) + (loaded.defects.empty() ? "            no defects\n" : "") +
                 periods_text(periods) + clocks_text(clocks, loaded.pass) + consistency_text(consistency, loaded);
        });
    exit_status = kTrustworthy;
  });
}

}  // namespace trihedron::cli
