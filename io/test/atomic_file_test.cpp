#include "trihedron/io/atomic_file.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <string>
#include <vector>

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
  EXPECT_THROW(write_file(directory.path(), "x"), UsageError);
  EXPECT_THAT(directory.names(), IsEmpty());
}

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

TEST(AtomicFile, KeepsTheModeOfTheFileItReplaces) {
  const TemporaryDirectory directory;
  using std::filesystem::perms;
  const perms mode = perms::owner_read | perms::owner_write | perms::group_read;
  write_text(directory / "a.txt", "old");
  std::filesystem::permissions(directory / "a.txt", mode);
  write_file(directory / "a.txt", "new");
  EXPECT_EQ(std::filesystem::status(directory / "a.txt").permissions(), mode);
  EXPECT_EQ(read_text(directory / "a.txt"), "new");
}

TEST(AtomicFile, ReplacesWhatLinksLeadToAndKeepsTheLinks) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory / "below");
  write_text(directory / "below/real", "old");
  std::filesystem::create_symlink("real", directory / "below/second");
  std::filesystem::create_symlink("below/second", directory / "first");
  std::filesystem::create_symlink("below/absent", directory / "dangling");
  std::filesystem::create_symlink("circle", directory / "circle");
  write_file(directory / "first", "new");
  write_file(directory / "dangling", "new");
  EXPECT_EQ(read_text(directory / "below/real"), "new");
  EXPECT_EQ(read_text(directory / "below/absent"), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(directory / "first"));
  EXPECT_TRUE(std::filesystem::is_symlink(directory / "dangling"));
  EXPECT_THROW(write_file(directory / "circle", "new"), MachineFailed);
  EXPECT_THAT(directory.names(), ElementsAre("below", "circle", "dangling", "first"));
}

TEST(AtomicFile, TakesTheLongestName) {
  const TemporaryDirectory directory;
  const std::string name(255, 'n');
  write_file(directory / name.c_str(), "x");
  EXPECT_THAT(directory.names(), ElementsAre(name));
}

TEST(AtomicFile, RemovesWhatAKilledProgramLeftAndNothingElse) {
  const TemporaryDirectory directory;
  std::array<char, 256> host{};
  ASSERT_EQ(::gethostname(host.data(), host.size()), 0);
  const ::pid_t dead = ::fork();
  if (dead == 0) {
    ::_exit(0);
  }
  ASSERT_EQ(::waitpid(dead, nullptr, 0), dead);
  const auto name = [](const std::string& of_host, ::pid_t process) {
    return fmt::format(".trihedron-{}-{}-0.partial", of_host, process);
  };
  write_text(directory / name(host.data(), dead).c_str(), "half");
  const std::vector<std::string> others = {name(host.data(), ::getppid()), name("7-of-another", dead),
                                           ".trihedron-.partial"};
  for (const std::string& other : others) {
    write_text(directory / other.c_str(), "half");
  }
  write_file(directory / "a.txt", "x");
  EXPECT_THAT(directory.names(), testing::UnorderedElementsAre(others[0], others[1], others[2], "a.txt"));
}

TEST(AtomicFile, TellsBeforeTheWorkWhatCannotBeWrittenAndOpensNoPipe) {
  const TemporaryDirectory directory;
  write_text(directory / "a.txt", "old");
  expect_writable(directory / "a.txt");
  expect_writable(directory / "b.txt");
  ASSERT_EQ(::mkfifo((directory / "pipe").c_str(), 0600), 0);
  expect_writable(directory / "pipe");  // would wait for a reader
  EXPECT_THROW(expect_writable(directory / "none/a.txt"), MachineFailed);
  EXPECT_THROW(expect_writable(directory.path()), UsageError);
  EXPECT_THAT(directory.names(), ElementsAre("a.txt", "pipe"));
  EXPECT_EQ(read_text(directory / "a.txt"), "old");
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
