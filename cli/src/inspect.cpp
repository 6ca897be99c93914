#include <fmt/core.h>

#include <memory>
#include <optional>
#include <string>

#include "commands.hpp"
#include "decisions.hpp"
#include "summary.hpp"
#include "trihedron/ground/clocks/clocks.hpp"

namespace trihedron::cli {

void add_inspect(CLI::App& program, const Common& common, int& exit_status) {
  auto pass = std::make_shared<std::string>();
  CLI::App* command = program.add_subcommand("inspect", "Say what a pass holds and what is wrong with its telemetry");
  command->add_option("PASS", *pass, "Directory or NetCDF file")->required();
  command->footer(
      "trihedron inspect pass-a\n"
      "# For a program\n"
      "trihedron --json inspect pass-a.nc");
  command->callback([&common, &exit_status, pass] {
    const io::LoadedPass loaded = io::read_pass(*pass);
    log_pass(common.log, *pass, loaded);
    const std::optional<Clocks> clocks = ground::clocks_of(loaded.pass);
    show(
        common,
        [&] {
          nlohmann::ordered_json json = pass_json(loaded);
          json["clocks"] = clocks_json(clocks, loaded.pass.gyro.gyros);
          return json;
        },
        [&] {
          return pass_text(loaded) + (loaded.defects.empty() ? "            no defects\n" : "") +
                 clocks_text(clocks, loaded.pass.gyro.gyros);
        });
    exit_status = kTrustworthy;
  });
}

}  // namespace trihedron::cli
