#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>

#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <string_view>

#include "commands.hpp"
#include "manual.hpp"
#include "standard_streams.hpp"
#include "stop_on_signals.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"
#include "trihedron/records/text.hpp"

namespace {

int fail(int status, std::string_view message) {
  trihedron::check_stop();  // what failed may have failed by that alone
  trihedron::cli::print_text(stderr, fmt::format("trihedron: {}\n", trihedron::printable(message)));
  return status;
}

/// `status`, or the failure to write all of standard output.
int printed(int status) {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    return fail(trihedron::cli::kMachineFailed, "standard output: cannot be written; free some space, or open it");
  }
  return status;
}

void add_commands(CLI::App& program, trihedron::cli::Common& common, int& exit_status) {
  namespace cli = trihedron::cli;
  cli::add_simulate(program, common, exit_status);
  cli::add_inspect(program, common, exit_status);
  cli::add_calibrate(program, common, exit_status);
  cli::add_navigate(program, common, exit_status);
  cli::add_replay(program, common, exit_status);
  cli::add_evaluate(program, common, exit_status);
  cli::add_observe(program, common, exit_status);
  cli::add_campaign(program, common, exit_status);
  cli::add_history(program, common, exit_status);
  cli::add_export(program, common, exit_status);
  cli::add_import(program, common, exit_status);
  cli::add_demo(program, common, exit_status);
  cli::add_references(program, exit_status);
}

int run(int argc, char** argv) {
  namespace cli = trihedron::cli;
  namespace io = trihedron::io;
  int exit_status = cli::kWrongUsage;
  try {
    CLI::App program("Calibrates electrostatic gyros in flight against a star tracker, and gives the attitude.",
                     "trihedron");
    program.formatter(std::make_shared<cli::HelpFormatter>());
    program.set_help_flag("-h,--help", "Print what a command takes and gives");
    program.set_version_flag("--version", TRIHEDRON_VERSION, "Print the version");
    program.require_subcommand(1);
    program.fallthrough();
    program.footer(
        "# The paper's experiment, with a report\n"
        "trihedron demo\n"
        "# A pass of telemetry: what it holds, and its calibration\n"
        "trihedron inspect pass.nc\n"
        "trihedron calibrate pass.nc -o out");
    cli::Common common;
    bool verbose = false;
    std::string log_file;
    program.add_flag("--quiet", common.quiet, "Print nothing but errors");
    program.add_flag("--json", common.json, "Print the summary as JSON; trihedron schema describes it");
    program.add_flag("--verbose", verbose, "Say on stderr what is decided, and why");
    program.add_option("--log-file", log_file, "Write that into a file, with time stamps")->type_name("FILE");
    program.parse_complete_callback([&] {
      common.log.open(verbose, log_file);
      common.log.say(fmt::format("trihedron " TRIHEDRON_VERSION ": {}", fmt::join(argv + 1, argv + argc, " ")));
    });
    add_commands(program, common, exit_status);
    try {
      program.parse(argc, argv);
    } catch (const CLI::CallForHelp& call) {
      cli::print_data(stdout, program.help());
      exit_status = cli::kTrustworthy;
    } catch (const CLI::ParseError& error) {
      if (error.get_exit_code() != 0) {
        const std::string better = cli::meant(program, {argv, static_cast<std::size_t>(argc)});
        const auto commands = program.get_subcommands();
        return fail(cli::kWrongUsage,
                    fmt::format("{}; see trihedron {}--help", better.empty() ? std::string(error.what()) : better,
                                commands.empty() ? std::string() : commands.front()->get_name() + " "));
      }
      program.exit(error);  // --version, --print-config
      exit_status = cli::kTrustworthy;
    }
    common.log.say(fmt::format("exit status {}", exit_status));
    return printed(exit_status);
  } catch (const io::UsageError& error) {
    return fail(cli::kWrongUsage, error.what());
  } catch (const io::InputRefused& error) {
    return fail(cli::kInputRefused, error.what());
  } catch (const io::MachineFailed& error) {
    return fail(cli::kMachineFailed, error.what());
  } catch (const std::bad_alloc&) {
    return fail(cli::kMachineFailed, "out of memory; free some, or use a shorter pass");
  } catch (const trihedron::Stopped&) {
    throw;
  } catch (const std::exception& error) {
    return fail(cli::kMachineFailed, error.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
#ifdef M_ARENA_MAX
  // The library of C keeps what each thread has freed for that thread: a fifth of the memory of a calibration.
  mallopt(M_ARENA_MAX, 1);
#endif
  trihedron::cli::open_standard_streams();
  return trihedron::cli::stopped_by_signals([argc, argv] { return run(argc, argv); });
}
