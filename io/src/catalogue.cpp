#include "trihedron/io/catalogue.hpp"

#include <fmt/format.h>

#include <cmath>
#include <system_error>

#include "sqlite.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kApplicationId = 0x54524948;  // "TRIH"
constexpr std::int64_t kSchemaVersion = 1;

constexpr const char* kSchema = R"(
CREATE TABLE calibration (
  id INTEGER PRIMARY KEY,
  spacecraft TEXT NOT NULL,
  pass TEXT NOT NULL,
  start_up TEXT NOT NULL,
  passes INTEGER NOT NULL CHECK (passes > 0),
  epoch_tai TEXT NOT NULL,
  t_s REAL NOT NULL,
  estimator TEXT NOT NULL,
  drift_model TEXT NOT NULL,
  trustworthy INTEGER NOT NULL,
  json TEXT NOT NULL,
  UNIQUE (epoch_tai, t_s, estimator, drift_model, passes)
) STRICT;
CREATE TABLE parameter (
  calibration INTEGER NOT NULL REFERENCES calibration (id) ON DELETE CASCADE,
  state TEXT NOT NULL,
  value REAL NOT NULL,
  sigma REAL NOT NULL,
  PRIMARY KEY (calibration, state)
) STRICT, WITHOUT ROWID;
CREATE TABLE finding (
  calibration INTEGER NOT NULL REFERENCES calibration (id) ON DELETE CASCADE,
  code TEXT NOT NULL
) STRICT;
)";

/// Refuses what is not a whole catalogue that this program can read.
void check_catalogue(SqliteDatabase& database, const fs::path& file) {
  SqliteStatement check(database, "PRAGMA quick_check(1)");
  check.step();
  if (const std::string found = check.text(0); found != "ok") {
    throw InputRefused(file, {}, fmt::format("is damaged: {}", found), "restore it from a copy");
  }
  if (database.number("PRAGMA application_id") != kApplicationId) {
    throw InputRefused(file, {}, "is a database, but no catalogue of calibrations",
                       "give a catalogue that `trihedron calibrate --catalogue` wrote, or the name of a new one");
  }
  if (const std::int64_t version = database.number("PRAGMA user_version"); version != kSchemaVersion) {
    throw InputRefused(file, {},
                       fmt::format("is a catalogue of version {}, this program reads {}", version, kSchemaVersion),
                       "use the program that wrote it, or a newer one");
  }
}

void make_tables(SqliteDatabase& database) {
  database.execute(kSchema);
  database.execute(fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}", kApplicationId, kSchemaVersion));
}

bool is_empty(SqliteDatabase& database) {
  return database.number("SELECT count(*) FROM sqlite_schema") == 0 && database.number("PRAGMA application_id") == 0;
}

void check_spacecraft(SqliteDatabase& database, const fs::path& file, const std::string& spacecraft) {
  SqliteStatement other(database, "SELECT spacecraft FROM calibration WHERE spacecraft <> ? LIMIT 1");
  other.bind(0, spacecraft);
  if (other.step()) {
    throw InputRefused(file, {},
                       fmt::format("is of spacecraft {}, not {}", in_quotes(other.text(0)), in_quotes(spacecraft)),
                       "give each spacecraft a catalogue of its own");
  }
}

void add_parameters(SqliteDatabase& database, std::int64_t row, const Calibration& calibration) {
  SqliteStatement insert(database, "INSERT INTO parameter VALUES (?, ?, ?, ?)");
  for (std::size_t i = 0; i < calibration.states.size(); ++i) {
    const auto index = static_cast<Eigen::Index>(i);
    insert.bind(0, row);
    insert.bind(1, name_of(calibration.states[i]));
    insert.bind(2, value_of(calibration, calibration.states[i]));
    insert.bind(3, std::sqrt(calibration.covariance(index, index)));
    insert.step();
    insert.reset();
  }
}

void add_findings(SqliteDatabase& database, std::int64_t row, const Verdict& verdict) {
  SqliteStatement insert(database, "INSERT INTO finding VALUES (?, ?)");
  for (const Finding& finding : verdict.findings) {
    insert.bind(0, row);
    insert.bind(1, name_of(finding.code));
    insert.step();
    insert.reset();
  }
}

void add_entry(SqliteDatabase& database, const CatalogueEntry& entry, const std::string& start_up) {
  const Calibration& calibration = entry.calibration;
  SqliteStatement insert(database, "INSERT OR REPLACE INTO calibration VALUES (NULL, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  insert.bind(0, entry.spacecraft);
  insert.bind(1, entry.pass);
  insert.bind(2, start_up);
  insert.bind(3, std::int64_t{entry.passes});
  insert.bind(4, format_epoch(calibration.epoch));
  insert.bind(5, to_seconds(calibration.t - calibration.epoch));
  insert.bind(6, name_of(calibration.estimator));
  insert.bind(7, name_of(calibration.gyros.front().drift_model));
  insert.bind(8, std::int64_t{calibration.verdict.trustworthy ? 1 : 0});
  insert.bind(9, format_calibration(calibration));
  insert.step();
  const std::int64_t row = database.last_row();
  add_parameters(database, row, calibration);
  add_findings(database, row, calibration.verdict);
}

}  // namespace

void expect_catalogue_of(const std::string& spacecraft, const fs::path& file) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    return;
  }
  SqliteDatabase database(file, SqliteDatabase::Access::kRead);
  if (!is_empty(database)) {
    check_catalogue(database, file);
    check_spacecraft(database, file, spacecraft);
  }
}

void add_to_catalogue(const fs::path& file, std::span<const CatalogueEntry> entries) {
  SqliteDatabase database(file, SqliteDatabase::Access::kWrite);
  database.execute("PRAGMA foreign_keys = ON; BEGIN IMMEDIATE");
  if (is_empty(database)) {
    make_tables(database);
  }
  check_catalogue(database, file);
  for (const CatalogueEntry& entry : entries) {
    check_spacecraft(database, file, entry.spacecraft);
    add_entry(database, entry,
              entry.start_up.empty() ? format_epoch(entries.front().calibration.epoch) : entry.start_up);
  }
  database.execute("COMMIT");
}

std::vector<CatalogueEntry> read_catalogue(const fs::path& file) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    throw InputRefused(file, {}, "there is no such catalogue", "make one with `trihedron calibrate --catalogue`");
  }
  SqliteDatabase database(file, SqliteDatabase::Access::kRead);
  check_catalogue(database, file);
  SqliteStatement rows(database,
                       "SELECT id, spacecraft, pass, start_up, passes, json FROM calibration "
                       "ORDER BY epoch_tai, t_s, passes, estimator, drift_model");
  std::vector<CatalogueEntry> entries;
  while (rows.step()) {
    const fs::path place = fmt::format("{}: calibration {}", file.string(), rows.number(0));
    entries.push_back({rows.text(1), rows.text(2), rows.text(3), static_cast<int>(rows.number(4)),
                       parse_calibration(rows.text(5), place)});
  }
  return entries;
}

}  // namespace trihedron::io
