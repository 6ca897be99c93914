#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "fixtures.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::io {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;

/// A clean pass in a directory, with one file replaced.
class PassCsv : public testing::Test {
 protected:
  PassCsv() { clean_pass().save_directory(directory_.path()); }

  LoadedPass read_with(const char* name, std::string_view text) {
    write_text(directory_ / name, text);
    return read_pass(directory_.path());
  }
  std::string refusal_with(const char* name, std::string_view text) {
    return refusal([&] { static_cast<void>(read_with(name, text)); });
  }

  TemporaryDirectory directory_;
  std::string gyro_ = clean_pass().gyro.csv();
  std::string fixes_ = clean_pass().star_tracker.csv();
};

TEST_F(PassCsv, ReadsACleanPassWithoutDefect) {
  const LoadedPass loaded = read_pass(directory_.path());
  EXPECT_TRUE(loaded.defects.empty());
  const Pass& pass = loaded.pass;
  EXPECT_EQ(pass.settings.spacecraft, "TEST");
  EXPECT_EQ(pass.settings.epoch.time_since_epoch(), std::chrono::sys_days(std::chrono::year(2009) / 5 / 20) -
                                                        std::chrono::sys_days(std::chrono::year(1958) / 1 / 1));
  EXPECT_EQ(pass.settings.gyro_period, std::chrono::milliseconds(500));
  EXPECT_EQ(pass.gyro.gyros, 2);
  ASSERT_EQ(pass.gyro.size(), 181U);
  EXPECT_EQ(pass.gyro.t[3] - pass.settings.epoch, std::chrono::milliseconds(1500));
  EXPECT_EQ(pass.gyro.direction(3, 1), Eigen::Vector3d(0, std::cos(1.5e-3), std::sin(1.5e-3)));
  ASSERT_EQ(pass.star_tracker.size(), 31U);
  EXPECT_EQ(pass.star_tracker.q_in_c[1].coeffs(), Eigen::Vector4d(0, 0, std::sin(1.5e-3), std::cos(1.5e-3)));
}

TEST_F(PassCsv, ReadsCrlfBlanksByteOrderMarkPlusSignsAndColumnsInAnyOrder) {
  std::string text = "\xEF\xBB\xBF q_w , t_s,q_z,q_y,q_x\r\n";
  for (const auto& row : clean_pass().star_tracker.rows) {
    text += std::to_string(row[4]) + " ,\t+" + std::to_string(row[0]) + ", " + std::to_string(row[3]) + ",0,0 \r\n";
  }
  const LoadedPass loaded = read_with("star_tracker.csv", text + "\r\n \n");
  EXPECT_TRUE(loaded.defects.empty());
  ASSERT_EQ(loaded.pass.star_tracker.size(), 31U);
  EXPECT_EQ(loaded.pass.star_tracker.q_in_c[30].w(), std::stod(std::to_string(std::cos(5e-4 * 90))));
}

TEST_F(PassCsv, LastLineWithoutNewlineIsASampleWhenItIsWhole) {
  gyro_.pop_back();
  const LoadedPass loaded = read_with("gyro.csv", gyro_);
  EXPECT_TRUE(loaded.defects.empty());
  EXPECT_EQ(loaded.pass.gyro.size(), 181U);
}

TEST_F(PassCsv, LastLineCutShortIsLeftOutAndCounted) {
  const std::string start = gyro_.substr(0, gyro_.rfind("90,"));
  for (const char* cut : {"9", "90,0.99", "90,1,0,0,0,1,", "90,1,0,0,0,1, ", "90,1,0,0,0,1,-", "90,1,0,0,0,1,0e"}) {
    const LoadedPass loaded = read_with("gyro.csv", start + cut);
    EXPECT_EQ(loaded.pass.gyro.size(), 180U) << cut;
    const Defect defect = only(loaded.defects, Defect::Kind::kTruncatedLine);
    EXPECT_EQ(defect.where, "gyro.csv");
    ASSERT_EQ(defect.first.size(), 1U);
    EXPECT_EQ(defect.first[0].line, 182);
    EXPECT_EQ(defect.text(), "gyro.csv: 1 last line that is cut short, left out: line 182.");
  }
}

TEST_F(PassCsv, EmptyAndNanFieldsAreMissingValues) {
  std::string text = replaced(gyro_, "\n0.5,", "\n0.5,nan,0,0,0,1,0\n0.6,");
  text = replaced(text, "\n1,", "\n0.7, ,0,0,0,1,\n1,");
  const LoadedPass loaded = read_with("gyro.csv", text);
  EXPECT_EQ(loaded.pass.gyro.size(), 183U);
  EXPECT_TRUE(std::isnan(loaded.pass.gyro.direction(1, 0).x()));
  EXPECT_TRUE(std::isnan(loaded.pass.gyro.direction(3, 0).x()));
  EXPECT_TRUE(std::isnan(loaded.pass.gyro.direction(3, 1).z()));
}

