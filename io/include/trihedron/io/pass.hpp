#pragma once
/// Passes as files: a directory with pass.toml, gyro.csv and star_tracker.csv, or one NetCDF-4 file with the same
/// variables.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "trihedron/core/time.hpp"
#include "trihedron/io/staged_directory.hpp"
#include "trihedron/io/time_scale.hpp"
#include "trihedron/records/pass.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::io {

/// Where something was seen.
struct Place {
  std::int64_t line = 0;    ///< of the CSV file, from 1; 0 in a NetCDF file
  std::int64_t sample = 0;  ///< of the table, from 0, as the file has it
  double t_s = 0;           ///< since the epoch of the pass, before it where a part is used; NaN where there is none
  std::int64_t packet = 0;  ///< number of a space packet, from 1; 0 in other files
  std::int64_t octet = 0;   ///< of the file, where it begins
};

/// One kind of defect in one table, with its count and first places. Every row that is left out of a Pass is counted in
/// one.
struct Defect {
  enum class Kind {
    kMissingTime,      ///< left out
    kTimeOutsidePass,  ///< left out: more than a period before the epoch or after the end
    kRepeatedTime,     ///< left out: the first of equal times stays
    kBackwardTime,     ///< left out: as few as possible, so that the times of the others increase
    kLeapingTime,      ///< left out: directions that bear the time of others, as shown by how the body turns
    kTruncatedLine,    ///< left out: the last line was cut short
    kMissingValue,     ///< kept: NaN, infinity or an empty field in a component
    kZeroNorm,         ///< kept
    kWrongNorm,        ///< kept: off 1 by more than 1e-3
    kSignFlip,         ///< kept: q changes hemisphere between neighbouring fixes
    kStuckSamples,     ///< kept: one gyro's direction is identical for 8 samples or more; counts the samples
    kSilentGyro,       ///< kept: no usable direction for a minute or more; counts the stretches
    kOutsideRange,     ///< left out: before or after the time range that was asked for
    kExcluded,         ///< left out: in an interval that was to be left out
    kFlagged,          ///< a quality flag says that it is bad: a fix is left out, a gyro's reading taken as missing
    kLargeSigma,       ///< left out: a fix whose own 1-sigma is too large, or none
    kNoCovariance,  ///< kept: a fix of a table with covariances that has none which can be used; noise_rad is its noise
    kPacketDamaged,    ///< left out: a space packet whose CRC is wrong
    kPacketsMissing,   ///< space packets that are missing by their sequence count; places are of those that follow
    kOtherPackets,     ///< left out: space packets of another APID, or other reports
    kTruthIncomplete,  ///< left out: a truth of which a part is missing; `where` says which
    kGap,              ///< more than 1.5 periods without a row, at the ends of the pass too; counts the gaps
  };
  static constexpr std::size_t kPlaces = 5;

  Kind kind{};
  std::string where;  ///< "gyro.csv", "gyro.csv, gyro 2", "group star_tracker"
  std::int64_t count = 0;
  std::vector<Place> first;  ///< at most kPlaces
  Duration total{};          ///< of gaps and of stuck and silent stretches
  Duration longest{};        ///< same

  /// One sentence for a person.
  [[nodiscard]] std::string text() const;
};

/// Stable, for programs: "missing-time", "time-outside-pass" …
[[nodiscard]] const char* name_of(Defect::Kind kind);

/// A stretch of time of which the telemetry is not to be used: begin ≤ t < end.
struct LeftOut {
  Time begin{};
  Time end{};
  bool gyros = true;
  bool star_trackers = true;
};

/// What of a pass is to be used. A pass of which a part is used begins and ends with that part: epoch and duration are
/// those of the part.
struct Selection {
  std::optional<Time> from;
  std::optional<Time> to;
  std::vector<LeftOut> exclude;
};

/// From which columns the components were taken; "-NAME" with the other sign.
struct ColumnsRead {
  std::vector<std::string> quaternion;               ///< x, y, z, w of the first head
  std::vector<std::vector<std::string>> directions;  ///< x, y, z of each gyro
};

/// A pass as read, and what was wrong with its telemetry.
struct LoadedPass {
  Pass pass;
  std::vector<Defect> defects;
  std::filesystem::path prior_file{};  ///< that `prior` of its settings names; empty where it names none
  /// Files that were read besides `path` and what is in it: those that a telemetry.toml names.
  std::vector<std::filesystem::path> sources{};
  ColumnsRead columns{};
  Duration epoch_moved{};  ///< from that of the files to that of the selection
};

/// Reads a pass and screens its telemetry: a directory, a NetCDF-4 file, or a telemetry.toml (docs/telemetry.md).
/// `selection` goes before what a telemetry.toml asks for, and its intervals are left out as well. Throws InputRefused
/// for what cannot be understood, MachineFailed when the disk fails. Not to be called from two threads at once for
/// NetCDF.
[[nodiscard]] LoadedPass read_pass(const std::filesystem::path& path, const Selection& selection = {});

/// All files that the pass was read from by this path: nothing may be written there (expect_apart()).
[[nodiscard]] std::vector<std::filesystem::path> inputs_of(const std::filesystem::path& path, const LoadedPass& loaded);

