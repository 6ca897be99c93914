#include "trihedron/core/paper_estimator.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "flight.hpp"
#include "numerical_jacobian.hpp"

namespace trihedron {
namespace {

using Paper = PaperEstimator;
using test::PaperGiven;

// The paper's state vector, in its order.
static_assert(Paper::States::kSize == 24);
static_assert(Paper::States::direction(1) == 2 && Paper::States::drift(0) == 4 && Paper::States::alignment(0) == 11 &&
              Paper::States::drift(1) == 14 && Paper::States::alignment(1) == 21);

/// Model and readings of one moment with misalignments, off by a little from each other so that no innovation is zero.
struct Moment {
  Paper::Gyros gyros;
  Directions h_b;
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
      const Eigen::Vector3d dh = qi.tangents[k] * x.segment<2>(Paper::States::direction(k));
      g[k].h_in = rotated<double>(g[k].h_in, g[k].h_in.cross(-dh));
      g[k].drift_rad_s -= x.segment<7>(Paper::States::drift(k));
      g[k].C_c_b = Rot<C, C>::exp(Vec<C>::assume(-x.segment<3>(Paper::States::alignment(k)))).raw() * g[k].C_c_b;
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
    Directions h_b;
    for (int k = 0; k < 2; ++k) {
      h_b[k] = (moment.h_b[k] + cause.segment<3>(3 + 3 * k)).normalized();
    }
    return Paper::measure(moment.gyros, qi, C_in_c, h_b, setup).innovation;
  };
  Eigen::Matrix<double, 9, 1> sigma;
  sigma << setup.star_trackers[0].noise_rad, Eigen::Vector3d::Constant(setup.readout_noise_rad[0]),
      Eigen::Vector3d::Constant(setup.readout_noise_rad[1]);
  const Eigen::Matrix<double, 4, 9> by_cause =
      test::central_differences<decltype(innovation)&, 9>(innovation, Eigen::Matrix<double, 9, 1>::Zero(), 1e-5);
  const Eigen::Matrix4d expected = by_cause * sigma.cwiseAbs2().asDiagonal() * by_cause.transpose();
  test::expect_jacobian(Paper::measure(moment.gyros, qi, moment.C_in_c, moment.h_b, setup).R, expected, 1e-7);

  // Of a fix that comes with a covariance, that, by how much the noise is larger than told about each axis.
  const FixCovariance told{{4e-10, 9e-10, 1e-8, 1e-10, -2e-10, 3e-10}};
  setup.over_told_covariance = {1, 2, 1.5};
  Eigen::Matrix<double, 9, 9> causes = sigma.cwiseAbs2().asDiagonal();
  const auto over = setup.over_told_covariance.asDiagonal();
  causes.topLeftCorner<3, 3>() = over * told.matrix() * over;
  const Eigen::Matrix4d expected_as_told = by_cause * causes * by_cause.transpose();
  test::expect_jacobian(Paper::measure(moment.gyros, qi, moment.C_in_c, moment.h_b, setup, told).R, expected_as_told,
                        1e-7);
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
  constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
  const auto fault_of = [](auto&& spoil) {
    PaperGiven given;
    spoil(given);
    return given.fault();
  };
  EXPECT_EQ(fault_of([](PaperGiven&) {}), std::nullopt);
  using Fault = SetupFault;
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.covariance(3, 3) = 0; }), Fault::kPriorNotPositiveDefinite);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.covariance(3, 3) = kNoNumber; }), Fault::kPriorNotPositiveDefinite);
  EXPECT_EQ(
      fault_of([](PaperGiven& g) { g.covariance(0, 1) = g.covariance(1, 0) = 4.1e-12; }),  // correlation above one
      Fault::kPriorNotPositiveDefinite);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.covariance.conservativeResize(19, 19); }), Fault::kPriorNotPositiveDefinite);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.setup.readout_noise_rad[1] = 0; }), Fault::kNoiseNotPositive);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.setup.star_trackers[0].noise_rad(2) = kNoNumber; }),
            Fault::kNoiseNotPositive);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.setup.direction_random_walk_rad_sqrt_s = -1e-9; }),
            Fault::kNoiseNotPositive);
  EXPECT_EQ(
      fault_of([](PaperGiven& g) { g.setup.star_trackers[0].noise_rad(0) = std::numeric_limits<double>::infinity(); }),
      Fault::kNoiseNotPositive);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.prior[0].drift_rad_s(2) = kNoNumber; }), Fault::kPriorMeanNotUsable);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.prior[1].C_c_b *= 1.001; }), Fault::kPriorMeanNotUsable);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.setup.gate_nis = 0; }), Fault::kGateNotPositive);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.setup.reopen_after_rejections = 0; }), Fault::kGateNotPositive);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.setup.reopen_after_jump_rejections = 0; }), Fault::kGateNotPositive);
  // It has one layout.
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.setup.layout.gyros = 3; }), Fault::kTooLarge);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.setup.layout.drift_model = vsh(1); }), Fault::kTooLarge);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.setup.layout.further.clock_offset = true; }), Fault::kTooLarge);
  EXPECT_EQ(fault_of([](PaperGiven& g) { g.setup.layout.star_trackers = 2; }), Fault::kTooLarge);
}

