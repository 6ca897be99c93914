#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "consistency/band.hpp"
#include "consistency/bound.hpp"
#include "consistency/flight.hpp"
#include "consistency/grid.hpp"
#include "trihedron/ground/calibrate.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::consistency {
namespace {

TEST(Band, OfOneValueIsTheTabulatedOneOfChiSquare) {
  const Band band = band_of_mean(20, 1);
  EXPECT_NEAR(band.low, 9.591, 1e-3);
  EXPECT_NEAR(band.high, 34.170, 1e-3);
}

TEST(Band, OfManyIsTheNormalOne) {
  const Band band = band_of_mean(4, 1000000);
  const double half = 1.959964 * std::sqrt(8 / 1e6);
  EXPECT_NEAR(band.low, 4 - half, 1e-2 * half);
  EXPECT_NEAR(band.high, 4 + half, 1e-2 * half);
}

TEST(Band, TellsTheSideAndDoesNotTakeNaNForInside) {
  const Band band{1, 2};
  EXPECT_EQ(band.side(0.5), -1);
  EXPECT_EQ(band.side(1), 0);
  EXPECT_EQ(band.side(2), 0);
  EXPECT_EQ(band.side(2.5), 1);
  EXPECT_EQ(band.side(std::nan("")), 1);
}

TEST(Grid, HasEachOf216CellsOnce) {
  std::set<std::string> names;
  for (const Cell& cell : grid()) {
    names.insert(cell.name());
  }
  EXPECT_EQ(names.size(), 216U);
}

/// At rest and without drift the momenta stand still in the case: each reading is φ0 − δ + B Δκ t, a straight line in
/// time. Its beginning is free, so that nothing is learned of the alignment and the drift has its slope's information.
TEST(Bound, AtRestIsThatOfAStraightLine) {
  Scenario scenario = grid().front().scenario(1);
  scenario.duration = std::chrono::minutes(20);
  scenario.attitude.reference = AttitudeScenario::Reference::kInertial;
  scenario.attitude.jitter_rad = 0;
  scenario.attitude.slews = std::vector<Slew>{};
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.kappa_rad_s.emplace().fill(0);
  }
  const sim::SimulatedPass flown = sim::simulate(scenario);
  const PassSettings& settings = flown.pass.settings;
  const ParameterCovariance bound = parameter_bound(settings, flown.truth);

  // Eleven samples to both sides of a fix, each with 2″; at both ends of the pass one alone.
  const double readout_variance = std::pow(2 * kArcsecond, 2);
  const double of_cubic = 3.0 * (3 * 121 + 33 - 1) / (21 * 23 * 25);
  const auto fixes = static_cast<int>(flown.truth.t.size());
  Eigen::Matrix<double, 6, 14> by_drift = Eigen::Matrix<double, 6, 14>::Zero();
  Eigen::Matrix<double, 4, 6> across = Eigen::Matrix<double, 4, 6>::Zero();
  Eigen::Matrix<double, 6, 3> by_fix;
  for (int k = 0; k < 2; ++k) {
    const Truth::Gyro& gyro = flown.truth.gyros[static_cast<std::size_t>(k)];
    const Eigen::Matrix3d C_in_c = flown.truth.q_in_c.front().toRotationMatrix();
    const Eigen::Matrix3d C_in_b = C_in_c * Rot<C, C>::exp(Vec<C>::assume(gyro.alignment_rotation_vector_rad)).raw();
    const Eigen::Vector3d h_in = Eigen::Map<const Eigen::Vector3d>(&flown.truth.h_in[static_cast<std::size_t>(3 * k)]);
    by_drift.block<3, 7>(3 * k, 7 * k) = C_in_b * Esg7::basis<double>(C_in_b.transpose() * h_in);
    const Eigen::Vector3d first = h_in.unitOrthogonal();
    across.block<1, 3>(2 * k, 3 * k) = first.transpose();
    across.block<1, 3>(2 * k + 1, 3 * k) = h_in.cross(first).transpose();
    by_fix.middleRows<3>(3 * k) = C_in_c;
  }
  const Eigen::Matrix<double, 4, 3> fix_noise = across * by_fix * settings.star_tracker_noise_rad.asDiagonal();
  const auto information_of = [&](double variance) {
    return Eigen::Matrix4d(fix_noise * fix_noise.transpose() + variance * Eigen::Matrix4d::Identity()).inverse().eval();
  };
  const double middle_s = to_seconds(scenario.duration) / 2;
  Eigen::Matrix4d of_slope = Eigen::Matrix4d::Zero();
  for (int i = 0; i < fixes; ++i) {
    const bool at_an_end = i == 0 || i == fixes - 1;
    of_slope += std::pow(3.0 * i - middle_s, 2) * information_of(readout_variance * (at_an_end ? 1 : of_cubic));
  }
  const Eigen::Matrix<double, 4, 14> seen = across * by_drift;
  const double prior_information = std::pow(scenario.gyros[0].drift.prior_sigma_rad_s, -2);
  const Eigen::Matrix<double, 14, 14> information =
      prior_information * Eigen::Matrix<double, 14, 14>::Identity() + seen.transpose() * of_slope * seen;
  const Eigen::Matrix<double, 14, 14> expected = information.inverse();

