#include "trihedron/io/attitude_message.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "fixtures.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/time_text.hpp"

namespace trihedron::io::aem_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::AllOf;
using testing::HasSubstr;

constexpr std::string_view kCreated = "2026-01-02T03:04:05";

Time tai(std::string_view text) { return parse_epoch(text).value(); }

/// Turning about a skew axis, every 125 ms; rows from 40 to 59 are missing.
struct Turning {
  AttitudeHistory attitude;
  std::vector<Eigen::Vector3d> rate_rad_s;
};

Turning turning(bool rates) {
  Turning result;
  AttitudeHistory& attitude = result.attitude;
  const Eigen::Vector3d axis = Eigen::Vector3d(0.3, -0.7, 0.5).normalized();
  for (int i = 0; i < 100; ++i) {
    if (i >= 40 && i < 60) {
      continue;
    }
    attitude.t.push_back(tai("2009-05-20T00:00:00") + i * milliseconds(125) + Duration(i));
    attitude.q_in_c.emplace_back(Eigen::AngleAxisd(0.1 + 0.031 * i, axis));
    if (rates) {
      result.rate_rad_s.push_back(0.248 * axis);
    }
  }
  return result;
}

MessageDescription description(TimeScale scale) {
  MessageDescription d;
  d.object_name = "RESURS-DK1 <1> & \"2\"";
  d.object_id = "2006-021A";
  d.time_scale = scale;
  d.created_utc = kCreated;
  return d;
}

class EveryMessage : public testing::TestWithParam<std::tuple<TimeScale, MessageSyntax, bool>> {};

TEST_P(EveryMessage, ComesBackWithEveryEpochAndQuaternion) {
  const auto [scale, syntax, rates] = GetParam();
  const auto [attitude, rate_rad_s] = turning(rates);
  const Time epoch = tai("2009-05-19T23:59:00.5");
  const std::string text = format_aem(attitude, rate_rad_s, epoch, description(scale), usual_gap(attitude), syntax);
  const AttitudeMessage back = parse_attitude_message(text, "a.aem");
  EXPECT_EQ(back.epoch, epoch);
  EXPECT_EQ(back.object_name, "RESURS-DK1 <1> & \"2\"");
  EXPECT_EQ(back.object_id, "2006-021A");
  EXPECT_EQ(back.inertial_frame, "GCRF");
  EXPECT_EQ(back.body_frame, "SC_BODY_1");
  EXPECT_EQ(back.time_system, name_of(scale));
  EXPECT_EQ(back.segments, 2U);
  EXPECT_EQ(back.left_out, 0U);
  EXPECT_EQ(back.attitude.t, attitude.t);
  ASSERT_EQ(back.rate_rad_s.size(), rate_rad_s.size());
  for (std::size_t i = 0; i < attitude.size(); ++i) {
    // 16 digits of numbers below 1: half of 1e-16, and the rounding of the binary number.
    EXPECT_LE((back.attitude.q_in_c[i].coeffs() - attitude.q_in_c[i].coeffs()).cwiseAbs().maxCoeff(), 1.2e-16);
    if (rates) {
      EXPECT_LE((back.rate_rad_s[i] - rate_rad_s[i]).norm(), 1e-16);
    }
  }
  EXPECT_EQ(format_aem(back.attitude, back.rate_rad_s, epoch, description(scale), usual_gap(attitude), syntax).size(),
            text.size());
}

INSTANTIATE_TEST_SUITE_P(Aem, EveryMessage,
                         testing::Combine(testing::Values(TimeScale::kTai, TimeScale::kUtc, TimeScale::kGps,
                                                          TimeScale::kTt, TimeScale::kTdb),
                                          testing::Values(MessageSyntax::kKvn, MessageSyntax::kXml), testing::Bool()));

// ---- Time scales

TEST(TimeText, IsWhatEachScaleShows) {
  const Time t = tai("2009-05-20T00:00:00");
  EXPECT_EQ(TimeText(TimeScale::kTai).format(t), "2009-05-20T00:00:00");
  EXPECT_EQ(TimeText(TimeScale::kUtc).format(t), "2009-05-19T23:59:26");
  EXPECT_EQ(TimeText(TimeScale::kGps).format(t), "2009-05-19T23:59:41");
  EXPECT_EQ(TimeText(TimeScale::kTt).format(t), "2009-05-20T00:00:32.184000000");
  // TDB − TT = 1.657 ms sin(E) with E = M + 0.01671 sin M, M = 6.239996 + 1.99096871e-7 (TT − J2000): good to 5e-5 s.
  const double since_j2000_s = to_seconds(t - tai("2000-01-01T12:00:00")) + 32.184;
  const double m = 6.239996 + 1.99096871e-7 * since_j2000_s;
  const double expected_s = 1.657e-3 * std::sin(m + 0.01671 * std::sin(m));
  const Time as_tdb = tai(TimeText(TimeScale::kTdb).format(t));
  EXPECT_NEAR(to_seconds(as_tdb - t) - 32.184, expected_s, 5e-5);
}

