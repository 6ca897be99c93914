#include "trihedron/io/staged_directory.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <iterator>
#include <string>

#include "fixtures.hpp"
#include "trihedron/io/atomic_file.hpp"

namespace trihedron::io {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

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
  EXPECT_THROW(MadeDirectory(directory / "file"), UsageError);
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

TEST(StagedDirectory, TakesASetBackThatWasNotKept) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory / "out");
  write_text(directory / "out/a.txt", "old");
  write_text(directory / "out/dropped.txt", "old");
  {
    StagedDirectory staged(directory / "out");
    write_file(staged.path() / "a.txt", "new");
    std::filesystem::create_directory(staged.path() / "below");
    write_file(staged.path() / "below/b.txt", "new");
    staged.drop("dropped.txt");
    staged.drop("never.txt");
    staged.put_in_place();
    EXPECT_EQ(read_text(directory / "out/a.txt"), "new");
    EXPECT_EQ(read_text(directory / "out/below/b.txt"), "new");
    EXPECT_FALSE(std::filesystem::exists(directory / "out/dropped.txt"));
  }
  EXPECT_EQ(read_text(directory / "out/a.txt"), "old");
  EXPECT_EQ(read_text(directory / "out/dropped.txt"), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory / "out"), {}), 2);
}

TEST(StagedDirectory, TakesBackWhatAKilledProgramPutInPlace) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory / "out");
  write_text(directory / "out/a.txt", "old");
  const ::pid_t child = ::fork();
  if (child == 0) {
    StagedDirectory staged(directory / "out");
    write_file(staged.path() / "a.txt", "new");
    write_file(staged.path() / "b.txt", "new");
    staged.put_in_place();
    ::_exit(0);  // without a destructor, as by kill -9
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
  EXPECT_EQ(read_text(directory / "out/a.txt"), "new");
  { const StagedDirectory next(directory / "out"); }
  EXPECT_EQ(read_text(directory / "out/a.txt"), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory / "out"), {}), 1);
}

TEST(StagedDirectory, KeepsLinksAndModes) {
  const TemporaryDirectory directory;
  using std::filesystem::perms;
  std::filesystem::create_directories(directory / "out");
  std::filesystem::create_directories(directory / "elsewhere");
  write_text(directory / "elsewhere/a.txt", "old");
  std::filesystem::permissions(directory / "elsewhere/a.txt", perms::owner_read | perms::owner_write);
  std::filesystem::create_symlink("../elsewhere/a.txt", directory / "out/a.txt");
  std::filesystem::create_symlink("out", directory / "link");
  {
    StagedDirectory staged(directory / "link");
    write_file(staged.path() / "a.txt", "new");
    staged.commit();
  }
  EXPECT_TRUE(std::filesystem::is_symlink(directory / "link"));
  EXPECT_TRUE(std::filesystem::is_symlink(directory / "out/a.txt"));
  EXPECT_EQ(read_text(directory / "elsewhere/a.txt"), "new");
  EXPECT_EQ(std::filesystem::status(directory / "elsewhere/a.txt").permissions(),
            perms::owner_read | perms::owner_write);
}

TEST(StagedDirectory, FollowsALinkToAnotherFileSystem) {
  const std::filesystem::path memory = fmt::format("/dev/shm/trihedron-test-{}", ::getpid());
  const TemporaryDirectory directory;
  struct stat here {};
  struct stat there {};
  if (::stat(directory.path().c_str(), &here) != 0 || ::stat("/dev/shm", &there) != 0 || here.st_dev == there.st_dev) {
    GTEST_SKIP() << "there is no second file system";
  }
  write_text(memory, "old");
  std::filesystem::create_directory(directory / "out");
  std::filesystem::create_symlink(memory, directory / "out/a.txt");
  for (const bool kept : {false, true}) {
    {
      StagedDirectory staged(directory / "out");
      write_file(staged.path() / "a.txt", "new");
      staged.put_in_place();
      EXPECT_EQ(read_text(memory), "new");
      if (kept) {
        staged.keep();
      }
    }
    EXPECT_EQ(read_text(memory), kept ? "new" : "old");
  }
  EXPECT_TRUE(std::filesystem::is_symlink(directory / "out/a.txt"));
  std::filesystem::remove(memory);
}

TEST(StagedDirectory, IsForOneAtATimeAndTellsWhoThatIs) {
  const TemporaryDirectory directory;
  {
    const StagedDirectory first(directory / "out");
    EXPECT_THAT(
        [&] { const StagedDirectory second(directory / "out"); },
        testing::ThrowsMessage<MachineFailed>(testing::HasSubstr(fmt::format("out: process {} on ", ::getpid()))));
  }
  EXPECT_THAT(directory.names(), IsEmpty());
  write_text((std::filesystem::create_directory(directory / "out"), directory / "out/.trihedron-lock"), "left");
  { const StagedDirectory next(directory / "out"); }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory / "out"), {}), 0);
}

TEST(StagedDirectory, TellsBeforeTheWorkWhichPlacesAreTaken) {
  const TemporaryDirectory directory;
  std::filesystem::create_directories(directory / "out/taken");
  write_text(directory / "out/file", "old");
  std::filesystem::create_symlink("/dev/null", directory / "out/device");
  const StagedDirectory staged(directory / "out");
  const auto fault_of = [&](const std::filesystem::path& name) {
    try {
      staged.expect_places({&name, 1});
    } catch (const MachineFailed& failed) {
      return failed.reason();
    }
    return std::string();
  };
  EXPECT_EQ(fault_of("file"), "");
  EXPECT_EQ(fault_of("absent"), "");
  EXPECT_EQ(fault_of("taken"), "cannot be written: a directory has its name");
  EXPECT_EQ(fault_of("file/below"), "cannot be written: a file has its name");
  EXPECT_EQ(fault_of("device"), "cannot be written: what has its name is no regular file");
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

}  // namespace
}  // namespace trihedron::io
