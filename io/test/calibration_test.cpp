#include "trihedron/io/calibration.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>

#include "fixtures.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/records/limits.hpp"

namespace trihedron::io {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string refusal_of(std::string_view text) {
  return refusal([&] { static_cast<void>(parse_calibration(text, "c.json")); });
}

std::string sample_text() { return format_calibration(sample_calibration()); }

TEST(CalibrationJson, KeepsTheForecastUpToWhereThereIsNoAttitude) {
  Calibration calibration = sample_calibration();
  calibration.determined = Determined{7, 14};
  OpenLoopForecast& forecast = calibration.forecast.emplace();
  forecast.usual = {1.5e-3, std::chrono::minutes(90), true};
  forecast.need = NeedForecast{{1e-3, std::chrono::minutes(30)},
                               false,
                               2e-3,
                               {1e-3, std::chrono::minutes(20), false},
                               {{"gyro1.k0", true, 0.75}, {"readout noise", false, 0.25}}};
  for (const double sigma : {1e-4, 2e-4, std::numeric_limits<double>::infinity()}) {
    PredictedError& error = forecast.errors.emplace_back();
    error.after = std::chrono::minutes(10) * static_cast<int>(forecast.errors.size() - 1);
    error.covariance_rad2 = Eigen::Vector3d(sigma * sigma, 4 * sigma * sigma, 9 * sigma * sigma).asDiagonal();
    error.error_68_rad = sigma;
    error.error_95_rad = 2 * sigma;
    error.error_997_rad = 3 * sigma;
  }
  const Calibration back = parse_calibration(format_calibration(calibration), "calibration.json");
  EXPECT_EQ(back.determined->coefficients, 7);
  EXPECT_EQ(back.determined->of, 14);
  ASSERT_TRUE(back.forecast && back.forecast->need);
  EXPECT_EQ(back.forecast->usual.within, forecast.usual.within);
  EXPECT_TRUE(back.forecast->usual.is_lower_bound);
  EXPECT_EQ(back.forecast->need->need, forecast.need->need);
  EXPECT_FALSE(back.forecast->need->met);
  EXPECT_EQ(back.forecast->need->error_997_rad, 2e-3);
  EXPECT_EQ(back.forecast->need->accuracy.within, std::chrono::minutes(20));
  ASSERT_EQ(back.forecast->need->causes.size(), 2U);
  EXPECT_TRUE(back.forecast->need->causes[0].is_parameter);
  EXPECT_FALSE(back.forecast->need->causes[1].is_parameter);
  ASSERT_EQ(back.forecast->errors.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(back.forecast->errors[i].after, forecast.errors[i].after);
    EXPECT_TRUE(back.forecast->errors[i].covariance_rad2.isApprox(forecast.errors[i].covariance_rad2, 1e-12));
    EXPECT_EQ(back.forecast->errors[i].error_68_rad, forecast.errors[i].error_68_rad);
    EXPECT_EQ(back.forecast->errors[i].error_95_rad, forecast.errors[i].error_95_rad);
    EXPECT_EQ(back.forecast->errors[i].error_997_rad, forecast.errors[i].error_997_rad);
  }
}

TEST(CalibrationJson, RefusesAForecastThatIsNone) {
  Calibration calibration = sample_calibration();
  OpenLoopForecast& forecast = calibration.forecast.emplace();
  forecast.usual.limit_rad = 1.5e-3;
  forecast.errors.resize(2);
  const std::string text = format_calibration(calibration);
  const auto refusal_with = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    return refusal_of(changed);
  };
  EXPECT_THAT(refusal_with("\"error_95_rad\":[0.0,0.0]", "\"error_95_rad\":[0.0]"), HasSubstr("1 values for 2 times"));
  EXPECT_THAT(refusal_with("\"error_95_rad\":[0.0,0.0]", "\"error_95_rad\":[0.0,-1.0]"), HasSubstr("outside"));
}

TEST(CalibrationJson, NamesTheStartUpWhereItIsKnown) {
  Calibration calibration = sample_calibration();
  EXPECT_EQ(format_calibration(calibration).find("start_up"), std::string::npos);
  EXPECT_EQ(parse_calibration(format_calibration(calibration), "c.json").start_up, "");
  calibration.start_up = "of \"May\"";
  EXPECT_EQ(parse_calibration(format_calibration(calibration), "c.json").start_up, calibration.start_up);
}