TEST(TimeText, CountsThroughALeapSecond) {
  TimeText utc(TimeScale::kUtc);
  // TAI − UTC became 34 s at the end of 2008.
  EXPECT_EQ(utc.format(tai("2009-01-01T00:00:32.5")), "2008-12-31T23:59:59.500000000");
  EXPECT_EQ(utc.format(tai("2009-01-01T00:00:33")), "2008-12-31T23:59:60");
  EXPECT_EQ(utc.format(tai("2009-01-01T00:00:33.999999999")), "2008-12-31T23:59:60.999999999");
  EXPECT_EQ(utc.format(tai("2009-01-01T00:00:34")), "2009-01-01T00:00:00");
  TimeText::Fault fault;
  for (std::int64_t ms = -3000; ms < 3000; ms += 250) {
    const Time t = tai("2009-01-01T00:00:33") + milliseconds(ms);
    EXPECT_EQ(utc.parse(utc.format(t), fault), t) << ms;
  }
}

TEST(TimeText, ReadsDayOfYearFractionsAndZulu) {
  TimeText::Fault fault;
  TimeText tai_text(TimeScale::kTai);
  EXPECT_EQ(tai_text.parse("2009-140T00:00:00.125", fault), tai("2009-05-20T00:00:00.125"));
  EXPECT_EQ(tai_text.parse("2008-366T00:00:00", fault), tai("2008-12-31T00:00:00"));
  EXPECT_EQ(tai_text.parse("2009-05-20T00:00:00.1234567894999", fault), tai("2009-05-20T00:00:00.123456789"));
  EXPECT_EQ(tai_text.parse("2009-05-20T23:59:59.9999999996", fault), tai("2009-05-21T00:00:00"));
  EXPECT_EQ(TimeText(TimeScale::kUtc).parse("2009-05-20T00:00:00Z", fault), tai("2009-05-20T00:00:34"));
}

TEST(TimeText, RefusesWhatIsNoTime) {
  TimeText::Fault fault;
  for (const char* text :
       {"", "2009", "2009-05-20", "2009-05-20 00:00:00", "2009-5-20T00:00:00", "2009-02-29T00:00:00",
        "2009-366T00:00:00", "2009-000T00:00:00", "2009-05-20T24:00:00", "2009-05-20T00:60:00", "2009-05-20T00:00:61",
        "2009-05-20T00:00:00.", "2009-05-20T00:00:00,5", "2009-05-20T00:00:00 ", "2009-05-20T00:00:00+01:00",
        "1957-12-31T00:00:00", "2201-01-01T00:00:00", "2009-05-20T-1:00:00", "2009-05-20T12:59:60"}) {
    EXPECT_FALSE(TimeText(TimeScale::kTai).parse(text, fault)) << text;
    EXPECT_THAT(fault.reason, HasSubstr("is no time")) << text;
  }
  EXPECT_FALSE(TimeText(TimeScale::kTai).parse("2009-05-20T00:00:00Z", fault));
  EXPECT_THAT(fault.reason, HasSubstr("ends with Z"));
  EXPECT_FALSE(TimeText(TimeScale::kTai).parse("2008-12-31T23:59:60", fault));
  EXPECT_THAT(fault.reason, HasSubstr("leap second that there is not"));
  EXPECT_FALSE(TimeText(TimeScale::kUtc).parse("2009-12-31T23:59:60", fault));
  EXPECT_THAT(fault.reason, HasSubstr("leap second that there is not"));
  for (const char* text : {"1971-12-31T00:00:00", "2199-01-01T00:00:00"}) {
    EXPECT_FALSE(TimeText(TimeScale::kUtc).parse(text, fault)) << text;
    EXPECT_THAT(fault.reason, HasSubstr("leap seconds"));
  }
  EXPECT_THROW(static_cast<void>(TimeText(TimeScale::kUtc).format(tai("1971-01-01T00:00:00"))), UsageError);
  EXPECT_THROW(static_cast<void>(TimeText(TimeScale::kUtc).format(tai("2199-01-01T00:00:00"))), UsageError);
}

// ---- Direction of the quaternion

std::string kvn(const std::string& metadata, const std::string& data, const std::string& version = "2.0") {
  return "CCSDS_AEM_VERS = " + version + "\nCREATION_DATE = 2026-01-02T03:04:05\nORIGINATOR = ME\nMETA_START\n" +
         metadata + "META_STOP\nDATA_START\n" + data + "DATA_STOP\n";
}

