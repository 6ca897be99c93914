#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "trihedron/core/drift.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron {
namespace {

using testing::ElementsAre;
using testing::Pair;

std::vector<DriftModelId> all_drift_models() {
  std::vector<DriftModelId> models = {kEsg7, kEsg20};
  for (int degree = 1; degree <= kLargestDriftModel.degree; ++degree) {
    models.push_back(vsh(degree));
  }
  return models;
}

TEST(Vocabulary, RowsStandWhereTheirValuesSay) {
  for (std::size_t i = 0; i < kFurtherStates.size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(kFurtherStates[i].state), i);
    EXPECT_EQ(static_cast<std::size_t>(kFurtherStateKinds[i].state), i);
  }
  for (std::size_t i = 0; i < kFindings.size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(kFindings[i].code), i);
  }
  for (std::size_t i = 0; i < drift_models().size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(drift_models()[i].family), i);
  }
}

TEST(Vocabulary, EstimatorsComeBackFromTheirNames) {
  for (const EstimatorRow& row : kEstimators) {
    EXPECT_EQ(estimator_named(name_of(row.estimator)), row.estimator);
  }
  EXPECT_FALSE(estimator_named("magic").has_value());
  EXPECT_FALSE(estimator_named("").has_value());
}

TEST(Vocabulary, FindingsComeBackFromTheirNamesAndNoTwoHaveOne) {
  std::set<std::string_view> names;
  for (const FindingRow& row : kFindings) {
    EXPECT_EQ(finding_code_named(row.name), row.code);
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
  }
  EXPECT_EQ(finding_code_named("from-the-future"), FindingCode::kOther);
}

TEST(Vocabulary, AFindingIsAsSevereAsItsCodeUnlessToldOtherwise) {
  EXPECT_EQ((Finding{FindingCode::kTooFewFixes, "", "", ""}.severity), FindingSeverity::kDoNotUse);
  EXPECT_EQ((Finding{FindingCode::kTooFewFixes, "", "", "", FindingSeverity::kNote}.severity), FindingSeverity::kNote);
}

TEST(Vocabulary, SeveritiesHaveTheNamesOfTheirTable) {
  for (const FindingSeverityRow& row : kFindingSeverities) {
    EXPECT_EQ(name_of(row.severity), row.name);
  }
  EXPECT_EQ(name_of(FindingSeverity::kDoNotUse), "do-not-use");
}

TEST(Vocabulary, DriftModelsComeBackFromTheirNames) {
  for (const DriftModelId& model : all_drift_models()) {
    EXPECT_EQ(drift_model_named(name_of(model)), model) << name_of(model);
  }
  EXPECT_EQ(name_of(kLargestDriftModel), "vsh:8");
  EXPECT_EQ(drift_model_choices(), "esg7, esg20, or vsh:1 … vsh:8");
  for (const char* name : {"", "auto", "esg", "esg70", "vsh", "vsh:", "vsh:0", "vsh:9", "vsh:01", "vsh:+1", "vsh:1 ",
                           "vsh:-1", "vsh:1x"}) {
    EXPECT_FALSE(drift_model_named(name).has_value()) << name;
  }
}

TEST(Vocabulary, ADriftModelHasAsManyCoefficientsAsItSays) {
  EXPECT_EQ(kEsg7.size(), Esg7::kSize);
  EXPECT_EQ(kEsg20.size(), 20);
  for (const DriftModelId& model : all_drift_models()) {
    const std::vector<DriftCoefficient> coefficients = coefficients_of(model);
    EXPECT_EQ(coefficients.size(), static_cast<std::size_t>(model.size())) << name_of(model);
    EXPECT_EQ(std::set<DriftCoefficient>(coefficients.begin(), coefficients.end()).size(), coefficients.size());
    for (const DriftCoefficient& coefficient : coefficients) {
      EXPECT_EQ(drift_coefficient_named(name_of(coefficient)), coefficient) << name_of(coefficient);
    }
  }
}

TEST(Vocabulary, CoefficientsHaveTheNamesOfTheModelOnBoard) {
  const auto names = [](const auto& list) { return std::vector<std::string>(list.begin(), list.end()); };
  EXPECT_EQ(coefficient_names(kEsg7), names(Esg7::kNames));
  EXPECT_THAT(coefficient_names(kEsg20),
              testing::ElementsAre("k0", "mu12", "mu23", "mu31", "nu12", "nu23", "nu31", "W(1,-1)", "W(1,0)", "W(1,1)",
                                   "W(2,-2)", "W(2,-1)", "W(2,1)", "D(1,-1)", "D(1,0)", "D(1,1)", "D(2,-2)", "D(2,-1)",
                                   "D(2,1)", "D(k0)"));
  EXPECT_EQ(coefficient_names(vsh(1)).back(), "D(1,1)");
}

TEST(Vocabulary, NoCoefficientHasANameThatIsNearlyRight) {
  for (const char* name : {"", "k", "K0", "W", "W(", "W()", "W(1)", "W(1,)", "W(0,0)", "W(1,2)", "W(21,0)", "W(1, 0)",
                           "W(01,0)", "W(1,0", "X(1,0)", "D(k1)", "W(4,4)", "D(4,4-k0)"}) {
    EXPECT_FALSE(drift_coefficient_named(name).has_value()) << name;
  }
}

