// What a pass can tell of the parameters.

#include "trihedron/ground/observe/observe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "batch/pass_setup.hpp"
#include "named.hpp"
#include "observe/angle_row.hpp"
#include "observe/combinations.hpp"
#include "onboard/screen.hpp"
#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

/// Both momenta near the orbit plane, as in examples/steady-flight.toml.
Scenario steady(Duration duration) {
  Scenario scenario = scenario_in_eq1(2, duration);
  scenario.attitude.slews = std::vector<Slew>{};
  scenario.gyros[0].start_direction_c = {0.995, 0.085, 0.043};
  scenario.gyros[1].start_direction_c = {0.050, 0.124, 0.991};
  return scenario;
}

const Observability& in_steady_flight() {
  static const Observability observability = observe(sim::simulate(steady(std::chrono::hours(4))).pass, told());
  return observability;
}

const Observability& with_slews() {
  static const Observability observability = observe(two_hours().pass, told());
  return observability;
}

std::vector<std::string> unobservable(const Observability& observability) {
  std::vector<std::string> texts;
  for (const Combination& combination : observability.weak) {
    if (combination.singular_value < Observability::kUnobservable) {
      texts.push_back(combination.text);
    }
  }
  return texts;
}

TEST(Observability, OfSteadyFlightLacksTheAlignmentOfEachGyroAboutTheOrbitNormal) {
  EXPECT_THAT(unobservable(in_steady_flight()),
              testing::UnorderedElementsAre("gyro 1 alignment about the orbit normal, against its initial direction",
                                            "gyro 2 alignment about the orbit normal, against its initial direction"));
  EXPECT_TRUE(in_steady_flight().is_harmful());
  EXPECT_GT(in_steady_flight().attitude_error_rad, 20 * kArcsecond);
}

TEST(Observability, OfTheSameFlightWithSlewsLacksNothing) {
  Scenario scenario = steady(std::chrono::hours(2));
  scenario.attitude.slews = ImagingProgramme{};
  const Observability observability = observe(sim::simulate(scenario).pass, told());
  EXPECT_THAT(unobservable(observability), testing::IsEmpty());
  EXPECT_FALSE(observability.is_harmful());
  EXPECT_EQ(observability.rank, 20);
}

/// The momentum of its second gyro is near the orbit normal: drift that works only in the orbit plane is hardly seen in
/// two hours. The combinations are as many as there are singular values below the limits.
TEST(Observability, CountsWhatIsWeak) {
  const Observability& observability = with_slews();
  EXPECT_THAT(unobservable(observability), testing::ElementsAre("gyro 2 drift mu31, nu31"));
  EXPECT_FALSE(observability.is_harmful());
  const auto below = [&](double limit) { return (observability.singular_values.array() < limit).count(); };
  EXPECT_EQ(below(Observability::kUnobservable), 1);
  EXPECT_EQ(static_cast<Eigen::Index>(observability.weak.size()), below(Observability::kWeak));
}

/// Two ways to the same covariance: the constants alone in a forward pass with the prior put to it in the end, and the
/// batch, which has it from the start. They are linearised apart by the last step of the iteration.
TEST(Observability, PredictsTheSigmasOfTheBatch) {
  CalibrationOptions options = told();
  options.estimator = Estimator::kBatch;
  const Calibration calibration = calibrate(two_hours().pass, options).calibration;
  ASSERT_EQ(with_slews().parameters, calibration.states);
  for (Eigen::Index i = 0; i < calibration.covariance.rows(); ++i) {
    EXPECT_NEAR(with_slews().sigma(i) / std::sqrt(calibration.covariance(i, i)), 1, 2e-3)
        << name_of(calibration.states[static_cast<std::size_t>(i)]);
  }
}