TEST(CalibrationJson, HasDriftThatComesBackAmongTheStatesOfItsCovariance) {
  Calibration calibration = sample_with_drift_that_comes_back();
  const Time told_from = calibration.epoch + std::chrono::minutes(7);
  for (GyroCalibration& gyro : calibration.gyros) {
    gyro.orbital_drift->zero_at = gyro.polhode->zero_at = told_from;
  }
  const std::string text = format_calibration(calibration);
  const Calibration back = parse_calibration(text, "c.json");
  EXPECT_EQ(back.states, calibration.states);
  EXPECT_EQ(back.covariance, calibration.covariance);
  EXPECT_EQ(back.amplitude_covariance, calibration.amplitude_covariance);
  ASSERT_TRUE(back.gyros[1].orbital_drift);
  EXPECT_EQ(back.gyros[1].orbital_drift->zero_at, calibration.epoch);
  const OrbitalDrift as_before = back.gyros[1].orbital_drift->from(told_from);
  EXPECT_TRUE(as_before.sine_rad_s.isApprox(calibration.gyros[1].orbital_drift->sine_rad_s, 1e-12));
  EXPECT_TRUE(as_before.cosine_rad_s.isApprox(calibration.gyros[1].orbital_drift->cosine_rad_s, 1e-12));
  const PolhodeDrift& told = *calibration.gyros[1].polhode;
  ASSERT_TRUE(back.gyros[1].polhode);
  EXPECT_EQ(back.gyros[1].polhode->zero_at, calibration.epoch);
  const PolhodeDrift polhode = back.gyros[1].polhode->from(told_from);
  EXPECT_NEAR(polhode.polhode.period_s, told.polhode.period_s, 1e-3);
  EXPECT_EQ(polhode.polhode.period_rate, told.polhode.period_rate);
  EXPECT_TRUE(polhode.sine_rad_s.isApprox(told.sine_rad_s, 1e-6));
  EXPECT_TRUE(polhode.cosine_rad_s.isApprox(told.cosine_rad_s, 1e-6));

  const auto refusal_with = [](std::string changed, const std::string& from, const std::string& to) {
    changed.replace(changed.find(from), from.size(), to);
    return refusal_of(changed);
  };
  EXPECT_THAT(refusal_with(text, "gyro1.orbital_drift_cosine_z_rad_s", "gyro1.other"), HasSubstr("has no row of"));
  EXPECT_THAT(refusal_with(text, "\"rate_rad_s\":0.0011", "\"rate_rad_s\":0.0012"), HasSubstr("different rates"));
  EXPECT_THAT(refusal_with(text, "\"rate_rad_s\":0.0011", "\"rate_rad_s\":1.1"), HasSubstr("outside"));
  EXPECT_THAT(refusal_with(text, "gyro2.nu31_polhode_cosine_rad_s", "gyro2.other"), HasSubstr("has no row of"));
  EXPECT_THAT(refusal_with(text, "\"period_rate\":0.03125", "\"period_rate\":1.5"), HasSubstr("outside"));
  EXPECT_THAT(refusal_with(text, "\"polhode\"", "\"other\""), HasSubstr("polhode of some gyros alone"));
  // Without it, the sigmas of the further states are what is known.
  calibration.amplitude_covariance.resize(0, 0);
  EXPECT_EQ(parse_calibration(format_calibration(calibration), "c.json").amplitude_covariance.size(), 0);
}

