#include "trihedron/io/catalogue.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <SQLiteCpp/VariadicBind.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <map>
#include <system_error>
#include <utility>

#include "directories.hpp"
#include "input_file.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/stop.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kApplicationId = 0x54524948;  // "TRIH"
constexpr std::int64_t kSchemaVersion = 2;           // version 1 is read, and brought up to this one when it is written

// By the key of `calibration`.
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
  UNIQUE ({})
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

std::string schema_of_version(std::int64_t version) {
  return fmt::format(kSchema, version == 1 ? "epoch_tai, t_s, estimator, drift_model, passes"
                                           : "start_up, pass, epoch_tai, t_s, estimator, drift_model, passes");
}

// The tables of version 1, whose key left out start-up and pass, are taken over whole. Children go first.
constexpr const char* kUpgradeBegin = R"(
ALTER TABLE calibration RENAME TO calibration_1;
ALTER TABLE parameter RENAME TO parameter_1;
ALTER TABLE finding RENAME TO finding_1;
)";
constexpr const char* kUpgradeEnd = R"(
INSERT INTO calibration SELECT id, spacecraft, pass, start_up, passes, epoch_tai, t_s, estimator, drift_model, trustworthy, json
  FROM calibration_1;
INSERT INTO parameter SELECT calibration, state, value, sigma FROM parameter_1;
INSERT INTO finding SELECT calibration, code FROM finding_1;
DROP TABLE finding_1;
DROP TABLE parameter_1;
DROP TABLE calibration_1;
)";
int stop_asked_for(void* /*unused*/) {
  const StopRequest* const request = StopScope::current();
  return request != nullptr && request->made() ? 1 : 0;
}

/// Whoever wrote the file, nothing in it is executed, and damage is found rather than believed.
void distrust(SQLite::Database& database) {
  constexpr int kLongestValue = 64 << 20;  // bytes; the calibration with most states has 5 MB
  constexpr int kSteps = 10'000;           // of SQLite's machine: less than a millisecond
  sqlite3* const handle = database.getHandle();
  sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, kLongestValue);
  sqlite3_progress_handler(handle, kSteps, stop_asked_for, nullptr);
  database.exec("PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0");
}

/// Refuses one with a write-ahead log before SQLite looks into it: even a reader then leaves files beside it. Asked of
/// SQLite's own descriptor, because the lock of this process goes when any other of the file is closed.
void expect_no_log(SQLite::Database& database, const fs::path& file) {
  // The database file format, section 1.3; 1 is the rollback journal. SQLite goes by this byte alone, whatever the
  // version to write by, before it, says.
  constexpr std::size_t kReadVersion = 19;
  std::array<unsigned char, 100> header{};
  sqlite3_file* open_file = nullptr;
  sqlite3_file_control(database.getHandle(), "main", SQLITE_FCNTL_FILE_POINTER, static_cast<void*>(&open_file));
  const int status = open_file->pMethods->xRead(open_file, header.data(), static_cast<int>(header.size()), 0);
  if (status == SQLITE_OK && header[kReadVersion] == 2) {
    throw InputRefused(file, {}, "keeps a write-ahead log, as no catalogue does",
                       "give it to sqlite3 with \"PRAGMA journal_mode = DELETE\"");
  }
}

SQLite::Database opened(const fs::path& file, int access) {
  constexpr int kPatience_ms = 2000;  // for another program that writes
  expect_regular_file(file);
  // A relative name could be one that means something else to SQLite, ":memory:".
  SQLite::Database database(fs::absolute(file).string(), access, kPatience_ms);
  expect_no_log(database, file);
  distrust(database);
  return database;
}