std::string metadata(const std::string& a, const std::string& b, const std::string& more,
                     const std::string& type = "QUATERNION") {
  return "OBJECT_NAME = S\nOBJECT_ID = 2006-021A\nREF_FRAME_A = " + a + "\nREF_FRAME_B = " + b +
         "\nTIME_SYSTEM = TAI\nSTART_TIME = 2009-05-20T00:00:00\nSTOP_TIME = 2009-05-20T00:00:10\nATTITUDE_TYPE = " +
         type + "\n" + more;
}

AttitudeHistory read(const std::string& text) { return parse_attitude_message(text, "a.aem").attitude; }

TEST(Aem, TurnsTheExampleOfTheStandardAsTheStandardDoes) {
  // Annex F2.2: B is A turned by +90° about Z, Q = 0 0 0.7071 0.7071, and the X axis of A is (0, −1, 0) in B.
  const AttitudeHistory attitude = read(
      kvn(metadata("ICRF", "SC_BODY_1", ""), "2009-05-20T00:00:00 0.0 0.0 0.70710678118654752 0.70710678118654752\n"));
  const Eigen::Vector3d x_in_c = attitude.q_in_c[0].conjugate() * Eigen::Vector3d::UnitX();
  EXPECT_LE((x_in_c - Eigen::Vector3d(0, -1, 0)).norm(), 1e-15);
}

TEST(Aem, TakesEitherDirectionAndOrder) {
  const std::string first = "2009-05-20T00:00:00 ";
  const Eigen::Quaterniond expected(0.8, 0.36, 0.48, 0);
  const std::vector<std::string> texts = {
      kvn(metadata("ICRF", "SC_BODY_1", ""), first + "0.36 0.48 0 0.8\n"),
      kvn(metadata("sc body 1", "j2000", ""), first + "-0.36 -0.48 0 0.8\n"),
      kvn(metadata("EME2000", "INSTRUMENT_A", "ATTITUDE_DIR = A2B\nQUATERNION_TYPE = LAST\n"),
          first + "0.36 0.48 0 0.8\n", "1.0"),
      kvn(metadata("ICRF", "SC_BODY_1", "ATTITUDE_DIR = B2A\nQUATERNION_TYPE = FIRST\n"), first + "0.8 -0.36 -0.48 0\n",
          "1.0"),
      kvn(metadata("SC_BODY_1", "GCRF", "ATTITUDE_DIR = B2A\nQUATERNION_TYPE = LAST\n"), first + "0.36 0.48 0 0.8\n",
          "1.0"),
      kvn(metadata("SC_BODY_1", "ICRF", "ATTITUDE_DIR = A2B\nQUATERNION_TYPE = LAST\n"), first + "-0.36 -0.48 0 0.8\n",
          "1.0"),
      kvn(metadata("ICRF", "SC_BODY_1", "ATTITUDE_DIR = A2B\nQUATERNION_TYPE = LAST\n", "QUATERNION/RATE"),
          first + "0.36 0.48 0 0.8 1 2 3\n", "1.0")};
  for (const std::string& text : texts) {
    EXPECT_EQ(read(text).q_in_c[0].coeffs(), expected.coeffs()) << text;
  }
}

