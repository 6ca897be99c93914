#include "trihedron/ground/evaluate/convergence.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <cmath>

#include "named.hpp"

namespace trihedron::ground {
namespace {

using std::chrono::minutes;

TEST(SettledFrom, CountsTheLastExcursion) {
  EXPECT_EQ(settled_from({5, 0.1, 3, 0.2, 0.1}, 1), 3U);
  EXPECT_EQ(settled_from({0.1, 0.2}, 1), 0U);
}

TEST(SettledFrom, IsTheEndWhereTheLastRowIsOutside) { EXPECT_EQ(settled_from({0, 0, 2}, 1), 3U); }

TEST(SettledFrom, DoesNotTakeNaNForSettled) { EXPECT_EQ(settled_from({0, std::nan(""), 0}, 1), 2U); }

/// Of one gyro: k0 settles, nu12 stays at its prior, align_y ends off.
CalibrationRun three_parameters() {
  CalibrationRun run;
  run.calibration.states = parameters({"gyro1.k0", "gyro1.nu12", "gyro1.align_y"});
  run.calibration.covariance = Eigen::Vector3d(0.01, 0.9, 0.1).cwiseAbs2().asDiagonal();
  run.known_before.covariance = Eigen::Matrix3d::Identity();
  const auto add = [&](int at_min, std::vector<double> value, std::vector<double> sigma) {
    run.parameters.t.push_back(Time(minutes(at_min)));
    run.parameters.value.push_back(std::move(value));
    run.parameters.sigma.push_back(std::move(sigma));
  };
  add(0, {0, 0, 0}, {1, 1, 1});
  add(10, {1, 0.1, 1}, {0.5, 1, 0.5});
  add(20, {1.95, 0.2, 2}, {0.1, 0.95, 0.2});
  add(30, {2.02, 0.1, 3}, {0.01, 0.9, 0.1});
  return run;
}

TEST(Convergence, IsReachedWithinThreeSigmasOrATenthOfTheFirstError) {
  const auto parameters = convergence(three_parameters(), nullptr);
  EXPECT_TRUE(parameters[0].determined);
  EXPECT_EQ(parameters[0].settled, minutes(20));  // within 0.2 of 2.02
  EXPECT_FALSE(parameters[1].determined);
  EXPECT_EQ(parameters[2].settled, minutes(30));
}

TEST(Convergence, IsAgainstTheTruthWhereItIsKnown) {
  Truth truth;
  truth.gyros.resize(1);
  truth.gyros[0].drift_rad_s = {{coefficient("nu12"), 0}, {coefficient("k0"), 1.9}};
  truth.gyros[0].alignment_rotation_vector_rad = {9, 2, 9};
  const auto parameters = convergence(three_parameters(), &truth);
  EXPECT_EQ(parameters[0].settled, minutes(20));
  EXPECT_EQ(parameters[2].settled, std::nullopt);  // 3 at the end, the truth is 2
}

TEST(Convergence, OfAKindIsThatOfItsLastDeterminedParameter) {
  const CalibrationRun run = three_parameters();
  auto parameters = convergence(run, nullptr);
  EXPECT_EQ(settled(run, parameters, false), minutes(20));
  EXPECT_EQ(settled(run, parameters, true), minutes(30));
  parameters[2].settled.reset();
  EXPECT_EQ(settled(run, parameters, true), std::nullopt);
  parameters[0].determined = false;
  EXPECT_EQ(settled(run, parameters, false), std::nullopt);
}

TEST(Convergence, IsNotThatOfAParameterThatTheOnBoardStepDoesNotEstimate) {
  CalibrationRun run = three_parameters();
  run.calibration.states[1] = parameter("gyro1.W(3,1)");
  run.calibration.covariance(1, 1) = 0.01;
  for (std::vector<double>& row : run.parameters.value) {
    row[1] = std::nan("");
  }
  const auto parameters = convergence(run, nullptr);
  EXPECT_TRUE(parameters[1].determined);
  EXPECT_FALSE(parameters[1].followed);
  EXPECT_TRUE(parameters[0].followed);
  EXPECT_EQ(settled(run, parameters, false), minutes(20));
}

/// Members outside eq. (1) are estimated to protect the others.
TEST(Convergence, OfTheCoefficientsIsThatOfEq1) {
  CalibrationRun run = three_parameters();
  run.calibration.states[1] = parameter("gyro1.W(3,1)");
  run.calibration.covariance(1, 1) = 0.01;
  auto parameters = convergence(run, nullptr);
  ASSERT_TRUE(parameters[1].determined && parameters[1].followed);
  parameters[1].settled.reset();
  EXPECT_EQ(settled(run, parameters, false), minutes(20));
}

TEST(Convergence, IsUnknownWithoutAHistory) {
  CalibrationRun run = three_parameters();
  run.parameters = {};
  for (const Convergence& parameter : convergence(run, nullptr)) {
    EXPECT_FALSE(parameter.settled);
  }
}

}  // namespace
}  // namespace trihedron::ground
