#include <fmt/format.h>
#include <gmock/gmock.h>

#include "fixtures.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/io/calibration.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::io {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

class PassToml : public testing::Test {
 protected:
  PassToml() { clean_pass().save_directory(directory_.path()); }

  PassSettings read_with(std::string_view toml) {
    write_text(directory_ / "pass.toml", toml);
    return read_pass(directory_.path()).pass.settings;
  }
  std::string refusal_with(std::string_view toml) {
    return refusal([&] { static_cast<void>(read_with(toml)); });
  }

  TemporaryDirectory directory_;
  const std::string toml_ = clean_pass().toml;
};

TEST_F(PassToml, GivesEveryGyroTheCommonPrior) {
  const PassSettings settings = read_with(toml_);
  ASSERT_EQ(settings.gyros.size(), 2U);
  for (const GyroPrior& gyro : settings.gyros) {
    EXPECT_EQ(gyro.readout_noise_rad, 1e-5);
    EXPECT_EQ(gyro.drift_common_sigma_rad_s, 2e-6);
    EXPECT_EQ(gyro.alignment_sigma_rad, Eigen::Vector3d(8e-3, 8e-3, 8e-3));
  }
  EXPECT_EQ(settings.star_tracker_noise_rad, Eigen::Vector3d(1e-5, 2e-5, 9e-5));
}

TEST_F(PassToml, CorrectsStampsWhenThePassIsRead) {
  const Pass given = read_pass(directory_.path()).pass;
  write_text(directory_ / "pass.toml",
             toml_ + "clock_offset_s = 1.5\nclock_rate_s_s = 1e-3\n[[gyro.unit]]\n[[gyro.unit]]\nlatency_s = 0.25\n");
  const Pass corrected = read_pass(directory_.path()).pass;
  // The last fixes lie after the end of the pass.
  ASSERT_GT(corrected.star_tracker.size(), 25U);
  for (std::size_t i = 0; i < corrected.star_tracker.size(); ++i) {
    const double given_s = to_seconds(given.star_tracker.t[i] - given.settings.epoch);
    EXPECT_NEAR(to_seconds(corrected.star_tracker.t[i] - given.settings.epoch), 1.001 * given_s + 1.5, 2e-9);
  }
  EXPECT_EQ(corrected.gyro.direction(7, 0), given.gyro.direction(7, 0));
  const Eigen::Vector3d later = (given.gyro.direction(7, 1) + given.gyro.direction(8, 1)) / 2;
  EXPECT_LT((corrected.gyro.direction(7, 1) - later).norm(), 1e-15);
  // What is written is what was corrected, and says nothing of it any more.
  write_pass(directory_ / "again", corrected, nullptr);
  const Pass again = read_pass(directory_ / "again").pass;
  EXPECT_EQ(again.star_tracker.t, corrected.star_tracker.t);
  EXPECT_THAT(refusal_with(toml_ + "clock_rate_s_s = 1\n"), HasSubstr("clock_rate_s_s"));
}

TEST_F(PassToml, UnitOverridesTheCommonPriorOfItsGyro) {
  const PassSettings settings = read_with(toml_ + R"(
[[gyro.unit]]
drift_prior_rad_s = {k0 = 1e-6, nu31 = -2e-7}
drift_prior_sigma_rad_s = {k0 = 1e-8}
alignment_prior_rotation_vector_rad = [1e-3, 0, -1e-3]
alignment_prior_sigma_rad = [1e-4, 2e-4, 3e-4]
readout_noise_rad = 2e-5
[[gyro.unit]]
drift_prior_sigma_rad_s = 5e-8
alignment_prior_sigma_rad = 1e-5
)");
  const GyroPrior& first = settings.gyros[0];
  EXPECT_EQ(first.drift_rad_s, (std::map<DriftCoefficient, double>{{DriftCoefficient::of_eq1(Esg7::kK0), 1e-6},
                                                                   {DriftCoefficient::of_eq1(Esg7::kNu31), -2e-7}}));
  EXPECT_EQ(first.drift_sigma_rad_s, (std::map<DriftCoefficient, double>{{DriftCoefficient::of_eq1(Esg7::kK0), 1e-8}}));
  EXPECT_EQ(first.drift_common_sigma_rad_s, 2e-6);
  EXPECT_EQ(first.alignment_rotation_vector_rad, Eigen::Vector3d(1e-3, 0, -1e-3));
  EXPECT_EQ(first.alignment_sigma_rad, Eigen::Vector3d(1e-4, 2e-4, 3e-4));
  EXPECT_EQ(first.readout_noise_rad, 2e-5);
  const GyroPrior& second = settings.gyros[1];
  EXPECT_EQ(second.drift_common_sigma_rad_s, 5e-8);
  EXPECT_EQ(second.alignment_sigma_rad, Eigen::Vector3d(1e-5, 1e-5, 1e-5));
  EXPECT_EQ(second.readout_noise_rad, 1e-5);
}