TEST(CalibrationJson, ComesBackFromAFileWhole) {
  const TemporaryDirectory directory;
  const Calibration calibration = sample_calibration();
  write_calibration(directory / "c.json", calibration);
  const Calibration back = read_calibration(directory / "c.json");
  EXPECT_EQ(back.estimator, calibration.estimator);
  EXPECT_EQ(back.epoch, calibration.epoch);
  EXPECT_EQ(back.t, calibration.t);
  ASSERT_EQ(back.gyros.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(back.gyros[i].drift_model, kEsg7);
    EXPECT_EQ(back.gyros[i].drift_rad_s, calibration.gyros[i].drift_rad_s);
    EXPECT_EQ(back.gyros[i].alignment_rotation_vector_rad, calibration.gyros[i].alignment_rotation_vector_rad);
    EXPECT_EQ(back.gyros[i].readout_bias, calibration.gyros[i].readout_bias);
    EXPECT_EQ(back.gyros[i].momentum_in, calibration.gyros[i].momentum_in);
  }
  ASSERT_EQ(back.further.size(), 2U);
  for (const FurtherEstimate& estimate : back.further) {
    const FurtherEstimate& written =
        calibration.further[estimate.parameter.is_further(FurtherState::kClockOffset) ? 0 : 1];
    EXPECT_EQ(estimate.parameter, written.parameter);
    EXPECT_EQ(estimate.value, written.value);
    EXPECT_EQ(estimate.sigma, written.sigma);
  }
  ASSERT_TRUE(back.noise.has_value());
  EXPECT_EQ(back.noise->direction_random_walk_rad_sqrt_s, calibration.noise->direction_random_walk_rad_sqrt_s);
  EXPECT_EQ(back.noise->star_tracker_noise_rad, calibration.noise->star_tracker_noise_rad);
  EXPECT_EQ(back.noise->wandering_drift_rad_s, calibration.noise->wandering_drift_rad_s);
  EXPECT_EQ(back.noise->wandering_time_s, calibration.noise->wandering_time_s);
  ASSERT_TRUE(back.on_board_drift.has_value());
  EXPECT_EQ(back.on_board_drift->drift_model, calibration.on_board_drift->drift_model);
  EXPECT_EQ(back.on_board_drift->random_walk_rad_sqrt_s, calibration.on_board_drift->random_walk_rad_sqrt_s);
  EXPECT_EQ(back.states, calibration.states);
  EXPECT_EQ(back.covariance, calibration.covariance);
  EXPECT_FALSE(back.verdict.trustworthy);
  ASSERT_EQ(back.verdict.findings.size(), 2U);
  const Finding& finding = back.verdict.findings[0];
  EXPECT_EQ(finding.code, FindingCode::kNisOutOfBounds);
  EXPECT_EQ(finding.text, "The innovations are \"too large\".");
  EXPECT_EQ(finding.evidence, "4.7 instead of 4");
  EXPECT_EQ(finding.cure, "add harmonics");
  EXPECT_EQ(finding.severity, Finding::Severity::kDoNotUse);
  EXPECT_EQ(back.verdict.findings[1].severity, Finding::Severity::kNote);
  EXPECT_EQ(named_values(back.statistics), named_values(calibration.statistics));
}

TEST(CalibrationJson, MayHaveItsCoefficientsInAnyOrder) {
  const Calibration calibration = sample_calibration();
  const auto& in_order = calibration.gyros[0].drift_rad_s;
  const std::string text = format_calibration(calibration);
  const std::string first = fmt::format("\"k0\":{},\"mu12\":{}", in_order[0], in_order[1]);
  const std::string turned = fmt::format("\"mu12\":{},\"k0\":{}", in_order[1], in_order[0]);
  EXPECT_EQ(parse_calibration(replaced(text, first, turned), "c.json").gyros[0].drift_rad_s, in_order);
}

TEST(CalibrationJson, KnowsTheCoefficientsOfEachDriftModel) {
  for (const DriftModelId& model : {kEsg7, kEsg20, vsh(1), kLargestDriftModel}) {
    Calibration calibration = sample_calibration();
    GyroCalibration& gyro = calibration.gyros[0];
    gyro.drift_model = model;
    gyro.drift_rad_s.clear();
    for (int i = 0; i < model.size(); ++i) {
      gyro.drift_rad_s.push_back(1e-6 * (i + 1));
    }
    const GyroCalibration back = parse_calibration(format_calibration(calibration), "c.json").gyros[0];
    EXPECT_EQ(back.drift_model, model);
    EXPECT_EQ(back.drift_rad_s, gyro.drift_rad_s);
    gyro.drift_rad_s.pop_back();
    EXPECT_THAT(refusal_of(format_calibration(calibration)),
                HasSubstr(fmt::format("lacks key \"{}\"", coefficient_names(model).back())));
  }
}

