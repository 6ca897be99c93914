#include "oem.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <string>

#include "fixtures.hpp"
#include "trihedron/io/scenario.hpp"

namespace trihedron::io::oem_test {
namespace {

using testing::HasSubstr;
using Interpolation = EphemerisSegment::Interpolation;

OrbitMessage parsed(const std::string& text) {
  return parse_orbit_message(text, "orbit.oem", sample_calibration().epoch);
}

std::string refused(const std::string& text) {
  return refusal([&] { static_cast<void>(parsed(text)); });
}

class OrbitMessages : public testing::TestWithParam<bool> {
 protected:
  [[nodiscard]] std::string whole() const { return orbit_message(GetParam()); }
};

TEST_P(OrbitMessages, AreStatesInMetresSinceTheEpoch) {
  EXPECT_TRUE(is_orbit_message(whole()));
  const OrbitMessage message = parsed(whole());
  EXPECT_EQ(message.format, GetParam() ? "CCSDS OEM version 2, XML" : "CCSDS OEM version 2, KVN");
  EXPECT_EQ(message.object_name, "TEST");
  EXPECT_EQ(message.inertial_frame, "EME2000");
  EXPECT_EQ(message.time_system, "UTC");
  ASSERT_EQ(message.segments.size(), 2U);
  const EphemerisSegment& first = message.segments[0];
  ASSERT_EQ(first.t_s.size(), 11U);
  EXPECT_EQ(first.t_s[1], 60);  // 23:59:26 UTC of the day before is 00:00:00 TAI
  EXPECT_EQ(first.begin_s, 0);
  EXPECT_EQ(first.end_s, 540);
  EXPECT_NEAR(first.position_m[0].x(), 7000e3, 1e-3);
  EXPECT_NEAR(first.velocity_m_s[0].y(), 7546.05, 0.01);
  EXPECT_EQ(first.interpolation, Interpolation::kLagrange);
  EXPECT_EQ(first.degree, 5);
  EXPECT_EQ(first.nodes(), 6U);
  EXPECT_EQ(message.segments[1].interpolation, Interpolation::kHermite);  // where none is told
  EXPECT_EQ(message.segments[1].begin_s, 540);
  EXPECT_EQ(message.segments[1].t_s.back(), 1200);
}

INSTANTIATE_TEST_SUITE_P(Syntaxes, OrbitMessages, testing::Bool());

struct SpoiltOrbit {
  bool xml;
  std::string_view from;
  std::string_view to;
  std::string_view words;