TEST(Aem, GivesTheSameRateInWhateverFrameItIsWritten) {
  // A body that turns by ω (c axes) from an attitude that is not simple.
  const Eigen::Quaterniond q(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -2).normalized()));
  const Eigen::Vector3d omega_c(0.01, -0.02, 0.03);
  const Eigen::Vector3d omega_in = q * omega_c;
  const Eigen::Quaterniond half(0, omega_c.x() / 2, omega_c.y() / 2, omega_c.z() / 2);
  const Eigen::Quaterniond q_dot = q * half;
  const auto row = [](const Eigen::Quaterniond& a, const std::vector<double>& more) {
    std::string text = fmt::format("2009-05-20T00:00:00 {:.17g} {:.17g} {:.17g} {:.17g}", a.x(), a.y(), a.z(), a.w());
    for (const double value : more) {
      text += fmt::format(" {:.17g}", value);
    }
    return text + "\n";
  };
  const auto degrees = [](const Eigen::Vector3d& rate) {
    const Eigen::Vector3d d = rate * (180 / std::numbers::pi);
    return std::vector<double>{d.x(), d.y(), d.z()};
  };
  const std::string old = "ATTITUDE_DIR = B2A\nQUATERNION_TYPE = LAST\n";
  const std::vector<std::string> texts = {
      kvn(metadata("ICRF", "SC_BODY_1", "ANGVEL_FRAME = SC_BODY_1\n", "QUATERNION/ANGVEL"), row(q, degrees(omega_c))),
      kvn(metadata("ICRF", "SC_BODY_1", "ANGVEL_FRAME = REF_FRAME_B\n", "QUATERNION/ANGVEL"), row(q, degrees(omega_c))),
      kvn(metadata("ICRF", "SC_BODY_1", "ANGVEL_FRAME = ICRF\n", "QUATERNION/ANGVEL"), row(q, degrees(omega_in))),
      // The rate of the inertial frame in the body's is the opposite.
      kvn(metadata("SC_BODY_1", "ICRF", "ANGVEL_FRAME = SC_BODY_1\n", "QUATERNION/ANGVEL"),
          row(q.conjugate(), degrees(-omega_c))),
      kvn(metadata("SC_BODY_1", "ICRF", "ANGVEL_FRAME = REF_FRAME_B\n", "QUATERNION/ANGVEL"),
          row(q.conjugate(), degrees(-omega_in))),
      kvn(metadata("ICRF", "SC_BODY_1", "", "QUATERNION/DERIVATIVE"),
          row(q, {q_dot.x(), q_dot.y(), q_dot.z(), q_dot.w()})),
      kvn(metadata("ICRF", "SC_BODY_1", old, "QUATERNION/DERIVATIVE"),
          row(q.conjugate(), {-q_dot.x(), -q_dot.y(), -q_dot.z(), q_dot.w()}), "1.0")};
  for (const std::string& text : texts) {
    const AttitudeMessage message = parse_attitude_message(text, "a.aem");
    ASSERT_EQ(message.rate_rad_s.size(), 1U) << text;
    EXPECT_LE((message.attitude.q_in_c[0].coeffs() - q.coeffs()).norm(), 1e-15) << text;
    EXPECT_LE((message.rate_rad_s[0] - omega_c).norm(), 1e-16) << text;
  }
}

// ---- Segments

TEST(Aem, LeavesOutWhatIsNotUseable) {
  const std::string useable = "USEABLE_START_TIME = 2009-05-20T00:00:01\nUSEABLE_STOP_TIME = 2009-05-20T00:00:02\n";
  const AttitudeMessage message = parse_attitude_message(
      kvn(metadata("ICRF", "SC_BODY_1", useable),
          "2009-05-20T00:00:00 0 0 0 1\n2009-05-20T00:00:01 0 0 0 1\n2009-05-20T00:00:02 0 0 0 1\n"
          "2009-05-20T00:00:03 0 0 0 1\n"),
      "a.aem");
  EXPECT_EQ(message.left_out, 2U);
  EXPECT_EQ(message.attitude.t, (std::vector<Time>{tai("2009-05-20T00:00:01"), tai("2009-05-20T00:00:02")}));
}

TEST(Aem, TakesTheLaterOfTwoSegmentsWhereTheyMeet) {
  const std::string m = metadata("ICRF", "SC_BODY_1", "");
  const std::string second =
      m.substr(0, m.find("START_TIME")) + "START_TIME = 2009-05-20T00:00:02\n" + m.substr(m.find("STOP_TIME"));
  const AttitudeMessage message = parse_attitude_message(
      kvn(m, "2009-05-20T00:00:00 0 0 0 1\n2009-05-20T00:00:02 0 0 0 1\n") + "META_START\n" + second +
          "META_STOP\nDATA_START\n2009-05-20T00:00:02 0 0 1 0\n2009-05-20T00:00:04 0 0 1 0\nDATA_STOP\n",
      "a.aem");
  EXPECT_EQ(message.segments, 2U);
  EXPECT_EQ(message.left_out, 1U);
  ASSERT_EQ(message.attitude.size(), 3U);
  EXPECT_EQ(message.attitude.q_in_c[1].z(), 1);
}

TEST(Aem, EndsLinesInEveryWay) {
  const std::string text = kvn(metadata("ICRF", "SC_BODY_1", ""), "2009-05-20T00:00:00 0 0 0 1\n");
  for (const char* end : {"\r\n", "\n\r", "\r", "\n\n", "  \n"}) {
    std::string changed;
    for (const char c : text) {
      changed += c == '\n' ? std::string(end) : std::string(1, c);
    }
    EXPECT_EQ(read(changed).size(), 1U);
  }
}

TEST(Aem, IsReadWhereverAnAttitudeIs) {
  const TemporaryDirectory directory;
  write_text(directory / "a.csv", kvn(metadata("ICRF", "SC_BODY_1", ""), "2009-05-20T00:00:05 0 0 0 1\n"));
  const AttitudeHistory attitude = read_attitude(directory / "a.csv", tai("2001-01-01T00:00:00"));
  EXPECT_EQ(attitude.t, (std::vector<Time>{tai("2009-05-20T00:00:05")}));
  write_text(directory / "b.csv", "t_s,q_x,q_y,q_z,q_w\n1,0,0,0,1\n");
  EXPECT_THROW(static_cast<void>(read_attitude_of_any_format(directory / "b.csv", std::nullopt)), UsageError);
}