  const double alignment_variance = std::pow(scenario.gyros[0].alignment_prior_sigma_rad, 2);
  for (int k = 0; k < 2; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(bound(Parameters::alignment(k) + axis, Parameters::alignment(k) + axis), alignment_variance,
                  1e-9 * alignment_variance);
    }
    for (int i = 0; i < 7; ++i) {
      const double variance = expected(7 * k + i, 7 * k + i);
      EXPECT_NEAR(bound(Parameters::drift(k) + i, Parameters::drift(k) + i), variance, 1e-6 * variance);
    }
  }
}

/// Where the first, wrong values are off by little, the filter's linearisation is that of the truth.
TEST(Bound, IsTheCovarianceOfTheFilterForSmallMisalignments) {
  Scenario scenario = grid().front().scenario(1);  // slews, 1e-7 rad/s, 1′
  scenario.duration = std::chrono::hours(2);
  const sim::SimulatedPass flown = sim::simulate(scenario);
  CalibrationOptions options;
  options.estimator = "invariant";
  options.direction_random_walk_rad_sqrt_s = 0;
  const Eigen::MatrixXd covariance = ground::calibrate(flown.pass, options).calibration.covariance;
  const ParameterCovariance bound = parameter_bound(flown.pass.settings, flown.truth);
  for (Eigen::Index i = 0; i < bound.rows(); ++i) {
    EXPECT_NEAR(std::sqrt(covariance(i, i) / bound(i, i)), 1, 0.03) << i;
  }
}

/// Misalignments of degrees, and drift ten times that of a good gyro: first estimates far enough off that the filter
/// has to begin anew, once or more.
TEST(Flights, WithWrongFirstEstimatesAreNotLost) {
  const std::vector<std::pair<std::string, int>> flights = {
      {"slews/plane-normal/1e-05/60arcmin/0e+00", 10},  {"slews/plane-normal/1e-05/300arcmin/0e+00", 12},
      {"slews/plane-plane/1e-07/300arcmin/1e-07", 11},  {"steady/plane-plane/1e-07/300arcmin/0e+00", 1},
      {"steady/plane-plane/1e-05/300arcmin/0e+00", 14}, {"slews/plane-normal/1e-05/300arcmin/1e-07", 11},
      {"slews/plane-plane/1e-05/300arcmin/1e-08", 9},   {"slews/plane-plane/1e-06/300arcmin/0e+00", 45},
      {"slews/plane-plane/1e-06/300arcmin/0e+00", 52},  {"slews/plane-plane/1e-06/300arcmin/1e-08", 46}};
  const std::vector<Cell> cells = grid();
  for (const auto& [name, run] : flights) {
    const auto cell = std::find_if(cells.begin(), cells.end(), [&](const Cell& c) { return c.name() == name; });
    ASSERT_NE(cell, cells.end()) << name;
    const Outcome outcome = fly(*cell, run, {"invariant"}).front();
    EXPECT_EQ(outcome.fixes, 10800) << name;
    EXPECT_LT(outcome.nees, 50) << name;  // χ² of 20, once in 5000
  }
}

}  // namespace
}  // namespace trihedron::consistency