TEST_F(PassToml, PriorIsReadBesideTheFileFromEitherPlace) {
  write_calibration(directory_ / "earlier.json", sample_calibration());
  for (const std::string& text :
       {"prior = \"earlier.json\"\n" + toml_, replaced(toml_, "duration_s", "prior = \"earlier.json\"\nduration_s")}) {
    const PassSettings settings = read_with(text);
    ASSERT_TRUE(settings.prior.has_value());
    EXPECT_EQ(settings.prior->states, sample_calibration().states);
  }
}

TEST_F(PassToml, MayNameTheStartUpOfTheRotors) {
  EXPECT_EQ(read_with(toml_).start_up, "");
  EXPECT_EQ(read_with(replaced(toml_, "[gyro]", "[gyro]\nstart_up = \"2009-05-20\"")).start_up, "2009-05-20");
  EXPECT_THAT(refusal_with(replaced(toml_, "[gyro]", "[gyro]\nstart_up = 2009-05-20")),
              HasSubstr("\"start_up\" is a date or time; make it a string"));
}

TEST_F(PassToml, RefusesBadPriors) {
  EXPECT_THAT(refusal_with("prior = \"none.json\"\n" + toml_), HasSubstr("none.json: cannot be opened"));
  write_calibration(directory_ / "earlier.json", sample_calibration());
  EXPECT_THAT(refusal_with("prior = \"earlier.json\"\n" + replaced(toml_, "duration_s", "prior = \"x\"\nduration_s")),
              HasSubstr("pass.toml:1:9: \"prior\" is there twice"));
  EXPECT_THAT(refusal_with("prior = \"\"\n" + toml_), HasSubstr("not a regular file"));
  Calibration three = sample_calibration();
  three.gyros.push_back(three.gyros[0]);
  write_calibration(directory_ / "earlier.json", three);
  EXPECT_THAT(refusal_with("prior = \"earlier.json\"\n" + toml_),
              HasSubstr("earlier.json: has 3 gyros, the telemetry of the pass has 2"));
}

TEST_F(PassToml, EpochMayBeATomlDateAndCarryAFraction) {
  const Time midnight = read_with(toml_).epoch;
  EXPECT_EQ(read_with(replaced(toml_, "\"2009-05-20T00:00:00\"", "2009-05-20T00:00:01.5")).epoch - midnight,
            std::chrono::milliseconds(1500));
  EXPECT_EQ(read_with(replaced(toml_, "00:00:00", "01:02:03.000000004")).epoch - midnight,
            std::chrono::seconds(3723) + Duration(4));
}

TEST_F(PassToml, RefusesEpochThatIsNoIsoDate) {
  for (const char* epoch : {"2009-05-20", "2009-02-29T00:00:00", "2009-05-20T24:00:00", "2009-05-20T00:60:00",
                            "2009-05-20T00:00:60", "2009-05-20T00:00:00Z", "2009-05-20T00:00:00.",
                            "1957-05-20T00:00:00", "2201-05-20T00:00:00", "2009-5-20T00:00:00", "yesterday", "",
                            "2009-05-20T00:00:00.0123456789", "2009-05-20T00:00:-1", "2009-05-20T00:00:00.-1"}) {
    EXPECT_THAT(refusal_with(replaced(toml_, "2009-05-20T00:00:00", epoch)),
                HasSubstr(fmt::format("pass.toml:3:13: \"epoch_tai\" is \"{}\", not an ISO date and time", epoch)));
  }
  EXPECT_THAT(refusal_with(replaced(toml_, "\"2009-05-20T00:00:00\"", "2009-05-20T00:00:00Z")),
              HasSubstr("\"epoch_tai\" is a date or time; make it a string"));
}