TEST_F(PassCsv, RefusesATableWithoutItsLineOfNamesAndGivesIt) {
  const auto without_names = [](const std::string& table) { return table.substr(table.find('\n') + 1); };
  EXPECT_THAT(refusal_with("gyro.csv", without_names(gyro_)),
              EndsWith("gyro.csv:1:1: the first line holds numbers, where the names of the columns should be; put this "
                       "line before it: t_s,h1_x,h1_y,h1_z,h2_x,h2_y,h2_z"));
  clean_pass().save_directory(directory_.path());
  EXPECT_THAT(refusal_with("star_tracker.csv", without_names(fixes_)),
              EndsWith("star_tracker.csv:1:1: the first line holds numbers, where the names of the columns should be; "
                       "put this line before it: t_s,q_x,q_y,q_z,q_w"));
  // As many columns as it has.
  EXPECT_THAT(refusal_with("star_tracker.csv", "0,0,0,0,1,1e-10,1e-10,1e-9\n"),
              EndsWith("it: t_s,q_x,q_y,q_z,q_w,cov_xx_rad2,cov_yy_rad2,cov_zz_rad2"));
  EXPECT_THAT(refusal_with("star_tracker.csv", "0,0,0,0,1,1e-10,1e-10,1e-9,0,0,0\n"),
              EndsWith("cov_zz_rad2,cov_xy_rad2,cov_xz_rad2,cov_yz_rad2"));
  clean_pass().save_directory(directory_.path());
  EXPECT_THAT(refusal_with("gyro.csv", "0,1,0,0,0,1,0,0,0,1\n"), EndsWith("h2_z,h3_x,h3_y,h3_z"));
  EXPECT_THAT(refusal_with("gyro.csv", "0,1,0,0,0,1,0,0,0,1,1,0,0\n"), EndsWith("h3_z,h4_x,h4_y,h4_z"));
  EXPECT_THAT(refusal_with("gyro.csv", "0,1,0\n"), EndsWith("put a line with the names of its columns before it"));
  // Values that are missing are no names.
  EXPECT_THAT(refusal_with("gyro.csv", "\xEF\xBB\xBF 0, nan,,,+0,1e-3, -1 \r\n"), HasSubstr("holds numbers"));
  // A name beside numbers is an unknown column, and a line of nothing has none.
  EXPECT_THAT(refusal_with("gyro.csv", "t_s,1,0,0,0,1,0\n"), HasSubstr("column \"1\" is not known"));
  EXPECT_THAT(refusal_with("gyro.csv", ",,,,,,\n"), HasSubstr("column \"\" is not known"));
}

TEST_F(PassCsv, RefusesOtherSeparatorsDecimalCommasAndUtf16NamingThem) {
  const auto with = [&](char from, char to) {
    std::string text = gyro_;
    std::ranges::replace(text, from, to);
    return text;
  };
  EXPECT_THAT(
      refusal_with("gyro.csv", with(',', ';')),
      EndsWith("gyro.csv:1:4: semicolons stand between the names of the columns, not commas; write commas between "
               "columns, and points in numbers"));
  EXPECT_THAT(refusal_with("gyro.csv", with(',', '\t')), HasSubstr("gyro.csv:1:4: tabs stand between"));
  EXPECT_THAT(refusal_with("gyro.csv", with('.', ',')), EndsWith("write numbers with decimal points, not commas"));
  std::string wide;
  for (const char c : gyro_) {
    wide += {c, '\0'};
  }
  EXPECT_THAT(refusal_with("gyro.csv", wide), HasSubstr("gyro.csv:1:1: is UTF-16"));
  EXPECT_THAT(refusal_with("gyro.csv", "\xFF\xFE" + wide), HasSubstr("gyro.csv:1:1: is UTF-16"));
  EXPECT_THAT(refusal_with("gyro.csv", "\x1F\x8B\x08"), HasSubstr("gyro.csv:1:1: is compressed; unpack it: gunzip"));
  clean_pass().save_directory(directory_.path());
  EXPECT_THAT(refusal_with("pass.toml", "\xFE\xFF[pass]\n"), HasSubstr("pass.toml:1:1: is UTF-16"));
}

TEST_F(PassCsv, RefusesMissingFilesNamingThem) {
  EXPECT_THAT(refusal([] { static_cast<void>(read_pass("no-such-pass")); }),
              HasSubstr("no-such-pass: there is no such file or directory; give a pass"));
  for (const char* name : {"pass.toml", "gyro.csv", "star_tracker.csv"}) {
    clean_pass().save_directory(directory_.path());
    std::filesystem::remove(directory_ / name);
    EXPECT_THAT(refusal([&] { static_cast<void>(read_pass(directory_.path())); }),
                AllOf(HasSubstr(name), HasSubstr("cannot be opened: No such file")));
  }
}

