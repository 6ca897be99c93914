#include "trihedron/io/config.hpp"

#include <gmock/gmock.h>

#include "fixtures.hpp"

namespace trihedron::io {
namespace {

using testing::HasSubstr;
using Choice = FurtherStateOptions::Choice;

CalibrationOptions read_config_text(const std::string& text) {
  const TemporaryDirectory directory;
  write_text(directory / "config.toml", text);
  return read_config(directory / "config.toml");
}

std::string refused_config(const std::string& text) {
  return refusal([&] { static_cast<void>(read_config_text(text)); });
}

TEST(Config, ComesBackWithEachFurtherState) {
  for (const FurtherStateRow& row : kFurtherStates) {
    if (row.key.empty()) {
      continue;
    }
    CalibrationOptions options;
    options.further_states[row.state] = Choice::kOn;
    const std::string text = format_config(options);
    const FurtherStateOptions states = read_config_text(text).further_states;
    for (const FurtherStateRow& other : kFurtherStates) {
      EXPECT_EQ(states[other.state], other.state == row.state ? Choice::kOn : Choice::kAuto) << text;
    }
    options.further_states[row.state] = Choice::kOff;
    EXPECT_EQ(read_config_text(format_config(options)).further_states[row.state], Choice::kOff);
  }
}

TEST(Config, ComesBackWithEachEstimatorAndDriftModel) {
  for (const EstimatorRow& row : kEstimators) {
    CalibrationOptions options;
    options.estimator = row.estimator;
    EXPECT_EQ(read_config_text(format_config(options)).estimator, row.estimator);
    EXPECT_FALSE(read_config_text(format_config(options)).drift_model.has_value());
  }
  for (const DriftModelId& model : {kEsg7, kEsg20, vsh(3)}) {
    CalibrationOptions options;
    options.drift_model = model;
    EXPECT_EQ(read_config_text(format_config(options)).drift_model, model);
  }
}

TEST(Config, RefusesNamesThatThereAreNot) {
  EXPECT_THAT(refused_config("estimator = \"magic\"\n"),
              HasSubstr("there is no estimator \"magic\"; use one of: invariant, paper, batch"));
  EXPECT_THAT(refused_config("drift_model = \"vsh:9\"\n"),
              HasSubstr("there is no drift model \"vsh:9\"; use auto, field, esg7, esg20, or vsh:1 … vsh:8"));
  EXPECT_THAT(refused_config("[further_states]\nclock_ofset = \"on\"\n"), HasSubstr("did you mean \"clock_offset\"?"));
  EXPECT_THAT(refused_config("[further_states]\nreadout_bias = \"maybe\"\n"),
              HasSubstr("\"readout_bias\" cannot be \"maybe\"; known here: auto, off, on"));
  EXPECT_THAT(refused_config("[further_states]\nwandering_drift = \"-1e-8rad/s\"\n"),
              HasSubstr("\"wandering_drift\" in [further_states]: \"-1e-8rad/s\" is outside 1e-15 to 0.01 rad/s"));
}

TEST(Config, AKeyOfATableIsSentThere) {
  EXPECT_THAT(refused_config("gate_nis = 3\n"),
              HasSubstr("config.toml:1:1: key \"gate_nis\" is not known in the file; it belongs into [filter]"));
  EXPECT_THAT(refused_config("gate_niss = 3\n"), HasSubstr("did you mean \"gate_nis\", which belongs into [filter]?"));
  EXPECT_THAT(
      refused_config("[further_states]\ngate_nis = 3\n"),
      HasSubstr("config.toml:2:1: key \"gate_nis\" is not known in [further_states]; it belongs into [filter]"));
  EXPECT_THAT(refused_config("estimater = 3\n"), HasSubstr("did you mean \"estimator\"?"));
}

TEST(Config, RefusesNumbersOutsideTheirRanges) {
  EXPECT_THAT(refused_config("[filter]\ndirection_random_walk = \"1rad/s^0.5\"\n"),
              HasSubstr("outside 0 and 1e-15 to 0.1 rad/s^0.5: give 0 where there is none"));
  EXPECT_THAT(refused_config("[filter]\ngate_nis = 0\n"), HasSubstr("\"gate_nis\" is 0, outside 0.1 to 1e+12"));
  EXPECT_THAT(refused_config("[filter]\nstudent_t_freedom = 0.5\n"), HasSubstr("0 for the gate alone"));
  EXPECT_THAT(refused_config("[filter]\nreopen_after_rejections = 0\n"), HasSubstr("it is a number of fixes"));
  EXPECT_THAT(refused_config("[filter]\nangles_after = \"0s\"\n"), HasSubstr("or never"));
  EXPECT_THAT(refused_config("[further_states]\nwandering_time = \"1000000h\"\n"), HasSubstr("an hour is usual"));
  EXPECT_THAT(refused_config("[corrections]\ninterval = \"0s\"\n"),
              HasSubstr("or say none (only the first correction) or continuous (one at each fix)"));
}

TEST(Config, HasAPolhodeForEachGyro) {
  CalibrationOptions options;
  for (int k = 0; k < kMaxGyros; ++k) {
    options.further_states.polhodes[k] = {5000.25F + 100.0F * static_cast<float>(k), 0.01F * static_cast<float>(k)};
  }
  const FurtherStateOptions back = read_config_text(format_config(options)).further_states;
  for (int k = 0; k < kMaxGyros; ++k) {
    EXPECT_EQ(back.polhodes[k].period_s, options.further_states.polhodes[k].period_s);
    EXPECT_EQ(back.polhodes[k].period_rate, options.further_states.polhodes[k].period_rate);
  }
  // The last one stands for all further gyros.
  const std::string text = "[further_states]\npolhode_period = [\"2h\", \"90min\"]\npolhode_period_rate = [0.5]\n";
  const FurtherStateOptions two = read_config_text(text).further_states;
  EXPECT_EQ(two.polhodes[0].period_s, 7200);
  EXPECT_EQ(two.polhodes[3].period_s, 5400);
  EXPECT_EQ(two.polhodes[3].period_rate, 0.5);
  const auto refused_period = [](const std::string& value) {
    return refused_config("[further_states]\npolhode_period = " + value + "\n");
  };
  for (const std::string list : {"\"2h\"", "[]", "[\"1h\", \"1h\", \"1h\", \"1h\", \"1h\"]"}) {
    EXPECT_THAT(refused_period(list), HasSubstr("no list of one to 4 values")) << list;
  }
  EXPECT_THAT(refused_period("[\"2h\", \"3\"]"), HasSubstr("unit is missing"));
  EXPECT_THAT(refused_period("[\"10s\"]"), HasSubstr("outside 60"));
  EXPECT_THAT(refused_config("[further_states]\npolhode_period_rate = [0.9]\n"), HasSubstr("outside -0.5 to 0.5"));
}

}  // namespace
}  // namespace trihedron::io
