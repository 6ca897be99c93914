#pragma once
/// What export and import share.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "commands.hpp"
#include "trihedron/core/time.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::cli {

/// Where t_s counts from.
struct EpochOptions {
  std::string pass;
  std::string epoch;
};

void add_epoch_options(CLI::App& command, EpochOptions& options, const std::string& use);

/// What a pass or an option says.
struct EpochSource {
  std::optional<Time> epoch;
  std::string spacecraft;        ///< of the pass; empty without one
  std::string inertial_frame{};  ///< same
  bool body_is_told = false;     ///< the pass says how the star tracker is mounted: its axes are not those of the body
  std::vector<std::filesystem::path> inputs{};  ///< files that the pass was read from
};

/// Whether a pass says how its star tracker is mounted, other than along the axes of the body.
[[nodiscard]] bool body_is_told(const PassSettings& settings);

/// Throws UsageError where both say it, or the option is no time.
[[nodiscard]] EpochSource epoch_of(const EpochOptions& options);

/// For people and programs.
struct InterchangeSummary {
  std::string input;
  std::string input_format;
  std::vector<std::string> written;
  std::string output_format;
  std::size_t epochs = 0;
  std::size_t segments = 0;
  std::size_t left_out = 0;
  Time epoch{};
  std::string time_system;
  std::string inertial_frame;
  std::string body_frame;
  std::string object_name;
  std::string object_id;
  std::size_t covariances_left_out = 0;  ///< of fixes, for which the format has no room
};

void show_interchange(const Common& common, const InterchangeSummary& summary);

}  // namespace trihedron::cli
