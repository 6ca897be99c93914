#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "consistency/band.hpp"
#include "consistency/bound.hpp"
#include "consistency/flight.hpp"
#include "consistency/grid.hpp"
#include "consistency/results.hpp"
#include "consistency/statistics.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
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

TEST(Band, OfDifferentFreedomsIsThatOfTheirSum) {
  const Band band = band_of_mean(18.5, 2);
  EXPECT_NEAR(band.low, 22.106 / 2, 1e-3);
  EXPECT_NEAR(band.high, 55.668 / 2, 1e-3);
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
  options.estimator = Estimator::kInvariant;
  options.direction_random_walk_rad_sqrt_s = 0;
  const Eigen::MatrixXd covariance = ground::calibrate(flown.pass, options).calibration.covariance;
  const ParameterCovariance bound = parameter_bound(flown.pass.settings, flown.truth);
  for (Eigen::Index i = 0; i < bound.rows(); ++i) {
    EXPECT_NEAR(std::sqrt(covariance(i, i) / bound(i, i)), 1, 0.03) << i;
  }
}

/// An estimator whose covariance is known: combinations of the parameters, oblique in all of them, with these variances
/// in units of their prior ones.
struct KnownEstimator {
  explicit KnownEstimator(const ParameterErrors& variances) {
    prior_sigma.setConstant(1e-6);
    for (int k = 0; k < 2; ++k) {
      prior_sigma.segment<3>(Parameters::alignment(k)).setConstant(5e-3);
    }
    prior = prior_sigma.cwiseAbs2().asDiagonal();
    Eigen::HouseholderQR<ParameterCovariance> oblique(ParameterCovariance::NullaryExpr([&] { return normal(random); }));
    root = prior_sigma.asDiagonal() * ParameterCovariance(oblique.householderQ()) *
           ParameterCovariance(variances.cwiseSqrt().asDiagonal());
    covariance = root * root.transpose();
  }

  /// Of each combination, in its 1-sigma.
  ParameterErrors draw() {
    return ParameterErrors::NullaryExpr([&] { return normal(random); });
  }

  std::mt19937_64 random{2};
  std::normal_distribution<double> normal;
  ParameterErrors prior_sigma;
  ParameterCovariance prior;
  ParameterCovariance root;  ///< a column per combination
  ParameterCovariance covariance;
};

/// Variance of a combination over its prior one, whose prior sigma is `ratio` of that by the measurements alone.
double share(double ratio) { return 1 / (1 + ratio * ratio); }

TEST(ObservableNees, OfDrawnErrorsIsTheSquareOfWhatWasDrawn) {
  ParameterErrors variances = ParameterErrors::Constant(1e-9);
  variances.head<3>() << 1, share(9.9), share(10.1);
  KnownEstimator estimator(variances);
  constexpr int kRuns = 1000;
  double mean = 0;
  for (int run = 0; run < kRuns; ++run) {
    const ParameterErrors drawn = estimator.draw();
    const Nees nees = observable_nees(estimator.root * drawn, estimator.covariance, estimator.prior);
    ASSERT_EQ(nees.freedom, 18);
    ASSERT_NEAR(nees.value, drawn.tail<18>().squaredNorm(), 1e-4 * nees.value);  // 1e-16 of the prior in 1e-9 of it
    mean += nees.value / kRuns;
  }
  EXPECT_EQ(band_of_mean(18, kRuns).side(mean), 0) << mean;
}

TEST(ObservableNees, DoesNotCountWhatStaysAtItsPrior) {
  ParameterErrors variances = ParameterErrors::Constant(1e-6);
  variances(5) = 1;
  KnownEstimator estimator(variances);
  const ParameterErrors errors = estimator.root * estimator.draw();
  const Nees nees = observable_nees(errors, estimator.covariance, estimator.prior);
  const Nees far_off = observable_nees(errors + 100 * estimator.root.col(5), estimator.covariance, estimator.prior);
  EXPECT_EQ(nees.freedom, 19);
  EXPECT_NEAR(far_off.value, nees.value, 1e-6 * nees.value);
}

TEST(ObservableNees, IsNothingBeforeTheFlight) {
  KnownEstimator estimator(ParameterErrors::Ones());
  const Nees nees = observable_nees(estimator.root * estimator.draw(), estimator.covariance, estimator.prior);
  EXPECT_EQ(nees.freedom, 0);
  EXPECT_EQ(nees.value, 0);
}

TEST(Difference, OfEqualEstimatesIsZero) {
  const KnownEstimator estimator(ParameterErrors::LinSpaced(1e-9, 1e-2));
  for (const auto& difference_of : {difference_by_parameter, difference_by_combination}) {
    const Difference none = difference_of(ParameterErrors::Zero(), estimator.covariance, estimator.covariance);
    EXPECT_EQ(none.square, 0);
    EXPECT_NEAR(none.variance_ratio, 1, 1e-6);
    EXPECT_TRUE(agrees(none));
  }
}