TEST(Aem, IsNotWrittenWithWhatItCannotHold) {
  const AttitudeHistory attitude = turning(false).attitude;
  const auto write = [&](const MessageDescription& d) {
    static_cast<void>(format_aem(attitude, {}, attitude.t[0], d, seconds(1), MessageSyntax::kKvn));
  };
  MessageDescription d = description(TimeScale::kTai);
  d.object_name = "Ресурс";
  EXPECT_THROW(write(d), UsageError);
  d = description(TimeScale::kTai);
  d.object_id = "a\nb";
  EXPECT_THROW(write(d), UsageError);
  d = description(TimeScale::kTai);
  d.originator = " ";
  EXPECT_THROW(write(d), UsageError);
  d = description(TimeScale::kTai);
  d.inertial_frame = "ITRF2014";
  EXPECT_THROW(write(d), UsageError);
  d = description(TimeScale::kTai);
  d.body_frame = "BODY";
  EXPECT_THROW(write(d), UsageError);
}

// ---- Damaged messages: each edit of a good one, and what the refusal says.

struct Damage {
  std::string from;
  std::string to;
  std::string reason;
};

std::string changed(std::string text, const Damage& damage) {
  const std::size_t at = text.find(damage.from);
  EXPECT_NE(at, std::string::npos) << damage.from;
  return text.replace(at, damage.from.size(), damage.to);
}

std::string refusal_of(const std::string& text) {
  return refusal([&] { static_cast<void>(parse_attitude_message(text, "a.aem")); });
}

const std::string& good(MessageSyntax syntax) {
  static const auto make = [](MessageSyntax s) {
    const auto [attitude, rate_rad_s] = turning(true);
    MessageDescription d = description(TimeScale::kTai);
    d.object_name = "RESURS-DK1";
    return format_aem(attitude, rate_rad_s, tai("2009-05-20T00:00:00"), d, usual_gap(attitude), s);
  };
  static const std::string kKvn = make(MessageSyntax::kKvn);
  static const std::string kXml = make(MessageSyntax::kXml);
  return syntax == MessageSyntax::kKvn ? kKvn : kXml;
}

