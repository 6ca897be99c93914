#include <fmt/core.h>

#include <cstdio>
#include <exception>
#include <new>

#include "commands.hpp"
#include "standard_streams.hpp"
#include "stop_on_signals.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/records/stop.hpp"

namespace {

int fail(int status, const char* message) {
  trihedron::check_stop();  // what failed may have failed by that alone
  trihedron::cli::say(fmt::format("trihedron: {}\n", message));
  return status;
}

/// `status`, or the failure to write all of standard output.
int printed(int status) {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    return fail(trihedron::cli::kMachineFailed, "standard output: cannot be written; free some space, or open it");
  }
  return status;
}

int run(int argc, char** argv) {
  namespace cli = trihedron::cli;
  namespace io = trihedron::io;
  int exit_status = cli::kWrongUsage;
  try {
    CLI::App program("Calibrates electrostatic gyros in flight against a star tracker, and gives the attitude.",
                     "trihedron");
    program.set_version_flag("--version", TRIHEDRON_VERSION);
    program.require_subcommand(1);
    program.fallthrough();
    cli::Common common;
    program.add_flag("--quiet", common.quiet, "Print nothing but errors");
    program.add_flag("--json", common.json, "Print the summary as JSON");
    cli::add_simulate(program, common, exit_status);
    cli::add_inspect(program, common, exit_status);
    cli::add_calibrate(program, common, exit_status);
    cli::add_navigate(program, common, exit_status);
    cli::add_evaluate(program, common, exit_status);
    cli::add_observe(program, common, exit_status);
    cli::add_history(program, common, exit_status);
    cli::add_demo(program, common, exit_status);
    try {
      program.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      if (error.get_exit_code() == 0) {  // --help, --version
        return printed(program.exit(error));
      }
      return fail(cli::kWrongUsage, fmt::format("{}; see trihedron --help", error.what()).c_str());
    }
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
    if (std::ferror(stdout) != 0) {
      return printed(cli::kMachineFailed);
    }
    return fail(cli::kMachineFailed, error.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  trihedron::cli::open_standard_streams();
  return trihedron::cli::stopped_by_signals([argc, argv] { return run(argc, argv); });
}