/// All fixes of ten minutes without process noise as one dense problem, from which the directions at the start are
/// eliminated.
TEST(Observability, IsThatOfTheDenseProblem) {
  const Pass pass = sim::simulate(scenario_in_eq1(6, std::chrono::minutes(10))).pass;
  CalibrationOptions options = told();
  options.direction_random_walk_rad_sqrt_s = 0;
  const Screened screened = screen(pass, options);
  const PassProblem problem(screened.pass, pass_setup(pass.settings, options));
  const PassProblem::Linear linear = problem.linearise(first_solution(problem, screened));
  const Eigen::Index n = linear.prior.cols();
  const Eigen::Index d = problem.layout().dynamic();
  Eigen::MatrixXd by_first = Eigen::MatrixXd::Identity(n, n);  // of the states of an arc
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t arc = 0; arc < linear.stages.size(); ++arc) {
    const Eigen::MatrixXd rows = linear.stages[arc].H * by_first;
    information += rows.transpose() * rows;
    if (arc < linear.ends.size()) {
      by_first.topRows(d) =
          (linear.ends[arc].A * by_first.topRows(d) + linear.stages[arc].B * by_first.bottomRows(n - d)).eval();
    }
  }
  const Eigen::MatrixXd marginal = information.bottomRightCorner(n - d, n - d) -
                                   information.bottomLeftCorner(n - d, d) * information.topLeftCorner(d, d).llt().solve(
                                                                                information.topRightCorner(d, n - d));
  Eigen::MatrixXd prior = linear.prior;
  prior.rightCols(n - d).setZero();
  const Eigen::MatrixXd root = information_on_constants(prior, linear.stages, {linear.stages.size() - 1}).back();
  // In units in which the diagonal is one: normal equations lose half of the digits.
  const Eigen::VectorXd unit = marginal.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((unit.asDiagonal() * (root.transpose() * root - marginal) * unit.asDiagonal()).norm(), 1e-6);
}

TEST(Observability, GrowsWithTime) {
  const Observability& observability = in_steady_flight();
  ASSERT_EQ(observability.t.size(), observability.sigma_until.size());
  ASSERT_GT(observability.t.size(), 10U);
  EXPECT_TRUE(std::is_sorted(observability.t.begin(), observability.t.end()));
  EXPECT_TRUE((observability.sigma_until.front().array() < observability.prior_sigma.array()).all());
  for (std::size_t i = 1; i < observability.sigma_until.size(); ++i) {
    EXPECT_TRUE((observability.sigma_until[i].array() <= observability.sigma_until[i - 1].array()).all()) << i;
  }
}

/// The angle between the momenta does not change when both alignments turn together, and hardly when one turns about
/// the momentum of the other; it does when drift or alignment turns one towards the other.
TEST(Observability, GainsByTheAngleWhatTurnsTheMomentaTowardsEachOther) {
  const Observability& observability = with_slews();
  ASSERT_EQ(observability.angle_gain.size(), 20);
  EXPECT_GT(observability.angle_gain.minCoeff(), 1);
  EXPECT_LT(observability.angle_gain.minCoeff(), 1.05);
  EXPECT_GT(observability.angle_gain.maxCoeff(), 1.5);
  EXPECT_GT(in_steady_flight().angle_gain.maxCoeff(), 1.5);
}

/// In steady flight an alignment error of all gyros about the orbit normal does no harm until the satellite rolls by r:
/// the attitude is then off by |(Rx(r)ᵀ − 1) n| of it, 2 (1 − cos r) squared. Pitch turns about n itself.
TEST(Observability, CountsTheErrorOfTheAttitudeWhileTheSatelliteSlews) {
  const Observability& observability = in_steady_flight();
  Eigen::VectorXd both = Eigen::VectorXd::Zero(20);
  both(8) = both(18) = 1;
  const double roll = Mission{}.max_roll_rad * std::numbers::inv_sqrt3;
  const double expected = 2 * (1 - std::cos(roll)) / 3;
  // The orbit plane turns by 0.1° between corrections, and the body jitters.
  EXPECT_NEAR(both.dot(observability.attitude_metric * both) / expected, 1, 0.01);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> metric(observability.attitude_metric);
  EXPECT_GT(metric.eigenvalues().minCoeff(), -1e-9 * metric.eigenvalues().maxCoeff());
}

