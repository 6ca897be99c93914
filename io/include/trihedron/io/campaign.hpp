#pragma once
/// Campaign files (TOML): a base scenario, settings of the calibration, and what varies from run to run. And what a
/// campaign leaves: the journal of its runs, and the table of them.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/io/lasting_file.hpp"
#include "trihedron/records/campaign.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::io {

/// Throws std::invalid_argument for a scenario that makes no sense.
using ScenarioCheck = std::function<void(const Scenario&)>;

/// A campaign as its file describes it.
class CampaignFile {
 public:
  /// Reads the file, and the files of scenario and settings that it names. Every key that varies is tried at the ends
  /// of what can be drawn for it: read as a scenario is read, and given to `check`, or as settings are read. Throws
  /// InputRefused with line, column, reason and cure for what is not known, has another unit or is out of range;
  /// MachineFailed.
  CampaignFile(const std::filesystem::path& file, const ScenarioCheck& check);
  CampaignFile(const CampaignFile&) = delete;
  CampaignFile& operator=(const CampaignFile&) = delete;
  ~CampaignFile();

  [[nodiscard]] const CampaignPlan& plan() const;
  /// All that results depend on, of this file and those it names, and of the program by its `version`.
  [[nodiscard]] CampaignIdentity identity(std::string_view version) const;
  /// All files that were read.
  [[nodiscard]] std::vector<std::filesystem::path> inputs() const;

  /// The scenario of a run, by CampaignPlan and what was drawn. May be called from several threads. Throws
  /// InputRefused where the draws together make no scenario.
  [[nodiscard]] Scenario scenario(std::uint64_t seed, std::span<const double> draws) const;
  /// Settings of its calibration, likewise.
  [[nodiscard]] CalibrationOptions options(std::span<const double> draws) const;
  /// The same as a scenario file (TOML), which reads back to it, bit for bit.
  [[nodiscard]] std::string scenario_text(std::uint64_t seed, std::span<const double> draws) const;

 private:
  struct Content;
  std::unique_ptr<const Content> content_;
};

/// 16 hexadecimal digits that are others for another campaign.
[[nodiscard]] std::string digest_of(const CampaignIdentity& identity);

/// What is different, as a sentence names it: `campaign.runs is 400, was 200`; empty where nothing is.
[[nodiscard]] std::string difference_between(const CampaignIdentity& before, const CampaignIdentity& now);

/// A record as a line of the journal, without the line end: CRC-32 and JSON. It is what one process tells another of a
/// run.
[[nodiscard]] std::string format_record(const RunRecord& record);
/// Nothing for a line that is damaged.
[[nodiscard]] std::optional<RunRecord> parse_record(std::string_view line);

/// What a journal holds.
struct Journal {
  CampaignIdentity identity;
  std::vector<RunRecord> records;  ///< in the order of their numbers, each run once
  std::size_t damaged = 0;         ///< lines that cannot be read: those runs are not there
  std::uint64_t size = 0;          ///< bytes up to the end of the last whole line
  std::uint32_t crc = 0;           ///< crc32() of them
};

/// Whether the file ends within the line that a journal of this campaign begins with: it was killed, or the disk was
/// full, before a run could be kept.
[[nodiscard]] bool is_barely_begun(const std::filesystem::path& file, const CampaignIdentity& identity);

/// Of a run that is there twice the later record. Throws InputRefused for a file that is no journal.
[[nodiscard]] Journal read_journal(const std::filesystem::path& file);

/// The finished runs of a campaign, one line each, that outlive whatever ends the program. One writer at a time.
class JournalWriter {
 public:
  /// A new journal, with nothing but the identity.
  JournalWriter(const std::filesystem::path& file, const CampaignIdentity& identity);
  /// Carries on with one that was read; what comes after its last whole line is cut off.
  JournalWriter(const std::filesystem::path& file, const Journal& journal);

  /// Returns when all of them are on the disk. Throws MachineFailed.
  void add(std::span<const RunRecord> records);

 private:
  GrowingFile file_;
};

/// The table of runs as a CF NetCDF-4 file for xarray.open_dataset(path). The same records give the same bytes.
/// records: in the order of their numbers. Throws MachineFailed.
void write_run_table(const std::filesystem::path& file, const CampaignPlan& plan, std::string_view digest,
                     std::span<const RunRecord> records);

/// What is not repeatable: run,cpu_s,elapsed_s (CSV). Throws MachineFailed.
void write_run_times(const std::filesystem::path& file, std::span<const RunRecord> records);

}  // namespace trihedron::io
