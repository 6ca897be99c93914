#include "model/drift_on_board.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "batch/left_out_walk.hpp"
#include "model/left_out.hpp"
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

Eigen::Index row_of(const Calibration& calibration, const DriftCoefficient& member) {
  return rows_of(calibration, {ParameterId::drift(0, member)}).front();
}

/// Coefficients and alignments of nothing, each with this variance by itself.
Calibration of_two_gyros(const DriftModelId& model, double variance) {
  Calibration calibration;
  calibration.gyros.resize(2);
  for (GyroCalibration& gyro : calibration.gyros) {
    gyro.drift_model = model;
    gyro.drift_rad_s.assign(static_cast<std::size_t>(model.size()), 0);
  }
  calibration.states = drift_and_alignment(model, 2);
  const auto size = static_cast<Eigen::Index>(calibration.states.size());
  calibration.covariance = Eigen::MatrixXd::Identity(size, size) * variance;
  return calibration;
}

/// A pass that knows k0 + 3 W(2,1) of gyro 1 far better than either, as along a flight on which both do the same.
Calibration by_a_flight_on_which_k0_acts_as_three_times_a_member() {
  Calibration calibration = of_two_gyros(vsh(2), 1e-18);
  const Eigen::Index k0 = row_of(calibration, DriftCoefficient::of_eq1(0));
  const Eigen::Index member = row_of(calibration, {kW, 2, 1});
  calibration.gyros[0].drift_rad_s[static_cast<std::size_t>(k0)] = 1e-6;
  calibration.gyros[0].drift_rad_s[static_cast<std::size_t>(member)] = 2e-8;
  const double variance = 1e-16;
  calibration.covariance(member, member) = variance;
  calibration.covariance(k0, member) = calibration.covariance(member, k0) = -3 * variance;
  calibration.covariance(k0, k0) = 9 * variance + 1e-20;
  return calibration;
}

TEST(DriftOnBoard, ItsCoefficientsMakeUpForWhatIsLeftOutAsAlongTheFlight) {
  const Calibration calibration = by_a_flight_on_which_k0_acts_as_three_times_a_member();
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

TEST(LeftOut, IsInTheCalibrationAgainWhichReducedIsWhatWasEstimated) {
  const Calibration all = by_a_flight_on_which_k0_acts_as_three_times_a_member();
  const LeftOut left_out(all, kEsg7);
  ASSERT_EQ(left_out.left_out().size(), static_cast<std::size_t>(2 * (vsh(2).size() - kEsg7.size())));
  Calibration estimated = left_out.reduced();
  EXPECT_NEAR(value_of(estimated, ParameterId::drift(0, DriftCoefficient::of_eq1(0))), 1e-6 + 3 * 2e-8, 1e-14);
  estimated.gyros[0].drift_rad_s[0] += 5e-9;  // by an estimator on board, along the same flight
  estimated.gyros[0].alignment_rotation_vector_rad.x() = 1e-3;
  estimated.covariance(0, 0) *= 4;
  const Eigen::Index align = kEsg7.size();
  estimated.covariance(0, align) = estimated.covariance(align, 0) = 1e-20;

  const Calibration completed = left_out.completed(estimated, {});
  EXPECT_EQ(completed.states, all.states);
  EXPECT_NEAR(value_of(completed, ParameterId::drift(0, DriftCoefficient::of_eq1(0))), 1e-6 + 5e-9, 1e-14);
  EXPECT_EQ(value_of(completed, ParameterId::drift(0, {kW, 2, 1})), 2e-8);
  // k0 itself is as uncertain as what it makes up for.
  EXPECT_NEAR(sigma_of(completed, ParameterId::drift(0, DriftCoefficient::of_eq1(0))), std::sqrt(9e-16 + 4e-20), 1e-14);
  const Calibration again = LeftOut(completed, kEsg7).reduced();
  EXPECT_NEAR(again.gyros[0].drift_rad_s[0], estimated.gyros[0].drift_rad_s[0], 1e-18);
  EXPECT_LT((again.gyros[0].alignment_rotation_vector_rad - estimated.gyros[0].alignment_rotation_vector_rad).norm(),
            1e-15);
  EXPECT_LT((again.covariance - estimated.covariance).cwiseAbs().maxCoeff(), 1e-26);
}

/// Where an alignment stood for a part of it, it is known as badly; and the momentum is read through the alignment.
TEST(LeftOut, IsMadeUpForByAlignmentsWithWhichTheMomentaTurn) {
  Calibration all = by_a_flight_on_which_k0_acts_as_three_times_a_member();
  const Eigen::Index member = row_of(all, {kW, 2, 1});
  const Eigen::Index align_y = rows_of(all, {ParameterId::alignment(1, 1)}).front();
  const double turn_per_drift = 200;  // 2e-8 rad/s are 4e-6 rad
  all.covariance(align_y, align_y) += turn_per_drift * turn_per_drift * 1e-16;
  all.covariance(align_y, member) = all.covariance(member, align_y) = -turn_per_drift * 1e-16;
  const LeftOut left_out(all, kEsg7);
  Calibration estimated = left_out.reduced();
  EXPECT_NEAR(estimated.gyros[1].alignment_rotation_vector_rad.y(), 4e-6, 1e-14);
  const Eigen::Index kept = kEsg7.size() * 2 + 3 + 1;
  EXPECT_EQ(estimated.states[static_cast<std::size_t>(kept)], ParameterId::alignment(1, 1));
  EXPECT_NEAR(std::sqrt(estimated.covariance(kept, kept)), 1e-9, 1e-14);

  estimated.gyros[1].momentum_in = Eigen::Vector3d::UnitX();
  const auto C_in_c =
      Rot<In, C>::assume(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()).toRotationMatrix());
  const Calibration completed = left_out.completed(estimated, C_in_c);
  EXPECT_LT(completed.gyros[1].alignment_rotation_vector_rad.norm(), 1e-15);
  EXPECT_NEAR(sigma_of(completed, ParameterId::alignment(1, 1)), std::hypot(2e-6, 1e-9), 1e-12);
  // −4e-6 rad about y of c, which is z of `in`.
  EXPECT_LT((completed.gyros[1].momentum_in - Eigen::Vector3d(1, -4e-6, 0)).norm(), 1e-10);
  EXPECT_EQ(completed.gyros[0].momentum_in, estimated.gyros[0].momentum_in);

  // As rotations in c, also in a history, of a gyro that is mounted by a quarter of a turn.
  estimated.gyros[1].alignment_rotation_vector_rad = {0, 0, std::numbers::pi / 2};
  const Calibration mounted = left_out.completed(estimated, {});
  ParameterHistory history{{Time{}}, {{}}, {std::vector(estimated.states.size(), 1e-9)}};
  for (const ParameterId& state : estimated.states) {
    history.value[0].push_back(value_of(estimated, state));
  }
  const ParameterHistory also = left_out.completed(history);
  for (std::size_t i = 0; i < mounted.states.size(); ++i) {
    if (mounted.states[i].is_alignment()) {
      EXPECT_NEAR(also.value[0][i], value_of(mounted, mounted.states[i]), 1e-15);
    }
  }
  const Eigen::Matrix3d turn = Rot<C, B<1>>::exp(Vec<C>::assume(mounted.gyros[1].alignment_rotation_vector_rad)).raw() *
                               Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitZ());
  EXPECT_LT((turn - Eigen::AngleAxisd(-4e-6, Eigen::Vector3d::UnitY()).toRotationMatrix()).norm(), 1e-12);
}