/// Gives columns of a Parquet or NetCDF file as the text of a CSV file: their names in the first line, commas, an empty
/// field or nan where there is no value, timestamps as ISO dates and times. Where it lacks one, the names that it has,
/// without rows.
using ReadColumns =
    std::function<std::string(const std::filesystem::path& file, const std::vector<std::string>& names)>;

/// Reads the pass of a telemetry.toml as read_pass() does, but tables in Parquet and NetCDF by `others`.
[[nodiscard]] LoadedPass read_telemetry(const std::filesystem::path& file, const ReadColumns& others);

/// A table of a pass in memory, as a file has it before it is screened: rows may be as dirty as telemetry is.
struct TableInMemory {
  std::string name;              ///< for messages: "gyro"
  std::vector<double> t_s;       ///< since the epoch of the pass
  std::vector<double> values;    ///< row by row; NaN where missing
  bool has_covariances = false;  ///< of fixes
};

/// A pass in memory, for programs that have read it themselves.
struct PassInMemory {
  std::filesystem::path name;                ///< for messages
  std::string settings;                      ///< the text of a pass.toml
  std::string prior;                         ///< the text of a calibration.json; empty where there is none
  int gyros = 0;                             ///< 2 or more
  TableInMemory gyro;                        ///< h1_x, h1_y, h1_z, h2_x …
  std::vector<TableInMemory> star_trackers;  ///< q_x, q_y, q_z, q_w, and cov_xx_rad2, yy, zz, xy, xz, yz if
                                             ///< any; the first head, then the further ones
};

/// Settings, the text of a pass.toml of so many gyros, with an earlier calibration, the text of a calibration.json, or
/// empty. A `prior` that they name is looked up in the directory of `name`. Throws InputRefused.
[[nodiscard]] PassSettings parse_settings(const std::string& settings, const std::string& prior,
                                          const std::filesystem::path& name, int gyros);

/// The tables of a pass with its settings, its earlier calibration among them, as they stand in a directory. Throws as
/// read_pass().
[[nodiscard]] PassInMemory read_tables(const std::filesystem::path& directory);

/// Screens them as read_pass() does what it has read, with the same result. Throws as parse_settings(), and
/// InputRefused.
[[nodiscard]] LoadedPass screened(PassInMemory tables, const Selection& selection = {});

/// What a file keeps of a pass: its direction cosines, in steps of `step`, are those that read_tables() finds again.
[[nodiscard]] PassInMemory tables_of(const Pass& pass, double direction_step);

/// The truth of a simulated pass, likewise.
struct TruthInMemory {
  std::string parameters;  ///< the text of a truth.json
  int gyros = 0;
  TableInMemory table;  ///< q_x, q_y, q_z, q_w, h1_x, h1_y, h1_z, h2_x …
};
/// Of the truth of a pass with this epoch.
[[nodiscard]] TruthInMemory tables_of(const Truth& truth, Time epoch);
/// Throws InputRefused for any flaw. `name`: for messages.
[[nodiscard]] Truth truth_of(TruthInMemory tables, const std::filesystem::path& name, Time epoch);

/// Whether the file is a telemetry.toml, a TOML document with a table `telemetry`, and not another: a scenario. What
/// cannot be understood is none.
[[nodiscard]] bool is_telemetry_toml(const std::filesystem::path& file);

/// Intervals of a CSV file with columns `begin` and `end`, ISO dates and times of this scale; other columns are
/// skipped. Throws InputRefused, also where an interval does not end after it begins.
[[nodiscard]] std::vector<LeftOut> read_intervals(const std::filesystem::path& file, TimeScale scale);

/// The truth of a simulated pass; nullopt when there is none. Throws as read_pass, also for any flaw in it.
[[nodiscard]] std::optional<Truth> read_truth(const std::filesystem::path& path);

/// How exactly a pass is written.
struct PassFormat {
  /// Step of the packed direction cosines in NetCDF; the error is at most half of it. CSV has nine decimals always.
  double direction_step = 5e-10;
};

/// As exact as the readout of the gyros of this scenario: a quantised one needs no finer step in the file.
[[nodiscard]] PassFormat format_for(const Scenario& scenario);

/// Where a pass is going to be written: NetCDF-4 when the name ends in .nc, else a directory, replacing the pass that
/// is there with its truth. Made before a long calculation it refuses what cannot be written at once, and keeps a
/// directory from others as long as it lives.
class PassWriter {
 public:
  /// Throws MachineFailed, and UsageError where the path is of another kind.
  explicit PassWriter(std::filesystem::path path);
  /// Once. `truth` may be null. The prior calibration goes along. Throws MachineFailed when it cannot be written; then
  /// the pass that was there before stays.
  void write(const Pass& pass, const Truth* truth, const PassFormat& format = {});

 private:
  std::filesystem::path path_;
  std::optional<StagedDirectory> staged_;
};

/// Writes it at once, as PassWriter.
void write_pass(const std::filesystem::path& path, const Pass& pass, const Truth* truth, const PassFormat& format = {});

/// The files that writing a pass with this number of star trackers may replace.
[[nodiscard]] std::vector<std::filesystem::path> files_of_pass(const std::filesystem::path& path,
                                                               std::size_t star_trackers);

}  // namespace trihedron::io
