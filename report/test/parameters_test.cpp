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