TEST(Difference, ByParameterIsInItsSigmas) {
  const KnownEstimator estimator(ParameterErrors::LinSpaced(1e-9, 1e-2));
  ParameterErrors sigma = estimator.covariance.diagonal().cwiseSqrt();
  sigma.head<10>() *= -2;
  const Difference difference = difference_by_parameter(sigma, 9 * estimator.covariance, estimator.covariance);
  EXPECT_NEAR(difference.square, (4 + 1) / 2.0, 1e-9);
  EXPECT_NEAR(difference.variance_ratio, 9, 1e-9);
}

/// One that no parameter shows by itself counts as much as any other.
TEST(Difference, ByCombinationSeesEachCombination) {
  const KnownEstimator estimator(ParameterErrors::LinSpaced(1e-9, 1e-2));
  const ParameterErrors best_known = estimator.root.col(0);
  const ParameterCovariance less_known =
      estimator.covariance + 40 * best_known * best_known.transpose();  // 41 times the variance
  const Difference hidden = difference_by_parameter(3 * best_known, less_known, estimator.covariance);
  const Difference seen = difference_by_combination(3 * best_known, less_known, estimator.covariance);
  EXPECT_LT(hidden.square, 1e-5);
  EXPECT_LT(hidden.variance_ratio, 1 + 1e-4);
  EXPECT_NEAR(seen.square, 9.0 / 20, 1e-6);
  EXPECT_NEAR(seen.variance_ratio, (19 + 41) / 20.0, 1e-6);
}

TEST(Difference, MayBeAThirdOfASigmaBesideWhatTheFirstSaysToKnowLess) {
  EXPECT_TRUE(agrees({0.11, 1}));
  EXPECT_FALSE(agrees({0.12, 1}));
  EXPECT_TRUE(agrees({0.11 + 2, 3}));
  EXPECT_FALSE(agrees({0.12 + 2, 3}));
  EXPECT_FALSE(agrees({0.12, 0.9}));
  EXPECT_FALSE(agrees({std::nan(""), 1}));
}

std::vector<Cell> first_cell() { return {grid().front()}; }

TEST(Results, ComeBackFromTheFile) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "consistency_results.txt";
  std::filesystem::remove(file);
  const std::string cell = first_cell().front().name();
  Outcome outcome;
  outcome.nees = 21;
  outcome.observable = {17.5, 18};
  outcome.nis = 4.001;
  outcome.fixes = 10800;
  outcome.error_over_bound_square = std::nan("");
  outcome.by_parameter = {0.04, 1.21};
  outcome.by_combination = {0.09, 1.44};
  Results written(file);
  written.add({cell, 1, "batch"}, outcome);
  const Results read(file);
  ASSERT_TRUE(read.contains({cell, 1, "batch"}));
  EXPECT_EQ(read.table(first_cell(), {{"batch", 1}}), written.table(first_cell(), {{"batch", 1}}));
  EXPECT_EQ(read.observable_table(first_cell(), {{"batch", 1}}),
            written.observable_table(first_cell(), {{"batch", 1}}));
  EXPECT_NE(read.observable_table(first_cell(), {{"batch", 1}}).find("| 17.5 | 18.00 | 8.2 … 31.5 |"),
            std::string::npos);
  EXPECT_NE(read.agreement_table(first_cell(), 1).find("| 0.20 | 1.100 | 0.30 | 1.200 |"), std::string::npos);

  std::ofstream(file, std::ios::app) << cell << " 2 batch 10800 21 what\n";
  EXPECT_THROW(Results{file}, std::runtime_error);
}

TEST(Results, TellWhichEstimatesDoNotAgree) {
  Results results;
  Outcome outcome;
  outcome.by_parameter = {0.1, 1};
  outcome.by_combination = {0.5, 1.1};
  results.add({first_cell().front().name(), 1, "batch"}, outcome);
  const std::string table = results.agreement_table(first_cell(), 1);
  EXPECT_NE(table.find("| 0.32 | 1.000 | 0.71 ↑ | 1.049 |"), std::string::npos) << table;
  EXPECT_NE(table.find("by parameter 0, by combination 1 of 1 rows"), std::string::npos) << table;
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
    const Outcome outcome = fly(*cell, run, {Estimator::kInvariant}).front();
    EXPECT_EQ(outcome.fixes, 10800) << name;
    EXPECT_LT(outcome.nees, 50) << name;  // χ² of 20, once in 5000
  }
}

TEST(Flights, OfFilterAndBatchAgree) {
  const std::vector<Cell> cells = grid();
  const auto cell = std::find_if(cells.begin(), cells.end(),
                                 [](const Cell& c) { return c.name() == "steady/plane-plane/1e-06/30arcmin/0e+00"; });
  ASSERT_NE(cell, cells.end());
  const std::vector<Outcome> outcomes = fly(*cell, 1, {Estimator::kInvariant, Estimator::kBatch});
  EXPECT_TRUE(agrees(outcomes[1].by_parameter));
  EXPECT_TRUE(agrees(outcomes[1].by_combination));
  for (const Outcome& outcome : outcomes) {
    EXPECT_EQ(outcome.observable.freedom, 18);  // about the orbit normal the alignment of neither gyro
    EXPECT_EQ(band_of_mean(kInnovations, outcome.fixes).side(outcome.nis), 0) << outcome.nis;
  }
}

}  // namespace
}  // namespace trihedron::consistency
