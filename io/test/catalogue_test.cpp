#include "trihedron/io/catalogue.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <vector>

#include "fixtures.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

CatalogueEntry sample_entry(const char* pass = "pass-a", int passes = 1) {
  return {"Resurs-DK1", pass, "2009-05-20", passes, sample_calibration()};
}

class Catalogue : public testing::Test {
 protected:
  void add(const CatalogueEntry& entry) const { add_to_catalogue(file_, {&entry, 1}); }
  void execute(const char* statement) const {
    SQLite::Database(file_.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE).exec(statement);
  }
  [[nodiscard]] std::int64_t count(const char* table) const {
    return SQLite::Database(file_.string()).execAndGet(std::string("SELECT count(*) FROM ") + table).getInt64();
  }
  /// Of reading, of adding and of asking before, which must be the same.
  [[nodiscard]] std::string refusal_of_all() const {
    const std::string of_reading = refusal([&] { static_cast<void>(read_catalogue(file_)); });
    EXPECT_EQ(refusal([&] { add(sample_entry()); }), of_reading);
    EXPECT_EQ(refusal([&] { expect_catalogue_of("Resurs-DK1", file_); }), of_reading);
    return of_reading;
  }

  TemporaryDirectory directory_;
  std::filesystem::path file_ = directory_ / "catalogue.db";
};

TEST_F(Catalogue, GivesBackWhatWasAdded) {
  add(sample_entry());
  const auto entries = read_catalogue(file_);
  ASSERT_THAT(entries, SizeIs(1));
  EXPECT_EQ(entries[0].spacecraft, "Resurs-DK1");
  EXPECT_EQ(entries[0].pass, "pass-a");
  EXPECT_EQ(entries[0].start_up, "2009-05-20");
  EXPECT_EQ(entries[0].passes, 1);
  EXPECT_EQ(format_calibration(entries[0].calibration), format_calibration(sample_calibration()));
  EXPECT_THAT(directory_.names(), ElementsAre("catalogue.db"));
}

TEST_F(Catalogue, NamesAStartUpThatHasNoNameByTheEpochOfItsFirstPass) {
  std::vector<CatalogueEntry> entries = {sample_entry("first"), sample_entry("second", 2)};
  for (CatalogueEntry& entry : entries) {
    entry.start_up.clear();
  }
  entries[1].calibration.epoch += std::chrono::hours(9);
  entries[1].calibration.t += std::chrono::hours(9);
  add_to_catalogue(file_, entries);
  EXPECT_THAT(read_catalogue(file_), testing::Each(testing::Field(&CatalogueEntry::start_up, "2009-05-20T00:00:00")));
}

TEST_F(Catalogue, AnswersQuestionsOfOtherPrograms) {
  add(sample_entry());
  EXPECT_EQ(count("calibration WHERE epoch_tai = '2009-05-20T00:00:00' AND t_s = 32400.125 AND NOT trustworthy "
                  "AND estimator = 'invariant' AND drift_model = 'esg7'"),
            1);
  EXPECT_EQ(count("parameter"), 20);
  EXPECT_EQ(count("parameter WHERE state = 'gyro2.k0' AND abs(value - 2e-6 / 3) < 1e-20 AND sigma > 5.7e-7"), 1);
  EXPECT_EQ(count("parameter WHERE state = 'gyro1.align_y' AND abs(value + 2e-3 / 7) < 1e-15"), 1);
  EXPECT_EQ(count("finding WHERE code = 'nis-out-of-bounds'"), 1);
}

