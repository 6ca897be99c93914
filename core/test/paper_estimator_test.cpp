#include "trihedron/core/paper_estimator.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "flight.hpp"
#include "numerical_jacobian.hpp"
#include "trihedron/core/cycles.hpp"

namespace trihedron {
namespace {

using Paper = PaperEstimator<Esg7>;

// The paper's state vector, in its order.
static_assert(Paper::Layout::kStates == 24);
static_assert(Paper::Layout::direction(1) == 2 && Paper::Layout::drift(0) == 4 && Paper::Layout::alignment(0) == 11 &&
              Paper::Layout::drift(1) == 14 && Paper::Layout::alignment(1) == 21);

/// Model and readings of one moment with misalignments, off by a little from each other so that no innovation is zero.
struct Moment {
  Paper::Gyros gyros;
  Paper::Directions h_b;
  Eigen::Matrix3d C_in_c = test::Flight::attitude(700, 0.5);
  Moment() {
    const test::Flight flight({.duration_s = 1});
    gyros = flight.truth;
    for (int k = 0; k < 2; ++k) {
      h_b[k] = gyros[k].C_c_b.transpose() * C_in_c.transpose() * gyros[k].h_in;
    }
  }
  [[nodiscard]] Trihedron<In> trihedron() const {
    return make_trihedron(Vec<In>::assume(gyros[0].h_in), Vec<In>::assume(gyros[1].h_in)).value();
  }
};

TEST(PaperMeasurement, MatchesCentralDifferencesOfEquation3) {
  const Moment moment;
  const auto qi = Paper::quasi_inertial(moment.trihedron());
  const auto setup = test::nominal_setup();
  // What the innovation would be if the truth differed from the model by x: model wrong by −x.
  const auto innovation = [&](const Eigen::Matrix<double, 24, 1>& x) {
    Paper::Gyros g = moment.gyros;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector3d dh = qi.tangents[k] * x.segment<2>(Paper::Layout::direction(k));
      g[k].h_in = rotated<double>(g[k].h_in, g[k].h_in.cross(-dh));
      g[k].drift_rad_s -= x.segment<7>(Paper::Layout::drift(k));
      g[k].C_c_b = Rot<C, C>::exp(Vec<C>::assume(-x.segment<3>(Paper::Layout::alignment(k)))).raw() * g[k].C_c_b;
    }
    return Paper::measure(g, qi, moment.C_in_c, moment.h_b, setup).innovation;
  };
  const auto numerical =
      test::central_differences<decltype(innovation)&, 24>(innovation, Eigen::Matrix<double, 24, 1>::Zero(), 1e-5);
  test::expect_jacobian(Paper::measure(moment.gyros, qi, moment.C_in_c, moment.h_b, setup).H, numerical, 1e-8);
}

TEST(PaperMeasurement, NoiseIsThatOfTrackerAndReadouts) {
  const Moment moment;
  const auto qi = Paper::quasi_inertial(moment.trihedron());
  auto setup = test::nominal_setup();
  setup.readout_noise_rad[1] = 3e-6;  // unequal, so that a mix-up shows
  // Causes: tracker rotation about c, then readout errors of gyro 1 and 2; each of its own sigma.
  const auto innovation = [&](const Eigen::Matrix<double, 9, 1>& cause) {
    const Eigen::Matrix3d C_in_c = moment.C_in_c * Rot<C, C>::exp(Vec<C>::assume(cause.head<3>())).raw();
    Paper::Directions h_b;
    for (int k = 0; k < 2; ++k) {
      h_b[k] = (moment.h_b[k] + cause.segment<3>(3 + 3 * k)).normalized();
    }
    return Paper::measure(moment.gyros, qi, C_in_c, h_b, setup).innovation;
  };
  Eigen::Matrix<double, 9, 1> sigma;
  sigma << setup.star_tracker_noise_rad, Eigen::Vector3d::Constant(setup.readout_noise_rad[0]),
      Eigen::Vector3d::Constant(setup.readout_noise_rad[1]);
  const Eigen::Matrix<double, 4, 9> by_cause =
      test::central_differences<decltype(innovation)&, 9>(innovation, Eigen::Matrix<double, 9, 1>::Zero(), 1e-5);
  const Eigen::Matrix4d expected = by_cause * sigma.cwiseAbs2().asDiagonal() * by_cause.transpose();
  test::expect_jacobian(Paper::measure(moment.gyros, qi, moment.C_in_c, moment.h_b, setup).R, expected, 1e-7);
}

TEST(PaperMeasurement, AngleIsAFunctionOfTheOtherFour) {
  // z1 = cosθ_R − cosθ_s adds nothing at a fix: to first order it is h1·z(2) + h2·z(1) of the direction differences.
  Moment moment;
  for (int k = 0; k < 2; ++k) {
    moment.h_b[k] = (moment.h_b[k] + Eigen::Vector3d(3e-5, -2e-5, 4e-5) * (k + 1)).normalized();
  }
  const auto t = moment.trihedron();
  const auto qi = Paper::quasi_inertial(t);
  const auto y = Paper::measure(moment.gyros, qi, moment.C_in_c, moment.h_b, test::nominal_setup()).innovation;
  const double z1 = moment.gyros[0].h_in.dot(moment.gyros[1].h_in) -
                    (moment.gyros[0].C_c_b * moment.h_b[0]).dot(moment.gyros[1].C_c_b * moment.h_b[1]);
  const Eigen::Vector3d d1 = qi.tangents[0] * y.head<2>();
  const Eigen::Vector3d d2 = qi.tangents[1] * y.tail<2>();
  const double from_four = -(d1.dot(moment.gyros[1].h_in) + d2.dot(moment.gyros[0].h_in));
  ASSERT_GT(std::abs(z1), 1e-5);
  EXPECT_NEAR(z1, from_four, 1e-8);  // squares of 1e-4
}

TEST(PaperEstimator, RefusesSetupsThatCannotWork) {
  auto setup = test::nominal_setup();
  EXPECT_TRUE(Paper::create(setup).ok());
  setup.prior_covariance(3, 3) = 0;
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kPriorNotPositiveDefinite);
  setup = test::nominal_setup();
  setup.prior_covariance(3, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kPriorNotPositiveDefinite);
  setup = test::nominal_setup();
  setup.prior_covariance(0, 1) = setup.prior_covariance(1, 0) = 4.1e-12;  // correlation above one
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kPriorNotPositiveDefinite);
  setup = test::nominal_setup();
  setup.readout_noise_rad[1] = 0;
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kNoiseNotPositive);
  setup = test::nominal_setup();
  setup.star_tracker_noise_rad(2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kNoiseNotPositive);
  setup = test::nominal_setup();
  setup.direction_random_walk_rad_sqrt_s = -1e-9;
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kNoiseNotPositive);
  setup = test::nominal_setup();
  setup.star_tracker_noise_rad(0) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kNoiseNotPositive);
  setup = test::nominal_setup();
  setup.prior[0].drift_rad_s(2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kPriorMeanNotUsable);
  setup = test::nominal_setup();
  setup.prior[1].C_c_b *= 1.001;
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kPriorMeanNotUsable);
  setup = test::nominal_setup();
  setup.gate_nis = 0;
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kGateNotPositive);
  setup = test::nominal_setup();
  setup.reopen_after_rejections = 0;
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kGateNotPositive);
  setup = test::nominal_setup();
  setup.reopen_after_jump_rejections = 0;
  EXPECT_EQ(Paper::create(setup).fault(), SetupFault::kGateNotPositive);
}

