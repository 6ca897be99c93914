#include "trihedron/io/calibration_message.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "fixtures.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"

namespace trihedron::io::acm_test {
namespace {

using testing::HasSubstr;
using testing::Not;

MessageDescription description() {
  MessageDescription d;
  d.created_utc = "2026-01-02T03:04:05";
  return d;
}

TEST(Acm, HoldsEachParameterAndItsSigma) {
  const Calibration calibration = sample_calibration();
  const std::string text = format_acm(calibration, {nullptr, nullptr, "c.nc"}, description(), MessageSyntax::kKvn);
  EXPECT_THAT(text, HasSubstr(fmt::format("EPOCH_TZERO = {}\n", format_epoch(calibration.epoch))));
  EXPECT_THAT(text, HasSubstr("ACM_DATA_ELEMENTS = AD, USER\n"));
  EXPECT_THAT(text, HasSubstr("USER_DEFINED_TRIHEDRON_COVARIANCE_FILE = c.nc\n"));
  EXPECT_THAT(text, Not(HasSubstr("ATT_START")));
  for (const ParameterId& state : calibration.states) {
    if (state.is_alignment()) {
      const std::string key = fmt::format("USER_DEFINED_TRIHEDRON_GYRO{}_ALIGN_{}", state.gyro() + 1,
                                          "XYZ"[static_cast<std::size_t>(state.component)]);
      EXPECT_THAT(text, HasSubstr(fmt::format("{}_RAD = {:.15e}\n", key, value_of(calibration, state))));
      EXPECT_THAT(text, HasSubstr(fmt::format("{}_SIGMA_RAD = {:.15e}\n", key, sigma_of(calibration, state))));
    }
  }
}

TEST(Acm, HoldsAttitudeAndDiagonalCovariance) {
  const Calibration calibration = sample_calibration();
  AttitudeMessage attitude;
  attitude.attitude.t = {calibration.epoch + std::chrono::milliseconds(1500),
                         calibration.epoch + std::chrono::seconds(3)};
  attitude.attitude.q_in_c = {Eigen::Quaterniond(0.8, 0.6, 0, 0), Eigen::Quaterniond(1, 0, 0, 0)};
  attitude.attitude.sigma_rad = {{1e-5, 2e-5, 3e-5}, {kNaN, 1e-5, 1e-5}};
  const std::string text = format_acm(calibration, {&attitude, nullptr, ""}, description(), MessageSyntax::kKvn);
  EXPECT_THAT(text, HasSubstr("ACM_DATA_ELEMENTS = ATT, COV, AD, USER\n"));
  EXPECT_THAT(text, HasSubstr("1.500 6.000000000000000e-01 0.000000000000000e+00 0.000000000000000e+00 "
                              "8.000000000000000e-01\n"));
  EXPECT_THAT(text, HasSubstr("1.500 3.282806e-07 1.313123e-06 2.954526e-06\n"));  // deg²
  EXPECT_THAT(text, Not(HasSubstr("nan")));
  EXPECT_THAT(format_acm(calibration, {&attitude, nullptr, ""}, description(), MessageSyntax::kXml),
              HasSubstr("<covLine>1.500 3.282806e-07"));
  EXPECT_THAT(text, Not(HasSubstr("RATE_TYPE")));
  const std::vector<Eigen::Vector3d> bias_rad_s = {{1e-6, 0, -2e-6}, {0, 0, 0}};
  for (const MessageSyntax syntax : {MessageSyntax::kKvn, MessageSyntax::kXml}) {
    const std::string biased = format_acm(calibration, {&attitude, nullptr, "", {}, bias_rad_s}, description(), syntax);
    EXPECT_THAT(biased, HasSubstr("8.000000000000000e-01 5.729578e-05 0.000000e+00 -1.145916e-04"));  // deg/s
    EXPECT_THAT(biased, HasSubstr("GYRO_BIAS"));
    EXPECT_EQ(refusal([&] { static_cast<void>(parse_calibration_message(biased, "c.acm")); }), "");
  }
}

/// Ten minutes at the rate of an orbit, with a turn of 20° in 60 s after 200 s, and back after 400 s.
AttitudeHistory with_slews() {
  AttitudeHistory attitude;
  for (int i = 0; i <= 200; ++i) {
    const double t_s = 3.0 * i;
    const double part = std::clamp((t_s - 200) / 60, 0.0, 1.0) - std::clamp((t_s - 400) / 60, 0.0, 1.0);
    attitude.t.push_back(sample_calibration().epoch + from_seconds(t_s));
    attitude.q_in_c.push_back(Eigen::Quaterniond(Eigen::AngleAxisd(1.1e-3 * t_s, Eigen::Vector3d::UnitY()) *
                                                 Eigen::AngleAxisd(0.35 * part, Eigen::Vector3d::UnitX())));
  }
  return attitude;
}

TEST(Slews, AreWhereTheBodyTurnsFast) {
  AttitudeHistory attitude = with_slews();
  std::vector<Manoeuvre> slews = slews_of(attitude, std::chrono::seconds(5));
  ASSERT_EQ(slews.size(), 2U);
  const Time epoch = sample_calibration().epoch;
  EXPECT_NEAR(to_seconds(slews[0].begin - epoch), 200, 3);
  EXPECT_NEAR(to_seconds(slews[0].end - epoch), 260, 3);
  EXPECT_NEAR(to_seconds(slews[1].begin - epoch), 400, 3);
  const auto after = static_cast<std::size_t>(std::ranges::find(attitude.t, slews[0].end) - attitude.t.begin());
  EXPECT_EQ(slews[0].target_q_in_c->coeffs(), attitude.q_in_c[after].normalized().coeffs());
  // Of what happens in a gap nothing is known; in steady flight there is none.
  const auto cut = [&](double begin_s, double end_s) {
    for (std::size_t i = attitude.size(); i-- > 0;) {
      const double t_s = to_seconds(attitude.t[i] - epoch);
      if (t_s > begin_s && t_s < end_s) {
        attitude.t.erase(attitude.t.begin() + static_cast<std::ptrdiff_t>(i));
        attitude.q_in_c.erase(attitude.q_in_c.begin() + static_cast<std::ptrdiff_t>(i));
      }
    }
  };
  cut(190, 270);
  EXPECT_EQ(slews_of(attitude, std::chrono::seconds(5)).size(), 1U);
  cut(390, 1000);
  EXPECT_TRUE(slews_of(attitude, std::chrono::seconds(5)).empty());
  EXPECT_TRUE(slews_of({}, std::chrono::seconds(5)).empty());
}

/// With two slews; the covariance is diagonal.
std::string with_manoeuvres(MessageSyntax syntax) {
  const Calibration calibration = sample_calibration();
  AttitudeMessage attitude;
  attitude.attitude = with_slews();
  return format_acm(calibration, {&attitude, nullptr, "", slews_of(attitude.attitude, std::chrono::seconds(5))},
                    description(), syntax);
}

TEST(Acm, HoldsSlewsAsManoeuvres) {
  const std::vector<Manoeuvre> slews = slews_of(with_slews(), std::chrono::seconds(5));
  for (const MessageSyntax syntax : {MessageSyntax::kKvn, MessageSyntax::kXml}) {
    const std::string text = with_manoeuvres(syntax);
    EXPECT_THAT(text, HasSubstr("ATT, MAN, AD, USER"));
    const std::vector<Manoeuvre> back = parse_calibration_message(text, "c.acm").manoeuvres;
    ASSERT_EQ(back.size(), slews.size());
    for (std::size_t i = 0; i < back.size(); ++i) {
      EXPECT_EQ(back[i].begin, slews[i].begin);
      EXPECT_EQ(back[i].end, slews[i].end);
      EXPECT_LT(back[i].target_q_in_c->angularDistance(*slews[i].target_q_in_c), 1e-14);
    }
  }
  const std::string lasting = replaced(with_manoeuvres(MessageSyntax::kKvn), "MAN_END_TIME = 261", "MAN_DURATION = 64");
  EXPECT_EQ(to_seconds(parse_calibration_message(lasting, "c.acm").manoeuvres[0].end - slews[0].begin), 64);
}

TEST(Acm, RefusesManoeuvresThatMakeNoSense) {
  const auto refused = [](std::string_view from, std::string_view to) {
    return refusal([&] {
      static_cast<void>(parse_calibration_message(replaced(with_manoeuvres(MessageSyntax::kKvn), from, to), "c.acm"));
    });
  };
  EXPECT_THAT(refused("MAN_PURPOSE = ATT_ADJUST\n", ""), HasSubstr("MAN has no MAN_PURPOSE"));
  EXPECT_THAT(refused("MAN_PURPOSE", "MAN_PORPOSE"), HasSubstr("is no keyword of MAN"));
  EXPECT_THAT(refused("MAN_END_TIME = 261", "MAN_END_TIME = 1"), HasSubstr("ends before it begins"));
  EXPECT_THAT(refused("MAN_END_TIME = 261.000", "MAN_END_TIME = 261.000 [min]"), HasSubstr("the unit of"));
  EXPECT_THAT(refused("MAN_END_TIME", "MAN_DURATION = 1 [h]\nMAN_ID2"), HasSubstr("is no keyword of MAN"));
  EXPECT_THAT(refused("MAN_END_TIME", "MAN_DURATION = 1\nMAN_END_TIME"), HasSubstr("are both there"));
  EXPECT_THAT(refused("MAN_END_TIME = 261.000", "MAN_DURATION = 1e99"), HasSubstr("MAN_DURATION is 1e99"));
  EXPECT_THAT(refused("TARGET_ATTITUDE = ", "TARGET_ATTITUDE = 1 "), HasSubstr("give a unit quaternion"));
}

TEST(Acm, IsNotInTdb) {
  MessageDescription d = description();
  d.time_scale = TimeScale::kTdb;
  EXPECT_THROW(static_cast<void>(format_acm(sample_calibration(), {}, d, MessageSyntax::kKvn)), UsageError);
}

TEST(Acm, CovarianceThatCannotBeWrittenIsAFailureOfTheMachine) {
  const TemporaryDirectory directory;
  EXPECT_THROW(write_covariance(directory / "no" / "c.nc", sample_calibration()), MachineFailed);
  EXPECT_TRUE(directory.names().empty());
}

/// With everything that a message can hold: another drift model for the second gyro, clocks, a drift field.
Calibration full_calibration() {
  Calibration calibration = sample_calibration();
  calibration.start_up = "2009-05 first";
  GyroCalibration& second = calibration.gyros[1];
  second.drift_model = vsh(2);
  second.drift_rad_s.clear();
  for (std::size_t i = 0; i < coefficients_of(second.drift_model).size(); ++i) {
    second.drift_rad_s.push_back(1e-7 * (1 + static_cast<double>(i)) / 3);
  }
  calibration.states = drift_and_alignment(kEsg7, 1);
  for (const DriftCoefficient& coefficient : coefficients_of(second.drift_model)) {
    calibration.states.push_back(ParameterId::drift(1, coefficient));
  }
  for (int axis = 0; axis < 3; ++axis) {
    calibration.states.push_back(ParameterId::alignment(1, axis));
  }
  const auto n = static_cast<Eigen::Index>(calibration.states.size());
  Eigen::MatrixXd root = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    root(i, (i * 7) % n) += 0.3;
  }
  calibration.covariance = root * root.transpose() * (1e-14 / 3);
  calibration.covariance = (calibration.covariance + calibration.covariance.transpose()).eval() / 2;
  calibration.clocks = ClockCorrection{-0.125 / 3, 1e-6 / 7, {}};
  calibration.clocks->late_s[1] = 1e-3 / 3;
  calibration.drift_field = {{1, DriftCoefficient::Member::kD, 3, 1e-9 / 3, 1.5},
                             {0, DriftCoefficient::Member::kW, 2, 0, 7}};
  for (std::size_t k = 0; k < 2; ++k) {
    OrbitalDrift& drift = calibration.gyros[k].orbital_drift.emplace();
    drift.rate_rad_s = 1.1e-3 / 3;
    drift.zero_at = calibration.epoch;
    for (int i = 0; i < 6; ++i) {
      const double value = 1e-8 * (i - 2.0 + 4.0 * static_cast<double>(k)) / 3;
      (i < 3 ? drift.sine_rad_s : drift.cosine_rad_s)(i % 3) = value;
      calibration.further.push_back({ParameterId::further(FurtherState::kOrbitalDrift, k, i), value, 1e-9 / 3});
    }
    PolhodeDrift& polhode = calibration.gyros[k].polhode.emplace();
    polhode.polhode = {5000.3F + 700.0F * static_cast<float>(k), 0.03F};
    polhode.zero_at = calibration.epoch;
    for (int i = 0; i < Layout::kPolhode; ++i) {
      const double value = 1e-8 * (i - 5.0 + 3.0 * static_cast<double>(k)) / 3;
      (i < Layout::kEq1 ? polhode.sine_rad_s : polhode.cosine_rad_s)(i % Layout::kEq1) = value;
      calibration.further.push_back({ParameterId::further(FurtherState::kPolhode, k, i), value, 1e-9 / 3});
    }
  }
  calibration.determined = Determined{13, 14};
  calibration.statistics.innovation_rms_rad = {1e-5 / 3, 2e-5, 3e-5, 4e-5 / 7};
  return calibration;
}

/// As export writes them, and read again.
CalibrationMessage there_and_back(const Calibration& calibration, const TemporaryDirectory& directory,
                                  MessageSyntax syntax, TimeScale scale) {
  MessageDescription d = description();
  d.time_scale = scale;
  write_covariance(directory / "c.nc", calibration);
  return parse_calibration_message(format_acm(calibration, {nullptr, nullptr, "c.nc"}, d, syntax), directory / "c.acm");
}

void expect_near(double a, double b) { EXPECT_LE(std::abs(a - b), 1e-15 * std::abs(a)) << a << " and " << b; }

/// Numbers to the 16 digits of the message, the covariance bit by bit.
void expect_same(const Calibration& a, const Calibration& b) {
  EXPECT_EQ(a.estimator, b.estimator);
  EXPECT_EQ(a.epoch, b.epoch);
  EXPECT_EQ(a.t, b.t);
  EXPECT_EQ(a.start_up, b.start_up);
  ASSERT_EQ(a.gyros.size(), b.gyros.size());
  for (std::size_t k = 0; k < a.gyros.size(); ++k) {
    EXPECT_EQ(a.gyros[k].drift_model, b.gyros[k].drift_model);
    ASSERT_EQ(a.gyros[k].drift_rad_s.size(), b.gyros[k].drift_rad_s.size());
    for (std::size_t i = 0; i < a.gyros[k].drift_rad_s.size(); ++i) {
      expect_near(a.gyros[k].drift_rad_s[i], b.gyros[k].drift_rad_s[i]);
    }
    for (int axis = 0; axis < 3; ++axis) {
      expect_near(a.gyros[k].alignment_rotation_vector_rad(axis), b.gyros[k].alignment_rotation_vector_rad(axis));
      expect_near(a.gyros[k].momentum_in(axis), b.gyros[k].momentum_in(axis));
      expect_near(a.gyros[k].readout_bias(axis), b.gyros[k].readout_bias(axis));
    }
    ASSERT_EQ(a.gyros[k].orbital_drift.has_value(), b.gyros[k].orbital_drift.has_value());
    if (a.gyros[k].orbital_drift) {
      expect_near(a.gyros[k].orbital_drift->rate_rad_s, b.gyros[k].orbital_drift->rate_rad_s);
      EXPECT_EQ(a.gyros[k].orbital_drift->zero_at, b.gyros[k].orbital_drift->zero_at);
      for (int axis = 0; axis < 3; ++axis) {
        expect_near(a.gyros[k].orbital_drift->sine_rad_s(axis), b.gyros[k].orbital_drift->sine_rad_s(axis));
        expect_near(a.gyros[k].orbital_drift->cosine_rad_s(axis), b.gyros[k].orbital_drift->cosine_rad_s(axis));
      }
    }
    ASSERT_EQ(a.gyros[k].polhode.has_value(), b.gyros[k].polhode.has_value());
    if (a.gyros[k].polhode) {
      EXPECT_EQ(a.gyros[k].polhode->polhode.period_s, b.gyros[k].polhode->polhode.period_s);
      EXPECT_EQ(a.gyros[k].polhode->polhode.period_rate, b.gyros[k].polhode->polhode.period_rate);
      EXPECT_EQ(a.gyros[k].polhode->zero_at, b.gyros[k].polhode->zero_at);
      for (int i = 0; i < Layout::kEq1; ++i) {
        expect_near(a.gyros[k].polhode->sine_rad_s(i), b.gyros[k].polhode->sine_rad_s(i));
        expect_near(a.gyros[k].polhode->cosine_rad_s(i), b.gyros[k].polhode->cosine_rad_s(i));
      }
    }
  }
  EXPECT_EQ(a.states, b.states);
  EXPECT_EQ(a.covariance, b.covariance);
  ASSERT_EQ(a.further.size(), b.further.size());
  for (std::size_t i = 0; i < a.further.size(); ++i) {
    EXPECT_EQ(a.further[i].parameter, b.further[i].parameter);
    expect_near(a.further[i].value, b.further[i].value);
    expect_near(a.further[i].sigma, b.further[i].sigma);
  }
  ASSERT_EQ(a.clocks.has_value(), b.clocks.has_value());
  if (a.clocks) {
    expect_near(a.clocks->offset_s, b.clocks->offset_s);
    expect_near(a.clocks->rate_s_s, b.clocks->rate_s_s);
    expect_near(a.clocks->late_s[1], b.clocks->late_s[1]);
  }
  ASSERT_TRUE(b.noise);
  expect_near(a.noise->direction_random_walk_rad_sqrt_s, b.noise->direction_random_walk_rad_sqrt_s);
  expect_near(a.noise->wandering_drift_rad_s, b.noise->wandering_drift_rad_s);
  expect_near(a.noise->wandering_time_s, b.noise->wandering_time_s);
  for (int axis = 0; axis < 3; ++axis) {
    expect_near((*a.noise->star_tracker_noise_rad)(axis), (*b.noise->star_tracker_noise_rad)(axis));
  }
  ASSERT_TRUE(b.on_board_drift);
  EXPECT_EQ(a.on_board_drift->drift_model, b.on_board_drift->drift_model);
  expect_near(a.on_board_drift->random_walk_rad_sqrt_s, b.on_board_drift->random_walk_rad_sqrt_s);
  ASSERT_EQ(a.drift_field.size(), b.drift_field.size());
  for (std::size_t i = 0; i < a.drift_field.size(); ++i) {
    EXPECT_EQ(a.drift_field[i].gyro, b.drift_field[i].gyro);
    EXPECT_EQ(a.drift_field[i].potential, b.drift_field[i].potential);
    EXPECT_EQ(a.drift_field[i].degree, b.drift_field[i].degree);
    expect_near(a.drift_field[i].rms_rad_s, b.drift_field[i].rms_rad_s);
    expect_near(a.drift_field[i].sigma_factor, b.drift_field[i].sigma_factor);
  }
  ASSERT_EQ(a.determined.has_value(), b.determined.has_value());
  if (a.determined) {
    EXPECT_EQ(a.determined->coefficients, b.determined->coefficients);
    EXPECT_EQ(a.determined->of, b.determined->of);
  }
  EXPECT_EQ(a.verdict.trustworthy, b.verdict.trustworthy);
  ASSERT_EQ(a.verdict.findings.size(), b.verdict.findings.size());
  for (std::size_t i = 0; i < a.verdict.findings.size(); ++i) {
    EXPECT_EQ(a.verdict.findings[i].code, b.verdict.findings[i].code);
    EXPECT_EQ(a.verdict.findings[i].severity, b.verdict.findings[i].severity);
  }
  const auto statistics = named_values(a.statistics);
  const auto read = named_values(b.statistics);
  ASSERT_EQ(statistics.size(), read.size());
  for (std::size_t i = 0; i < statistics.size(); ++i) {
    EXPECT_EQ(statistics[i].first, read[i].first);
    expect_near(statistics[i].second, read[i].second);
  }
}

TEST(Acm, ComesBack) {
  for (const Calibration& calibration : {sample_calibration(), full_calibration()}) {
    for (const MessageSyntax syntax : {MessageSyntax::kKvn, MessageSyntax::kXml}) {
      for (const TimeScale scale : {TimeScale::kTai, TimeScale::kUtc, TimeScale::kGps, TimeScale::kTt}) {
        const TemporaryDirectory directory;
        const CalibrationMessage message = there_and_back(calibration, directory, syntax, scale);
        EXPECT_TRUE(message.has_full_covariance);
        EXPECT_EQ(message.time_system, name_of(scale));
        EXPECT_EQ(message.inertial_frame, "GCRF");
        EXPECT_EQ(message.body_frame, "SC_BODY_1");
        expect_same(calibration, message.calibration);
        // And it is a calibration for every command.
        expect_same(calibration, parse_calibration(format_calibration(message.calibration), "calibration.json"));
      }
    }
  }
}

TEST(Acm, RefusesDriftAtOrbitalPeriodWithoutItsRate) {
  std::string text = format_acm(full_calibration(), {nullptr, nullptr, "c.nc"}, description(), MessageSyntax::kKvn);
  const std::size_t begin = text.rfind('\n', text.find("ORBITAL_RATE_RAD_S"));
  text.erase(begin, text.find('\n', begin + 1) - begin);
  EXPECT_THAT(refusal([&] { static_cast<void>(parse_calibration_message(text, "c.acm")); }),
              HasSubstr("no ORBITAL_RATE_RAD_S"));
}

TEST(Acm, RefusesAmplitudesOfAPolhodeWithoutItsPeriod) {
  std::string text = format_acm(full_calibration(), {nullptr, nullptr, "c.nc"}, description(), MessageSyntax::kKvn);
  for (const std::string key : {"GYRO2_POLHODE_PERIOD_S", "GYRO2_POLHODE_PERIOD_RATE"}) {
    const std::size_t begin = text.rfind('\n', text.find(key));
    text.erase(begin, text.find('\n', begin + 1) - begin);
  }
  EXPECT_THAT(refusal([&] { static_cast<void>(parse_calibration_message(text, "c.acm")); }),
              HasSubstr("no POLHODE_PERIOD_S"));
}

TEST(Acm, WithoutItsCovarianceFileHasTheSigmas) {
  const TemporaryDirectory directory;
  const Calibration calibration = full_calibration();
  const CalibrationMessage message = parse_calibration_message(
      format_acm(calibration, {nullptr, nullptr, "c.nc"}, description(), MessageSyntax::kKvn), directory / "c.acm");
  EXPECT_FALSE(message.has_full_covariance);
  EXPECT_EQ(message.covariance_file, directory / "c.nc");
  EXPECT_EQ(message.calibration.states, calibration.states);
  EXPECT_TRUE(message.calibration.covariance.isDiagonal());
  for (const ParameterId& state : calibration.states) {
    expect_near(sigma_of(calibration, state) / 2, sigma_of(message.calibration, state) / 2);
  }
}

TEST(Acm, RefusesTheCovarianceOfAnotherCalibration) {
  const TemporaryDirectory directory;
  const Calibration calibration = sample_calibration();
  const std::string text = format_acm(calibration, {nullptr, nullptr, "c.nc"}, description(), MessageSyntax::kKvn);
  const auto reason = [&] { return refusal([&] { return parse_calibration_message(text, directory / "c.acm"); }); };
  Calibration other = calibration;
  other.covariance(2, 2) *= 1.001;
  write_covariance(directory / "c.nc", other);
  EXPECT_THAT(reason(), HasSubstr("has another sigma of gyro1.mu23 than the message"));
  write_covariance(directory / "c.nc", full_calibration());
  EXPECT_THAT(reason(), HasSubstr("whose sigma the message does not have"));
  other = calibration;
  other.states.pop_back();
  other.covariance = Eigen::MatrixXd(calibration.covariance.topLeftCorner(19, 19));
  write_covariance(directory / "c.nc", other);
  EXPECT_THAT(reason(), HasSubstr("has 19 states, the message 20"));
  other = calibration;
  other.covariance(3, 4) *= 2;
  write_covariance(directory / "c.nc", other);
  EXPECT_THAT(reason(), HasSubstr("not symmetric"));
}

/// The text of a message with an attitude, in which `from` is replaced, gives this reason.
struct Wrong {
  const char* from;
  const char* to;
  const char* reason;
};

TEST(Acm, RefusesWhatIsWrong) {
  const Calibration calibration = sample_calibration();
  AttitudeMessage attitude;
  attitude.attitude.t = {calibration.epoch + std::chrono::milliseconds(1500),
                         calibration.epoch + std::chrono::seconds(3)};
  attitude.attitude.q_in_c = {Eigen::Quaterniond(0.8, 0.6, 0, 0), Eigen::Quaterniond(1, 0, 0, 0)};
  attitude.attitude.sigma_rad = {{1e-5, 2e-5, 3e-5}, {1e-5, 1e-5, 1e-5}};
  const std::string text = format_acm(calibration, {&attitude, nullptr, ""}, description(), MessageSyntax::kKvn);
  const std::string prefix = "USER_DEFINED_TRIHEDRON_";
  const std::string xml = format_acm(calibration, {&attitude, nullptr, ""}, description(), MessageSyntax::kXml);
  EXPECT_FALSE(parse_calibration_message(text, "c.acm").has_full_covariance);
  const Wrong wrong[] = {
      {"VERS = 2.0", "VERS = 1.0", "version \"1.0\" of the ACM is not known"},
      {"CREATION_DATE", "CREATED", "is no keyword of the header"},
      {"CREATION_DATE = 2026", "CREATION_DATE = 26", "CREATION_DATE: "},
      {"TIME_SYSTEM = TAI", "TIME_SYSTEM = LOCAL", "time system \"LOCAL\" is not known"},
      {"TIME_SYSTEM = TAI", "TIME_SYSTEM = TDB", "TIME_SYSTEM is TDB"},
      {"TIME_SYSTEM = TAI\n", "", "metadata has no TIME_SYSTEM"},
      {"EPOCH_TZERO = 2009-05", "EPOCH_TZERO = 2009-25", "2009-25"},
      {"EPOCH_TZERO", "EPOCH_ZERO", "did you mean \"EPOCH_TZERO\""},
      {"START_TIME = 1.500", "START_TIME = 2.5", "lies outside START_TIME and STOP_TIME"},
      {"STOP_TIME = 32400.125", "STOP_TIME = 1", "STOP_TIME is before START_TIME"},
      {"\n3.000 0", "\n1.500 0", "is not later than the one before"},
      {"\n3.000 0", "\n3.000 1 0", "the line has 6 values, not 5"},
      {"\n3.000 0", "\n3.000 x", "is not a number"},
      {"REF_FRAME_A = GCRF", "REF_FRAME_A = ITRF2014", "\"ITRF2014\" is neither an inertial frame"},
      {"REF_FRAME_B = SC_BODY_1", "REF_FRAME_B = ICRF", "both frames are inertial"},
      {"REF_FRAME_B = SC_BODY_1", "REF_FRAME_B = SC_BODY_2", "the frames of ATT are not those of AD"},
      {"AD_START", "BD_START", "begins no block that there is"},
      {"AD_STOP", "USER_STOP", "ends a block that has not begun"},
      {"USER_STOP\n", "", "the file ends without USER_STOP"},
      {"VERDICT = DO NOT USE", "VERDICT = FINE", "VERDICT is \"FINE\""},
      {"VERDICT = DO NOT USE\n", "VERDICT = DO NOT USE\nUSER_DEFINED_TRIHEDRON_VERDICT = TRUSTWORTHY\n",
       "is there twice"},
      {"SEVERITIES = do-not-use", "SEVERITIES = warning do-not-use", "SEVERITIES has 3 words, FINDINGS 2"},
      {"SEVERITIES = do-not-use", "SEVERITIES = fatal", "severity \"fatal\" is not known"},
      {"ESTIMATOR = invariant", "ESTIMATOR = other", "ESTIMATOR is \"other\""},
      {"GYROS = 2", "GYROS = 3", "have no USER_DEFINED_TRIHEDRON_GYRO3_DRIFT_MODEL"},
      {"GYROS = 2", "GYROS = 1", "is no keyword of a calibration"},
      {"GYROS = 2", "GYROS = 2.5", "it is a whole number from 1 to 4"},
      {"GYRO1_DRIFT_MODEL = esg7", "GYRO1_DRIFT_MODEL = esg9", "no drift model"},
      {"GYRO1_DRIFT_MODEL = esg7", "GYRO1_DRIFT_MODEL = vsh:1", "have no USER_DEFINED_TRIHEDRON_GYRO1_W"},
      {"GYRO1_K0_RAD_S", "GYRO1_W_2_M1_RAD_S", "have no USER_DEFINED_TRIHEDRON_GYRO1_K0_RAD_S"},
      {"USER_STOP", "USER_DEFINED_TRIHEDRON_GYRO1_W_3_M1_RAD_S = 1e-9\nUSER_STOP",
       "W(3,-1) is not a coefficient of the drift model esg7 of gyro 1"},
      {"GYRO1_K0_RAD_S = ", "GYRO1_K0_RAD_S = 9999999", "GYRO1_K0_RAD_S is "},
      {"GYRO1_K0_SIGMA_RAD_S = ", "GYRO1_K0_SIGMA_RAD_S = -", "GYRO1_K0_SIGMA_RAD_S is -"},
      {"GYRO1_MOMENTUM_IN_X = 4", "GYRO1_MOMENTUM_IN_X = 5", "GYRO1_MOMENTUM_IN is not a unit vector"},
      {"GYRO1_ALIGN_X_RAD = 3", "GYRO1_ALIGN_X_RAD = 0x3", "is not a number"},
      {"GYRO2_COSINE_BIAS_Z = 6", "GYRO2_COSINE_BIAS_Z = 6000000", "GYRO2_COSINE_BIAS_Z is 60"},
      {"CLOCK_OFFSET_S_SIGMA = ", "CLOCK_OFFSET_S_SIGMA = 1e9 ", "is not a number"},
      {"CLOCK_OFFSET_S_SIGMA", "CLOCK_OFFSET_SIGMA", "have no USER_DEFINED_TRIHEDRON_CLOCK_OFFSET_S_SIGMA"},
      {"CLOCK_OFFSET_S =", "CLOCK_DRIFT_S =", "is no keyword of a calibration; did you mean"},
      {"EPOCH_S = 32400.125", "EPOCH_S = 32400.125 [s]", "has a unit in brackets"},
      {"NOISE_STAR_TRACKER_RAD = ", "NOISE_STAR_TRACKER_RAD = 1 ", "NOISE_STAR_TRACKER_RAD has 4 values"},
      {"ON_BOARD_DRIFT_MODEL = vsh:3", "ON_BOARD_DRIFT_MODEL = vsh:9",
       "ON_BOARD_DRIFT_MODEL is \"vsh:9\", no drift model"},
      {"ON_BOARD_DRIFT_MODEL = vsh:3", "ON_BOARD_DRIFT_MODEL = vsh:8", "there is room for degree 6 and less"},
      {"STATISTIC_NIS_MEAN = ", "STATISTIC_NIS_MEAN = x", "is not a number"},
  };
  for (const Wrong& one : wrong) {
    const std::string spoilt = replaced(text, one.from, one.to);
    EXPECT_THAT(refusal([&] { return parse_calibration_message(spoilt, "c.acm"); }),
                testing::AllOf(testing::StartsWith("c.acm:"), HasSubstr(one.reason), HasSubstr("; ")))
        << one.from << " -> " << one.to;
  }
  const Wrong wrong_xml[] = {
      {"</user>", "", "is no whole XML"},
      {"<body>", "<body><x/>", "does not consist of"},
      {"id=\"CCSDS_ACM_VERS\"", "id=\"CCSDS_AEM_VERS\"", "its root has no id"},
      {"parameter=\"TRIHEDRON_VERDICT\"", "", "has no parameter"},
      {"<ad>", "<bd><A/></bd><ad>", "<bd> is no block that there is"},
      {"<TIME_SYSTEM>TAI", "<TIME_SYSTEM><b/>TAI", "holds more than a text"},
      {"<TIME_SYSTEM>TAI", "<TIME_SYSTEM>ET", "time system \"ET\""},
      {"<covLine>3.000", "<covLine>1.000", "is not later than the one before"},
      {"<USER_DEFINED parameter=\"TRIHEDRON_EPOCH_S\">", "<USER_DEFINED parameter=\"TRIHEDRON_EPOCH_S\" units=\"min\">",
       "has a unit"},
  };
  for (const Wrong& one : wrong_xml) {
    const std::string spoilt = replaced(xml, one.from, one.to);
    EXPECT_THAT(refusal([&] { return parse_calibration_message(spoilt, "c.xml"); }),
                testing::AllOf(testing::StartsWith("c.xml:"), HasSubstr(one.reason), HasSubstr("; ")))
        << one.from << " -> " << one.to;
  }
  // Of others: read over.
  EXPECT_EQ(parse_calibration_message(replaced(text, "USER_STOP", "USER_DEFINED_MISSION = 7\nUSER_STOP"), "c.acm")
                .calibration.gyros.size(),
            2U);
  EXPECT_THAT(refusal([&] {
                return parse_calibration_message(
                    replaced(text, "USER_STOP", prefix + "COVARIANCE_FILE = ../c.nc\nUSER_STOP"), "c.acm");
              }),
              HasSubstr("without a directory"));
}

AttitudeMessage one_attitude() {
  AttitudeMessage message;
  message.attitude.t = {sample_calibration().epoch + std::chrono::nanoseconds(1500000001)};
  message.attitude.q_in_c = {Eigen::Quaterniond(0.1, -0.7, 0.5, 0.5).normalized()};
  message.rate_rad_s = {{1e-3 / 3, -2e-3 / 7, 0.1}};
  return message;
}

TEST(Apm, ComesBack) {
  AttitudeMessage message = one_attitude();
  for (const bool with_rate : {true, false}) {
    for (const MessageSyntax syntax : {MessageSyntax::kKvn, MessageSyntax::kXml}) {
      for (const TimeScale scale :
           {TimeScale::kTai, TimeScale::kUtc, TimeScale::kGps, TimeScale::kTt, TimeScale::kTdb}) {
        MessageDescription d = description();
        d.time_scale = scale;
        const Time epoch = sample_calibration().epoch;
        const AttitudeMessage back = parse_attitude_message(format_apm(message, 0, epoch, d, syntax), "a.apm");
        EXPECT_EQ(back.epoch, epoch);
        EXPECT_EQ(back.attitude.t, message.attitude.t);
        EXPECT_LE((back.attitude.q_in_c[0].coeffs() - message.attitude.q_in_c[0].coeffs()).norm(), 1e-15);
        ASSERT_EQ(back.rate_rad_s.size(), message.rate_rad_s.size());
        if (with_rate) {
          EXPECT_LE((back.rate_rad_s[0] - message.rate_rad_s[0]).norm(), 1e-16);  // of 0.1 rad/s, 16 digits
        }
        EXPECT_EQ(back.time_system, name_of(scale));
      }
    }
    message.rate_rad_s.clear();
  }
}

/// Of the same attitude, told from the other side and in other axes.
TEST(Apm, IsReadInEitherDirectionAndInTheAxesOfEither) {
  const AttitudeMessage message = one_attitude();
  const Eigen::Quaterniond& q = message.attitude.q_in_c[0];
  const Eigen::Vector3d& rate = message.rate_rad_s[0];
  for (const bool reversed : {false, true}) {
    for (const bool in_inertial_axes : {false, true}) {
      AttitudeMessage told = message;
      told.attitude.q_in_c[0] = reversed ? q.conjugate() : q;
      Eigen::Vector3d value = in_inertial_axes ? Eigen::Vector3d(q * rate) : rate;
      told.rate_rad_s[0] = reversed ? Eigen::Vector3d(-value) : value;
      std::string text = format_apm(told, 0, message.attitude.t[0], description(), MessageSyntax::kKvn);
      text = replaced(text, "ANGVEL_FRAME = SC_BODY_1",
                      in_inertial_axes ? "ANGVEL_FRAME = GCRF" : "ANGVEL_FRAME = SC_BODY_1");
      if (reversed) {
        for (int i = 0; i < 2; ++i) {
          text = replaced(text, "REF_FRAME_A = GCRF\nREF_FRAME_B = SC_BODY_1",
                          "REF_FRAME_A = SC_BODY_1\nREF_FRAME_B = GCRF");
        }
      }
      const AttitudeMessage back = parse_attitude_message(text, "a.apm");
      EXPECT_LE((back.attitude.q_in_c[0].coeffs() - q.coeffs()).norm(), 1e-15);
      EXPECT_LE((back.rate_rad_s[0] - rate).norm(), 1e-15) << reversed << in_inertial_axes;
      EXPECT_EQ(back.inertial_frame, "GCRF");
    }
  }
}

/// The standard's examples have no delimiters about the metadata, and some writers give them.
TEST(Apm, MayDelimitItsMetadata) {
  const std::string text = format_apm(one_attitude(), 0, Time{}, description(), MessageSyntax::kKvn);
  const std::string delimited = replaced(replaced(text, "OBJECT_NAME", "META_START\nOBJECT_NAME"),
                                         "TIME_SYSTEM = TAI\n", "TIME_SYSTEM = TAI\nMETA_STOP\n");
  EXPECT_EQ(parse_attitude_message(delimited, "a.apm").attitude.q_in_c[0].coeffs(),
            parse_attitude_message(text, "a.apm").attitude.q_in_c[0].coeffs());
  const std::string without_epoch = replaced(delimited, "\nEPOCH =", "\nCOMMENT");
  EXPECT_THAT(refusal([&] { return parse_attitude_message(without_epoch, "a.apm"); }), HasSubstr("data has no EPOCH"));
}

TEST(Apm, RefusesWhatIsWrong) {
  const std::string text = format_apm(one_attitude(), 0, Time{}, description(), MessageSyntax::kKvn);
  const Wrong wrong[] = {
      {"VERS = 2.0", "VERS = 1.0", "version \"1.0\" of the APM is not known"},
      {"OBJECT_ID = UNKNOWN\n", "", "metadata has no OBJECT_ID"},
      {"TIME_SYSTEM = TAI", "TIME_SYSTEM = MET", "time system \"MET\" is not known"},
      {"EPOCH = 2009-05-20T", "EPOCH = 2009-05-32T", "2009-05-32"},
      {"\nEPOCH = ", "\nCOMMENT ", "data has no EPOCH"},
      {"REF_FRAME_A = GCRF", "REF_FRAME_A = LVLH", "\"LVLH\" is neither an inertial frame"},
      {"REF_FRAME_B = SC_BODY_1", "REF_FRAME_B = SC_BODY_2", "frames of ANGVEL are not those of QUAT"},
      {"ANGVEL_FRAME = SC_BODY_1", "ANGVEL_FRAME = SC_BODY_2", "is neither of the two frames"},
      {"[deg/s]", "[rad/s]", "the unit of ANGVEL_X is \"rad/s\""},
      {"Q3 = ", "Q3 = 9", "the quaternion has the norm"},
      {"Q2 = ", "Q1 = ", "\"Q1\" is there twice"},
      {"Q3 = ", "Q4 = ", "\"Q4\" is no keyword of QUAT"},
      {"QC = ", "QC = ?", "is not a number"},
      {"QUAT", "SPIN", "ends a block that has not begun"},
  };
  for (const Wrong& one : wrong) {
    const std::string spoilt = replaced(text, one.from, one.to);
    EXPECT_THAT(refusal([&] { return parse_attitude_message(spoilt, "a.apm"); }),
                testing::AllOf(testing::StartsWith("a.apm:"), HasSubstr(one.reason), HasSubstr("; ")))
        << one.from << " -> " << one.to;
  }
}

}  // namespace
}  // namespace trihedron::io::acm_test