TEST_F(Catalogue, ReplacesTheSameCalibrationAndKeepsOthers) {
  add(sample_entry("same"));
  CatalogueEntry later = sample_entry("later");
  later.calibration.epoch += std::chrono::hours(24);
  later.calibration.t += std::chrono::hours(24);
  CatalogueEntry of_two = sample_entry("of two", 2);
  CatalogueEntry other = sample_entry("batch");
  other.calibration.estimator = Estimator::kBatch;
  const std::vector<CatalogueEntry> entries = {later, of_two, other};
  add_to_catalogue(file_, entries);
  CatalogueEntry again = sample_entry("same");
  again.calibration.verdict.trustworthy = true;
  add(again);
  std::vector<std::string> passes;
  for (const CatalogueEntry& entry : read_catalogue(file_)) {
    passes.push_back(entry.pass);
  }
  EXPECT_THAT(passes, ElementsAre("batch", "same", "of two", "later"));
  EXPECT_EQ(count("calibration WHERE pass = 'same' AND trustworthy"), 1);
  EXPECT_EQ(count("parameter"), 4 * 20);
  EXPECT_EQ(count("finding"), 4 * 2);
}

TEST_F(Catalogue, KeepsAnotherStartUpAndAnotherPassOfTheSameEpoch) {
  add(sample_entry());
  CatalogueEntry start_up = sample_entry();
  start_up.start_up = "another";
  add(start_up);
  add(sample_entry("pass-b"));
  EXPECT_THAT(read_catalogue(file_), SizeIs(3));
}

TEST_F(Catalogue, IsAsItWasUntilTheUpdateIsCommitted) {
  add(sample_entry());
  const CatalogueEntry further = sample_entry("pass-b");
  { const CatalogueUpdate update(file_, {&further, 1}); }
  EXPECT_THAT(read_catalogue(file_), SizeIs(1));
  {
    CatalogueUpdate update(file_, {&further, 1});
    update.commit();
  }
  EXPECT_THAT(read_catalogue(file_), SizeIs(2));
  { const CatalogueUpdate update(directory_ / "new.db", {&further, 1}); }
  EXPECT_THAT(directory_.names(), ElementsAre("catalogue.db"));
}

TEST_F(Catalogue, OfVersion1IsReadAndBroughtUpToVersion2WhenItIsWritten) {
  add(sample_entry());
  add(sample_entry("of two", 2));
  // The tables of version 1 were these but for the key.
  const auto tables = SQLite::Database(file_.string())
                          .execAndGet("SELECT group_concat(sql, ';') FROM sqlite_schema WHERE type = 'table'")
                          .getString();
  const std::filesystem::path newer = directory_ / "newer.db";
  std::filesystem::rename(file_, newer);
  execute(replaced(tables, "UNIQUE (start_up, pass, ", "UNIQUE (").c_str());
  execute(("ATTACH '" + newer.string() +
           "' AS newer; INSERT INTO main.calibration SELECT * FROM newer.calibration; "
           "INSERT INTO main.parameter SELECT * FROM newer.parameter; "
           "INSERT INTO main.finding SELECT * FROM newer.finding; "
           "PRAGMA main.application_id = 0x54524948; PRAGMA main.user_version = 1")
              .c_str());
  const std::string before = read_text(file_);
  EXPECT_THAT(read_catalogue(file_), SizeIs(2));
  expect_catalogue_of("Resurs-DK1", file_);
  EXPECT_EQ(read_text(file_), before);
  CatalogueEntry start_up = sample_entry();
  start_up.start_up = "another";
  { const CatalogueUpdate update(file_, {&start_up, 1}); }
  EXPECT_EQ(count("pragma_user_version WHERE user_version = 1"), 1);
  add(start_up);
  EXPECT_EQ(count("pragma_user_version WHERE user_version = 2"), 1);
  EXPECT_THAT(read_catalogue(file_), SizeIs(3));
  EXPECT_EQ(count("parameter"), 3 * 20);
  EXPECT_EQ(count("finding"), 3 * 2);
  EXPECT_EQ(count("sqlite_schema WHERE type = 'table'"), 3);
  add(start_up);  // replaced with its parameters
  EXPECT_EQ(count("parameter"), 3 * 20);
}

