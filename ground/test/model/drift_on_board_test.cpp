#include "model/drift_on_board.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/prior.hpp"
#include "trihedron/records/drift_models.hpp"

namespace trihedron::ground {
namespace {

constexpr auto kW = DriftCoefficient::Member::kW;
constexpr auto kD = DriftCoefficient::Member::kD;

/// All members up to degree 8 of two gyros, each of this root mean square, rad/s.
MeanSquares all_of(double rms_rad_s) {
  MeanSquares members(2);
  for (auto& gyro : members) {
    for (const DriftCoefficient& member : coefficients_of(kLargestDriftModel)) {
      if (!member.is_in_eq1()) {
        gyro[member] = rms_rad_s * rms_rad_s;
      }
    }
  }
  return members;
}

TEST(DriftOnBoard, IsEq1WhereNextToNothingIsOutside) {
  const DriftOnBoard drift = drift_on_board(all_of(1e-12));
  EXPECT_EQ(drift.drift_model, kEsg7);
  EXPECT_EQ(drift.left_out_rad_s, 0);
}

TEST(DriftOnBoard, IsTheSmallestModelWithTheMembersThatCount) {
  MeanSquares members = all_of(1e-12);
  members[1][{kD, 3, 1}] = 1e-8 * 1e-8;
  const DriftOnBoard drift = drift_on_board(members);
  EXPECT_EQ(drift.drift_model, vsh(3));
  EXPECT_EQ(drift.left_out_rad_s, 0);
}

/// The mean square of the gradient of a harmonic over the sphere is l (l + 1)/4π; it is shared by two axes.
TEST(DriftOnBoard, LeavesOutWhatThereIsNoRoomFor) {
  MeanSquares members = all_of(0);
  members[0][{kW, 1, 0}] = 1e-8 * 1e-8;
  members[0][{kW, 8, -2}] = 2e-9 * 2e-9;
  members[1][{kD, 7, 3}] = 1e-9 * 1e-9;  // less: the gyro with the most counts
  const DriftOnBoard drift = drift_on_board(members);
  EXPECT_EQ(drift.drift_model, vsh(DriftModelId::kMaxDegreeOnBoard));
  EXPECT_NEAR(drift.left_out_rad_s, 2e-9 * std::sqrt(72 / (4 * std::numbers::pi) / 2), 1e-15);
  const DriftOnBoard eq1 = drift_on_board(members, kEsg7);
  EXPECT_EQ(eq1.drift_model, kEsg7);
  EXPECT_GT(eq1.left_out_rad_s, drift.left_out_rad_s);
}

TEST(DriftOnBoard, WhatIsLeftOutIsAddedToTheDriftThatWanders) {
  CalibrationOptions options;
  use(DriftOnBoard{vsh(2), 0}, options);
  EXPECT_EQ(options.drift_model, vsh(2));
  EXPECT_FALSE(options.further_states.is_on(FurtherState::kWanderingDrift));
  use(DriftOnBoard{vsh(6), 3e-9}, options);
  EXPECT_TRUE(options.further_states.is_on(FurtherState::kWanderingDrift));
  EXPECT_EQ(options.further_states.wandering_drift_rad_s, 3e-9);
  use(DriftOnBoard{vsh(6), 4e-9}, options);
  EXPECT_NEAR(options.further_states.wandering_drift_rad_s, 5e-9, 1e-15);
}

TEST(DriftOnBoard, MembersOfTheModelHaveTheirSizesAsPriorSigmas) {
  PassSettings settings;
  settings.gyros.resize(2);
  settings.gyros[0].drift_sigma_rad_s[{kW, 1, 0}] = 7e-8;
  use(all_of(1e-8), vsh(1), settings);
  EXPECT_EQ(settings.gyros[0].drift_sigma_rad_s.size(), 6U);
  EXPECT_EQ((settings.gyros[0].drift_sigma_rad_s.at({kW, 1, 0})), 7e-8);  // what the settings say holds
  EXPECT_NEAR((settings.gyros[1].drift_sigma_rad_s.at({kD, 1, -1})), 1e-8, 1e-15);
}

/// A pass that knows k0 + 3 W(2,1) of gyro 1 far better than either, as along a flight on which both do the same.
TEST(DriftOnBoard, ItsCoefficientsMakeUpForWhatIsLeftOutAsAlongTheFlight) {
  Calibration calibration;
  calibration.gyros.resize(2);
  for (GyroCalibration& gyro : calibration.gyros) {
    gyro.drift_model = vsh(2);
    gyro.drift_rad_s.assign(static_cast<std::size_t>(vsh(2).size()), 0);
  }
  calibration.states = drift_and_alignment(vsh(2), 2);
  const auto size = static_cast<Eigen::Index>(calibration.states.size());
  const auto index_of = [&](const DriftCoefficient& member) {
    return std::ranges::find(calibration.states, ParameterId::drift(0, member)) - calibration.states.begin();
  };
  const Eigen::Index k0 = index_of(DriftCoefficient::of_eq1(0));
  const Eigen::Index member = index_of({kW, 2, 1});
  calibration.gyros[0].drift_rad_s[static_cast<std::size_t>(k0)] = 1e-6;
  calibration.gyros[0].drift_rad_s[static_cast<std::size_t>(member)] = 2e-8;
  calibration.covariance = Eigen::MatrixXd::Identity(size, size) * 1e-18;
  const double variance = 1e-16;
  calibration.covariance(member, member) = variance;
  calibration.covariance(k0, member) = calibration.covariance(member, k0) = -3 * variance;
  calibration.covariance(k0, k0) = 9 * variance + 1e-20;

  PassSettings settings;
  settings.gyros.resize(2);
  settings.prior = calibration;
  Layout layout;
  const Prior prior = prior_of(settings, layout);
  EXPECT_NEAR(prior.gyros[0].drift_rad_s(0), 1e-6 + 3 * 2e-8, 1e-14);
  EXPECT_NEAR(prior.covariance(0, 0), 1e-20, 1e-24);
  EXPECT_NEAR(prior.covariance(1, 1), 1e-18, 1e-24);
  EXPECT_EQ(prior.gyros[1].drift_rad_s(0), 0);

  layout.drift_model = vsh(2);  // all of it: as it is
  const Prior whole = prior_of(settings, layout);
  EXPECT_EQ(whole.covariance, calibration.covariance);
  EXPECT_EQ(whole.gyros[0].drift_rad_s(0), 1e-6);
}

TEST(DriftOnBoard, TakesValueAndSigmaOfACalibration) {
  Calibration calibration;
  GyroCalibration gyro;
  gyro.drift_model = vsh(1);
  gyro.drift_rad_s.assign(static_cast<std::size_t>(vsh(1).size()), 0);
  gyro.drift_rad_s[7] = 3e-8;
  calibration.gyros = {gyro};
  calibration.states = drift_and_alignment(vsh(1), 1);
  calibration.covariance = Eigen::MatrixXd::Identity(16, 16) * 4e-8 * 4e-8;
  const MeanSquares squares = mean_squares_of(calibration);
  ASSERT_EQ(squares.at(0).size(), 6U);
  EXPECT_NEAR(squares[0].at(coefficients_of(vsh(1))[7]), 25e-16, 1e-20);
  EXPECT_NEAR(squares[0].at(coefficients_of(vsh(1))[8]), 16e-16, 1e-20);
}

}  // namespace
}  // namespace trihedron::ground