TEST(Observability, NamesFurtherStates) {
  CalibrationOptions options = told();
  options.drift_model = kEsg20;
  options.further_states[FurtherState::kClockOffset] = options.further_states[FurtherState::kReadoutBias] =
      FurtherStateOptions::Choice::kOn;
  const Observability observability =
      observe(sim::simulate(scenario_in_eq1(4, std::chrono::minutes(30))).pass, options);
  EXPECT_EQ(observability.parameters.size(), 2 * 23 + 6 + 1U);
  EXPECT_EQ(observability.parameters.back(), parameter("clock_offset_s"));
  EXPECT_EQ(observability.parameters[46], parameter("gyro1_readout_bias_x_rad"));
  EXPECT_NEAR(observability.prior_sigma(52), 0.1, 1e-9);
  EXPECT_NEAR(observability.prior_sigma(46), 1e-4, 1e-9);
}

TEST(Observability, KnowsTheOrbitNormalByTheFixesOfEstimatorPaperAsWell) {
  CalibrationOptions options = told();
  options.estimator = Estimator::kPaper;
  const Pass pass = sim::simulate(steady(std::chrono::minutes(60))).pass;
  EXPECT_THAT(unobservable(observe(pass, options)), testing::Contains(testing::HasSubstr("the orbit normal")));
}

/// An attitude that stands still in space: each alignment can be turned about any axis.
TEST(Observability, OfAnInertialAttitudeLacksAllAlignments) {
  Scenario scenario = steady(std::chrono::minutes(60));
  scenario.attitude.reference = AttitudeScenario::Reference::kInertial;
  const auto texts = unobservable(observe(sim::simulate(scenario).pass, told()));
  EXPECT_GE(
      std::count_if(texts.begin(), texts.end(), [](const auto& text) { return text.find("alignment") != text.npos; }),
      4);
  EXPECT_THAT(texts, testing::Not(testing::Contains(testing::HasSubstr("turns about"))));
  EXPECT_THAT(texts, testing::Not(testing::Contains(testing::HasSubstr("orbit normal"))));
}

TEST(Observability, OfMoreThanTwoGyrosSaysNothingOfTheirAngle) {
  Scenario scenario = scenario_in_eq1(4, std::chrono::minutes(10));
  scenario.gyros.push_back(scenario.gyros[0]);
  scenario.gyros[2].start_direction_c = {0.1, 0.2, 1};
  const Observability observability = observe(sim::simulate(scenario).pass, told());
  EXPECT_EQ(observability.parameters.size(), 30U);
  EXPECT_EQ(observability.angle_gain.size(), 0);
}

TEST(Observability, RefusesAPassWithoutFixes) {
  Pass pass = two_hours().pass;
  pass.star_tracker.t.clear();
  pass.star_tracker.q_in_c.clear();
  EXPECT_THROW((void)observe(pass, told()), SetupError);
}

TEST(AngleRow, IsTheDerivativeOfZ1) {
  const Pass pass = sim::simulate(scenario_in_eq1(3, std::chrono::minutes(3))).pass;
  CalibrationOptions options = told();
  options.further_states[FurtherState::kWanderingDrift] = options.further_states[FurtherState::kReadoutBias] =
      FurtherStateOptions::Choice::kOn;
  const Screened screened = screen(pass, options);
  const PassProblem problem(screened.pass, pass_setup(pass.settings, options));
  const Layout& layout = problem.layout();
  const PassSolution solution = first_solution(problem, screened);
  const ScreenedSamples::Sample last = screened.pass.samples[screened.pass.samples.size() - 1];
  const auto row_at = [&](const PassSolution& at) {
    AngleRow row;
    problem.go_along(at, [&](const PassProblem::Moment& moment) {
      row = moment.t == last.t ? angle_row(problem, moment, last.h_b) : row;
    });
    return row;
  };
  const AngleRow row = row_at(solution);
  for (int state = 0; state < layout.size(); ++state) {
    const auto z1 = [&](double by) {
      PassSolution at = solution;
      SmootherResult found;
      found.x.assign(problem.arcs(), by * Eigen::VectorXd::Unit(layout.size(), state));
      problem.correct(found, at);
      return row_at(at).z1;
    };
    const double step = 1e-6;
    const double ahead = (z1(step) - row.z1) / step;
    const double behind = (row.z1 - z1(-step)) / step;
    // Terms of second order are of the size of the step, times the time that drift has acted.
    const double tolerance = 1e-3 * (1e-2 + std::abs(row.by_states(state)));
    EXPECT_NEAR(ahead, row.by_states(state), tolerance) << state;
    EXPECT_NEAR(behind, row.by_states(state), tolerance) << state;
  }
}

