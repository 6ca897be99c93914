#include "trihedron/io/quantity.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "trihedron/io/error.hpp"

namespace trihedron::io {
namespace {

using testing::HasSubstr;

template <class Value>
std::string usage_error(Value (*parse)(std::string_view), std::string_view text) {
  try {
    static_cast<void>(parse(text));
  } catch (const UsageError& error) {
    return error.what();
  }
  return {};
}

TEST(Quantity, ReadsDurationsInEveryUnit) {
  EXPECT_EQ(parse_duration("90min"), std::chrono::minutes(90));
  EXPECT_EQ(parse_duration("3s"), std::chrono::seconds(3));
  EXPECT_EQ(parse_duration(" 2 h "), std::chrono::hours(2));
  EXPECT_EQ(parse_duration("10ms"), std::chrono::milliseconds(10));
  EXPECT_EQ(parse_duration("0.1s"), std::chrono::milliseconds(100));
  EXPECT_EQ(parse_duration("1.5us"), Duration(1500));
  EXPECT_EQ(parse_duration("7ns"), Duration(7));
  EXPECT_EQ(parse_duration("1e1d"), std::chrono::days(10));
  EXPECT_EQ(parse_duration("0s"), Duration::zero());
}

TEST(Quantity, ReadsNegativeDurationsOnlyWhereTheyAreAllowed) {
  EXPECT_EQ(parse_signed_duration("-10ms"), std::chrono::milliseconds(-10));
  EXPECT_THAT(usage_error(parse_duration, "-10ms"), HasSubstr("must not be negative"));
}

TEST(Quantity, ReadsAnglesRatesAndRandomWalks) {
  constexpr double kPi = std::numbers::pi;
  EXPECT_DOUBLE_EQ(parse_angle_rad("5arcmin"), 5 * kPi / 10800);
  EXPECT_DOUBLE_EQ(parse_angle_rad("2arcsec"), 2 * kPi / 648000);
  EXPECT_DOUBLE_EQ(parse_angle_rad("0.5deg"), kPi / 360);
  EXPECT_EQ(parse_angle_rad("1e-5rad"), 1e-5);
  EXPECT_EQ(parse_angle_rad("-1rad"), -1);
  EXPECT_DOUBLE_EQ(parse_rate_rad_s("0.1deg/h"), kPi / 1800 / 3600);
  EXPECT_EQ(parse_rate_rad_s("1e-6rad/s"), 1e-6);
  EXPECT_EQ(parse_random_walk_rad_sqrt_s("1e-8rad/s^0.5"), 1e-8);
  EXPECT_DOUBLE_EQ(parse_random_walk_rad_sqrt_s("0.001deg/h^0.5"), 0.001 * kPi / 180 / 60);
  EXPECT_EQ(parse_number("-2.5e3"), -2500);
}

TEST(Quantity, ReadsANeedAndGivesItBack) {
  const Need need = parse_need("5arcmin for 270min");
  EXPECT_DOUBLE_EQ(need.error_rad, parse_angle_rad("5arcmin"));
  EXPECT_EQ(need.interval, std::chrono::minutes(270));
  EXPECT_EQ(format_need(need), "5arcmin for 270min");
  EXPECT_EQ(parse_need(" 30 arcsec for 4.5h ").interval, std::chrono::minutes(270));
  for (const char* text : {"5arcmin", "5arcmin 270min", "", "for", "5arcmin for270min"}) {
    EXPECT_THAT(usage_error(parse_need, text), HasSubstr("5arcmin for 270min")) << text;
  }
  EXPECT_THAT(usage_error(parse_need, "5arcmin for 270"), HasSubstr("unit"));
  EXPECT_THAT(usage_error(parse_need, "270min for 5arcmin"), HasSubstr("an angle"));
  EXPECT_THAT(usage_error(parse_need, "-5arcmin for 270min"), HasSubstr("outside"));
  EXPECT_THAT(usage_error(parse_need, "5arcmin for 1000d"), HasSubstr("month"));
}

TEST(Quantity, RefusesBareNumberSayingWhichUnitsAreAccepted) {
  EXPECT_THAT(usage_error(parse_duration, "90"),
              HasSubstr("the unit is missing; accepted units: d, h, min, s, ms, us, ns"));
  EXPECT_THAT(usage_error(parse_angle_rad, "5"), HasSubstr("accepted units: deg, arcmin, arcsec, rad"));
  EXPECT_THAT(usage_error(parse_rate_rad_s, "5"), HasSubstr("deg/h"));
  EXPECT_THAT(usage_error(parse_random_walk_rad_sqrt_s, "5"), HasSubstr("deg/h^0.5"));
}

TEST(Quantity, TellsARangeInTheUnitThatWasGiven) {
  const auto angle = [](std::string_view text) { return parse_angle_rad(text, limits::kAttitudeLimit_rad); };
  EXPECT_DOUBLE_EQ(angle("180deg"), std::numbers::pi);
  EXPECT_THAT(usage_error(+angle, "400deg"), HasSubstr("\"400deg\" is outside 5.72958e-08 to 180.481 deg: an error"));
  const auto duration = [](std::string_view text) { return parse_duration(text, {60, 3600, "s", "because"}); };
  EXPECT_EQ(duration("1h"), std::chrono::hours(1));
  EXPECT_THAT(usage_error(+duration, "61min"), HasSubstr("\"61min\" is outside 1 to 60 min: because"));
  EXPECT_THAT(usage_error(+duration, "-1min"), HasSubstr("must not be negative"));
}

std::string refusal_of_angle(const std::string& text, const Range& range) {
  try {
    static_cast<void>(parse_angle_rad(text, range));
  } catch (const UsageError& error) {
    return error.what();
  }
  return {};
}

TEST(Quantity, TakesTheEndsOfARangeAsTheyAreTold) {
  for (const char* unit : {"deg", "arcmin", "arcsec", "rad"}) {
    for (const Range& range : {limits::kAttitudeLimit_rad, limits::kHalfTurn_rad, limits::kAngle_rad}) {
      const std::string refused = refusal_of_angle(std::string("1e9") + unit, range);
      const std::string ends = refused.substr(refused.find("outside ") + 8);
      EXPECT_EQ(refusal_of_angle(ends.substr(0, ends.find(' ')) + unit, range), "") << refused;
      const std::string most = ends.substr(ends.find("to ") + 3);
      EXPECT_EQ(refusal_of_angle(most.substr(0, most.find(' ')) + unit, range), "") << refused;
    }
  }
}

TEST(Quantity, RefusesGarbageNotFiniteOverflowAndUnitsOfAnotherKind) {
  for (const char* text : {"", " ", "min", "nanmin", "infs", "-infs", "1e999s", "1e300h", "--1s", "5 arcmin", "5min!",
                           "5s s", "1e-12s", "300000d", "0x10s", "1,5s"}) {
    EXPECT_NE(usage_error(parse_signed_duration, text), "") << text;
  }
  for (const char* text : {"", "nan", "inf", "5s", "1e999rad", "5arcmin/s", "5Deg"}) {
    EXPECT_NE(usage_error(parse_angle_rad, text), "") << text;
  }
  EXPECT_NE(usage_error(parse_rate_rad_s, "5deg"), "");
  EXPECT_NE(usage_error(parse_random_walk_rad_sqrt_s, "5deg/h"), "");
  for (const char* text : {"", "nan", "1e999", "5s", "5 5"}) {
    EXPECT_NE(usage_error(parse_number, text), "") << text;
  }
}

TEST(Quantity, FormatsTheWayAPersonWrites) {
  EXPECT_EQ(format_duration(std::chrono::minutes(90)), "90min");
  EXPECT_EQ(format_duration(std::chrono::milliseconds(-125)), "-125ms");
  EXPECT_EQ(format_duration(Duration::zero()), "0s");
  EXPECT_EQ(format_angle(parse_angle_rad("5arcmin")), "5arcmin");
  EXPECT_EQ(format_angle(parse_angle_rad("2arcsec")), "2arcsec");
  EXPECT_EQ(format_angle(1e-5), "1e-05rad");
  EXPECT_EQ(format_rate(parse_rate_rad_s("0.1deg/h")), "0.1deg/h");
  EXPECT_EQ(format_random_walk(parse_random_walk_rad_sqrt_s("0.001deg/h^0.5")), "0.001deg/h^0.5");
}

RC_GTEST_PROP(Quantity, FormattedDurationsComeBackExactlyBelow104Days, ()) {
  // Beyond 2^53 ns a duration in an odd number of nanoseconds is no double any more.
  const auto ns = *rc::gen::inRange<std::int64_t>(-(std::int64_t{1} << 53), std::int64_t{1} << 53);
  RC_ASSERT(parse_signed_duration(format_duration(Duration(ns))) == Duration(ns));
}

RC_GTEST_PROP(Quantity, FormattedAnglesRatesAndRandomWalksComeBackBitForBit, (double value)) {
  RC_PRE(std::isfinite(value));
  RC_ASSERT(parse_angle_rad(format_angle(value)) == value);
  RC_ASSERT(parse_rate_rad_s(format_rate(value)) == value);
  RC_ASSERT(parse_random_walk_rad_sqrt_s(format_random_walk(value)) == value);
}

}  // namespace
}  // namespace trihedron::io