TEST_F(PassToml, RefusesSyntaxErrorWithLineAndColumn) {
  EXPECT_THAT(refusal_with(replaced(toml_, "period_s = 0.5", "period_s = = 0.5")), HasSubstr("pass.toml:7:12: "));
}

TEST_F(PassToml, RefusesKeyWithoutItsUnitSuggestingTheRightOne) {
  EXPECT_THAT(refusal_with(replaced(toml_, "duration_s", "duration")),
              EndsWith("pass.toml:4:1: key \"duration\" is not known in [pass]; did you mean \"duration_s\"?"));
  EXPECT_THAT(refusal_with(replaced(toml_, "readout_noise_rad", "readout_noise")),
              HasSubstr("did you mean \"readout_noise_rad\"?"));
  EXPECT_THAT(refusal_with(replaced(toml_, "drift_prior_sigma_rad_s", "drift_prior_sigma")),
              HasSubstr("did you mean \"drift_prior_sigma_rad_s\"?"));
  EXPECT_THAT(refusal_with(replaced(toml_, "noise_rad = [", "noise_arcsec = [")),
              HasSubstr("did you mean \"noise_rad\"?"));
}

TEST_F(PassToml, RefusesUnknownKeysAtEveryLevel) {
  EXPECT_THAT(
      refusal_with("nonsense_altogether = 1\n" + toml_),
      HasSubstr("pass.toml:1:1: key \"nonsense_altogether\" is not known in the file; known here: pass, prior, gyro"));
  EXPECT_THAT(refusal_with(toml_ + "[[gyro.unit]]\nperiod_s = 1\n[[gyro.unit]]\n"),
              HasSubstr("pass.toml:16:1: key \"period_s\" is not known in [[gyro.unit]] 1"));
  EXPECT_THAT(refusal_with(toml_ + "[[gyro.unit]]\n[[gyro.unit]]\ndrift_prior_rad_s = {mu13 = 1e-6}\n"),
              HasSubstr("pass.toml:17:22: key \"mu13\" is not known in drift_prior_rad_s; did you mean \"mu"));
}

TEST_F(PassToml, RefusesEachMissingKeyByName) {
  for (const char* key : {"spacecraft", "epoch_tai", "duration_s", "readout_noise_rad", "drift_prior_sigma_rad_s",
                          "alignment_prior_sigma_rad", "noise_rad"}) {
    const std::size_t at = toml_.find(fmt::format("\n{}", key)) + 1;
    std::string text = toml_;
    text.erase(at, text.find('\n', at) - at);
    EXPECT_THAT(refusal_with(text), HasSubstr(fmt::format("key \"{}\" is missing in [", key)));
  }
  EXPECT_THAT(refusal_with(replaced(toml_, "period_s = 0.5\n", "")),
              HasSubstr("pass.toml:6:1: key \"period_s\" is missing"));
  EXPECT_THAT(refusal_with(""), HasSubstr("key \"pass\" is missing in the file"));
}

TEST_F(PassToml, RefusesWrongTypes) {
  EXPECT_THAT(refusal_with(replaced(toml_, "\"TEST\"", "5")),
              HasSubstr("pass.toml:2:14: \"spacecraft\" is a number; make it a string"));
  EXPECT_THAT(refusal_with(replaced(toml_, "= 90", "= \"90s\"")),
              HasSubstr("\"duration_s\" is a string; make it a number"));
  EXPECT_THAT(refusal_with(replaced(toml_, "= 90", "= true")), HasSubstr("\"duration_s\" is a boolean"));
  EXPECT_THAT(refusal_with(replaced(toml_, "[1e-05, 2e-05, 9e-05]", "1e-5")),
              HasSubstr("\"noise_rad\" is a number; give three"));
  EXPECT_THAT(refusal_with(replaced(toml_, "[1e-05, 2e-05, 9e-05]", "[1e-5, 1e-5]")), HasSubstr("has 2 elements"));
  EXPECT_THAT(refusal_with(replaced(toml_, "[1e-05, 2e-05, 9e-05]", "[1e-5, 1e-5, \"a\"]")), HasSubstr("is a string"));
  EXPECT_THAT(refusal_with(replaced(toml_, "2e-06", "{k0 = 1e-6}")), HasSubstr("in [gyro] give one number"));
  EXPECT_THAT(refusal_with("pass = 1\n" + replaced(toml_, "[pass]", "[star_tracker.pass]")),
              HasSubstr("\"pass\" is a number"));
  EXPECT_THAT(refusal_with(replaced(toml_, "period_s = 0.5", "period_s = 0.5\nunit = 3")),
              HasSubstr("\"unit\" is not an array of tables"));
}

