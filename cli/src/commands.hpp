#pragma once
/// One function per command: adds it to the program, and sets `exit_status` when it has run.

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "output.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/records/limits.hpp"
#include "trihedron/records/options.hpp"

namespace trihedron::cli {

/// Pinned, see README. 2 to 4 come from exceptions, see main.cpp.
enum ExitStatus : int { kTrustworthy = 0, kDoNotUse = 1, kWrongUsage = 2, kInputRefused = 3, kMachineFailed = 4 };

void add_simulate(CLI::App& program, const Common& common, int& exit_status);
void add_inspect(CLI::App& program, const Common& common, int& exit_status);
void add_calibrate(CLI::App& program, const Common& common, int& exit_status);
void add_navigate(CLI::App& program, const Common& common, int& exit_status);
void add_replay(CLI::App& program, const Common& common, int& exit_status);
void add_evaluate(CLI::App& program, const Common& common, int& exit_status);
void add_observe(CLI::App& program, const Common& common, int& exit_status);
void add_export(CLI::App& program, const Common& common, int& exit_status);
void add_import(CLI::App& program, const Common& common, int& exit_status);
void add_campaign(CLI::App& program, const Common& common, int& exit_status);
void add_history(CLI::App& program, const Common& common, int& exit_status);
void add_demo(CLI::App& program, const Common& common, int& exit_status);
/// schema, man, completion: what the program says of itself.
void add_references(CLI::App& program, int& exit_status);

/// --need.
void add_need(CLI::App& command, std::string& need);

/// --config and --print-config of a command that `options` is for, in this order, after the options that overrule them:
/// `settle` gives the settings by all of these.
void add_config(CLI::App& command, std::string& file, const std::function<CalibrationOptions()>& settle);

/// Settings of the file, "-" for standard input, or of the program where there is none.
[[nodiscard]] CalibrationOptions settings_of(const std::string& file);

/// What `parse` gives of an option; a UsageError of it names the option.
template <class Parse>
[[nodiscard]] auto of_option(const char* name, const Parse& parse) {
  try {
    return parse();
  } catch (const io::UsageError& error) {
    throw io::UsageError(std::string(name) + ": " + error.what());
  }
}

/// For a whole number in a range.
[[nodiscard]] CLI::Validator whole(const Range& range);

}  // namespace trihedron::cli
