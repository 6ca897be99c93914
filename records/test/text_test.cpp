#include "trihedron/records/text.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "trihedron/records/scenario.hpp"

namespace trihedron {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Text, WhatPeopleWriteStaysAsItIs) {
  for (const char* text : {"", "RESURS-DK1", "Ресурс-ДК1", "θ = 5″ — 6′ 🛰", "C:\\pass"}) {
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Text, WhatATerminalObeysIsShownInstead) {
  EXPECT_EQ(printable("\x1b[31mred\x07"), "\\x1b[31mred\\x07");
  EXPECT_EQ(printable("two\nlines\r\t."), "two\\x0alines\\x0d\\x09.");
  EXPECT_EQ(printable("\xC2\x9B"), "\\u{9b}") << "the one-byte form of ESC [";
  EXPECT_EQ(printable("\xE2\x80\xAE"), "\\u{202e}") << "writes from right to left";
  EXPECT_EQ(printable("\x7f"), "\\x7f");
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
}

TEST(ShellWord, IsQuotedWhereAShellWouldReadAnythingElse) {
  EXPECT_EQ(shell_word("../out/run-1.nc"), "../out/run-1.nc");
  EXPECT_EQ(shell_word("a b"), "'a b'");
  EXPECT_EQ(shell_word("it's $HOME"), R"('it'\''s $HOME')");
  EXPECT_EQ(shell_word("~"), "'~'");
  EXPECT_EQ(shell_word(""), "''");
}

TEST(Text, BytesThatAreNoUtf8AreShownAsNumbers) {
  EXPECT_EQ(printable("p\xFFss"), "p\\xffss");
  EXPECT_EQ(printable("\xC3"), "\\xc3") << "cut short";
  EXPECT_EQ(printable("\xC0\xAF"), "\\xc0\\xaf") << "an overlong slash";
  EXPECT_EQ(printable("\xE0\x80\x9B"), "\\xe0\\x80\\x9b") << "an overlong CSI";
  EXPECT_EQ(printable("\xED\xA0\x80"), "\\xed\\xa0\\x80") << "half of a pair of UTF-16";
  EXPECT_EQ(printable("\xF4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond Unicode";
  EXPECT_EQ(printable("\xE2\x28\xA1"), "\\xe2(\\xa1");
}

TEST(Text, OfATimeIsIso8601) {
  EXPECT_EQ(iso_time(Time{}), "1958-01-01T00:00:00");
  EXPECT_EQ(iso_time(Scenario{}.epoch + std::chrono::milliseconds(3600250)), "2009-05-20T01:00:00.250000000");
}

TEST(Text, LinesKeepTheirEnds) { EXPECT_EQ(printable_lines("a\nb\r\x1b\n"), "a\nb\\x0d\\x1b\n"); }

TEST(Text, TheNearestNameIsFound) {
  const std::array<std::string_view, 3> known = {"calibrate", "navigate", "period_s"};
  EXPECT_EQ(nearest("calibrat", known), "calibrate");
  EXPECT_EQ(nearest("navgiate", known), "navigate");
  EXPECT_EQ(nearest("period", known), "period_s");
  EXPECT_EQ(nearest("xyzzy and more", known), "");
  EXPECT_EQ(nearest("", known), "");
  EXPECT_EQ(nearest("calibrate", {}), "");
  EXPECT_EQ(nearest(std::string(100000, 'c'), known), "");
}

TEST(Text, AnglesHaveTheUnitOfTheirSize) {
  EXPECT_EQ(angle_text(0.048 * kArcminute), "2.88″");
  EXPECT_EQ(angle_text(-30 * kArcminute), "-30.0′");
  EXPECT_EQ(angle_text(30 * kDegree), "30.0°");
  EXPECT_EQ(angle_text(3.1e-4 * kArcsecond), "0.000310″");
  EXPECT_EQ(angle_text(0), "0.00″");
}

TEST(Text, AnAngleThatIsNoneIsSaid) {
  for (const double none : {kInfinity, -kInfinity, std::nan("")}) {
    EXPECT_EQ(angle_text(none), "not determined");
  }
}

TEST(Text, OneUnitForAColumnIsThatOfItsMiddle) {
  const std::vector<double> errors = {30 * kArcminute, 20 * kArcsecond, 0.048 * kArcminute, kInfinity, 0};
  EXPECT_STREQ(unit_of_angles(errors).symbol, "″");
  EXPECT_STREQ(unit_of_angles(std::vector<double>{30 * kArcminute, 20 * kArcminute, kArcsecond}).symbol, "′");
  EXPECT_STREQ(unit_of_angles({}).symbol, "″");
}

}  // namespace
}  // namespace trihedron
