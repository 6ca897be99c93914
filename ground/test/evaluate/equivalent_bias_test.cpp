#include "trihedron/ground/evaluate/equivalent_bias.hpp"

#include <gtest/gtest.h>

#include "passes.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

constexpr std::size_t kRow = 600;  // half an hour

Calibration at_half_an_hour() {
  const Truth& truth = two_hours().truth;
  Calibration calibration;
  calibration.t = truth.t[kRow];
  calibration.gyros = true_gyros(truth, kRow);
  return calibration;
}

AttitudeHistory true_attitude() {
  const Truth& truth = two_hours().truth;
  AttitudeHistory attitude;
  attitude.t = truth.t;
  attitude.q_in_c = truth.q_in_c;
  return attitude;
}

Eigen::Vector3d momentum(std::size_t row, int gyro) {
  const double* h = &two_hours().truth.h_in[(row * 2 + static_cast<std::size_t>(gyro)) * 3];
  return {h[0], h[1], h[2]};
}

/// Of the attitude at `row` by momenta that are taken to be as at `still`, c axes, rad.
Eigen::Vector3d error(std::size_t row, std::size_t still) {
  const Eigen::Matrix3d C_in_c = two_hours().truth.q_in_c[row].normalized().toRotationMatrix();
  Directions h_in;
  Directions h_c;
  GyroMask used{};
  for (int k = 0; k < 2; ++k) {
    h_in[k] = momentum(still, k);
    h_c[k] = C_in_c.transpose() * momentum(row, k);
    used[k] = true;
  }
  const auto shown = optimal_attitude(h_in, h_c, used);
  return (Rot<In, C>::assume(Eigen::Quaterniond(C_in_c)).inverse() * shown.value().C_in_c).log().raw();
}

TEST(EquivalentBias, IsTheRateByMomentaThatAreTakenToStandStillLessTheTrueOne) {
  const std::vector<Eigen::Vector3d> bias_rad_s = equivalent_gyro_bias_rad_s(at_half_an_hour(), true_attitude());
  ASSERT_EQ(bias_rad_s.size(), two_hours().truth.t.size());
  // Before the time of the calibration, at it, and long after.
  for (const std::size_t row : {std::size_t{100}, kRow, std::size_t{2200}}) {
    const double apart_s = to_seconds(two_hours().truth.t[row + 5] - two_hours().truth.t[row - 5]);
    const Eigen::Vector3d expected = (error(row + 5, row) - error(row - 5, row)) / apart_s;
    EXPECT_GT(expected.norm(), 1e-7);
    // The body turns by a degree in half of that time, and drift changes with it: to the second order, in the
    // difference.
    EXPECT_LT((bias_rad_s[row] - expected).norm(), 2e-3 * expected.norm()) << row;
  }
}

TEST(EquivalentBias, OfACalibrationOutsideTheAttitudeHasItsMomenta) {
  Calibration calibration = at_half_an_hour();
  AttitudeHistory attitude = true_attitude();
  attitude.t.resize(1);
  attitude.q_in_c.resize(1);
  const Eigen::Vector3d at_its_time = equivalent_gyro_bias_rad_s(calibration, attitude).front();
  calibration.t = attitude.t.front();
  EXPECT_EQ(at_its_time, equivalent_gyro_bias_rad_s(calibration, attitude).front());
  EXPECT_TRUE(equivalent_gyro_bias_rad_s(calibration, {}).empty());
}

TEST(EquivalentBias, OfNearlyParallelMomentaIsRefused) {
  Calibration calibration = at_half_an_hour();
  calibration.gyros[1].momentum_in = calibration.gyros[0].momentum_in;
  EXPECT_THROW(static_cast<void>(equivalent_gyro_bias_rad_s(calibration, true_attitude())), SetupError);
}

}  // namespace
}  // namespace trihedron::ground