TEST_F(PassCsv, RefusesADirectoryInPlaceOfAFile) {
  std::filesystem::remove(directory_ / "gyro.csv");
  std::filesystem::create_directory(directory_ / "gyro.csv");
  EXPECT_THAT(refusal([&] { static_cast<void>(read_pass(directory_.path())); }),
              HasSubstr("gyro.csv: is a directory, not a regular file"));
}

TEST_F(PassCsv, RefusesWhatCouldBeReadForEverAtOnce) {
  for (const char* name : {"pass.toml", "gyro.csv", "star_tracker.csv"}) {
    clean_pass().save_directory(directory_.path());
    std::filesystem::remove(directory_ / name);
    ASSERT_EQ(::mkfifo((directory_ / name).c_str(), 0600), 0);
    EXPECT_THAT(refusal([&] { static_cast<void>(read_pass(directory_.path())); }),
                AllOf(HasSubstr(name), HasSubstr("is a FIFO, not a regular file")));
    std::filesystem::remove(directory_ / name);
    std::filesystem::create_symlink("/dev/zero", directory_ / name);
    EXPECT_THAT(refusal([&] { static_cast<void>(read_pass(directory_.path())); }),
                AllOf(HasSubstr(name), HasSubstr("is a device, not a regular file")));
    std::filesystem::remove(directory_ / name);
  }
}

TEST_F(PassCsv, RefusesASocketInPlaceOfAFile) {
  std::filesystem::remove(directory_ / "gyro.csv");
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  const std::string name = (directory_ / "gyro.csv").string();
  ASSERT_LT(name.size(), sizeof address.sun_path);
  std::ranges::copy(name, std::begin(address.sun_path));
  const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_THAT(refusal([&] { static_cast<void>(read_pass(directory_.path())); }),
              HasSubstr("is a socket, not a regular file"));
  ::close(listener);
}

TEST_F(PassCsv, RefusesUnknownColumnNamingItsPlaceAndTheNearest) {
  EXPECT_THAT(refusal_with("gyro.csv", replaced(gyro_, "h1_y", "h1y")),
              EndsWith("gyro.csv:1:10: column \"h1y\" is not known; did you mean \"h1_y\"?"));
}

TEST_F(PassCsv, RefusesMissingColumn) {
  EXPECT_THAT(refusal_with("star_tracker.csv", "t_s,q_x,q_y,q_w\n0,0,0,1\n"),
              EndsWith("star_tracker.csv:1: lacks column \"q_z\"; its columns must be t_s,q_x,q_y,q_z,q_w"));
  EXPECT_THAT(refusal_with("star_tracker.csv", ""), HasSubstr("star_tracker.csv: is empty; write it again"));
}

TEST_F(PassCsv, RefusesColumnThatIsThereTwice) {
  EXPECT_THAT(refusal_with("star_tracker.csv", "t_s,q_x,q_y,q_y,q_z,q_w\n"),
              HasSubstr("star_tracker.csv:1:13: column \"q_y\" is there twice"));
}

TEST_F(PassCsv, RefusesOneGyroAndMoreThanFour) {
  EXPECT_THAT(refusal_with("gyro.csv", "t_s,h1_x,h1_y,h1_z\n0,1,0,0\n"), HasSubstr("has one gyro only"));
  EXPECT_THAT(refusal_with("gyro.csv", "t_s,h5_x\n"), HasSubstr("gyro.csv:1:5: \"h5_x\" is of a fifth or later gyro"));
}

TEST_F(PassCsv, ReadsFourGyros) {
  std::string text = "t_s,h1_x,h1_y,h1_z,h2_x,h2_y,h2_z,h3_x,h3_y,h3_z,h4_x,h4_y,h4_z\n";
  for (int i = 0; i <= 180; ++i) {
    const std::string angle = std::to_string(1e-6 * i);
    text += std::to_string(0.5 * i) + ",1,0," + angle + ",0,1," + angle + "," + angle + ",0,1," + angle + ",0.6,0.8\n";
  }
  const LoadedPass loaded = read_with("gyro.csv", text);
  EXPECT_EQ(loaded.pass.gyro.gyros, 4);
  EXPECT_EQ(loaded.pass.settings.gyros.size(), 4U);
  EXPECT_EQ(loaded.pass.gyro.direction(2, 3).z(), 0.8);
}

TEST_F(PassCsv, RefusesFieldThatIsNoNumberWithLineAndColumn) {
  for (const char* garbage : {"abc", "1.2.3", "0x1", "--1", "1e", "+-1", "1 2"}) {
    const std::string text = replaced(gyro_, "\n0.5,", std::string("\n0.5,") + garbage + ",0,0,0,1,0\n0.6,");
    EXPECT_THAT(refusal_with("gyro.csv", text), HasSubstr("gyro.csv:3:5: \"" + std::string(garbage) +
                                                          "\" of column h1_x is not a number; repair the field"));
  }
}

