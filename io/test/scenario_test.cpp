#include "trihedron/io/scenario.hpp"

#include <gmock/gmock.h>

#include "fixtures.hpp"
#include "trihedron/io/error.hpp"

namespace trihedron::io {
namespace {

using testing::HasSubstr;

Scenario parse(std::string_view toml) { return parse_scenario(toml, "scenario.toml"); }

std::string why_refused(std::string_view toml) {
  return refusal([&] { static_cast<void>(parse(toml)); });
}

TEST(ScenarioToml, EmptyFileIsThePapersExperiment) {
  const Scenario scenario = parse("");
  EXPECT_EQ(scenario.duration, std::chrono::hours{9});
  EXPECT_EQ(scenario.gyros.size(), 2U);
  EXPECT_DOUBLE_EQ(scenario.star_tracker.noise_rad.z(), 20 * kArcsecond);
}

TEST(ScenarioToml, FurtherStarTrackerIsAsTheFirstInWhatItDoesNotSay) {
  const Scenario scenario = parse(R"(
[star_tracker]
clock_offset = "5ms"
max_rate = "1deg/s"
[[star_tracker.further]]
mounting_rotation_vector = ["90deg", "0deg", "0deg"]
misalignment = ["1arcmin", "0deg", "0deg"]
clock_offset = "7ms"
)");
  ASSERT_EQ(scenario.further_star_trackers.size(), 1U);
  const StarTrackerScenario& head = scenario.further_star_trackers[0];
  EXPECT_EQ(head.clock_offset_s, 7e-3);
  EXPECT_EQ(head.max_rate_rad_s, kDegree);
  EXPECT_EQ(head.mounting_rotation_vector_rad.x(), 90 * kDegree);
  EXPECT_EQ(head.misalignment_rad.x(), kArcminute);
  EXPECT_EQ(scenario.star_tracker.clock_offset_s, 5e-3);
  EXPECT_TRUE(scenario.star_tracker.mounting_rotation_vector_rad.isZero(0));
  EXPECT_THAT(why_refused("[star_tracker]\nfurther = 1"), HasSubstr("begin the part of each further head with"));
  EXPECT_THAT(why_refused("[star_tracker]\nmisalignment = [\"1deg\", \"0deg\", \"0deg\"]"), HasSubstr("misalignment"));
}

TEST(ScenarioToml, MountingsMoveByTheirOwnKeys) {
  const Scenario scenario = parse(R"(
[gyro]
mounting_step = ["20arcsec", "0deg", "0deg"]
mounting_step_at = "4h"
[[gyro.unit]]
[[gyro.unit]]
mounting_step = ["0deg", "0deg", "0deg"]
[star_tracker]
mounting_rate = ["0deg/h", "0.002deg/h", "0deg/h"]
inertial_step = ["0deg", "0deg", "1deg"]
inertial_step_at = "5h"
)");
  EXPECT_EQ(scenario.gyros[0].mounting_change.at(4 * 3600.0 - 1), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(scenario.gyros[0].mounting_change.at(4 * 3600.0).x(), 20 * kArcsecond);
  EXPECT_FALSE(scenario.gyros[1].mounting_change.is_there());
  EXPECT_DOUBLE_EQ(scenario.star_tracker.mounting_change.at(1800).y(), 0.001 * kDegree);
  EXPECT_EQ(scenario.star_tracker.inertial_step_rad.z(), kDegree);
  EXPECT_EQ(scenario.star_tracker.inertial_step_at_s, 5 * 3600.0);
}

TEST(ScenarioToml, ValuesGoWhereTheirNamesSay) {
  const Scenario scenario = parse(R"(
[scenario]
spacecraft = "Test"
seed = 42
epoch_tai = "2010-01-02T03:04:05"
duration = "90min"

[orbit]
perigee_altitude = "500km"
apogee_altitude = "510000 m"
inclination = "97deg"

[attitude]
reference = "yaw-steered"
max_slew_acceleration = "0.1deg/s^2"
jitter = "0arcsec"
slews = [{begin = "10min", roll = "30deg"}, {begin = "20min"}]

[gyro]
period = "250ms"
gaps = [{begin = "1min", end = "2min"}]
readout = {noise = "1arcsec"}

[[gyro.unit]]
start_direction_c = [1, 0, 0]
[gyro.unit.drift]
kappa = {k0 = "1e-6rad/s", nu31 = "0.1deg/h"}
harmonics = [{potential = "D", degree = 2, order = -1, amplitude = "1e-7rad/s"}]

[[gyro.unit]]
misalignment = ["30arcmin", "0deg", "-1e-3rad"]
readout = {noise = "3arcsec", quantum = "0.5arcsec"}

[[gyro.unit]]

[star_tracker]
noise = ["1arcsec", "2arcsec", "30arcsec"]
clock_offset = "-10ms"
aberration = "uncorrected"
sun_exclusion = "30deg"
outages = [{begin = "1h", end = "65min"}]
outlier_probability = 0.01
)");
  EXPECT_EQ(scenario.spacecraft, "Test");
  EXPECT_EQ(scenario.seed, 42U);
  EXPECT_EQ(scenario.epoch - Scenario{}.epoch, std::chrono::days{227} + std::chrono::seconds{11045});
  EXPECT_EQ(scenario.duration, std::chrono::minutes{90});
  EXPECT_EQ(scenario.orbit.perigee_altitude_m, 500e3);
  EXPECT_EQ(scenario.orbit.apogee_altitude_m, 510e3);
  EXPECT_EQ(scenario.orbit.inclination_rad, 97 * kDegree);
  EXPECT_EQ(scenario.attitude.reference, AttitudeScenario::Reference::kYawSteered);
  EXPECT_EQ(scenario.attitude.max_slew_acceleration_rad_s2, 0.1 * kDegree);
  EXPECT_EQ(scenario.attitude.jitter_rad, 0);
  const auto& slews = std::get<std::vector<Slew>>(scenario.attitude.slews);
  ASSERT_EQ(slews.size(), 2U);
  EXPECT_EQ(slews[0].begin_s, 600);
  EXPECT_EQ(slews[0].roll_rad, 30 * kDegree);
  EXPECT_EQ(scenario.gyro_period, std::chrono::milliseconds{250});
  ASSERT_EQ(scenario.gyro_gaps.size(), 1U);
  EXPECT_EQ(scenario.gyro_gaps[0].end_s, 120);

  ASSERT_EQ(scenario.gyros.size(), 3U);
  EXPECT_DOUBLE_EQ(scenario.gyros[0].readout.noise_rad, kArcsecond);
  EXPECT_DOUBLE_EQ(scenario.gyros[1].readout.noise_rad, 3 * kArcsecond);
  EXPECT_DOUBLE_EQ(scenario.gyros[2].readout.noise_rad, kArcsecond);
  EXPECT_EQ(scenario.gyros[0].start_direction_c, Eigen::Vector3d::UnitX());
  ASSERT_TRUE(scenario.gyros[0].drift.kappa_rad_s);
  EXPECT_EQ(scenario.gyros[0].drift.kappa_rad_s->front(), 1e-6);
  EXPECT_EQ(scenario.gyros[0].drift.kappa_rad_s->at(1), 0);
  EXPECT_DOUBLE_EQ(scenario.gyros[0].drift.kappa_rad_s->back(), 0.1 * kDegree / 3600);
  EXPECT_FALSE(scenario.gyros[1].drift.kappa_rad_s);
  ASSERT_EQ(scenario.gyros[0].drift.harmonics.size(), 1U);
  EXPECT_EQ(scenario.gyros[0].drift.harmonics[0].order, -1);
  ASSERT_TRUE(scenario.gyros[1].misalignment_rad);
  EXPECT_EQ(scenario.gyros[1].misalignment_rad->z(), -1e-3);

  EXPECT_DOUBLE_EQ(scenario.star_tracker.noise_rad.y(), 2 * kArcsecond);
  EXPECT_EQ(scenario.star_tracker.clock_offset_s, -0.01);
  EXPECT_EQ(scenario.star_tracker.aberration, StarTrackerScenario::Aberration::kUncorrected);
  EXPECT_EQ(scenario.star_tracker.sun_exclusion_rad, 30 * kDegree);
  EXPECT_FALSE(scenario.star_tracker.earth_exclusion_rad);
  EXPECT_EQ(scenario.star_tracker.outages.at(0).begin_s, 3600);
  EXPECT_EQ(scenario.star_tracker.outlier_probability, 0.01);
}

TEST(ScenarioToml, DriftOutsideEveryModelGoesWhereItsNamesSay) {
  const DriftScenario drift = parse(R"([gyro.drift]
bump = "1e-7rad/s"
bump_centre = [0, 1, 2]
bump_radius = "15deg"
hysteresis = "2e-8rad/s"
hysteresis_width = "3deg"
slew_fraction = 0.1
slew_time = "10min"
jump_sigma = "3e-8rad/s"
jump_at = "2h"
polhode_fraction = 0.2
polhode_period = "90min"
polhode_period_rate = -0.01
thermal_fraction = 0.3
thermal_time = "5min"
)")
                                  .gyros[1]
                                  .drift;
  EXPECT_EQ(drift.bump_rad_s, 1e-7);
  EXPECT_EQ(drift.bump_centre, Eigen::Vector3d(0, 1, 2));
  EXPECT_DOUBLE_EQ(drift.bump_radius_rad, 15 * kDegree);
  EXPECT_EQ(drift.hysteresis_rad_s, 2e-8);
  EXPECT_DOUBLE_EQ(drift.hysteresis_width_rad, 3 * kDegree);
  EXPECT_EQ(drift.slew_fraction, 0.1);
  EXPECT_EQ(drift.slew_time_s, 600);
  EXPECT_EQ(drift.jump_sigma_rad_s, 3e-8);
  EXPECT_EQ(drift.jump_at_s, 7200);
  EXPECT_EQ(drift.polhode_fraction, 0.2);
  EXPECT_EQ(drift.polhode_period_s, 5400);
  EXPECT_EQ(drift.polhode_period_rate, -0.01);
  EXPECT_EQ(drift.thermal_fraction, 0.3);
  EXPECT_EQ(drift.thermal_time_s, 300);
  EXPECT_FALSE(parse("").gyros[0].drift.bump_centre);
}

TEST(ScenarioToml, SlewsNoneAndImagingAreAlternatives) {
  EXPECT_TRUE(std::get<std::vector<Slew>>(parse("attitude = {slews = \"none\"}").attitude.slews).empty());
  EXPECT_EQ(std::get<ImagingProgramme>(parse("attitude = {imaging = {dwell = \"5min\"}}").attitude.slews).dwell_s, 300);
  EXPECT_THAT(why_refused("attitude = {slews = \"none\", imaging = {dwell = \"5min\"}}"), HasSubstr("keep one"));
}

TEST(ScenarioToml, RefusalNamesPlaceReasonAndCure) {
  EXPECT_THAT(why_refused("[orbit]\ninclinaton = \"70deg\""), HasSubstr("scenario.toml:2:1"));
  EXPECT_THAT(why_refused("[orbit]\ninclinaton = \"70deg\""), HasSubstr("did you mean \"inclination\"?"));
  EXPECT_THAT(why_refused("[orbit]\ninclination = 70"), HasSubstr("with its unit"));
  EXPECT_THAT(why_refused("[orbit]\ninclination = \"70\""), HasSubstr("accepted units: deg"));
  EXPECT_THAT(why_refused("[orbit]\nperigee_altitude = \"360 miles\""), HasSubstr("accepted units: km, m"));
  EXPECT_THAT(why_refused("[attitude]\nreference = \"orbit\""), HasSubstr("orbital"));
  EXPECT_THAT(why_refused("[scenario]\nepoch_tai = \"yesterday\""), HasSubstr("not an ISO date and time"));
  EXPECT_THAT(why_refused("[star_tracker]\nnoise = [\"1arcsec\"]"), HasSubstr("[x, y, z]"));
  EXPECT_THAT(why_refused("[gyro]\nunit = 3"), HasSubstr("[[gyro.unit]]"));
  EXPECT_THAT(why_refused("[gyro]\nunit = []"), HasSubstr("scenario.toml:2:8: \"unit\" tells 0 gyros"));
  EXPECT_THAT(why_refused("[gyro]\nunit = [{}]"), HasSubstr("at most 4 are handled"));
  EXPECT_THAT(why_refused("[gyro]\nunit = [{}, {}, {}, {}, {}]"), HasSubstr("at most 4 are handled"));
  EXPECT_THAT(why_refused("[scenario]\nseed = -1"), HasSubstr("whole number"));
}

TEST(ScenarioToml, ValuesOutsideTheirRangeAreRefusedWhereTheyStand) {
  const auto refuses = [](const char* table, const char* line, const char* words) {
    const std::string why = why_refused(std::string("[") + table + "]\n" + line);
    EXPECT_THAT(why, HasSubstr("scenario.toml:2:")) << line;
    EXPECT_THAT(why, HasSubstr(words)) << line;
  };
  refuses("gyro.readout", "noise = \"-2arcsec\"", "\"noise\" in [gyro.readout]: \"-2arcsec\" is outside 0 to ");
  refuses("gyro.readout", "stuck = \"-1s\"", "\"stuck\"");
  refuses("gyro.readout", "spike_probability = -0.1", "\"spike_probability\" is -0.1, outside 0 to 1; it is a prob");
  refuses("star_tracker", "dropout_probability = 1.5", "\"dropout_probability\" is 1.5, outside 0 to 1; it is a prob");
  refuses("star_tracker", "noise = [\"1arcsec\", \"-1arcsec\", \"1arcsec\"]", "\"-1arcsec\" is outside");
  refuses("star_tracker", "sun_exclusion = \"190deg\"", "outside 0 to 180 deg");
  refuses("star_tracker", "earth_exclusion = \"-1deg\"", "outside 0 to 180 deg");
  refuses("star_tracker", "field_correlation = \"0deg\"", "\"field_correlation\"");
  refuses("star_tracker", "max_rate = \"-1deg/s\"", "\"max_rate\"");
  refuses("orbit", "inclination = \"270deg\"", "outside 0 to 180 deg");
  refuses("orbit", "perigee_altitude = \"0km\"", "above the Earth");
  refuses("attitude", "max_slew_rate = \"0deg/s\"", "\"max_slew_rate\" in [attitude]: \"0deg/s\" is outside");
  refuses("attitude", "max_slew_acceleration = \"0deg/s^2\"", "\"max_slew_acceleration\"");
  refuses("attitude", "jitter = \"-1arcsec\"", "\"jitter\"");
  refuses("attitude", "jitter_bandwidth = \"0Hz\"", "\"jitter_bandwidth\" is zero where there is jitter");
  refuses("attitude.imaging", "mean_rest = \"0s\"", "\"mean_rest\" in [attitude.imaging]");
  refuses("attitude.imaging", "mean_rest = \"0s\"", "it is the mean of times that are drawn");
  refuses("gyro.drift", "hysteresis_width = \"0deg\"", "it is the angle over which the drift changes sides");
  refuses("gyro", "start_direction_c = [1e-200, 0, 0]", "\"start_direction_c\" is zero");
  refuses("attitude.imaging", "dwell = \"-1s\"", "\"dwell\"");
  refuses("gyro", "alignment_prior_sigma = \"0deg\"", "\"alignment_prior_sigma\"");
  refuses("gyro", "start_direction_c = [0, 0, 0]", "\"start_direction_c\" is zero");
  refuses("gyro.drift", "prior_sigma = \"0rad/s\"", "\"prior_sigma\"");
  refuses("gyro.drift", "markov_time = \"0s\"", "\"markov_time\"");
  refuses("gyro.drift", "bump_radius = \"91deg\"", "to 90 deg");
  refuses("gyro.drift", "bump_centre = [0, 0, 0]", "\"bump_centre\" is zero");
  refuses("gyro.drift", "harmonics = [{degree = 21}]", "\"degree\" is 21, outside 1 to 20");
}

TEST(ScenarioToml, AKeyOfAnotherTableIsSentThere) {
  EXPECT_THAT(
      why_refused("[gyro.drift]\nspike = \"1deg\""),
      HasSubstr("scenario.toml:2:1: key \"spike\" is not known in [gyro.drift]; it belongs into [gyro.readout]"));
  EXPECT_THAT(why_refused("[gyro]\nnoise = \"1arcsec\""),
              HasSubstr("it belongs into [gyro.readout] or [star_tracker]"));
  EXPECT_THAT(why_refused("[attitude]\nnu12 = \"1deg/h\""), HasSubstr("it belongs into [gyro.drift.kappa]"));
  EXPECT_THAT(why_refused("[attitude]\namplitude = \"1deg/h\""), HasSubstr("or [[gyro.drift.harmonics]]"));
  EXPECT_THAT(why_refused("[gyro.drift]\nperiod = \"1s\""), HasSubstr("it belongs into [gyro] or [star_tracker]"));
  EXPECT_THAT(why_refused("[orbit]\nmax_slew_rates = \"1deg/s\""),
              HasSubstr("did you mean \"max_slew_rate\", which belongs into [attitude]?"));
  EXPECT_THAT(why_refused("[gyro.drift]\nprior_sigmas = \"1deg/h\""), HasSubstr("did you mean \"prior_sigma\"?"));
  EXPECT_THAT(why_refused("seed = 3"), HasSubstr("it belongs into [scenario]"));
}

TEST(ScenarioToml, WhatSeveralKeysSayTogetherIsRefusedWhereItStands) {
  EXPECT_THAT(why_refused("[orbit]\nperigee_altitude = \"700km\""),
              HasSubstr("scenario.toml:1:1: \"perigee_altitude\" is 700km, above \"apogee_altitude\", 604km"));
  EXPECT_THAT(why_refused("[gyro.drift]\nharmonics = [{degree = 3, order = 7}]"),
              HasSubstr("scenario.toml:2:14: a harmonic of degree 3 has no order 7; give an order from -3 to 3"));
  for (const char* list : {"[star_tracker]\noutages", "[gyro]\ngaps"}) {
    const std::string key = list;
    EXPECT_THAT(why_refused(key + " = [{begin = \"1h\", end = \"30min\"}]"),
                HasSubstr("ends at 30min, before it begins at 1h; give an \"end\" after \"begin\""));
    EXPECT_THAT(why_refused(key + " = [{begin = \"1h\"}]"), HasSubstr("key \"end\" is missing"));
    EXPECT_EQ(why_refused(key + " = [{end = \"1h\"}]"), "");
  }
  EXPECT_THAT(why_refused("[attitude]\nreference = \"inertial\""),
              HasSubstr("scenario.toml:2:13: this reference needs \"inertial_q_in_c\", which is missing"));
  EXPECT_THAT(why_refused("[attitude]\nreference = \"recorded\""), HasSubstr("add recorded = \"attitude.csv\""));
  EXPECT_EQ(why_refused("[attitude]\nreference = \"inertial\"\ninertial_q_in_c = [0, 0, 0, 1]"), "");
  EXPECT_EQ(why_refused("[attitude]\njitter = \"0deg\"\njitter_bandwidth = \"0Hz\""), "");
}

}  // namespace
}  // namespace trihedron::io