TEST_F(PassToml, RefusesValuesThatMakeNoSense) {
  EXPECT_THAT(refusal_with(replaced(toml_, "= 0.5", "= 0")),
              HasSubstr("pass.toml:7:12: \"period_s\" is 0 s, outside 1e-05 to 60 s; it is the time between samples"));
  EXPECT_THAT(refusal_with(replaced(toml_, "= 0.5", "= -1")), HasSubstr("is -1 s, outside"));
  EXPECT_THAT(refusal_with(replaced(toml_, "= 0.5", "= nan")), HasSubstr("\"period_s\" is not finite"));
  EXPECT_THAT(refusal_with(replaced(toml_, "= 0.5", "= 1e-12")), HasSubstr("outside 1e-05 to 60 s"));
  EXPECT_THAT(refusal_with(replaced(toml_, "= 90", "= 1e12")), HasSubstr("none is longer than a year"));
  EXPECT_THAT(refusal_with(replaced(toml_, "= 90", "= 59.9")), HasSubstr("shorter than a minute"));
  EXPECT_THAT(refusal_with(replaced(toml_, "2e-06", "0")), HasSubstr("\"drift_prior_sigma_rad_s\" is 0"));
  EXPECT_THAT(refusal_with(replaced(toml_, "8e-03", "[1e-3, 1e-3, 0]")),
              HasSubstr("\"alignment_prior_sigma_rad\" is 0 rad, outside"));
  EXPECT_THAT(refusal_with(replaced(toml_, "2e-05", "-2e-05")), HasSubstr("\"noise_rad\" is -2e-05 rad, outside"));
}

TEST_F(PassToml, RefusesNumbersThatAreNoMeasurementsTellingTheBounds) {
  EXPECT_THAT(refusal_with(toml_ + "[[gyro.unit]]\nreadout_noise_rad = 2\n[[gyro.unit]]\n"),
              HasSubstr("pass.toml:16:21: \"readout_noise_rad\" is 2 rad, outside 1e-09 to 0.1 rad; it is the 1-sigma "
                        "of a direction cosine, which is at most 1"));
  EXPECT_THAT(refusal_with(replaced(toml_, "2e-06", "100")),
              HasSubstr("\"drift_prior_sigma_rad_s\" is 100 rad/s, outside 1e-15 to 0.01 rad/s"));
  EXPECT_THAT(refusal_with(replaced(toml_, "2e-05", "1e100")), HasSubstr("is 1e+100 rad, outside 1e-09 to 0.1 rad"));
  EXPECT_THAT(refusal_with(toml_ + "[[gyro.unit]]\ndrift_prior_rad_s = {k0 = 1e10}\n[[gyro.unit]]\n"),
              HasSubstr("\"k0\" is 10000000000 rad/s, outside -0.1 to 0.1 rad/s"));
  EXPECT_THAT(refusal_with(replaced(toml_, "8e-03", "1e30")), HasSubstr("a half turn is all there is"));
}

TEST_F(PassToml, RefusesUnitsThatAreNotOnePerGyro) {
  EXPECT_THAT(refusal_with(toml_ + "[[gyro.unit]]\n"),
              HasSubstr("[[gyro.unit]] is there 1 times, the telemetry has 2 gyros; give one per gyro"));
}

}  // namespace
}  // namespace trihedron::io