TEST_F(PassCsv, RefusesGarbageInTheMiddleOfAnUnterminatedLastLine) {
  EXPECT_THAT(refusal_with("gyro.csv", gyro_ + "90.5,1,zero,0,0,1,0"),
              HasSubstr("gyro.csv:183:8: \"zero\" of column h1_y"));
}

TEST_F(PassCsv, RefusesWrongNumberOfFieldsAnywhereButInACutLastLine) {
  EXPECT_THAT(refusal_with("gyro.csv", replaced(gyro_, "\n0.5,", "\n0.4,1,0\n0.5,")),
              HasSubstr("gyro.csv:3:1: the line has 3 fields, the header 7"));
  EXPECT_THAT(refusal_with("gyro.csv", gyro_ + "90.5\n"),
              HasSubstr("gyro.csv:183:1: the line has 1 field, the header 7"));
  EXPECT_THAT(refusal_with("gyro.csv", gyro_ + "90.5,1,0,0,0,1,0,7"),
              HasSubstr("gyro.csv:183:1: the line has 8 fields"));
  EXPECT_THAT(refusal_with("gyro.csv", replaced(gyro_, "\n0.5,", "\n\n0.5,")),
              HasSubstr("gyro.csv:3:1: an empty line between samples"));
}

TEST_F(PassCsv, RefusalOfABinaryFileIsOnePrintableLine) {
  const std::string message = refusal_with("gyro.csv", std::string("\x89HDF\r\n\x1a\n\0\0\0,\xff\xfe", 14));
  EXPECT_THAT(message, HasSubstr("gyro.csv:1:1: column \"\\x89HDF\" is not known"));
  EXPECT_EQ(message.find('\n'), std::string::npos);
}

TEST_F(PassCsv, RefusesPassWithoutSamplesOrFixes) {
  const std::string header = gyro_.substr(0, gyro_.find('\n') + 1);
  EXPECT_THAT(refusal_with("gyro.csv", header), HasSubstr("gyro.csv has no samples"));
  EXPECT_THAT(refusal_with("gyro.csv", header.substr(0, header.size() - 1)), HasSubstr("gyro.csv has no samples"));
  write_text(directory_ / "gyro.csv", gyro_);
  EXPECT_THAT(refusal_with("star_tracker.csv", "t_s,q_x,q_y,q_z,q_w\n"), HasSubstr("no fix at all"));
}

TEST_F(PassCsv, WrittenPassIsReadBackToTheLastDecimal) {
  Pass pass = read_pass(directory_.path()).pass;
  pass.gyro.h[5] = std::nan("");
  pass.settings.spacecraft = "Odd \"name\" \\ in\nTOML";
  pass.settings.start_up = "the \"third\"";
  GyroPrior& prior = pass.settings.gyros[1];
  prior.drift_rad_s = {{DriftCoefficient::of_eq1(Esg7::kK0), 1e-6 / 3}, {DriftCoefficient::of_eq1(Esg7::kNu31), -2e-7}};
  prior.drift_sigma_rad_s = {{DriftCoefficient::of_eq1(Esg7::kK0), 1e-8}};
  prior.alignment_rotation_vector_rad = {1e-3, -2e-3 / 3, 0};
  prior.alignment_sigma_rad = {1e-4, 2e-4, 3e-4};
  pass.settings.prior = sample_calibration();
  const Truth truth = clean_truth();
  write_pass(directory_ / "copy", pass, &truth);
  const LoadedPass copy = read_pass(directory_ / "copy");
  expect_same_pass(pass, copy.pass, 5.01e-10, 5.01e-11);
  ASSERT_TRUE(copy.pass.settings.prior.has_value());
  EXPECT_EQ(copy.pass.settings.prior->covariance, pass.settings.prior->covariance);
}

TEST_F(PassCsv, PassWrittenWithoutTruthLeavesNoStaleTruthBehind) {
  const Pass pass = read_pass(directory_.path()).pass;
  Truth truth = clean_truth();
  write_pass(directory_ / "copy", pass, &truth);
  EXPECT_TRUE(read_truth(directory_ / "copy").has_value());
  write_pass(directory_ / "copy", pass, nullptr);
  EXPECT_FALSE(read_truth(directory_ / "copy").has_value());
}

TEST_F(PassCsv, WritingADirectoryOverAFileFails) {
  write_text(directory_ / "file", "x");
  EXPECT_THROW(write_pass(directory_ / "file", read_pass(directory_.path()).pass, nullptr), UsageError);
}

}  // namespace
}  // namespace trihedron::io