TEST(CalibrationJson, RefusesACoefficientWithTheMeaningItHadInEarlierVersions) {
  Calibration calibration = sample_calibration();
  GyroCalibration& gyro = calibration.gyros[0];
  gyro.drift_model = vsh(4);
  gyro.drift_rad_s.assign(static_cast<std::size_t>(vsh(4).size()), 1e-9);
  EXPECT_THAT(refusal_of(replaced(format_calibration(calibration), "W(4,4-k0)", "W(4,4)")),
              HasSubstr("drift_rad_s has W(4,4) of an earlier version; calibrate again"));
}

TEST(CalibrationJson, RefusesDriftModelsAndEstimatorsThatThereAreNot) {
  EXPECT_THAT(refusal_of(replaced(sample_text(), "\"esg7\"", "\"vsh:9\"")),
              HasSubstr("gyros[0].drift_model is \"vsh:9\", no drift model; give esg7, esg20, or vsh:1"));
  EXPECT_THAT(refusal_of(replaced(sample_text(), "\"invariant\"", "\"magic\"")),
              HasSubstr("estimator is \"magic\", no estimator; give one of: invariant, paper, batch"));
}

TEST(CalibrationJson, KeepsTheDriftField) {
  Calibration calibration = sample_calibration();
  calibration.drift_field = {{0, DriftCoefficient::Member::kW, 1, 3e-8, 1.5},
                             {1, DriftCoefficient::Member::kD, 8, 1e-10, 3.0}};
  const std::string text = format_calibration(calibration);
  const Calibration back = parse_calibration(text, "c.json");
  ASSERT_EQ(back.drift_field.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(back.drift_field[i].gyro, calibration.drift_field[i].gyro);
    EXPECT_EQ(back.drift_field[i].potential, calibration.drift_field[i].potential);
    EXPECT_EQ(back.drift_field[i].degree, calibration.drift_field[i].degree);
    EXPECT_EQ(back.drift_field[i].rms_rad_s, calibration.drift_field[i].rms_rad_s);
    EXPECT_EQ(back.drift_field[i].sigma_factor, calibration.drift_field[i].sigma_factor);
  }
  EXPECT_THAT(refusal_of(replaced(text, "\"potential\":\"D\"", "\"potential\":\"X\"")), HasSubstr("no potential"));
  EXPECT_THAT(refusal_of(replaced(text, "\"gyro\":2", "\"gyro\":3")), HasSubstr("drift_field[1].gyro"));
  EXPECT_THAT(refusal_of(replaced(text, "\"degree\":8", "\"degree\":9")), HasSubstr("drift_field[1].degree"));
  EXPECT_THAT(refusal_of(replaced(text, "\"sigma_factor\":1.5", "\"sigma_factor\":0.5")),
              HasSubstr("drift_field[0].sigma_factor"));
}

TEST(CalibrationJson, KeepsTheOrbitalRateWhereThereIsOne) {
  Calibration calibration = sample_calibration();
  EXPECT_FALSE(parse_calibration(format_calibration(calibration), "c.json").orbital_rate_rad_s.has_value());
  calibration.orbital_rate_rad_s = 1.059e-3;
  const std::string text = format_calibration(calibration);
  EXPECT_EQ(parse_calibration(text, "c.json").orbital_rate_rad_s, 1.059e-3);
  EXPECT_THAT(refusal_of(replaced(text, "\"orbital_rate_rad_s\": 0.001059", "\"orbital_rate_rad_s\": 1")),
              HasSubstr("orbital_rate_rad_s is 1"));
}