SQLite::Database opened_to_write(const fs::path& file) {
  SQLite::Database database = opened(file, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  database.exec("PRAGMA foreign_keys = ON");  // not possible within a transaction
  return database;
}

/// Whether the head of the database says so: its byte 18 is the version of the format to write by, of which 1 and 2 are
/// known.
bool must_not_be_written(const fs::path& file) {
  std::array<char, 19> head{};
  return std::ifstream(file, std::ios::binary).read(head.data(), head.size()) &&
         static_cast<unsigned char>(head.back()) > 2;
}

/// Calls `work` and turns the faults of SQLite into those of this module: InputRefused for a file that is no whole
/// database, MachineFailed when the disk fails or another program holds the file.
template <class Work>
auto told_of(const fs::path& file, const Work& work) {
  try {
    return work();
  } catch (const SQLite::Exception& fault) {
    check_stop();                           // which ends what SQLite does
    switch (fault.getErrorCode() & 0xff) {  // the primary code
      case SQLITE_NOTADB:
      case SQLITE_CORRUPT:
      case SQLITE_TOOBIG:
      case SQLITE_CONSTRAINT:
      case SQLITE_MISMATCH:
      case SQLITE_ERROR:
        throw InputRefused(file, {}, fmt::format("is damaged or no database: {}", fault.what()),
                           "restore it from a copy, or give the name of a new one");
      case SQLITE_READONLY:
        // Also where the disk let SQLite open the file for reading alone.
        if (must_not_be_written(file)) {
          throw InputRefused(file, {}, "can only be read: it is damaged, or of a later SQLite",
                             "restore it from a copy, or give the name of a new one");
        }
        [[fallthrough]];
      default:
        throw MachineFailed(
            file, fmt::format("cannot be read or written: {}", fault.what()),
            "check that the directory is there and may be written, that the disk has room, and that no other program "
            "holds the file");
    }
  }
}

/// Of a statement with one number as result, such as a PRAGMA.
std::int64_t number(SQLite::Database& database, const std::string& query) {
  return database.execAndGet(query).getInt64();
}

std::int64_t version_of(SQLite::Database& database) { return number(database, "PRAGMA user_version"); }
/// What each table, index, view and trigger is, by kind and name: the statement that made it, without the quotation
/// marks that renaming puts round names. Those of SQLite itself are left out.
std::map<std::string, std::string> schema_of(SQLite::Database& database) {
  SQLite::Statement rows(database,
                         "SELECT type || ' ' || name, replace(coalesce(sql, ''), '\"', '') FROM sqlite_schema "
                         "WHERE name NOT LIKE 'sqlite\\_%' ESCAPE '\\'");
  std::map<std::string, std::string> schema;
  while (rows.executeStep()) {
    schema[rows.getColumn(0).getString()] = rows.getColumn(1).getString();
  }
  return schema;
}

/// Refuses a database of which the tables are not exactly those that `schema` makes: a view, a trigger or a check in it
/// could do anything, or never end.
void check_schema(SQLite::Database& database, const fs::path& file, const std::string& schema) {
  constexpr const char* kCure = "give a catalogue that `trihedron calibrate --catalogue` wrote and nobody has changed";
  SQLite::Database own(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  own.exec(schema);
  const auto expected = schema_of(own);
  const auto found = schema_of(database);
  for (const auto& [name, statement] : found) {
    if (const auto same = expected.find(name); same == expected.end() || same->second != statement) {
      throw InputRefused(file, {}, fmt::format("has the {}, which is not that of a catalogue", in_quotes(name)), kCure);
    }
  }
  for (const auto& [name, statement] : expected) {
    if (!found.contains(name)) {
      throw InputRefused(file, {}, fmt::format("lacks the {} of a catalogue", in_quotes(name)), kCure);
    }
  }
}

/// Refuses what is not a whole catalogue that this program can read.
void check_catalogue(SQLite::Database& database, const fs::path& file) {
  if (number(database, "PRAGMA application_id") != kApplicationId) {
    throw InputRefused(file, {}, "is a database, but no catalogue of calibrations",
                       "give a catalogue that `trihedron calibrate --catalogue` wrote, or the name of a new one");
  }
  const std::int64_t version = version_of(database);
  if (version < 1 || version > kSchemaVersion) {
    throw InputRefused(file, {},
                       fmt::format("is a catalogue of version {}, this program reads 1 to {}", version, kSchemaVersion),
                       "use the program that wrote it, or a newer one");
  }
  check_schema(database, file, schema_of_version(version));
  if (const std::string found = database.execAndGet("PRAGMA integrity_check(1)").getString(); found != "ok") {
    throw InputRefused(file, {}, fmt::format("is damaged: {}", in_quotes(found)), "restore it from a copy");
  }
  if (SQLite::Statement orphans(database, "PRAGMA foreign_key_check"); orphans.executeStep()) {
    throw InputRefused(file, {},
                       fmt::format("has a row in table {} that belongs to no calibration",
                                   in_quotes(orphans.getColumn(0).getString())),
                       "restore it from a copy, or remove the row; use sqlite3 with \"PRAGMA foreign_keys = ON\"");
  }
}

void make_tables(SQLite::Database& database) {
  database.exec(schema_of_version(kSchemaVersion));
  database.exec(fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}", kApplicationId, kSchemaVersion));
}

void upgrade(SQLite::Database& database) {
  database.exec(kUpgradeBegin);
  make_tables(database);
  database.exec(kUpgradeEnd);
}

bool is_empty(SQLite::Database& database) {
  return number(database, "SELECT count(*) FROM sqlite_schema") == 0 && number(database, "PRAGMA application_id") == 0;
}

void check_spacecraft(SQLite::Database& database, const fs::path& file, const std::string& spacecraft) {
  SQLite::Statement other(database, "SELECT spacecraft FROM calibration WHERE spacecraft <> ? LIMIT 1");
  other.bind(1, spacecraft);
  if (other.executeStep()) {
    throw InputRefused(
        file, {},
        fmt::format("is of spacecraft {}, not {}", in_quotes(other.getColumn(0).getString()), in_quotes(spacecraft)),
        "give each spacecraft a catalogue of its own");
  }
}

void add_parameters(SQLite::Database& database, std::int64_t row, const Calibration& calibration) {
  SQLite::Statement insert(database, "INSERT INTO parameter VALUES (?, ?, ?, ?)");
  for (std::size_t i = 0; i < calibration.states.size(); ++i) {
    const auto index = static_cast<Eigen::Index>(i);
    insert.reset();
    SQLite::bind(insert, row, name_of(calibration.states[i]), value_of(calibration, calibration.states[i]),
                 std::sqrt(calibration.covariance(index, index)));
    insert.exec();
  }
}

void add_findings(SQLite::Database& database, std::int64_t row, const Verdict& verdict) {
  SQLite::Statement insert(database, "INSERT INTO finding VALUES (?, ?)");
  for (const Finding& finding : verdict.findings) {
    insert.reset();
    SQLite::bind(insert, row, std::string(name_of(finding.code)));
    insert.exec();
  }
}

void add_entry(SQLite::Database& database, const CatalogueEntry& entry, const std::string& start_up) {
  const Calibration& calibration = entry.calibration;
  SQLite::Statement insert(database, "INSERT OR REPLACE INTO calibration VALUES (NULL, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  SQLite::bind(insert, entry.spacecraft, entry.pass, start_up, entry.passes, format_epoch(calibration.epoch),
               to_seconds(calibration.t - calibration.epoch), std::string(name_of(calibration.estimator)),
               name_of(calibration.gyros.front().drift_model), calibration.verdict.trustworthy ? 1 : 0,
               format_calibration(calibration));
  insert.exec();
  const std::int64_t row = database.getLastInsertRowid();
  add_parameters(database, row, calibration);
  add_findings(database, row, calibration.verdict);
}

/// Takes back what a killed program left half done, by its journal; without that the file cannot be read.
void take_back_half_done(const fs::path& file) {
  if (fs::exists(behind_links(file).string() + "-journal")) {
    SQLite::Database database = opened(file, SQLite::OPEN_READWRITE);
    static_cast<void>(number(database, "PRAGMA schema_version"));
  }
}

/// SQLite makes its journal beside the file that links lead to.
void expect_directory_writable(const fs::path& file) {
  const fs::path directory = directory_of(behind_links(file));
  if (::access(directory.c_str(), W_OK | X_OK) != 0) {
    throw MachineFailed(file, fmt::format("cannot be written: {}", std::generic_category().message(errno)),
                        "check that the directory is there and may be written");
  }
}

}  // namespace

void expect_catalogue_of(const std::string& spacecraft, const fs::path& file) {
  expect_directory_writable(file);
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    return;
  }
  told_of(file, [&] {
    take_back_half_done(file);
    SQLite::Database database = opened(file, SQLite::OPEN_READONLY);
    if (!is_empty(database)) {
      check_catalogue(database, file);
      check_spacecraft(database, file, spacecraft);
    }
    SQLite::Database to_write = opened(file, SQLite::OPEN_READWRITE);
    const SQLite::Transaction possible(to_write, SQLite::TransactionBehavior::IMMEDIATE);
  });
}

