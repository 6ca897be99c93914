#pragma once
/// One function per command: adds it to the program, and sets `exit_status` when it has run.

#include <CLI/CLI.hpp>

namespace trihedron::cli {

/// Pinned, see README. 2 to 4 come from exceptions, see main.cpp.
enum ExitStatus : int { kTrustworthy = 0, kDoNotUse = 1, kWrongUsage = 2, kInputRefused = 3, kMachineFailed = 4 };

struct Common {
  bool quiet = false;
  bool json = false;
};

void add_simulate(CLI::App& program, const Common& common, int& exit_status);
void add_inspect(CLI::App& program, const Common& common, int& exit_status);
void add_calibrate(CLI::App& program, const Common& common, int& exit_status);
void add_navigate(CLI::App& program, const Common& common, int& exit_status);
void add_evaluate(CLI::App& program, const Common& common, int& exit_status);
void add_observe(CLI::App& program, const Common& common, int& exit_status);
void add_history(CLI::App& program, const Common& common, int& exit_status);
void add_demo(CLI::App& program, const Common& common, int& exit_status);

}  // namespace trihedron::cli
