#pragma once
/// The formats in which a pass can be read. A further one is a reader in a source file of its own, declared here, and a
/// row of the table.

#include <array>
#include <filesystem>
#include <vector>

#include "series.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::io {

/// Settings and tables as the format holds them, before any screening.
struct UnscreenedPass {
  PassSettings settings;
  std::filesystem::path settings_file;  ///< that holds them, for messages
  Series gyro;                          ///< columns h1_x, h1_y, h1_z, h2_x …
  std::vector<Series> star_trackers;    ///< columns q_x, q_y, q_z, q_w, covariances; the first head, then the rest
  std::filesystem::path prior_file;     ///< that the settings name; empty where they name none
  // Of telemetry.toml alone.
  std::vector<Defect> left_out{};                ///< rows that its flags and sigmas have taken out
  Selection selection{};                         ///< that it asks for
  ColumnsRead columns{};                         ///< in other formats they have the names of the components
  std::vector<std::filesystem::path> sources{};  ///< files that it names
};

/// A directory with pass.toml, gyro.csv and star_tracker.csv.
[[nodiscard]] UnscreenedPass read_raw_directory(const std::filesystem::path& directory);
/// A NetCDF-4 file with the same variables.
[[nodiscard]] UnscreenedPass read_raw_netcdf(const std::filesystem::path& file);
/// A telemetry.toml, which says where others' files have the columns.
[[nodiscard]] UnscreenedPass read_raw_telemetry(const std::filesystem::path& file);
[[nodiscard]] UnscreenedPass read_raw_telemetry(const std::filesystem::path& file, const ReadColumns& others);
[[nodiscard]] bool is_telemetry_map(const std::filesystem::path& path);

struct InputFormat {
  bool (*recognises)(const std::filesystem::path& path);  ///< whether a path that exists is to be read by this format
  UnscreenedPass (*read)(const std::filesystem::path& path);  ///< throws InputRefused, MachineFailed
};

/// The first that recognises a path reads it; the last one takes whatever is left.
inline constexpr std::array kInputFormats = {
    InputFormat{[](const std::filesystem::path& path) { return std::filesystem::is_directory(path); },
                read_raw_directory},
    InputFormat{is_telemetry_map, read_raw_telemetry},
    InputFormat{[](const std::filesystem::path&) { return true; }, read_raw_netcdf},
};

}  // namespace trihedron::io