TEST(LeftOut, IsInTheHistoryAndThePriorAsUncertainAsItIs) {
  const Calibration all = by_a_flight_on_which_k0_acts_as_three_times_a_member();
  const LeftOut left_out(all, kEsg7);
  const Eigen::Index k0 = row_of(all, DriftCoefficient::of_eq1(0));
  const Eigen::Index member = row_of(all, {kW, 2, 1});
  const std::size_t states = drift_and_alignment(kEsg7, 2).size();
  const ParameterHistory history =
      left_out.completed(ParameterHistory{{Time{}}, {std::vector(states, 2e-6)}, {std::vector(states, 4e-8)}});
  ASSERT_EQ(history.value.at(0).size(), all.states.size());
  EXPECT_NEAR(history.value[0][static_cast<std::size_t>(k0)], 2e-6 - 6e-8, 1e-14);
  EXPECT_NEAR(history.sigma[0][static_cast<std::size_t>(k0)], 5e-8, 1e-12);
  EXPECT_TRUE(std::isnan(history.value[0][static_cast<std::size_t>(member)]));
  EXPECT_NEAR(history.sigma[0][static_cast<std::size_t>(member)], 1e-8, 1e-14);

  Calibration prior = left_out.reduced();
  prior.covariance.setIdentity();
  const Calibration completed = left_out.completed_prior(prior);
  EXPECT_EQ(completed.states, all.states);
  EXPECT_EQ(completed.covariance(k0, k0), 1);
  EXPECT_NEAR(completed.covariance(member, member), 1e-16 + 4e-16, 1e-22);
}

TEST(LeftOut, IsNothingByTheSameModel) {
  const Calibration all = by_a_flight_on_which_k0_acts_as_three_times_a_member();
  const LeftOut left_out(all, vsh(2));
  EXPECT_TRUE(left_out.nothing());
  EXPECT_EQ(left_out.reduced().covariance, all.covariance);
  EXPECT_EQ(left_out.completed(all, {}).covariance, all.covariance);
  EXPECT_EQ(left_out.completed_prior(all).states, all.states);
  EXPECT_EQ(left_out.completed(ParameterHistory{{Time{}}, {{1}}, {{2}}}).value,
            (std::vector<std::vector<double>>{{1}}));
  EXPECT_EQ(left_out_walk_rad_sqrt_s(left_out, all, ScreenedPass()), 0);
}