TEST(Vocabulary, ParametersComeBackFromTheirNames) {
  std::vector<ParameterId> all = drift_and_alignment(vsh(6), 4);
  for (const FurtherStateRow& row : kFurtherStates) {
    for (std::size_t i = 0; i < row.components.size(); ++i) {
      for (std::size_t owner = 0; owner < (kind_of(row.state).owner == FurtherStateKind::Owner::kPass ? 1U : 4U);
           ++owner) {
        all.push_back(ParameterId::further(row.state, owner, static_cast<int>(i)));
      }
    }
  }
  std::set<std::string> names;
  for (const ParameterId& parameter : all) {
    EXPECT_EQ(parameter_named(name_of(parameter)), parameter) << name_of(parameter);
    EXPECT_TRUE(names.insert(name_of(parameter)).second) << name_of(parameter);
  }
}

TEST(Vocabulary, ParametersHaveTheNamesOfCalibrationJson) {
  EXPECT_EQ(name_of(ParameterId::drift(0, DriftCoefficient::of_eq1(Esg7::kNu31))), "gyro1.nu31");
  EXPECT_EQ(name_of(ParameterId::alignment(1, 2)), "gyro2.align_z");
  EXPECT_EQ(short_name_of(ParameterId::alignment(1, 2)), "align_z");
  EXPECT_EQ(name_of(ParameterId::further(FurtherState::kClockOffset, 0, 0)), "clock_offset_s");
  EXPECT_EQ(name_of(ParameterId::further(FurtherState::kOrbitalError, 0, 4)), "orbital_cosine_y_rad");
  EXPECT_EQ(name_of(ParameterId::further(FurtherState::kOrbitalError, 1, 4)), "star_tracker_2_orbital_cosine_y_rad");
  EXPECT_EQ(name_of(ParameterId::further(FurtherState::kStarTrackerAlignment, 1, 0)), "star_tracker_2_align_x_rad");
  EXPECT_EQ(name_of(ParameterId::further(FurtherState::kReadoutBias, 1, 1)), "gyro2_readout_bias_y_rad");
  EXPECT_EQ(name_of(ParameterId::further(FurtherState::kCoefficientChange, 0, Esg7::kMu12)), "gyro1_mu12_change_rad_s");
}

TEST(Vocabulary, NoParameterHasANameThatIsNearlyRight) {
  for (const char* name : {"", "gyro", "gyro1", "gyro1.", "gyro0.k0", "gyro-1.k0", "gyro999.k0", "gyro1.align_w",
                           "gyro1.align_", "gyro1.align_xx", "gyro1.heat", "clock_offset", "gyro1_clock_offset_s",
                           "orbital_sine_w_rad", "star_tracker_1_orbital_sine_x_rad", "gyro2_orbital_sine_x_rad",
                           "star_tracker_align_x_rad", "gyro1readout_bias_x_rad"}) {
    EXPECT_FALSE(parameter_named(name).has_value()) << name;
  }
}

TEST(Vocabulary, FurtherStatesHaveAsManyNamesAsComponentsOrNone) {
  for (const FurtherStateRow& row : kFurtherStates) {
    EXPECT_TRUE(row.components.empty() || row.components.size() == static_cast<std::size_t>(kind_of(row.state).size))
        << row.label;
  }
}

TEST(Vocabulary, FurtherStatesAreLeftToTheProgramUnlessToldOtherwise) {
  FurtherStateOptions states;
  EXPECT_EQ(states[FurtherState::kReadoutBias], FurtherStateOptions::Choice::kAuto);
  states[FurtherState::kReadoutBias] = FurtherStateOptions::Choice::kOn;
  EXPECT_TRUE(states.is_on(FurtherState::kReadoutBias));
  EXPECT_FALSE(states.is_on(FurtherState::kClockOffset));
  EXPECT_EQ(FurtherStateOptions::none()[FurtherState::kClockOffset], FurtherStateOptions::Choice::kOff);
}

TEST(Vocabulary, StatisticsComeBackFromTheirNamesInTheirOrder) {
  Statistics statistics;
  statistics.fixes = 100;
  statistics.fixes_used = 90;
  statistics.nis_mean = std::nan("");
  statistics.innovation_rms_rad = {1e-5, 2e-5};
  statistics.batch_converged = false;
  Statistics back;
  for (const auto& [name, value] : named_values(statistics)) {
    set_value(back, name, value);
  }
  set_value(back, "from_the_future", 3);
  set_value(back, "reopened", std::numeric_limits<double>::quiet_NaN());
  set_value(back, "innovation_x_rms_rad", 3);
  EXPECT_THAT(named_values(back),
              ElementsAre(Pair("batch_converged", 0), Pair("fixes", 100), Pair("fixes_frozen", 0),
                          Pair("fixes_off_in_a_row", 0), Pair("fixes_rejected_as_outliers", 0), Pair("fixes_used", 90),
                          Pair("innovation_1_rms_rad", 1e-5), Pair("innovation_2_rms_rad", 2e-5), Pair("nis_count", 0),
                          Pair("nis_degrees_of_freedom", 0), Pair("nis_mean", testing::IsNan()), Pair("reopened", 0)));
}

TEST(Truth, TellsDriftInsideAndOutsideEq1) {
  Truth::Gyro gyro;
  gyro.drift_rad_s = {{DriftCoefficient::of_eq1(Esg7::kMu12), 2e-6}};
  gyro.unmodelled_rad_s = {{"W(1,-1)", 1e-8}, {"heat", 1}};
  EXPECT_EQ(gyro.drift(DriftCoefficient::of_eq1(Esg7::kMu12)), 2e-6);
  EXPECT_EQ(gyro.drift(*drift_coefficient_named("W(1,-1)")), 1e-8);
  EXPECT_FALSE(gyro.drift(DriftCoefficient::of_eq1(Esg7::kK0)).has_value());
}

}  // namespace
}  // namespace trihedron