TEST(ParameterBlocks, SeparateWhatOneBlockHolds) {
  const ParameterBlocks blocks(parameters({"gyro1.k0", "gyro1.align_x", "gyro1.align_y", "gyro1.align_z", "gyro2.k0"}));
  Eigen::MatrixXd space = Eigen::MatrixXd::Zero(5, 2);
  space.col(0) << 0, 0, 1, 0, 1;
  space.col(1) << 0, 0, 1, 0, -1;
  const Eigen::MatrixXd separated = blocks.separated(space / std::numbers::sqrt2);
  EXPECT_NEAR(separated.row(2).norm(), 1, 1e-12);
  EXPECT_NEAR(separated.row(4).norm(), 1, 1e-12);
  EXPECT_NEAR(separated.row(2).cwiseAbs().maxCoeff(), 1, 1e-12);
  EXPECT_NEAR((separated.transpose() * separated - Eigen::Matrix2d::Identity()).norm(), 0, 1e-12);
}

TEST(ParameterBlocks, GiveTheDirectionOfWhatTheyName) {
  const ParameterBlocks blocks(
      parameters({"gyro1.k0", "gyro1.align_x", "gyro1.align_y", "gyro1.align_z", "clock_offset_s"}));
  Eigen::VectorXd direction(5);
  direction << 0.2, 0.6, 0, 0.8, 0.1;
  Eigen::VectorXd expected(5);
  expected << 0, 0.6, 0, 0.8, 0;
  EXPECT_LT((blocks.named(direction) - expected).norm(), 1e-12);
}

TEST(ParameterBlocks, SayWhichCombination) {
  const ParameterBlocks blocks(
      parameters({"gyro1.k0", "gyro1.mu12", "gyro1.align_x", "gyro1.align_y", "gyro1.align_z", "clock_offset_s"}));
  const Eigen::VectorXd sigma = Eigen::VectorXd::Ones(6);
  const auto words = [&](std::initializer_list<double> direction, const BodyRotation& rotation = {}) {
    return blocks.in_words(Eigen::Map<const Eigen::VectorXd>(direction.begin(), 6).normalized(), sigma, rotation);
  };
  const BodyRotation about_y{Eigen::Vector3d::UnitY(), false};
  EXPECT_EQ(words({1, 1, 0, 0, 0, 0}), "gyro 1 drift k0, mu12");
  EXPECT_EQ(words({0, 0, 0, 0, 1, 0}), "gyro 1 alignment about the boresight (c z), against its initial direction");
  EXPECT_EQ(words({0, 0, 0, 1, 0, 0}, about_y),
            "gyro 1 alignment about the axis that the body turns about, against its initial direction");
  EXPECT_EQ(words({1, 0, 1, 0, 0, 0}),
            "gyro 1 drift k0, with gyro 1 alignment about (+1.00, +0.00, +0.00) in c, against its initial direction");
  EXPECT_EQ(words({0, 0, 0, 0.1, 0, 1}), "clock_offset_s");
  EXPECT_EQ(words({0.3, 0.3, 0, 0, 0, 1}), "gyro 1 drift k0, mu12, with clock_offset_s");
}

}  // namespace
}  // namespace trihedron::ground