/// A pass of two gyros whose momenta turn in their cases once in 5400 s, in the plane of x and y.
ScreenedPass orbits(Duration length) {
  ScreenedPass pass;
  for (Duration t{}; t < length; t += std::chrono::seconds(10)) {
    ScreenedPass::Fix& fix = pass.fixes.emplace_back();
    const double angle = 2 * std::numbers::pi * to_seconds(t) / 5400;
    fix.fix.t = Time(t);
    fix.fix.q_in_c = Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitZ());
    fix.used[0] = fix.used[1] = true;
    fix.h_b[0] = {std::cos(angle), std::sin(angle), 0};
    fix.h_b[1] = Eigen::Vector3d::UnitX();
  }
  return pass;
}

TEST(LeftOut, WalksAsFarAsNothingMakesUpForIt) {
  Calibration all = of_two_gyros(vsh(1), 1e-30);
  const Eigen::Index member = row_of(all, {kW, 1, 0});
  const double sigma = 1e-9;
  all.covariance(member, member) = sigma * sigma;
  // W(1, 0) = sqrt(3/4π) z turns the momentum about z by its amplitude: the same way all the time, so that over the
  // longest time, 270 min, it is most of a random walk; only one of the two axes moves.
  const LeftOut left_out(all, kEsg7);
  const double rate = sigma * std::sqrt(3 / (4 * std::numbers::pi));
  EXPECT_NEAR(left_out_walk_rad_sqrt_s(left_out, all, orbits(std::chrono::hours(9))), rate * std::sqrt(270 * 60 / 2.0),
              1e-3 * rate * std::sqrt(270 * 60 / 2.0));
  EXPECT_NEAR(left_out_walk_rad_sqrt_s(left_out, all, orbits(std::chrono::hours(1))), rate * std::sqrt(45 * 60 / 2.0),
              1e-2 * rate * std::sqrt(45 * 60 / 2.0));
  EXPECT_EQ(left_out_walk_rad_sqrt_s(left_out, all, orbits(std::chrono::minutes(5))), 0);
}

/// Drift about y of the case turns the momentum as an error of the alignment about x does, on orbits().
TEST(LeftOut, WalksNowhereWhereTheAlignmentMakesUpForIt) {
  Calibration all = of_two_gyros(vsh(1), 1e-30);
  const Eigen::Index member = row_of(all, {kW, 1, -1});
  const Eigen::Index align_x = rows_of(all, {ParameterId::alignment(0, 0)}).front();
  all.covariance(member, member) = 1e-18;
  const ScreenedPass pass = orbits(std::chrono::hours(9));
  const double alone = left_out_walk_rad_sqrt_s(LeftOut(all, kEsg7), all, pass);
  EXPECT_GT(alone, 5e-9);
  // −∇W(1, −1) = −sqrt(3/4π) y, over one radian of the orbit.
  const double turn_per_drift = -std::sqrt(3 / (4 * std::numbers::pi)) * 5400 / (2 * std::numbers::pi);
  all.covariance(align_x, align_x) += turn_per_drift * turn_per_drift * 1e-18;
  all.covariance(align_x, member) = all.covariance(member, align_x) = -turn_per_drift * 1e-18;
  EXPECT_LT(left_out_walk_rad_sqrt_s(LeftOut(all, kEsg7), all, pass), 1e-3 * alone);
}

TEST(DriftOnBoard, IsWhatACalibrationWithAFieldSays) {
  Calibration field = by_a_flight_on_which_k0_acts_as_three_times_a_member();
  field.on_board_drift = OnBoardDrift{vsh(1), 3e-9};
  CalibrationOptions options;
  options.direction_random_walk_rad_sqrt_s = 4e-9;
  use_on_board(field, options);
  EXPECT_EQ(options.drift_model, vsh(1));
  EXPECT_NEAR(options.direction_random_walk_rad_sqrt_s, 5e-9, 1e-15);
  EXPECT_FALSE(options.further_states.is_on(FurtherState::kWanderingDrift));
  // By another model nobody has said what it leaves out.
  options.drift_model = kEsg7;
  use_on_board(field, options);
  EXPECT_EQ(options.drift_model, kEsg7);
  EXPECT_TRUE(options.further_states.is_on(FurtherState::kWanderingDrift));
}

TEST(DriftOnBoard, SizesOfMembersThatMakeUpForOthersGrowByThat) {
  Calibration all = by_a_flight_on_which_k0_acts_as_three_times_a_member();
  const Eigen::Index first = row_of(all, {kW, 1, 0});
  const Eigen::Index member = row_of(all, {kW, 2, 1});
  all.covariance(first, member) = all.covariance(member, first) = -2e-17;
  MeanSquares members = mean_squares_of(all);
  const double before = members[0].at({kW, 1, 0});
  add_made_up(LeftOut(all, vsh(1)), all, members);
  EXPECT_NEAR(members[0].at({kW, 1, 0}), before + 0.2 * 0.2 * (1e-16 + 4e-16), 1e-22);
  EXPECT_EQ(members[1].at({kW, 1, 0}), 1e-18);
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
