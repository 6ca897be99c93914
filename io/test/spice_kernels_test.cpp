#include "trihedron/io/spice_kernels.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "fixtures.hpp"
#include "trihedron/io/attitude_message.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"

namespace trihedron::io::spice_test {
namespace {

using testing::HasSubstr;

template <class T>
T at(const std::string& bytes, std::size_t offset) {
  T value{};
  std::memcpy(&value, &bytes[offset], sizeof value);
  return value;
}

/// `count` epochs, of which every tenth begins a stretch; turning about x by a rate that grows: angle = t²/50 rad.
AttitudeHistory attitude_of(int count) {
  AttitudeHistory attitude;
  const Time begin = parse_epoch("2009-05-20T00:00:00.250").value();
  for (int i = 0; i < count; ++i) {
    const Duration since = std::chrono::milliseconds(125) * (i + 5 * (i / 10));
    attitude.t.push_back(begin + since);
    const double s = to_seconds(since);
    attitude.q_in_c.emplace_back(Eigen::AngleAxisd(s * s / 50, Eigen::Vector3d::UnitX()));
  }
  return attitude;
}

TEST(SpiceClock, CountsNanosecondsFromAWholeSecondOfTt) {
  const AttitudeHistory attitude = attitude_of(2);
  const SpiceClock clock = SpiceClock::of(attitude);
  // 2009-05-20T00:00:00.25 TAI is …:32.434 TT: 3426 days and 12 h 32 s of TT after J2000.
  EXPECT_EQ(clock.tt_since_j2000_s, 3426 * 86400LL + 43200 + 32);
  EXPECT_EQ(clock.zero, parse_epoch("2009-05-19T23:59:59.816").value());
  EXPECT_EQ(clock.ticks(attitude.t[0]), 434e6);
  AttitudeHistory longest = attitude;
  longest.t.back() = attitude.t[0] + std::chrono::days(105);
  EXPECT_THROW(static_cast<void>(SpiceClock::of(longest)), UsageError);
}

TEST(Ck, HasTheStructureOfADafOfType3) {
  const AttitudeHistory attitude = attitude_of(1234);
  const std::vector<std::size_t> bounds = stretches(attitude, usual_gap(attitude));
  ASSERT_EQ(bounds.size(), 125U);
  const SpiceClock clock = SpiceClock::of(attitude);
  const std::string bytes = format_ck(attitude, {}, clock, {-28380, "RESURS-DK1"}, bounds);
  ASSERT_EQ(bytes.size() % 1024, 0U);
  EXPECT_EQ(bytes.substr(0, 8), "DAF/CK  ");
  EXPECT_EQ(at<std::int32_t>(bytes, 8), 2);
  EXPECT_EQ(at<std::int32_t>(bytes, 12), 6);
  EXPECT_EQ(bytes.substr(88, 8), "LTL-IEEE");
  EXPECT_EQ(bytes.substr(699, 28), std::string_view("FTPSTR:\r:\n:\r\n:\r\0:\x81:\x10\xCE:ENDFTP", 28));
  const auto last = at<std::int32_t>(bytes, 1024 + 60);
  EXPECT_EQ(at<std::int32_t>(bytes, 84), last + 1);
  // Seven numbers and a time for each epoch, two directories, the interval starts, and the two counts.
  EXPECT_EQ(last - 385 + 1, 1234 * 8 + 12 + 124 + 1 + 2);
  const auto word = [&](std::int32_t address) { return at<double>(bytes, static_cast<std::size_t>(address - 1) * 8); };
  EXPECT_EQ(word(last), 1234);
  EXPECT_EQ(word(last - 1), 124);
  EXPECT_EQ(word(last - 2), clock.ticks(attitude.t[bounds[99]]));
  EXPECT_EQ(word(last - 3), clock.ticks(attitude.t[bounds[123]]));
  EXPECT_EQ(word(385 + 1234 * 8), clock.ticks(attitude.t[99]));
  // Scalar first, of the matrix to c from J2000; the rate in J2000 axes.
  const Eigen::Quaterniond& q = attitude.q_in_c[7];
  EXPECT_EQ(word(385 + 7 * 7), q.w());
  EXPECT_EQ(word(385 + 7 * 7 + 1), -q.x());
}

TEST(Ck, RatesAreTheDerivativeOfTheAttitude) {
  const AttitudeHistory attitude = attitude_of(25);
  const std::vector<std::size_t> bounds = {0, 10, 20, 24, 25};
  const std::vector<Eigen::Vector3d> rates = rates_of(attitude, {}, bounds);
  const auto true_rate = [&](std::size_t i) { return to_seconds(attitude.t[i] - attitude.t[0]) / 25; };
  for (const std::size_t i : {1U, 5U, 8U, 12U, 22U}) {
    EXPECT_NEAR(rates[i].x(), true_rate(i), 1e-12) << i;  // a parabola is met exactly
  }
  EXPECT_NEAR(rates[9].x(), true_rate(9), 0.0026);  // at the end of a stretch that of half a step before: 0.0625 s / 25
  EXPECT_EQ(rates[24], Eigen::Vector3d::Zero());
  const std::vector<Eigen::Vector3d> given(25, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(rates_of(attitude, given, bounds), given);
  // A quaternion of the other sign is the same attitude.
  AttitudeHistory flipped = attitude;
  flipped.q_in_c[5].coeffs() = -flipped.q_in_c[5].coeffs();
  EXPECT_LE((rates_of(flipped, {}, bounds)[5] - rates[5]).norm(), 1e-12);
}

TEST(Fk, NamesFramesThatSpiceTakes) {
  const SpiceObject object{-5, "a very long name of a spacecraft"};
  EXPECT_EQ(object.frame_name(), "A_VERY_LONG_NAME_OF_A_SP_C");
  EXPECT_LE(object.gyro_frame_name(3).size(), 26U);
  EXPECT_NO_THROW(expect_spice_object(object));
  EXPECT_THROW(expect_spice_object({0, "A"}), UsageError);
  EXPECT_THROW(expect_spice_object({-2'000'001, "A"}), UsageError);
  EXPECT_THROW(expect_spice_object({-5, ""}), UsageError);
  EXPECT_THROW(expect_spice_object({-5, "1A"}), UsageError);
  EXPECT_THROW(expect_spice_object({-5, "A\n"}), UsageError);
}

TEST(Fk, HasEveryLineShortEnoughForSpice) {
  const std::string text = format_calibration_frames(sample_calibration(), {-28380, "RESURS-DK1"});
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    EXPECT_LE(end - begin, 132U) << text.substr(begin, end - begin);
    begin = end + 1;
  }
  EXPECT_THAT(text, HasSubstr("FRAME_RESURS-DK1_GYRO2 = -28380002"));
  EXPECT_THAT(text, HasSubstr("TKFRAME_-28380001_RELATIVE = 'RESURS-DK1_C'"));
}

}  // namespace
}  // namespace trihedron::io::spice_test