TEST_F(Catalogue, IsReadAfterAProgramWasKilledWhileItWrote) {
  add(sample_entry());
  const ::pid_t child = ::fork();
  if (child == 0) {
    // A cache of nothing brings pages to the disk before the end of the transaction.
    SQLite::Database database(file_.string(), SQLite::OPEN_READWRITE);
    database.exec("PRAGMA cache_size = 0; BEGIN; UPDATE calibration SET pass = 'x' || hex(zeroblob(100000))");
    ::_exit(0);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
  ASSERT_TRUE(std::filesystem::exists(file_.string() + "-journal"));
  EXPECT_EQ(read_catalogue(file_).at(0).pass, "pass-a");
  EXPECT_THAT(directory_.names(), ElementsAre("catalogue.db"));
}

TEST_F(Catalogue, IsAskedBeforeTheWorkWhetherItCanBeWritten) {
  EXPECT_THROW(expect_catalogue_of("Resurs-DK1", directory_ / "none/c.db"), MachineFailed);
  add(sample_entry());
  SQLite::Database other(file_.string(), SQLite::OPEN_READWRITE);
  other.exec("BEGIN IMMEDIATE");
  EXPECT_THROW(expect_catalogue_of("Resurs-DK1", file_), MachineFailed);
}

TEST_F(Catalogue, AddsAllOrNone) {
  add(sample_entry());
  CatalogueEntry stranger = sample_entry("stranger");
  stranger.spacecraft = "another";
  const std::vector<CatalogueEntry> entries = {sample_entry("of two", 2), stranger};
  EXPECT_THAT(refusal([&] { add_to_catalogue(file_, entries); }),
              HasSubstr("is of spacecraft \"Resurs-DK1\", not \"another\"; give each spacecraft"));
  EXPECT_THAT(read_catalogue(file_), SizeIs(1));
}

TEST_F(Catalogue, IsAskedBeforeThereIsSomethingToAdd) {
  expect_catalogue_of("Resurs-DK1", file_);
  EXPECT_THAT(directory_.names(), testing::IsEmpty());
  write_text(file_, "");
  expect_catalogue_of("Resurs-DK1", file_);
  add(sample_entry());
  expect_catalogue_of("Resurs-DK1", file_);
  EXPECT_THAT(refusal([&] { expect_catalogue_of("another", file_); }), HasSubstr("not \"another\""));
}

TEST_F(Catalogue, RefusesToReadWhereThereIsNone) {
  EXPECT_THAT(refusal([&] { static_cast<void>(read_catalogue(file_)); }), HasSubstr("there is no such catalogue"));
  EXPECT_THAT(directory_.names(), testing::IsEmpty());
}

/// Byte 18 of the head is the version of the format that a program must know to write.
TEST_F(Catalogue, RefusesToWriteWhatItsHeadSaysCanOnlyBeRead) {
  add(sample_entry());
  std::string bytes = read_text(file_);
  bytes[18] = '&';
  write_text(file_, bytes);
  EXPECT_THAT(refusal([&] { expect_catalogue_of("Resurs-DK1", file_); }), HasSubstr("can only be read"));
  EXPECT_THAT(refusal([&] { add(sample_entry("pass-b")); }), HasSubstr("can only be read"));
  EXPECT_THAT(read_catalogue(file_), SizeIs(1));
}

TEST_F(Catalogue, RefusesAFileThatIsNoDatabase) {
  write_text(file_, "t_s,h1_x\n" + std::string(1000, '0'));
  EXPECT_THAT(refusal_of_all(), HasSubstr("catalogue.db: is damaged or no database: "));
  EXPECT_THAT(read_text(file_), HasSubstr("t_s,h1_x"));
}

TEST_F(Catalogue, RefusesTheDatabaseOfAnotherProgram) {
  execute("CREATE TABLE songs (name TEXT)");
  EXPECT_THAT(refusal_of_all(), HasSubstr("is a database, but no catalogue of calibrations"));
  EXPECT_EQ(count("sqlite_schema"), 1);
}

TEST_F(Catalogue, RefusesANewerVersion) {
  add(sample_entry());
  execute("PRAGMA user_version = 3");
  EXPECT_THAT(refusal_of_all(), HasSubstr("is a catalogue of version 3, this program reads 1 to 2"));
}

TEST_F(Catalogue, RefusesADamagedOne) {
  add(sample_entry());
  std::filesystem::resize_file(file_, std::filesystem::file_size(file_) / 2);
  EXPECT_THAT(refusal_of_all(), HasSubstr("is damaged"));
}

TEST_F(Catalogue, RefusesACalibrationThatIsNone) {
  add(sample_entry());
  execute("UPDATE calibration SET json = replace(json, 'estimator', 'guess')");
  EXPECT_THAT(refusal([&] { static_cast<void>(read_catalogue(file_)); }),
              HasSubstr("catalogue.db: calibration 1: lacks key \"estimator\""));
}

TEST_F(Catalogue, RefusesOneWithoutItsTables) {
  add(sample_entry());
  execute("DROP TABLE calibration");
  EXPECT_THAT(refusal_of_all(), HasSubstr("lacks the \"table calibration\" of a catalogue"));
}

TEST_F(Catalogue, RefusesAViewInPlaceOfATableWithoutLookingIntoIt) {
  add(sample_entry());
  execute(
      "DROP TABLE calibration; CREATE VIEW calibration AS WITH RECURSIVE endless (id) AS (SELECT 1 UNION ALL SELECT id "
      "+ 1 FROM endless) SELECT id, '' AS spacecraft, '' AS pass, '' AS start_up, 1 AS passes, '' AS json, '' AS "
      "epoch_tai, 0.0 AS t_s, '' AS estimator, '' AS drift_model FROM endless");
  EXPECT_THAT(refusal_of_all(), HasSubstr("has the \"view calibration\", which is not that of a catalogue"));
}

TEST_F(Catalogue, RefusesTriggersAndDoesNotRunThem) {
  add(sample_entry());
  execute("CREATE TRIGGER thief AFTER INSERT ON calibration BEGIN DELETE FROM finding; END");
  EXPECT_THAT(refusal_of_all(), HasSubstr("has the \"trigger thief\", which is not that of a catalogue"));
  EXPECT_EQ(count("finding"), 2);
}

TEST_F(Catalogue, RefusesATableWithOtherColumns) {
  add(sample_entry());
  execute("ALTER TABLE finding ADD COLUMN endless TEXT AS (hex(zeroblob(length(code) * 1000)))");
  EXPECT_THAT(refusal_of_all(), HasSubstr("has the \"table finding\", which is not that of a catalogue"));
}

TEST_F(Catalogue, RefusesAWriteAheadLogAndLeavesNoneBehind) {
  add(sample_entry());
  execute("PRAGMA journal_mode = WAL");
  EXPECT_THAT(refusal_of_all(), HasSubstr("keeps a write-ahead log"));
  EXPECT_THAT(directory_.names(), ElementsAre("catalogue.db"));
  execute("PRAGMA journal_mode = DELETE");
  EXPECT_EQ(refusal_of_all(), "");
  // Where the version to read by alone says so, SQLite looks for the log as well.
  std::string bytes = read_text(file_);
  bytes[19] = 2;
  write_text(file_, bytes);
  EXPECT_THAT(refusal_of_all(), HasSubstr("keeps a write-ahead log"));
  EXPECT_THAT(directory_.names(), ElementsAre("catalogue.db"));
}

TEST_F(Catalogue, RefusesRowsThatBelongToNoCalibration) {
  add(sample_entry());
  execute("PRAGMA foreign_keys = OFF; DELETE FROM calibration");
  EXPECT_THAT(refusal_of_all(), HasSubstr("has a row in table"));
  execute("DELETE FROM parameter; DELETE FROM finding");
  EXPECT_EQ(refusal_of_all(), "");
}

TEST_F(Catalogue, RefusesAnIndexThatDisagreesWithItsTable) {
  add(sample_entry());
  std::string bytes = read_text(file_);
  // The key of the calibration stands in the table and again in its index.
  const std::string epoch = "2009-05-20T00:00:00";
  std::size_t places = 0;
  for (std::size_t at = bytes.find(epoch); at != std::string::npos; at = bytes.find(epoch, at + 1)) {
    if (bytes.compare(at + epoch.size(), 1, "\"") != 0) {  // not within its JSON
      bytes[at + 3] = places++ == 0 ? '9' : '8';
    }
  }
  ASSERT_EQ(places, 2U);  // in the row and in the index
  write_text(file_, bytes);
  EXPECT_THAT(refusal_of_all(), HasSubstr("is damaged"));
}

TEST_F(Catalogue, AcceptsWhatSqliteItselfAdds) {
  add(sample_entry());
  execute("ANALYZE");
  EXPECT_EQ(refusal_of_all(), "");
}

TEST_F(Catalogue, RefusesAValueTooLongForACalibration) {
  add(sample_entry());
  execute("UPDATE calibration SET json = hex(zeroblob(40000000))");
  EXPECT_THAT(refusal([&] { static_cast<void>(read_catalogue(file_)); }), HasSubstr("too big"));
}

TEST_F(Catalogue, IsLeftWhenItsReaderIsAskedToStop) {
  std::vector<CatalogueEntry> entries(200, sample_entry());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    entries[i].calibration.epoch += std::chrono::hours(i);
    entries[i].calibration.t += std::chrono::hours(i);
  }
  add_to_catalogue(file_, entries);
  StopRequest request;
  const StopScope scope(&request);
  request.make();
  EXPECT_THROW(static_cast<void>(read_catalogue(file_)), Stopped);
}