TEST(DamagedAem, OfTextIsRefusedWithTheReason) {
  const std::vector<Damage> damages = {
      {"CCSDS_AEM_VERS = 2.0", "CCSDS_AEM_VERS = 3.0", "version \"3.0\" of the AEM is not known; give"},
      {"CCSDS_AEM_VERS = 2.0", "CCSDS_AEM_VERS =", "version \"\""},
      {"CCSDS_AEM_VERS = 2.0", "CCSDS_OEM_VERS = 2.0", "does not begin with CCSDS_AEM_VERS"},
      {"CCSDS_AEM_VERS = 2.0", "CCSDS_AEM_VERS = 1.0", "\"ANGVEL_FRAME\" is no keyword"},
      {"CREATION_DATE = 2026-01-02T03:04:05\n", "", "a.aem:5:1: the header has no CREATION_DATE"},
      {"CREATION_DATE = 2026-01-02T03:04:05", "CREATION_DATE = yesterday", "CREATION_DATE: \"yesterday\" is no time"},
      {"ORIGINATOR = TRIHEDRON\n", "", "the header has no ORIGINATOR"},
      {"ORIGINATOR = TRIHEDRON\n", "ORIGINATOR = A\nORIGINATOR = B\n", "a.aem:5:1: ORIGINATOR is there twice"},
      {"ORIGINATOR = TRIHEDRON\n", "ORIGINATER = A\n", "did you mean \"ORIGINATOR\"?"},
      {"ORIGINATOR = TRIHEDRON\n", "ORIGINATOR =\n", "ORIGINATOR has no value"},
      {"OBJECT_NAME = RESURS-DK1\n", "", "the metadata has no OBJECT_NAME"},
      {"OBJECT_ID = 2006-021A\n", "", "the metadata has no OBJECT_ID"},
      {"REF_FRAME_A = GCRF\n", "", "the metadata has no REF_FRAME_A"},
      {"REF_FRAME_B = SC_BODY_1\n", "", "the metadata has no REF_FRAME_B"},
      {"TIME_SYSTEM = TAI\n", "", "the metadata has no TIME_SYSTEM"},
      {"START_TIME = 2009-05-20T00:00:00\n", "", "the metadata has no START_TIME"},
      {"STOP_TIME = 2009-05-20T00:00:04.875000039\n", "", "the metadata has no STOP_TIME"},
      {"ATTITUDE_TYPE = QUATERNION/ANGVEL\n", "", "the metadata has no ATTITUDE_TYPE"},
      {"ANGVEL_FRAME = SC_BODY_1\n", "", "the metadata has no ANGVEL_FRAME"},
      {"OBJECT_ID = 2006-021A\n", "OBJECT_ID = 2006-021A\nOBJECT_ID = 2006-021A\n", "OBJECT_ID is there twice"},
      {"REF_FRAME_A = GCRF", "REF_FRAME_A = ITRF2014", "\"ITRF2014\" is neither an inertial frame nor"},
      {"REF_FRAME_A = GCRF", "REF_FRAME_A = LVLH", "\"LVLH\" is neither"},
      {"REF_FRAME_A = GCRF", "REF_FRAME_A = SC_BODY_2", "both frames are of the spacecraft"},
      {"REF_FRAME_B = SC_BODY_1", "REF_FRAME_B = EME2000", "both frames are inertial"},
      {"REF_FRAME_B = SC_BODY_1", "REF_FRAME_B = SC_BODYGUARD", "\"SC_BODYGUARD\" is neither"},
      {"REF_FRAME_B = SC_BODY_1", "REF_FRAME_B = SC_BODY_", "\"SC_BODY_\" is neither"},
      {"REF_FRAME_A = GCRF", "REF_FRAME_A = J2000", "those of the segment before"},
      {"OBJECT_ID = 2006-021A", "OBJECT_ID = 2006-021B", "that of the segment before"},
      {"TIME_SYSTEM = TAI", "TIME_SYSTEM = ET", "the time system \"ET\" is not known; give one of TAI, UTC"},
      {"TIME_SYSTEM = TAI", "TIME_SYSTEM = GPS", "that of the segment before GPS"},
      {"START_TIME = 2009-05-20T00:00:00", "START_TIME = 2009-05-21T00:00:00", "STOP_TIME is before START_TIME"},
      {"START_TIME = 2009-05-20T00:00:00", "START_TIME = 2009-05-20T00:00:00.1",
       "lies outside START_TIME and STOP_TIME"},
      {"STOP_TIME = 2009-05-20T00:00:04.875000039", "STOP_TIME = 2009-05-20T00:00:04.8", "lies outside START_TIME"},
      {"STOP_TIME = 2009-05-20T00:00:04.875000039", "STOP_TIME = 2009-05-20T00:00:04.875000039Z", "ends with Z"},
      {"STOP_TIME = 2009", "USEABLE_START_TIME = 2008-05-20T00:00:00\nSTOP_TIME = 2009",
       "the useable span does not lie"},
      {"STOP_TIME = 2009", "USEABLE_STOP_TIME = 2010-05-20T00:00:00\nSTOP_TIME = 2009",
       "the useable span does not lie"},
      {"ATTITUDE_TYPE = QUATERNION/ANGVEL", "ATTITUDE_TYPE = EULER_ANGLE",
       "\"EULER_ANGLE\" is not read; give QUATERNION"},
      {"ATTITUDE_TYPE = QUATERNION/ANGVEL", "ATTITUDE_TYPE = QUATERNION/RATE", "is not read"},
      {"ATTITUDE_TYPE = QUATERNION/ANGVEL", "ATTITUDE_TYPE = QUATERNION", "the line has 8 values, not 5"},
      {"ATTITUDE_TYPE = QUATERNION/ANGVEL", "ATTITUDE_TYPE = QUATERNION/DERIVATIVE", "the line has 8 values, not 9"},
      {"ANGVEL_FRAME = SC_BODY_1", "ANGVEL_FRAME = SC_BODY_2", "is neither of the two frames; give GCRF or SC_BODY_1"},
      {"ANGVEL_FRAME = SC_BODY_1", "QUATERNION_TYPE = FIRST", "\"QUATERNION_TYPE\" is no keyword"},
      {"ANGVEL_FRAME = SC_BODY_1", "ANGVEL_FRAME = SC_BODY_1 [deg]", "an AEM has no units"},
      {"ANGVEL_FRAME = SC_BODY_1", "ANGVEL_FRAME", "\"ANGVEL_FRAME\" is no assignment"},
      {"META_START\n", "", "is no keyword of the header"},
      {"META_STOP\n", "", "\"DATA_START\" is no assignment"},
      {"DATA_START\n", "", "META_STOP is not followed by DATA_START"},
      {"DATA_STOP\n", "", "a.aem:62:1: the line has 1 value, not 8"},
      {"2009-05-20T00:00:00.125000001", "2009-05-20T00:00:00",
       "a.aem:22:1: the epoch \"2009-05-20T00:00:00\" is not later"},
      {"2009-05-20T00:00:00.125000001", "0.125", "\"0.125\" is no time"},
      {"2009-05-20T00:00:00.125000001", "2009-05-20T00:00:00.125000001Z", "ends with Z"},
      {"2009-05-20T00:00:00.125000001 ", "2009-05-20T00:00:00.125000001 0 ", "the line has 9 values, not 8"},
      {"2009-05-20T00:00:00.125000001 ", "2009-05-20T00:00:00.125000001 1", "the norm"},
      {"2009-05-20T00:00:00.125000001 ", "2009-05-20T00:00:00.125000001 x", "is not a number"},
      {"2009-05-20T00:00:00.125000001 ", "COMMENT between\n2009-05-20T00:00:00.125000001 ", "the line has 2 values"},
      {"2009-05-20T00:00:00.125000001 ", "2009-05-20T00:00:00.125000001 nan 0 0 0 0 0 0\n2009-05-20T00:00:00.2 ",
       "\"nan\" is not a number"},
      {"2009-05-20T00:00:00.125000001 ", "2009-05-20T00:00:00.125000001 1e999 0 0 0 0 0 0\n2009-05-20T00:00:00.2 ",
       "\"1e999\" is not a number"},
      {"2009-05-20T00:00:00.125000001 ", "2009-05-20T00:00:00.125000001 0 0 0 1 0 inf 0\n2009-05-20T00:00:00.2 ",
       "\"inf\" is not a number"},
      {"DATA_STOP\n\nMETA_START\n", "DATA_STOP\nstray\nMETA_START\n", "\"stray\" stands outside metadata and data"},
  };
  for (const Damage& damage : damages) {
    EXPECT_THAT(refusal_of(changed(good(MessageSyntax::kKvn), damage)),
                AllOf(HasSubstr("a.aem"), HasSubstr(damage.reason), HasSubstr("; ")))
        << damage.from << " → " << damage.to;
  }
}