struct CatalogueUpdate::Open {
  explicit Open(const fs::path& file)
      : database(opened_to_write(file)), transaction(database, SQLite::TransactionBehavior::EXCLUSIVE) {}

  SQLite::Database database;
  SQLite::Transaction transaction;
};

CatalogueUpdate::CatalogueUpdate(fs::path file, std::span<const CatalogueEntry> entries) : file_(std::move(file)) {
  std::error_code ignored;
  is_new_ = !fs::exists(file_, ignored);
  try {
    told_of(file_, [&] {
      open_ = std::make_unique<Open>(file_);
      SQLite::Database& database = open_->database;
      if (is_empty(database)) {
        make_tables(database);
      }
      check_catalogue(database, file_);
      if (version_of(database) < kSchemaVersion) {
        upgrade(database);
      }
      for (const CatalogueEntry& entry : entries) {
        check_spacecraft(database, file_, entry.spacecraft);
        add_entry(database, entry,
                  entry.start_up.empty() ? format_epoch(entries.front().calibration.epoch) : entry.start_up);
      }
    });
  } catch (...) {
    discard();
    throw;
  }
}

CatalogueUpdate::~CatalogueUpdate() { discard(); }

void CatalogueUpdate::discard() noexcept {
  if (open_ != nullptr && is_new_) {
    // While the lock is held: whoever waits for it finds that the file has gone.
    std::error_code ignored;
    fs::remove(behind_links(file_), ignored);
  }
  open_.reset();
}