TEST(CalibrationJson, KeepsTheClocksWhereTheyAreOff) {
  Calibration calibration = sample_calibration();
  EXPECT_FALSE(parse_calibration(format_calibration(calibration), "c.json").clocks.has_value());
  ClockCorrection& clocks = calibration.clocks.emplace(ClockCorrection{-3.25, 1e-6, {}});
  clocks.late_s[1] = 0.02;
  const std::string text = format_calibration(calibration);
  const std::optional<ClockCorrection> back = parse_calibration(text, "c.json").clocks;
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->offset_s, clocks.offset_s);
  EXPECT_EQ(back->rate_s_s, clocks.rate_s_s);
  EXPECT_EQ(back->late_s[0], 0);
  EXPECT_EQ(back->late_s[1], clocks.late_s[1]);
  EXPECT_THAT(refusal_of(replaced(text, "\"clock_rate_s_s\":1e-06", "\"clock_rate_s_s\":1")),
              HasSubstr("clocks.clock_rate_s_s is 1"));
  EXPECT_THAT(refusal_of(replaced(text, "[0.0,0.02]", "[0.02]")),
              HasSubstr("clocks.latency_s has 1 values for 2 gyros"));
  EXPECT_THAT(refusal_of(replaced(text, "[0.0,0.02]", "[0.0,99]")), HasSubstr("clocks.latency_s[1] is 99"));
}

TEST(CalibrationJson, MayBeWithoutNoise) {
  Calibration calibration = sample_calibration();
  calibration.noise->star_tracker_noise_rad.reset();
  EXPECT_FALSE(parse_calibration(format_calibration(calibration), "c.json").noise->star_tracker_noise_rad.has_value());
  calibration.noise.reset();
  EXPECT_FALSE(parse_calibration(format_calibration(calibration), "c.json").noise.has_value());
}

TEST(CalibrationJson, RefusesNoiseThatIsNone) {
  Calibration calibration = sample_calibration();
  calibration.noise->wandering_drift_rad_s = -1e-7;
  EXPECT_THAT(refusal_of(format_calibration(calibration)), HasSubstr("noise.wandering_drift_rad_s is -1e-07"));
  for (const double time_s : {0.0, 1e300}) {
    calibration.noise = CalibrationNoise{0, {}, 1e-7, time_s};
    EXPECT_THAT(refusal_of(format_calibration(calibration)), HasSubstr("noise.wandering_time_s is"));
  }
  calibration.noise = CalibrationNoise{0, Eigen::Vector3d(1e-5, 0, 1e-5), 0, 0};
  EXPECT_THAT(refusal_of(format_calibration(calibration)),
              HasSubstr("noise.star_tracker_noise_rad[1] is 0 rad, outside"));
}

TEST(CalibrationJson, RefusesWhatNoEstimatorOnBoardHasRoomFor) {
  Calibration calibration = sample_calibration();
  calibration.on_board_drift = OnBoardDrift{vsh(7), 0};
  EXPECT_THAT(refusal_of(format_calibration(calibration)),
              AllOf(HasSubstr("drift_on_board.drift_model is \"vsh:7\""), HasSubstr("room for degree 6")));
  calibration.on_board_drift = OnBoardDrift{vsh(6), -1e-9};
  EXPECT_THAT(refusal_of(format_calibration(calibration)),
              HasSubstr("drift_on_board.random_walk_rad_sqrt_s is -1e-09"));
}

TEST(CalibrationJson, RefusesNumbersThatNoGyroHas) {
  Calibration calibration = sample_calibration();
  calibration.gyros[0].drift_rad_s[0] = 1e10;
  EXPECT_THAT(refusal_of(format_calibration(calibration)),
              HasSubstr("gyros[0].drift_rad_s.k0 is 10000000000 rad/s, outside -0.1 to 0.1 rad/s; no gyro drifts"));
  calibration = sample_calibration();
  calibration.covariance(0, 0) = 1e50;
  EXPECT_THAT(refusal_of(format_calibration(calibration)),
              HasSubstr("covariance.matrix has the variance of a sigma of gyro1.k0 that is 1e+25 rad/s, outside"));
  calibration = sample_calibration();
  calibration.gyros[1].alignment_rotation_vector_rad.y() = 7;
  EXPECT_THAT(refusal_of(format_calibration(calibration)),
              HasSubstr("gyros[1].alignment_rotation_vector_rad[1] is 7 rad, outside"));
}

RC_GTEST_PROP(CalibrationJson, NumbersComeBackBitForBit, (std::uint64_t bits)) {
  const auto value = std::bit_cast<double>(bits);
  RC_PRE(limits::kDrift_rad_s.holds(value));
  Calibration calibration = sample_calibration();
  calibration.gyros[0].drift_rad_s[2] = value;
  const Calibration back = parse_calibration(format_calibration(calibration), "c.json");
  RC_ASSERT(std::bit_cast<std::uint64_t>(back.gyros[0].drift_rad_s[2]) == bits);
}

