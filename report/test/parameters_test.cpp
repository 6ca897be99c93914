#include "parameters.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "figures.hpp"
#include "synthetic_run.hpp"
#include "units.hpp"

namespace trihedron::report {
namespace {

TEST(SymbolOf, WritesTheNamesOfThePaper) {
  const auto symbol = [](const char* name) { return symbol_of(parameter_named(name).value()); };
  EXPECT_EQ(symbol("gyro1.k0"), "k₀");
  EXPECT_EQ(symbol("gyro2.mu31"), "μ₃₁");
  EXPECT_EQ(symbol("gyro1.nu12"), "ν₁₂");
  EXPECT_EQ(symbol("gyro1.align_y"), "Λy");
}

TEST(SymbolOf, LeavesOtherNamesAlone) {
  EXPECT_EQ(symbol_of(parameter_named("gyro1.W(3,-2)").value()), "W(3,-2)");
  EXPECT_EQ(symbol_of(parameter_named("clock_offset_s").value()), "clock_offset_s");
}

class ParametersOfARun : public testing::Test {
 protected:
  test::SyntheticRun run = test::synthetic_run({.duration = std::chrono::hours(3), .troubled = true});
};

TEST_F(ParametersOfARun, AreInTheOrderOfTheStates) {
  const auto parameters = parameters_of(run.judged());
  ASSERT_EQ(parameters.size(), 20U);
  EXPECT_EQ(name_of(parameters[0].id), "gyro1.k0");
  EXPECT_EQ(name_of(parameters[19].id), "gyro2.align_z");
}

TEST_F(ParametersOfARun, KnowTheirErrorWhereTheTruthIsKnown) {
  const auto parameters = parameters_of(run.judged());
  EXPECT_DOUBLE_EQ(*parameters[0].error, parameters[0].value - *parameters[0].truth);
  // The rotation from truth to estimate differs from the difference of two rotation vectors of 30′ in the second order.
  EXPECT_NEAR(*parameters[7].error, parameters[7].value - *parameters[7].truth, 0.01 * kArcminute_rad);
}

TEST_F(ParametersOfARun, ClaimNoErrorWithoutTruth) {
  for (const Parameter& parameter : parameters_of(run.alone())) {
    EXPECT_FALSE(parameter.truth);
    EXPECT_FALSE(parameter.error);
  }
}

/// Of a drift field the members are left out, and what comes after them keeps its own history and correlations.
TEST_F(ParametersOfARun, KeepTheirRowsWhereMembersOfAFieldAreLeftOut) {
  Calibration& calibration = run.run.calibration;
  calibration.states[3] = ParameterId::drift(0, {DriftCoefficient::Member::kW, 1, 0});
  calibration.drift_field.emplace_back();
  const ReportInput input = run.alone();
  const auto parameters = parameters_of(input);
  ASSERT_EQ(parameters.size(), 19U);
  EXPECT_EQ(name_of(parameters[3].id), "gyro1.nu12");
  EXPECT_EQ(parameters[3].row, 4U);
  const nlohmann::json figures = figure_data(input, parameters);
  const double first = run.run.parameters.value.front()[10] / kMicroradian;
  EXPECT_NEAR(figures.at("parameters").at("gyro2.k0").at("y").at(0).front().get<double>(), first,
              1e-3 * std::abs(first));
  const double rho =
      calibration.covariance(4, 10) / std::sqrt(calibration.covariance(4, 4) * calibration.covariance(10, 10));
  EXPECT_NEAR(figures.at("correlation").at("values").at(3).at(9).get<double>(), rho, 5.1e-4);
}

TEST_F(ParametersOfARun, AreDrawnWithoutGapsWhereFixesComeFasterThanRows) {
  run.pass.settings.star_tracker_period = std::chrono::milliseconds(100);
  const ReportInput input = run.judged();
  const nlohmann::json figure = figure_data(input, parameters_of(input)).at("parameters").at("gyro1.k0");
  for (const nlohmann::json& value : figure.at("y").at(0)) {
    EXPECT_TRUE(value.is_number());
  }
}

TEST_F(ParametersOfARun, SayWhatTheDataDoNotDetermine) {
  for (const Parameter& parameter : parameters_of(run.judged())) {
    EXPECT_EQ(parameter.is_determined, name_of(parameter.id) != "gyro2.nu12") << name_of(parameter.id);
  }
}

}  // namespace
}  // namespace trihedron::report