TEST(DamagedAem, OfXmlIsRefusedWithTheReason) {
  const std::vector<Damage> damages = {
      {"version=\"2.0\"", "version=\"2.1\"", "version \"2.1\" of the AEM is not known"},
      {" version=\"2.0\"", "", "version \"\""},
      {"id=\"CCSDS_AEM_VERS\"", "id=\"CCSDS_OEM_VERS\"", "its root has no id=\"CCSDS_AEM_VERS\""},
      {"<aem ", "<oem ", "is no whole XML"},
      {"</aem>", "", "is no whole XML"},
      {"</header>", "", "is no whole XML"},
      {"<header>", "<header><header></header>", "\"header\" is no keyword of the header"},
      {"<ORIGINATOR>TRIHEDRON</ORIGINATOR>\n", "", "the header has no ORIGINATOR"},
      {"<ORIGINATOR>TRIHEDRON</ORIGINATOR>", "<ORIGINATOR/>", "ORIGINATOR has no value"},
      {"<ORIGINATOR>TRIHEDRON</ORIGINATOR>", "<ORIGINATOR><b/></ORIGINATOR>", "holds more than a text"},
      {"<ORIGINATOR>TRIHEDRON</ORIGINATOR>", "<ORIGINATOR>A</ORIGINATOR><ORIGINATOR>B</ORIGINATOR>", "is there twice"},
      {"<OBJECT_ID>2006-021A</OBJECT_ID>", "", "the metadata has no OBJECT_ID"},
      {"<OBJECT_ID>2006-021A</OBJECT_ID>", "<OBJEKT_ID>2006-021A</OBJEKT_ID>", "did you mean \"OBJECT_ID\"?"},
      {"<REF_FRAME_A>GCRF<", "<REF_FRAME_A>MARS<", "\"MARS\" is neither an inertial frame"},
      {"<TIME_SYSTEM>TAI<", "<TIME_SYSTEM>SCLK<", "the time system \"SCLK\" is not known"},
      {"<segment>", "<segment><metadata></metadata>", "does not consist of <metadata> and <data>"},
      {"<body>", "<body><sigment></sigment>", "\"sigment\" where <segment> should stand"},
      {"<attitudeState>", "<attitudestate></attitudestate><attitudeState>", "where <attitudeState> should stand"},
      {"<attitudeState>", "<attitudeState></attitudeState><attitudeState>", "does not hold one quaternion"},
      {"<quaternionAngVel>", "<spin></spin><quaternionAngVel>", "does not hold one quaternion"},
      {"<Q1>", "<Q0>1</Q0><Q1>", "<Q0> is no part of this ATTITUDE_TYPE"},
      {"<Q2>", "<Q1>1</Q1><Q2>", "<Q1> is there twice"},
      {"<EPOCH>2009-05-20T00:00:00</EPOCH>", "", "<quaternionAngVel> has no <EPOCH>"},
      {"<EPOCH>2009-05-20T00:00:00</EPOCH>", "<EPOCH>now</EPOCH>", "\"now\" is no time"},
      {"<EPOCH>2009-05-20T00:00:00</EPOCH>", "<EPOCH>2009-05-20T00:00:01</EPOCH>", "is not later than the one before"},
      {"<ANGVEL_X units=\"deg/s\">", "<ANGVEL_X units=\"rad/s\">",
       "the unit of <ANGVEL_X> is \"rad/s\"; give it in deg/s"},
      {"<QC>", "<QC units=\"deg\">", "the unit of <QC> is \"deg\"; it has none"},
      {"<ATTITUDE_TYPE>QUATERNION/ANGVEL<", "<ATTITUDE_TYPE>QUATERNION<",
       "<ANGVEL_X> is no part of this ATTITUDE_TYPE"},
      {"<ATTITUDE_TYPE>QUATERNION/ANGVEL<", "<ATTITUDE_TYPE>SPIN<", "\"SPIN\" is not read"},
  };
  for (const Damage& damage : damages) {
    EXPECT_THAT(refusal_of(changed(good(MessageSyntax::kXml), damage)),
                AllOf(HasSubstr("a.aem:"), HasSubstr(damage.reason), HasSubstr("; ")))
        << damage.from << " → " << damage.to;
  }
}