TEST(PaperEstimator, HasARandomWalkThatIsAlikeInAllDirections) {
  PaperGiven given;
  given.setup.direction_random_walk_rad_sqrt_s = 1e-3;
  const auto estimator = given.estimator();
  const Moment moment;
  const FixReadings readings{.h_b = moment.h_b, .used = all_gyros(2)};
  const StarFix fix{Time{}, Eigen::Quaterniond(moment.C_in_c)};
  ASSERT_EQ(estimator->correct(fix, readings).status, FixStatus::kStarted);
  estimator->predict(moment.C_in_c, moment.h_b, Time(std::chrono::seconds(10)), 10);
  const auto covariance = estimator->correct(fix, readings).innovation_covariance;
  const double sine = estimator->gyros()[0].h_in.cross(estimator->gyros()[1].h_in).norm();
  EXPECT_LT(sine, 0.98);
  // Component 2 of the second momentum is by an axis that is not across it.
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(covariance(i, i) / 1e-5, i == 3 ? sine * sine : 1, 3e-3) << i;
  }
}

TEST(PaperEstimator, GivesNoAttitudeByOneGyro) {
  const Moment moment;
  EXPECT_TRUE(Paper::rotation(moment.gyros, moment.h_b, all_gyros(2)).ok());
  EXPECT_EQ(Paper::rotation(moment.gyros, moment.h_b, all_gyros(1)).fault(), DirectionsFault::kTooFew);
  EXPECT_TRUE(Paper::attitude(moment.gyros, moment.h_b, all_gyros(2)).ok());
  EXPECT_EQ(Paper::attitude(moment.gyros, moment.h_b, all_gyros(1)).fault(), DirectionsFault::kTooFew);
}

TEST(PaperEstimator, ConvergesToTheTruthWithoutNoise) {
  // Told of the nominal noise, given none: what is left is the error of the linearisation and of the prior.
  const test::Flight flight({.duration_s = 5400, .noise = 0});
  const auto on_board = PaperGiven().on_board();
  test::fly(flight, *on_board);
  const Eigen::VectorXd errors = test::parameter_errors(flight.truth, on_board->estimator().gyros());
  for (int k = 0; k < 2; ++k) {
    EXPECT_LT(errors.segment<3>(10 * k + 7).norm(), 0.5 * test::kArcsecond);
    EXPECT_LT(angle_between<double>(flight.truth[k].h_in, on_board->estimator().gyros()[k].h_in),
              0.5 * test::kArcsecond);
    EXPECT_LT(errors.segment<7>(10 * k).norm(), 0.05 * flight.truth[k].drift_rad_s.norm());
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
    // Truth must be a draw from the prior; the flight's is fixed, so the prior mean is drawn about it.
    PaperGiven given;
    given.set_alignment_sigma(kAlignmentSigma_rad);
    test::draw_means(flight.truth, seed, kAlignmentSigma_rad, given.prior);
    const auto on_board = given.on_board();
    test::fly(flight, *on_board, [&](const StepReport& report) {
      if (report.fix.status == FixStatus::kUsed) {
        nis += report.fix.nis;
        ++fixes;
      }
    });
    nees += test::parameter_nees(flight.truth, on_board->estimator()) / kRuns;
  }
  EXPECT_NEAR(nees, 20, 3.29 * std::sqrt(2.0 * 20 / kRuns));
  EXPECT_NEAR(nis / fixes, 4, 3.29 * std::sqrt(8 / fixes));
}

}  // namespace
}  // namespace trihedron