TEST_F(Catalogue, FailsWhereTheDirectoryIsMissing) {
  const CatalogueEntry entry = sample_entry();
  EXPECT_THROW(add_to_catalogue(directory_ / "none/c.db", {&entry, 1}), MachineFailed);
}

TEST_F(Catalogue, IsRefusedWhereItMayNotBeRead) {
  add(sample_entry());
  std::filesystem::permissions(file_, std::filesystem::perms::none);
  const NotRoot other_user(directory_.path());
  EXPECT_THROW(static_cast<void>(read_catalogue(file_)), InputRefused);
}

TEST_F(Catalogue, RefusesTheNameOfADirectoryOrAFifo) {
  std::filesystem::create_directory(file_);
  EXPECT_THAT(refusal_of_all(), HasSubstr("catalogue.db: is a directory, not a regular file"));
  std::filesystem::remove(file_);
  ASSERT_EQ(::mkfifo(file_.c_str(), 0600), 0);
  EXPECT_THAT(refusal_of_all(), HasSubstr("catalogue.db: is a FIFO, not a regular file"));
}

TEST_F(Catalogue, StaysAsItWasWhenTheDiskIsFull) {
  add(sample_entry());
  {
    const FileSizeLimit limit(std::filesystem::file_size(file_));
    EXPECT_THROW(add(sample_entry("of two", 2)), MachineFailed);
  }
  EXPECT_THAT(read_catalogue(file_), SizeIs(1));
  EXPECT_THAT(directory_.names(), ElementsAre("catalogue.db"));
}

TEST_F(Catalogue, WaitsForNoOtherProgramForever) {
  add(sample_entry());
  SQLite::Database other(file_.string(), SQLite::OPEN_READWRITE);
  other.exec("BEGIN EXCLUSIVE");
  EXPECT_THROW(add(sample_entry()), MachineFailed);
}

}  // namespace
}  // namespace trihedron::io