TEST(DamagedAem, CutAnywhereIsRefused) {
  for (const MessageSyntax syntax : {MessageSyntax::kKvn, MessageSyntax::kXml}) {
    const std::string& text = good(syntax);
    // Without its last line end it is whole.
    for (std::size_t size = 14; size + 1 < text.size(); size += 131) {
      EXPECT_THROW(static_cast<void>(parse_attitude_message(text.substr(0, size), "a.aem")), InputRefused) << size;
    }
    EXPECT_EQ(parse_attitude_message(text.substr(0, text.size() - 1), "a.aem").attitude.size(), 80U);
  }
}

TEST(DamagedAem, WithoutAnythingIsRefused) {
  EXPECT_THAT(refusal_of(""), HasSubstr("does not begin with CCSDS_AEM_VERS"));
  EXPECT_THAT(refusal_of("CCSDS_AEM_VERS = 2.0\nCREATION_DATE = 2026-01-02T03:04:05\nORIGINATOR = ME\n"),
              HasSubstr("the message has no segment"));
  EXPECT_THAT(refusal_of(kvn(metadata("ICRF", "SC_BODY_1", ""), "")), HasSubstr("the segment has no data"));
  EXPECT_THAT(refusal_of(kvn(metadata("ICRF", "SC_BODY_1", "USEABLE_START_TIME = 2009-05-20T00:00:09\n"),
                             "2009-05-20T00:00:00 0 0 0 1\n")),
              HasSubstr("no epoch lies in the useable span"));
  EXPECT_THAT(refusal_of("<ndm/>"), HasSubstr("its root is \"ndm\""));
  const std::string& xml = good(MessageSyntax::kXml);
  const std::string aem = xml.substr(xml.find("<aem"));
  EXPECT_EQ(parse_attitude_message("<ndm>" + aem + "</ndm>", "a.aem").attitude.size(), 80U);
  EXPECT_THAT(refusal_of("<ndm>" + aem + aem + "</ndm>"), HasSubstr("there are several AEM in it"));
}

TEST(DamagedAem, OfVersion1IsRefusedWithTheReason) {
  const std::string more = "ATTITUDE_DIR = A2B\nQUATERNION_TYPE = LAST\n";
  const std::string text = kvn(metadata("ICRF", "SC_BODY_1", more), "2009-05-20T00:00:00 0 0 0 1\n", "1.0");
  EXPECT_EQ(read(text).size(), 1U);
  const std::vector<Damage> damages = {
      {"ATTITUDE_DIR = A2B\n", "", "the metadata has no ATTITUDE_DIR"},
      {"ATTITUDE_DIR = A2B", "ATTITUDE_DIR = A", "ATTITUDE_DIR is \"A\"; give A2B or B2A"},
      {"QUATERNION_TYPE = LAST\n", "", "the metadata has no QUATERNION_TYPE"},
      {"QUATERNION_TYPE = LAST", "QUATERNION_TYPE = MIDDLE", "give FIRST or LAST"},
      {"ATTITUDE_TYPE = QUATERNION", "ATTITUDE_TYPE = QUATERNION/ANGVEL", "is not read; give QUATERNION"},
  };
  for (const Damage& damage : damages) {
    EXPECT_THAT(refusal_of(changed(text, damage)), HasSubstr(damage.reason)) << damage.to;
  }
}

}  // namespace
}  // namespace trihedron::io::aem_test
