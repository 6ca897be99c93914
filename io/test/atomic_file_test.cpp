#include "trihedron/io/atomic_file.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include "fixtures.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/residuals.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(AtomicFile, AppearsOnlyAtCommit) {
  const TemporaryDirectory directory;
  {
    AtomicFile file(directory / "a.txt");
    file.write("half");
    EXPECT_FALSE(std::filesystem::exists(directory / "a.txt"));
    file.write(" and half");
    file.commit();
  }
  EXPECT_EQ(read_text(directory / "a.txt"), "half and half");
  EXPECT_THAT(directory.names(), ElementsAre("a.txt"));
}

TEST(AtomicFile, LeavesTheOldFileAndNothingElseWithoutCommit) {
  const TemporaryDirectory directory;
  write_text(directory / "a.txt", "old");
  {
    AtomicFile file(directory / "a.txt");
    file.write("new");
  }
  EXPECT_EQ(read_text(directory / "a.txt"), "old");
  EXPECT_THAT(directory.names(), ElementsAre("a.txt"));
}

TEST(AtomicFile, MovedFromFileRemovesNothing) {
  const TemporaryDirectory directory;
  AtomicFile first(directory / "a.txt");
  {
    AtomicFile second(std::move(first));
    second.write("x");
    second.commit();
  }
  EXPECT_EQ(read_text(directory / "a.txt"), "x");
}

TEST(AtomicFile, FailsWhereTheDirectoryIsMissingOrTheTargetIsADirectory) {
  const TemporaryDirectory directory;
  EXPECT_THROW(write_file(directory / "none/a.txt", "x"), MachineFailed);
  EXPECT_THROW(write_file(directory.path(), "x"), MachineFailed);
  EXPECT_THAT(directory.names(), IsEmpty());
}

/// Another user for a while, where the test runs as root: root may write into read-only directories.
class NotRoot {
 public:
  explicit NotRoot(const std::filesystem::path& directory) : was_root_(::geteuid() == 0) {
    constexpr ::uid_t kNobody = 65534;
    if (was_root_ && (::chown(directory.c_str(), kNobody, kNobody) != 0 || ::seteuid(kNobody) != 0)) {
      throw std::runtime_error("cannot become another user");
    }
  }
  ~NotRoot() {
    if (was_root_ && ::seteuid(0) != 0) {
      std::abort();
    }
  }
  NotRoot(const NotRoot&) = delete;
  NotRoot& operator=(const NotRoot&) = delete;

 private:
  bool was_root_;
};

TEST(AtomicFile, FailsInAReadOnlyDirectory) {
  const TemporaryDirectory directory;
  const NotRoot other_user(directory.path());
  std::filesystem::permissions(directory.path(),
                               std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_THROW(write_file(directory / "a.txt", "x"), MachineFailed);
  std::filesystem::permissions(directory.path(), std::filesystem::perms::owner_all);
  EXPECT_THAT(directory.names(), IsEmpty());
}

TEST(AtomicFile, WritesStraightToADeviceAndReportsThatItIsFull) {
  write_file("/dev/null", "x");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  try {
    write_file("/dev/full", "x");
    FAIL() << "a full device took the text";
  } catch (const MachineFailed& failed) {
    EXPECT_THAT(failed.what(), HasSubstr("/dev/full: cannot be written: No space left on device"));
  }
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

TEST(AtomicFile, NothingStaysOfAnyFileWhenTheDiskIsFull) {
  const TemporaryDirectory directory;
  const RawPass raw = clean_pass();
  raw.save_directory(directory / "in");
  const Pass pass = read_pass(directory / "in").pass;
  const Truth truth = clean_truth();
  std::filesystem::remove_all(directory / "in");
  write_text(directory / "calibration.json", "old");
  {
    const FileSizeLimit limit(1000);
    EXPECT_THROW(write_pass(directory / "out", pass, &truth), MachineFailed);
    EXPECT_THROW(write_pass(directory / "out.nc", pass, &truth), MachineFailed);
    EXPECT_THROW(write_calibration(directory / "calibration.json", sample_calibration()), MachineFailed);
    EXPECT_THROW(write_attitude(directory / "attitude.csv", truth.t[0], {truth.t, truth.q_in_c, {}, {}}),
                 MachineFailed);
  }
  EXPECT_THAT(directory.names(), ElementsAre("calibration.json"));
  EXPECT_EQ(read_text(directory / "calibration.json"), "old");
}

TEST(MadeDirectory, GoesAgainWithThoseAboveItWhereNothingHasBeenPutIntoThem) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory / "old");
  for (const char* name : {"old", "old/a/b", "new/a/", "new"}) {
    const MadeDirectory made(directory / name);
    EXPECT_TRUE(std::filesystem::is_directory(directory / name));
  }
  EXPECT_THAT(directory.names(), ElementsAre("old"));
  {
    const MadeDirectory made(directory / "new/a/b");
    write_text(directory / "new/file", "x");
  }
  EXPECT_FALSE(std::filesystem::exists(directory / "new/a"));
  EXPECT_TRUE(std::filesystem::exists(directory / "new/file"));
}

