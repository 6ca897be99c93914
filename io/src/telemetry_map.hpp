#pragma once
/// telemetry.toml: which columns of which files hold a pass, and what they mean. docs/telemetry.md.

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/core/time.hpp"
#include "trihedron/io/packets.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/io/time_scale.hpp"

namespace trihedron::io {

/// How the instants of a table are written.
struct Stamps {
  enum class Format { kIso, kNumber, kMjd, kJd };

  TimeScale scale = TimeScale::kTai;
  Format format = Format::kIso;
  double unit_s = 1;          ///< of numbers
  std::optional<Time> since;  ///< of numbers: what the clock of the scale shows at 0, counted as Time counts TAI
  /// Of numbers in UTC: whether they count leap seconds. Unix time does not.
  std::optional<bool> leap_seconds_counted;
};

/// One table of a file, CSV by columns or NetCDF by variables.
struct TableMap {
  std::string file;  ///< as it is told; a relative one stands beside telemetry.toml
  std::string time_column;
  Stamps stamps;
  // Of CSV.
  std::string separator = ",";       ///< one character; a blank stands for any number of blanks and tabs
  int header_line = 1;               ///< with the names; 0: there is none, and columns are called "1", "2" …
  std::string comment;               ///< lines that begin with it are skipped; empty: there are none
  std::vector<std::string> missing;  ///< texts that stand for a missing value, besides an empty field and nan
};

/// Rows that are good.
struct FlagMap {
  std::string column;  ///< empty: there is none
  std::vector<double> good;
};

/// The direction of one momentum in the case axes of its gyro. A name that begins with "-" is of a column whose sign is
/// to be changed.
struct DirectionMap {
  std::vector<std::string> columns;  ///< along x, y, z
  double counts_per_unit = 1;
  double angle_unit_rad = 0;  ///< 0: direction cosines; else angles from the axes in this unit
  FlagMap flag;
};

struct GyroMap : TableMap {
  std::vector<DirectionMap> units;
};

struct StarTrackerMap : TableMap {
  std::vector<std::string> quaternion;  ///< Hamilton; signs as in DirectionMap
  bool scalar_first = false;
  bool is_inverse = false;  ///< it maps inertial components to those of the tracker
  double counts_per_unit = 1;
  FlagMap flag;
  std::vector<std::string> sigma;       ///< 1-sigma about x, y, z of the head; empty: there are none
  std::vector<std::string> covariance;  ///< in its place: xx, yy, zz, xy, xz, yz about these axes, in that unit squared
  double sigma_unit_rad = 1;
  bool is_variance = false;  ///< `sigma` are variances, in that unit squared
  std::optional<double> largest_sigma_rad;
};

/// A file of intervals.
struct IntervalMap : TableMap {
  std::string end_column;
  bool gyros = true;
  bool star_trackers = true;
};

/// Space packets in place of tables: docs/packets.md.
struct PacketMap {
  std::string file;         ///< as in TableMap
  int apid = kDefaultApid;  ///< of the gyros; those of the star trackers follow
  int gyros = 2;
};

struct TelemetryMap {
  Stamps stamps;                     ///< of each table that tells none of its own
  std::optional<PacketMap> packets;  ///< the next two are those of its tables then, as parse_packets() gives them
  GyroMap gyro;
  std::vector<StarTrackerMap> star_trackers;  ///< the first head, then the further ones
  std::vector<IntervalMap> exclude;
  std::optional<Time> from;
  std::optional<Time> to;
};

/// What a telemetry.toml says. Epoch, duration, periods and noise of the star tracker are zero where they are left out.
struct TelemetryToml {
  TelemetryMap map;
  PassSettings settings;
  std::filesystem::path prior_file;  ///< empty where there is none
};

/// Throws InputRefused with line and column. `file` is named in it; a relative prior stands in `directory`.
[[nodiscard]] TelemetryToml parse_telemetry_toml(std::string_view text, const std::filesystem::path& file,
                                                 const std::filesystem::path& directory);

}  // namespace trihedron::io