/// Rotation vector by which the estimated alignment is off, rad.
Eigen::Vector3d alignment_error(const GyroModel<Esg7>& truth, const GyroModel<Esg7>& estimate) {
  return Rot<C, C>::assume(Eigen::Matrix3d(truth.C_c_b * estimate.C_c_b.transpose())).log().raw();
}

TEST(PaperEstimator, ConvergesToTheTruthWithoutNoise) {
  // Told of the nominal noise, given none: what is left is the error of the linearisation and of the prior.
  const test::Flight flight({.duration_s = 5400, .noise = 0});
  auto cycle = Cycle<Paper>::create(test::nominal_setup(), {}).value();
  test::fly(flight, cycle, [](const auto&) {});
  for (int k = 0; k < 2; ++k) {
    const auto& estimate = cycle.estimator().gyros()[k];
    EXPECT_LT(alignment_error(flight.truth[k], estimate).norm(), 0.5 * test::kArcsecond);
    EXPECT_LT(angle_between<double>(flight.truth[k].h_in, estimate.h_in), 0.5 * test::kArcsecond);
    EXPECT_LT((flight.truth[k].drift_rad_s - estimate.drift_rad_s).norm(), 0.05 * flight.truth[k].drift_rad_s.norm());
  }
}

TEST(PaperEstimator, IsConsistentWithSlewsAndMisalignmentsOfMinutes) {
  // From 30′ on its linearisation about the first, wrong estimate stays in its information; see docs/validation.md.
  constexpr double kAlignmentSigma_rad = 1e-3;
  // NEES of the 20 parameters and NIS, over 20 seeds. 99.9 % of the mean NEES of a consistent filter lie in 20
  // ± 3.29·√(40/20).
  constexpr int kRuns = 20;
  double nees = 0;
  double nis = 0;
  double fixes = 0;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const test::Flight flight({.duration_s = 3600, .seed = seed});
    auto setup = test::nominal_setup();
    // Truth must be a draw from the prior; the flight's is fixed, so the prior mean is drawn about it.
    std::mt19937 random(seed + 1000);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 2; ++k) {
      setup.prior[k].drift_rad_s =
          flight.truth[k].drift_rad_s + 2e-6 * Esg7::Coefficients<double>::NullaryExpr([&] { return normal(random); });
      setup.prior_covariance.diagonal().segment<3>(10 * k + 7).setConstant(kAlignmentSigma_rad * kAlignmentSigma_rad);
      const Eigen::Vector3d delta = kAlignmentSigma_rad * Eigen::Vector3d::NullaryExpr([&] { return normal(random); });
      setup.prior[k].C_c_b = Rot<C, C>::exp(Vec<C>::assume(delta)).raw() * flight.truth[k].C_c_b;
    }
    auto cycle = Cycle<Paper>::create(setup, {}).value();
    test::fly(flight, cycle, [&](const auto& report) {
      if (report.fix.status == FixStatus::kUsed) {
        nis += report.fix.nis;
        ++fixes;
      }
    });
    Eigen::Matrix<double, 20, 1> error;
    for (int k = 0; k < 2; ++k) {
      const auto& estimate = cycle.estimator().gyros()[k];
      error.segment<7>(10 * k) = flight.truth[k].drift_rad_s - estimate.drift_rad_s;
      error.segment<3>(10 * k + 7) = alignment_error(flight.truth[k], estimate);
    }
    const auto root = cycle.estimator().error_root().bottomRows<20>().eval();
    nees += error.dot((root * root.transpose()).llt().solve(error)) / kRuns;
  }
  EXPECT_NEAR(nees, 20, 3.29 * std::sqrt(2.0 * 20 / kRuns));
  EXPECT_NEAR(nis / fixes, 4, 3.29 * std::sqrt(8 / fixes));
}

}  // namespace
}  // namespace trihedron