TEST(MadeDirectory, RefusesTheNameOfAFile) {
  const TemporaryDirectory directory;
  write_text(directory / "file", "x");
  EXPECT_THROW(MadeDirectory(directory / "file"), MachineFailed);
  EXPECT_THROW(MadeDirectory(directory / "file/a"), MachineFailed);
  EXPECT_THAT(directory.names(), ElementsAre("file"));
}

TEST(StagedDirectory, ShowsItsFilesOnlyAtCommitAndKeepsOthers) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory / "out");
  write_text(directory / "out/a.txt", "old");
  write_text(directory / "out/other.txt", "other");
  {
    StagedDirectory staged(directory / "out");
    write_file(staged.path() / "a.txt", "new");
    std::filesystem::create_directory(staged.path() / "below");
    write_file(staged.path() / "below/b.txt", "new");
    EXPECT_EQ(read_text(directory / "out/a.txt"), "old");
    staged.commit();
  }
  EXPECT_EQ(read_text(directory / "out/a.txt"), "new");
  EXPECT_EQ(read_text(directory / "out/below/b.txt"), "new");
  EXPECT_EQ(read_text(directory / "out/other.txt"), "other");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory / "out"), {}), 3);
}

TEST(StagedDirectory, LeavesNothingWithoutCommit) {
  const TemporaryDirectory directory;
  {
    const StagedDirectory staged(directory / "out/below");
    write_file(staged.path() / "a.txt", "new");
  }
  EXPECT_THAT(directory.names(), IsEmpty());
}

TEST(StagedDirectory, NamesThePlaceOfAFileThatCannotBeWritten) {
  const TemporaryDirectory directory;
  StagedDirectory staged(directory / "out");
  EXPECT_EQ(unstaged(staged.path() / "below/a.txt"), directory / "out/below/a.txt");
  const std::string text(2000, 'x');
  {
    const FileSizeLimit limit(1000);
    EXPECT_THAT([&] { write_file(staged.path() / "a.txt", text); },
                testing::ThrowsMessage<MachineFailed>(
                    testing::StartsWith((directory / "out/a.txt").string() + ": cannot be written")));
  }
  std::filesystem::create_directories(directory / "out/b.txt");
  write_file(staged.path() / "b.txt", text);
  EXPECT_THAT([&] { staged.commit(); }, testing::ThrowsMessage<MachineFailed>(testing::StartsWith(
                                            (directory / "out/b.txt").string() + ": cannot be written")));
}

TEST(AtomicFile, LeavesNothingWhereItIsStopped) {
  const TemporaryDirectory directory;
  const RawPass raw = clean_pass();
  raw.save_directory(directory / "in");
  const Pass pass = read_pass(directory / "in").pass;
  std::filesystem::remove_all(directory / "in");
  StopRequest request;
  request.make();
  const StopScope scope(&request);
  EXPECT_THROW(write_file(directory / "a.txt", "x"), Stopped);
  EXPECT_THROW(write_pass(directory / "out", pass, nullptr), Stopped);
  EXPECT_THROW(write_pass(directory / "out.nc", pass, nullptr), Stopped);
  EXPECT_THAT(directory.names(), IsEmpty());
}

TEST(AtomicFile, NetcdfIsNotWrittenOverADeviceNorWithoutADirectory) {
  const TemporaryDirectory directory;
  const Table table{"g", {}, {}};
  EXPECT_THROW(write_residuals("/dev/null", Time{}, {&table, 1}), MachineFailed);
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_THROW(write_residuals(directory / "none/r.nc", Time{}, {&table, 1}), MachineFailed);
}

}  // namespace
}  // namespace trihedron::io