void CatalogueUpdate::commit() {
  told_of(file_, [&] { open_->transaction.commit(); });
  open_.reset();
}

void add_to_catalogue(const fs::path& file, std::span<const CatalogueEntry> entries) {
  CatalogueUpdate(file, entries).commit();
}

std::vector<CatalogueEntry> read_catalogue(const fs::path& file) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    throw InputRefused(file, {}, "there is no such catalogue", "make one with `trihedron calibrate --catalogue`");
  }
  if (::faccessat(AT_FDCWD, file.c_str(), R_OK, AT_EACCESS) != 0) {  // SQLite does not say why it cannot open a file
    throw InputRefused(file, {}, fmt::format("cannot be opened: {}", std::generic_category().message(errno)),
                       "check the name and the rights");
  }
  return told_of(file, [&] {
    take_back_half_done(file);
    SQLite::Database database = opened(file, SQLite::OPEN_READONLY);
    check_catalogue(database, file);
    SQLite::Statement rows(database,
                           "SELECT id, spacecraft, pass, start_up, passes, json FROM calibration "
                           "ORDER BY epoch_tai, t_s, passes, estimator, drift_model");
    const auto text = [&](int column) { return rows.getColumn(column).getString(); };
    std::vector<CatalogueEntry> entries;
    while (rows.executeStep()) {
      const fs::path place = fmt::format("{}: calibration {}", file.string(), rows.getColumn(0).getInt64());
      entries.push_back({text(1), text(2), text(3), rows.getColumn(4).getInt(), parse_calibration(text(5), place)});
    }
    return entries;
  });
}

}  // namespace trihedron::io
