#pragma once
/// Passes as files: a directory with pass.toml, gyro.csv and star_tracker.csv, or one NetCDF-4 file with the same
/// variables.

#include <cstddef>
#include <cstdint>
#include <filesystem>
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
  double t_s = 0;           ///< as the file has it; NaN where it has none
};

/// One kind of defect in one table, with its count and first places. Every row that is left out of a Pass is counted in
/// one.
struct Defect {
  enum class Kind {
    kMissingTime,      ///< left out
    kTimeOutsidePass,  ///< left out: more than a period before the epoch or after the end
    kRepeatedTime,     ///< left out: the first of equal times stays
    kBackwardTime,     ///< left out: as few as possible, so that the times of the others increase
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
};

/// Reads a pass and screens its telemetry: a directory, a NetCDF-4 file, or a telemetry.toml (docs/telemetry.md).
/// `selection` goes before what a telemetry.toml asks for, and its intervals are left out as well. Throws InputRefused
/// for what cannot be understood, MachineFailed when the disk fails. Not to be called from two threads at once for
/// NetCDF.
[[nodiscard]] LoadedPass read_pass(const std::filesystem::path& path, const Selection& selection = {});

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
  /// Throws MachineFailed.
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