  friend void PrintTo(const SpoiltOrbit& spoilt, std::ostream* out) { *out << spoilt.words; }
};

class RefusedOrbits : public testing::TestWithParam<SpoiltOrbit> {};

TEST_P(RefusedOrbits, NameThePlaceAndTheCure) {
  const SpoiltOrbit& spoilt = GetParam();
  const std::string message = refused(replaced(orbit_message(spoilt.xml), spoilt.from, spoilt.to));
  EXPECT_THAT(message, HasSubstr(std::string(spoilt.words)));
  EXPECT_THAT(message, HasSubstr("; "));
}

INSTANTIATE_TEST_SUITE_P(
    Kvn, RefusedOrbits,
    testing::Values(
        SpoiltOrbit{false, "CCSDS_OEM_VERS", "CCSDS_OPM_VERS", "orbit.oem:1:1: does not begin with CCSDS_OEM_VERS"},
        SpoiltOrbit{false, "= 2.0", "= 4.0", "orbit.oem:1:18: version \"4.0\" of the OEM is not known"},
        SpoiltOrbit{false, "CREATION_DATE = 2026", "CREATION_DATE = x026", "CREATION_DATE: "},
        SpoiltOrbit{false, "ORIGINATOR = TEST\n", "", "ORIGINATOR is missing"},
        SpoiltOrbit{false, "ORIGINATOR =", "ORIGINATER =", "\"ORIGINATER\" is no keyword of the header"},
        SpoiltOrbit{false, "ORIGINATOR = TEST", "ORIGINATOR TEST", "\"ORIGINATOR TEST\" is no assignment"},
        SpoiltOrbit{false, "OBJECT_ID = 2026-001A\n", "", "OBJECT_ID is missing"},
        SpoiltOrbit{false, "OBJECT_ID = 2026-001A", "OBJECT_ID =", "OBJECT_ID has no value"},
        SpoiltOrbit{false, "OBJECT_ID = 2026-001A", "OBJECT_NAME = B", "OBJECT_NAME is there twice"},
        SpoiltOrbit{false, "CENTER_NAME = EARTH", "CENTER_NAME = MARS BARYCENTER", "CENTER_NAME is"},
        SpoiltOrbit{false, "REF_FRAME = EME2000", "REF_FRAME = TEME", "REF_FRAME \"TEME\" is not one of ICRF, GCRF"},
        SpoiltOrbit{false, "TIME_SYSTEM = UTC", "TIME_SYSTEM = UT1", "the time system \"UT1\" is not known"},
        SpoiltOrbit{false, "START_TIME = 2009-05-19T23:59:26", "START_TIME = 2009-05-32", "\"2009-05-32\" is no time"},
        SpoiltOrbit{false, "\nSTOP_TIME = 2009-05-20T00:09:26", "\nSTOP_TIME = 2009-05-18T00:00:00",
                    "STOP_TIME is before START_TIME"},
        SpoiltOrbit{false, "USEABLE_STOP_TIME = 2009-05-20T00:08:26", "USEABLE_STOP_TIME = 2009-05-20T01:00:00",
                    "the useable span does not lie within"},
        SpoiltOrbit{false, "INTERPOLATION = LAGRANGE", "INTERPOLATION = SPLINE", "the interpolation \"SPLINE\""},
        SpoiltOrbit{false, "INTERPOLATION_DEGREE = 5\n", "", "without INTERPOLATION_DEGREE"},
        SpoiltOrbit{false, "INTERPOLATION_DEGREE = 5", "INTERPOLATION_DEGREE = 5.5", "INTERPOLATION_DEGREE is \"5.5\""},
        SpoiltOrbit{false, "INTERPOLATION_DEGREE = 5", "INTERPOLATION_DEGREE = 26", "INTERPOLATION_DEGREE is \"26\""},
        SpoiltOrbit{false, "INTERPOLATION_DEGREE = 5", "INTERPOLATION_DEGREE = 11",
                    "has 11 states, and interpolation of degree 11 needs 12"},
        SpoiltOrbit{false, "INTERPOLATION = LAGRANGE", "INTERPOLATION = LINEAR", "it is 1"},
        SpoiltOrbit{false, "2009-05-20T00:00:26 ", "2009-05-19T23:59:26 ", "is not later than the one before"},
        SpoiltOrbit{false, "2009-05-20T00:09:26 ", "2009-05-20T00:10:26 ", "lies outside START_TIME and STOP_TIME"},
        SpoiltOrbit{false, "2009-05-20T00:00:26 ", "2009-05-20T00:00:26 1 ", "the line has 8 values"},
        SpoiltOrbit{false, "2009-05-19T23:59:26 7000", "2009-05-19T23:59:26 nan", "orbit.oem:18:21: \"nan"},
        SpoiltOrbit{false, "2009-05-19T23:59:26 7000", "2009-05-19T23:59:26 7", "the distance from the Earth's centre"},
        SpoiltOrbit{false, " 7.5460", " 7546.", "the speed is 7546"},
        SpoiltOrbit{false, "COVARIANCE_STOP\n", "", "ends within a covariance"},
        SpoiltOrbit{false, "META_STOP\n", "", "is no assignment"},
        SpoiltOrbit{false, "USEABLE_START_TIME = 2009-05-20T00:08:26\n", "",
                    "begins within the useable span of the one before"},
        SpoiltOrbit{false,
                    "OBJECT_NAME = TEST\nOBJECT_ID = 2026-001A\nCENTER_NAME = EARTH\nREF_FRAME = EME2000\n"
                    "TIME_SYSTEM = UTC\nSTART_TIME = 2009-05-20T00:07:26",
                    "OBJECT_NAME = OTHER\nOBJECT_ID = 2026-001A\nCENTER_NAME = EARTH\nREF_FRAME = EME2000\n"
                    "TIME_SYSTEM = UTC\nSTART_TIME = 2009-05-20T00:07:26",
                    "OBJECT_NAME is \"OTHER\", that of the segment before \"TEST\""}));

INSTANTIATE_TEST_SUITE_P(
    Xml, RefusedOrbits,
    testing::Values(
        SpoiltOrbit{true, "</oem>", "", "is no whole XML"},
        SpoiltOrbit{true, "<oem id=\"CCSDS_OEM_VERS\"", "<oem", "its root is \"oem\""},
        SpoiltOrbit{true, "version=\"2.0\"", "version=\"9\"", "version \"9\" of the OEM is not known"},
        SpoiltOrbit{true, "<CREATION_DATE>", "<CREATION_DATE/><CREATION_DATE>", "CREATION_DATE has no value"},
        SpoiltOrbit{true, "</header>", "</header><header/>", "does not consist of <header> and <body>"},
        SpoiltOrbit{true, "<segment>", "<part/><segment>", "\"part\" where <segment> should stand"},
        SpoiltOrbit{true, "<stateVector>", "<state/><stateVector>", "\"state\" where <stateVector> should stand"},
        SpoiltOrbit{true, "<Y units=\"km\">", "<Y units=\"m\">", "the unit of <Y> is \"m\""},
        SpoiltOrbit{true, "<X_DOT>", "<W_DOT/><X_DOT>", "<W_DOT> is no part of a state"},
        SpoiltOrbit{true, "<Z>", "<Z>0</Z><Z>", "<Z> is there twice"},
        SpoiltOrbit{true, "<EPOCH>2009-05-19T23:59:26</EPOCH>", "", "has no <EPOCH>"},
        SpoiltOrbit{true, "<REF_FRAME>EME2000", "<REF_FRAME>EME<b/>2000", "holds more than a text"}));

TEST(OrbitMessage, WithoutAMethodIsInterpolatedByHermite) {
  const EphemerisSegment its = parsed(replaced(orbit_message(false), "INTERPOLATION = LAGRANGE\n", "")).segments[0];
  EXPECT_EQ(its.interpolation, Interpolation::kHermite);
  EXPECT_EQ(its.degree, 7);
}

TEST(OrbitMessage, WithoutASegmentIsRefused) {
  const std::string whole = orbit_message(false);
  EXPECT_THAT(refused(whole.substr(0, whole.find("META_START"))), HasSubstr("the message has no segment"));
  EXPECT_THAT(refused(""), HasSubstr("does not begin with CCSDS_OEM_VERS"));
}

TEST(OrbitMessage, IsTheOrbitOfAScenario) {
  const TemporaryDirectory directory;
  const auto scenario = [&](const std::string& orbit) {
    write_text(directory / "scenario.toml", "[orbit]\n" + orbit);
    return read_scenario(directory / "scenario.toml");
  };
  write_text(directory / "orbit.oem", orbit_message(false));
  const OrbitScenario orbit = scenario("ephemeris = \"orbit.oem\"\n").orbit;
  ASSERT_EQ(orbit.ephemeris.size(), 2U);
  EXPECT_EQ(orbit.ephemeris[0].t_s[1], 60);  // since the epoch of the scenario
  EXPECT_EQ(files_of_scenario(directory / "scenario.toml"),
            std::vector<std::filesystem::path>{directory / "orbit.oem"});
  EXPECT_THAT(refusal([&] { static_cast<void>(scenario("ephemeris = \"orbit.oem\"\ninclination = \"70deg\"\n")); }),
              HasSubstr("are both there"));
  EXPECT_THAT(refusal([&] { static_cast<void>(scenario("ephemeris = \"none.oem\"\n")); }), HasSubstr("none.oem"));
}

}  // namespace
}  // namespace trihedron::io::oem_test