TEST(CalibrationJson, StatisticWithoutAValueBecomesNullAndNan) {
  Calibration calibration = sample_calibration();
  calibration.statistics.nis_mean = std::nan("");
  EXPECT_THAT(format_calibration(calibration), HasSubstr("\"nis_mean\":null"));
  EXPECT_TRUE(std::isnan(parse_calibration(format_calibration(calibration), "c.json").statistics.nis_mean.value()));
}

TEST(CalibrationJson, TextThatIsNoUtf8DoesNotCostTheFile) {
  Calibration calibration = sample_calibration();
  calibration.verdict.findings[0].text = "bad \xff byte";
  EXPECT_THAT(parse_calibration(format_calibration(calibration), "c.json").verdict.findings[0].text, HasSubstr("bad "));
}

TEST(CalibrationJson, WhatThisProgramDoesNotKnowIsLeftOut) {
  std::string text = replaced(sample_text(), "{\"format\"", "{\"made_by\": \"x\", \"format\"");
  text = replaced(text, "\"gyro1.nu12\"", "\"tracker.heat\"");
  text = replaced(text, "\"clock_offset_s\"", "\"clock_rate\"");
  text = replaced(text, "\"nis_mean\"", "\"pi_third\"");
  text = replaced(text, "\"nis-out-of-bounds\"", "\"from-the-future\"");
  const Calibration whole = sample_calibration();
  const Calibration left = parse_calibration(text, "c.json");
  ASSERT_EQ(left.states.size(), 19U);
  EXPECT_TRUE(std::isnan(sigma_of(left, ParameterId::drift(0, DriftCoefficient::of_eq1(Esg7::kNu12)))));
  // Of mu31 and alignment x of gyro 1, which stand before and after it.
  EXPECT_EQ(left.states[3], whole.states[3]);
  EXPECT_EQ(left.states[4], whole.states[5]);
  EXPECT_EQ(left.covariance(3, 3), whole.covariance(3, 3));
  EXPECT_EQ(left.covariance(3, 4), whole.covariance(3, 5));
  EXPECT_EQ(left.further.size(), 1U);
  EXPECT_FALSE(left.statistics.nis_mean.has_value());
  EXPECT_EQ(left.verdict.findings[0].code, FindingCode::kOther);
  EXPECT_EQ(left.verdict.findings[0].text, whole.verdict.findings[0].text);
}

TEST(CalibrationJson, RefusesSyntaxErrorWithItsPlace) {
  EXPECT_THAT(refusal_of("{\"format\":\n  oops}"), HasSubstr("c.json:2:3: is not valid JSON here"));
  EXPECT_THAT(refusal_of(""), HasSubstr("c.json:1:1: is not valid JSON here"));
  EXPECT_THAT(refusal_of("{\"format\": 1e999}"), HasSubstr("too large for a double"));
  EXPECT_THAT(refusal_of("[]"), HasSubstr("c.json: is array; make it an object"));
  EXPECT_THAT(refusal([] { static_cast<void>(read_calibration("none.json")); }),
              HasSubstr("none.json: cannot be opened"));
}

TEST(CalibrationJson, RefusesAnotherFormatOrVersion) {
  EXPECT_THAT(refusal_of(replaced(sample_text(), "trihedron-calibration", "other")), HasSubstr("format is \"other\""));
  EXPECT_THAT(refusal_of(replaced(sample_text(), "\"version\": 1", "\"version\": 2")),
              HasSubstr("version is 2; this program reads version 1"));
}

TEST(CalibrationJson, RefusesEachMissingKey) {
  for (const char* key : {"format",
                          "version",
                          "estimator",
                          "epoch_tai",
                          "t_s",
                          "gyros",
                          "covariance",
                          "states",
                          "matrix",
                          "verdict",
                          "trustworthy",
                          "findings",
                          "statistics",
                          "drift_model",
                          "drift_rad_s",
                          "mu12",
                          "alignment_rotation_vector_rad",
                          "momentum_in",
                          "code",
                          "text"}) {
    const std::string name = '"' + std::string(key) + '"';
    const std::string message = refusal_of(replaced(sample_text(), name + ":", "\"renamed\":"));
    EXPECT_TRUE(message.find("lacks key " + name) != std::string::npos ||
                message.find("coefficient \"renamed\"") != std::string::npos)
        << message;
  }
}

