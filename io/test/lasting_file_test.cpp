#include "trihedron/io/lasting_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "fixtures.hpp"
#include "trihedron/io/error.hpp"

namespace trihedron::io {
namespace {

using testing::HasSubstr;

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

template <class Refusal, class F>
std::string refusal_of(F&& f) {
  try {
    f();
  } catch (const Refusal& refusal) {
    return refusal.what();
  }
  return "not refused";
}

TEST(GrowingFile, IsThereWhileItGrowsAndIsCarriedOnFromAnyPlace) {
  const TemporaryDirectory directory;
  write_text(directory / "a.csv", "an old one");
  std::uint64_t size = 0;
  std::uint32_t crc = 0;
  {
    GrowingFile file = GrowingFile::begin(directory / "a.csv");
    file.append("first\n");
    file.synchronise();
    size = file.size();
    crc = file.crc();
    file.append("seco");
    EXPECT_EQ(read_text(directory / "a.csv"), "first\nseco");
  }
  GrowingFile file = GrowingFile::carry_on(directory / "a.csv", size, crc);
  file.append("second\n");
  EXPECT_EQ(read_text(directory / "a.csv"), "first\nsecond\n");
  EXPECT_EQ(file.size(), 13U);
  EXPECT_NO_THROW(GrowingFile::carry_on(directory / "a.csv", file.size(), file.crc()));
}

TEST(GrowingFile, IsNotCarriedOnWhereWhatWasConfirmedIsNotThere) {
  const TemporaryDirectory directory;
  GrowingFile file = GrowingFile::begin(directory / "a.csv");
  file.append("first\n");
  const auto carried_on = [&] { GrowingFile::carry_on(directory / "a.csv", file.size(), file.crc()); };
  write_text(directory / "a.csv", "fir");
  EXPECT_THAT(refusal_of<InputRefused>(carried_on), HasSubstr("has 3 bytes, though 6 are confirmed"));
  write_text(directory / "a.csv", "fIrst\nsecond\n");
  EXPECT_THAT(refusal_of<InputRefused>(carried_on), HasSubstr("is not what was confirmed"));
  EXPECT_EQ(read_text(directory / "a.csv"), "fIrst\nsecond\n");
  std::filesystem::remove(directory / "a.csv");
  EXPECT_THAT(refusal_of<InputRefused>(carried_on), HasSubstr("is not there"));
  std::filesystem::create_directory(directory / "a.csv");
  EXPECT_THAT(refusal_of<InputRefused>(carried_on), HasSubstr("a directory"));
}

TEST(GrowingFile, GoesStraightToADevice) {
  GrowingFile file = GrowingFile::begin("/dev/null");
  file.append("text");
  EXPECT_NO_THROW(file.synchronise());
  GrowingFile full = GrowingFile::begin("/dev/full");
  EXPECT_THROW(full.append("text"), MachineFailed);
}

TEST(SlotFile, KeepsWhatIsPutIntoIt) {
  const TemporaryDirectory directory;
  {
    SlotFile file = SlotFile::begin(directory / "state", bytes_of("first second"));
    EXPECT_EQ(file.content(), bytes_of("first second"));
    file.put(6, bytes_of("SECOND"));
    EXPECT_EQ(file.content(), bytes_of("first SECOND"));
  }
  EXPECT_EQ(read_text(directory / "state"), "first SECOND");
  EXPECT_EQ(SlotFile::open(directory / "state").content(), bytes_of("first SECOND"));
}

TEST(GrowingFile, RefusesTheNameOfADirectory) {
  const TemporaryDirectory directory;
  EXPECT_THROW(static_cast<void>(GrowingFile::begin(directory.path())), UsageError);
}

TEST(SlotFile, IsOfOneProgramAtATime) {
  const TemporaryDirectory directory;
  std::optional<SlotFile> file = SlotFile::begin(directory / "state", bytes_of("text"));
  EXPECT_THAT(refusal_of<MachineFailed>([&] { static_cast<void>(SlotFile::open(directory / "state")); }),
              HasSubstr("another program has it open"));
  EXPECT_THROW(static_cast<void>(SlotFile::begin(directory / "state", bytes_of("text"))), MachineFailed);
  file.reset();
  EXPECT_NO_THROW(static_cast<void>(SlotFile::open(directory / "state")));
}

TEST(SlotFile, IsARegularFile) {
  const TemporaryDirectory directory;
  EXPECT_THROW(static_cast<void>(SlotFile::open(directory / "none")), InputRefused);
  EXPECT_THROW(static_cast<void>(SlotFile::open("/dev/null")), InputRefused);
  EXPECT_THROW(static_cast<void>(SlotFile::begin("/dev/null", bytes_of("text"))), InputRefused);
  EXPECT_THROW(static_cast<void>(SlotFile::begin(directory / "none" / "state", bytes_of("text"))), MachineFailed);
}

}  // namespace
}  // namespace trihedron::io