TEST(CalibrationJson, RefusesWrongTypesNamingThePath) {
  EXPECT_THAT(refusal_of(replaced(sample_text(), "\"invariant\"", "3")),
              HasSubstr("estimator is number; make it a string"));
  EXPECT_THAT(refusal_of(replaced(sample_text(), "\"trustworthy\": false", "\"trustworthy\": 0")),
              HasSubstr("verdict.trustworthy is number; make it true or false"));
  EXPECT_THAT(refusal_of(replaced(sample_text(), "2009-05-20", "20 May")),
              HasSubstr("epoch_tai is \"20 MayT00:00:00\""));
  EXPECT_THAT(refusal_of(replaced(sample_text(), "32400.125", "1e12")), HasSubstr("t_s is 1000000000000"));
  EXPECT_THAT(refusal_of(replaced(sample_text(), "\"do-not-use\"", "\"fatal\"")),
              HasSubstr("verdict.findings[0].severity is \"fatal\"; it must be note, warning or do-not-use"));
}

TEST(CalibrationJson, RefusesUnknownCoefficientSuggestingTheRightOne) {
  EXPECT_THAT(refusal_of(replaced(sample_text(), "\"mu23\"", "\"mu32\"")),
              HasSubstr("gyros[0].drift_rad_s has coefficient \"mu32\", not one of esg7; did you mean \"mu"));
}

TEST(CalibrationJson, RefusesMomentumThatIsNoDirectionAndNoGyros) {
  Calibration calibration = sample_calibration();
  calibration.gyros[1].momentum_in *= 1.1;
  EXPECT_THAT(refusal_of(format_calibration(calibration)), HasSubstr("gyros[1].momentum_in is not a unit vector"));
  calibration.gyros.clear();
  calibration.states.clear();
  calibration.covariance.resize(0, 0);
  EXPECT_THAT(refusal_of(format_calibration(calibration)), HasSubstr("gyros is empty"));
}

TEST(CalibrationJson, RefusesStatesOfUnknownGyrosOrTwice) {
  for (const char* state : {"gyro3.k0", "gyro0.k0", "gyro.k0", "gyro2", "gyro-1.k0"}) {
    EXPECT_THAT(
        refusal_of(replaced(sample_text(), "\"gyro2.k0\"", '"' + std::string(state) + '"')),
        HasSubstr("covariance.states names \"" + std::string(state) + "\", which is not of any of the 2 gyros"));
  }
  EXPECT_THAT(refusal_of(replaced(sample_text(), "\"gyro2.k0\"", "\"gyro1.k0\"")),
              HasSubstr("names \"gyro1.k0\" twice"));
}

TEST(CalibrationJson, RefusesAMatrixThatIsNoCovariance) {
  Calibration calibration = sample_calibration();
  calibration.covariance(3, 4) *= 1.001;
  EXPECT_THAT(refusal_of(format_calibration(calibration)),
              HasSubstr("covariance.matrix is not symmetric at row 5, column 4"));
  calibration = sample_calibration();
  calibration.covariance(2, 2) = -1e-20;
  EXPECT_THAT(refusal_of(format_calibration(calibration)), HasSubstr("covariance.matrix[2] has a negative variance"));
  calibration = sample_calibration();
  calibration.covariance(2, 2) = std::nan("");
  EXPECT_THAT(refusal_of(format_calibration(calibration)), HasSubstr("covariance.matrix[2][2] is null"));
  calibration = sample_calibration();
  calibration.covariance.conservativeResize(20, 19);
  EXPECT_THAT(refusal_of(format_calibration(calibration)), HasSubstr("covariance.matrix[0] has 19 elements"));
  calibration.covariance = Eigen::MatrixXd::Identity(19, 19);
  EXPECT_THAT(refusal_of(format_calibration(calibration)), HasSubstr("covariance.matrix has 19 rows for 20 states"));
}

}  // namespace
}  // namespace trihedron::io
