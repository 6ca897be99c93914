#include "trihedron/core/invariant_estimator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "flight.hpp"

namespace trihedron {
namespace {

using test::FullGiven;
using test::PairGiven;

/// A pair of eq. (1) with every further state and two star trackers.
const Layout kWithAll{.further = kAllFurtherStates, .star_trackers = 2};

/// Rotation vector by which the estimated alignment is off, rad.
template <class A, class B>
Eigen::Vector3d alignment_error(const A& truth, const B& estimate) {
  return test::rotation_vector(truth.C_c_b * estimate.C_c_b.transpose());
}

TEST(InvariantEstimator, GainsNothingAboutTheAxisOfASteadyTurnInTenThousandSteps) {
  // An axis n fixed in the body and in space; everything else at random. Readings agree with the estimates, so that
  // the attitude in H is the true one.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  PairGiven given;
  for (int k = 0; k < 2; ++k) {
    given.prior[k].drift_rad_s << 1e-5, -2e-5, 1e-5, 3e-5, -1e-5, 2e-5, 1e-5;
    given.prior[k].C_c_b = test::turn(vector());
  }
  const auto made = given.estimator();
  auto& estimator = *made;
  const Layout layout;
  const Eigen::Vector3d n = vector().normalized();
  const Eigen::Matrix3d first = test::turn(vector());
  Eigen::Matrix3d C_in_c = first;
  const auto readings = [&] {
    FixReadings r;
    r.used = all_gyros(2);
    for (int k = 0; k < 2; ++k) {
      r.h_b[k] = estimator.gyros()[k].C_c_b.transpose() * C_in_c.transpose() * estimator.gyros()[k].h_in;
    }
    return r;
  };
  FixReadings start;
  start.used = all_gyros(2);
  start.h_b[0] = estimator.gyros()[0].C_c_b.transpose() * Eigen::Vector3d(0.8, 0.1, 0.6).normalized();
  start.h_b[1] = estimator.gyros()[1].C_c_b.transpose() * Eigen::Vector3d(-0.1, 0.9, 0.4).normalized();
  ASSERT_EQ(estimator.correct({Time{}, Eigen::Quaterniond(C_in_c)}, start).status, FixStatus::kStarted);

  // Of one gyro alone, φ = n and δ = C_c_in n change no measurement of it, whatever the other does.
  const auto information_about = [&](int gyro, const Eigen::Vector3d& axis) {
    Eigen::VectorXd v = Eigen::VectorXd::Zero(layout.size());
    v.segment<3>(layout.direction(gyro)) = axis;
    v.segment<3>(layout.alignment(gyro)) = first.transpose() * axis;
    return test::information_along(estimator, v);
  };
  const double before[2] = {information_about(0, n), information_about(1, n)};
  for (int step = 1; step <= 10'000; ++step) {
    C_in_c = test::turn(3 * uniform(random) * n) * C_in_c;
    const Time t(from_seconds(step));
    estimator.predict(C_in_c, readings().h_b, t, 0.1 + 0.1 * uniform(random));
    if (step % 5 == 0) {
      ASSERT_EQ(estimator.correct({t, Eigen::Quaterniond(C_in_c)}, readings()).status, FixStatus::kUsed);
    }
  }
  // The prior's information, to the rounding of 2000 fixes whose own is 1e9 times as large.
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(information_about(k, n) / before[k], 1, 1e-6) << k;
  }
  // About another axis there is plenty.
  EXPECT_GT(information_about(0, n.unitOrthogonal()), 1e6 * before[0]);
}

/// An estimator that has been started with momenta that are well apart, and readings that agree with it.
struct StartedPair {
  std::unique_ptr<test::PairEstimator> estimator;
  Eigen::Matrix3d C_in_c = test::turn(0.3, -0.2, 0.9);
  FixReadings readings;

  explicit StartedPair(const PairGiven& given) : estimator(given.estimator()) {
    readings.used = all_gyros(2);
    readings.h_b[0] = Eigen::Vector3d(0.8, 0.1, 0.6).normalized();
    readings.h_b[1] = Eigen::Vector3d(-0.1, 0.9, 0.4).normalized();
    EXPECT_EQ(estimator->correct(fix(0), readings).status, FixStatus::kStarted);
  }
  [[nodiscard]] StarFix fix(int t_s, const Eigen::Vector3d& turned_rad = Eigen::Vector3d::Zero()) const {
    return {Time(std::chrono::seconds(t_s)), Eigen::Quaterniond(C_in_c * test::turn(turned_rad))};
  }
};

TEST(InvariantEstimator, KnowsTheSecondOrderOfItsErrors) {
  // Alignments unknown by a radian and drift unknown: what the linear model of prediction and reading leaves out is as
  // large as what it has. With covariances σ² 1 and B: |a × b|²/8 is σ² tr B / 4; that of the prediction counts
  // 1.4² times. B is across the momentum: what drift there is along it moves nothing.
  PairGiven given;
  given.set_alignment_sigma(1);
  StartedPair s(given);
  auto& estimator = *s.estimator;
  for (int i = 1; i <= 600; ++i) {
    estimator.predict(s.C_in_c, s.readings.h_b, Time(std::chrono::seconds(i)), 1);
  }
  double expected[2];
  for (int k = 0; k < 2; ++k) {
    const Eigen::Matrix<double, 3, 7> by_drift = estimator.since_fix()[k].by_drift.first(7);
    const Eigen::Vector3d h = estimator.gyros()[k].h_in;
    const Eigen::Matrix<double, 3, 7> across = by_drift - h * (h.transpose() * by_drift);
    const Eigen::Matrix3d B = given.covariance(0, 0) * across * across.transpose();
    const double of_prediction = 1.4 * 1.4 * B.trace() / 4;
    const double of_reading = (B.trace() + 3 * of_prediction) / 4;
    // The noise of the two fixes is a hundredth of it.
    expected[k] = B.trace() + 2 * of_prediction + 2 * of_reading;
  }
  const auto covariance = estimator.correct(s.fix(600), s.readings).innovation_covariance;
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR((covariance.block<2, 2>(2L * k, 2L * k).trace()) / expected[k], 1, 0.03) << k;
  }
}

/// Covariances of the innovations of all fixes of a flight, by the estimator alone. `rate_c`: of the body at each fix,
/// where it is not that of the flight. `at_each_fix`: terms of second order are worked out for each, as they are after
/// a step that was too long, however little it may have missed.
std::vector<Eigen::MatrixXd> innovation_covariances(const test::Flight& flight, const PairGiven& given,
                                                    const std::optional<Eigen::Vector3d>& rate_c, bool at_each_fix) {
  const auto estimator = given.estimator();
  std::vector<Eigen::MatrixXd> found;
  FixReadings readings;
  readings.used = all_gyros(2);
  auto fix = flight.fixes.begin();
  for (std::size_t i = 0; i < flight.samples.size(); ++i) {
    const GyroSample& sample = flight.samples[i];
    const Eigen::Matrix3d& C_in_c = flight.C_in_c_at_samples[i];
    if (estimator->started()) {
      estimator->predict(C_in_c, sample.h_b, sample.t, 0.125);
      readings.rate_c =
          rate_c.value_or(test::rotation_vector(flight.C_in_c_at_samples[i - 1].transpose() * C_in_c) / 0.125);
    }
    readings.h_b = sample.h_b;
    for (; fix != flight.fixes.end() && fix->t <= sample.t; ++fix) {
      if (at_each_fix) {
        estimator->add_direction_variance(0);
      }
      const FixReport report = estimator->correct(*fix, readings);
      if (report.status != FixStatus::kStarted) {
        found.emplace_back(report.innovation_covariance);
      }
    }
  }
  return found;
}

/// The largest difference between these and those where terms of second order are held, relative to them.
double lost_by_holding(const test::Flight& flight, const PairGiven& given,
                       const std::optional<Eigen::Vector3d>& rate_c = std::nullopt) {
  const std::vector<Eigen::MatrixXd> held = innovation_covariances(flight, given, rate_c, false);
  const std::vector<Eigen::MatrixXd> worked_out = innovation_covariances(flight, given, rate_c, true);
  double most = 0;
  for (std::size_t i = 0; i < held.size(); ++i) {
    most = std::max(most, (held[i] - worked_out[i]).norm() / worked_out[i].norm());
  }
  return most;
}

TEST(InvariantEstimator, LosesNothingByTermsOfSecondOrderThatHoldForAWhile) {
  constexpr double kLittle = 0.01;
  PairGiven given;
  given.set_alignment_sigma(0.0873);
  const double lost = lost_by_holding(test::Flight({.duration_s = 1800, .misalignment = 10}), given);
  EXPECT_LT(lost, kLittle);
  EXPECT_GT(lost, 0);  // they are held

  // Two star trackers with one stamp, in steady flight.
  given.set_alignment_sigma(0.017);
  given.setup.star_trackers[0].noise_rad.setConstant(1e-5);
  given.setup.readout_noise_rad[0] = given.setup.readout_noise_rad[1] = 4e-5;
  PairGiven of_two = given;
  of_two.covariance.topLeftCorner<7, 7>() *= 25;
  test::Flight two({.duration_s = 600, .slews_rad = 0, .misalignment = 2, .noise = 0.1});
  std::vector<StarFix> twice;
  for (const StarFix& fix : two.fixes) {
    twice.insert(twice.end(), 2, fix);
  }
  two.fixes = twice;
  EXPECT_LT(lost_by_holding(two, of_two), kLittle);

  // Alignments that stay unknown in steady flight, until the body turns far: with fixes, without them, and without them
  // and so that it turns again as before when the next one comes. Terms that were last worked out at different times.
  const Eigen::Vector3d steady_rate_c(0, 1.1e-3, 0);
  for (const int begin_s : {900, 906, 912, 918, 924}) {
    const test::FlightPlan plan{
        .duration_s = 1000, .slews_rad = 2, .steady_until_s = 1.0 * begin_s, .misalignment = 2, .noise = 0.1};
    const auto is_between = [&](double from_s, double to_s) {
      return [=](const StarFix& fix) {
        return fix.t > Time(from_seconds(begin_s + from_s)) && fix.t < Time(from_seconds(begin_s + to_s));
      };
    };
    const test::Flight with_fixes(plan);
    EXPECT_LT(lost_by_holding(with_fixes, given), kLittle) << begin_s;
    test::Flight without = with_fixes;
    std::erase_if(without.fixes, is_between(0, 20));
    EXPECT_LT(lost_by_holding(without, given), kLittle) << begin_s;
    EXPECT_LT(lost_by_holding(without, given, steady_rate_c), kLittle) << begin_s;
    test::Flight with_outliers = with_fixes;  // fixes that are not used
    for (StarFix& fix : with_outliers.fixes) {
      if (is_between(0, 20)(fix)) {
        fix.q_in_c = fix.q_in_c * Eigen::Quaterniond(test::turn(0.3, 0, 0));
      }
    }
    EXPECT_LT(lost_by_holding(with_outliers, given, steady_rate_c), kLittle) << begin_s;
  }
}

TEST(InvariantEstimator, LinearisesAtTheAttitudeByGyrosAndFixTogether) {
  StartedPair s(PairGiven{});
  auto& estimator = *s.estimator;
  const StarFix fix = s.fix(3, Eigen::Vector3d(3e-5, -2e-5, 1e-4));
  test::PairEstimator::Correction correction;
  FixReport report;
  while (correction.stage != test::PairEstimator::Correction::Stage::kNoise) {
    ASSERT_FALSE(correction.done());
    estimator.carry_on(correction, fix, s.readings, report);
  }
  const CalibrationSetup& setup = estimator.setup();
  const auto by_gyros = estimator.attitude(estimator.gyros(), s.readings.h_b, s.readings.used).value();
  const auto by_errors = attitude_by_states_now<test::PairEstimator::kMaxStates>(estimator.layout(), by_gyros,
                                                                                 estimator.gyros(), s.readings.h_b);
  const Eigen::Matrix3d P =
      with_covariance(by_gyros, estimator.covariance_of_errors(by_errors), setup.readout_noise_rad, 2, 0)
          .covariance_rad2;
  const Eigen::Matrix3d R = setup.star_trackers[0].noise_rad.cwiseAbs2().asDiagonal();
  const Eigen::Matrix3d C_by_gyros = by_gyros.C_in_c.raw();
  const Eigen::Vector3d off = test::rotation_vector(C_by_gyros.transpose() * fix.q_in_c.toRotationMatrix());
  const Eigen::Matrix3d expected = C_by_gyros * test::turn(P * (P + R).inverse() * off);
  EXPECT_LT(test::rotation_vector(expected.transpose() * correction.C_linear).norm(), 1e-6 * off.norm());
}

struct MeanOutcome {
  double nees = 0;
  double nis = 0;
  double rejected = 0;
};

/// Means over flights whose priors are drawn about the truth.
MeanOutcome fly_many(int runs, double alignment_sigma_rad, const test::FlightPlan& plan) {
  MeanOutcome mean;
  double fixes = 0;
  for (int run = 1; run <= runs; ++run) {
    test::FlightPlan own = plan;
    own.seed = static_cast<unsigned>(run);
    const test::Flight flight(own);
    PairGiven given;
    given.set_alignment_sigma(alignment_sigma_rad);
    test::draw_means(flight.truth, own.seed, alignment_sigma_rad, given.prior);
    const auto on_board = given.on_board();
    test::fly(flight, *on_board, [&](const StepReport& report) {
      if (report.fix.status == FixStatus::kUsed) {
        mean.nis += report.fix.nis;
        ++fixes;
      }
      mean.rejected += report.fix.status == FixStatus::kRejectedByGate ? 1 : 0;
    });
    mean.nees += test::parameter_nees(flight.truth, on_board->estimator()) / runs;
  }
  mean.nis /= fixes;
  return mean;
}

// 99.9 % of the mean NEES of a consistent filter over n runs lie in 20 ± 3.29·√(40/n).
double nees_band(int runs) { return 3.29 * std::sqrt(40.0 / runs); }

TEST(InvariantEstimator, IsConsistentWithSlewsAndHalfADegree) {
  const MeanOutcome mean = fly_many(20, 8e-3, {.duration_s = 1800});
  EXPECT_NEAR(mean.nees, 20, nees_band(20));
  EXPECT_NEAR(mean.nis, 4, 0.06);  // 3.29·√(8/12000) = 0.085 for independent ones
}

TEST(InvariantEstimator, IsConsistentFromTwoDegrees) {
  const MeanOutcome mean = fly_many(40, 0.035, {.duration_s = 1800});
  EXPECT_NEAR(mean.nees, 20, nees_band(40));
}

// At five degrees what is of the third order shows: the band is about what flights have, not about 20.
TEST(InvariantEstimator, IsNearlyConsistentFromFiveDegrees) {
  const MeanOutcome mean = fly_many(20, 0.087, {.duration_s = 1800});
  EXPECT_NEAR(mean.nees, 22.5, nees_band(20));
}

TEST(InvariantEstimator, IsConsistentInSteadyFlight) {
  const MeanOutcome mean = fly_many(20, 8e-3, {.duration_s = 1800, .slews_rad = 0});
  EXPECT_NEAR(mean.nees, 20, nees_band(20));
  EXPECT_NEAR(mean.nis, 4, 0.085);
}

// As in geostationary orbit: alignments and momenta move together by as much as they are wrong, for hours.
TEST(InvariantEstimator, IsConsistentWhereTheBodyTurnsByDegreesAnHour) {
  const MeanOutcome mean = fly_many(20, 8e-3, {.duration_s = 7200, .slews_rad = 0, .turn_rad_s = 7.3e-5});
  EXPECT_NEAR(mean.nees, 20, nees_band(20));
  EXPECT_NEAR(mean.nis, 4, 0.1);  // what grows evenly counts as more noise than it is
}

TEST(InvariantEstimator, DoesNotDependOnTheInertialFrame) {
  const test::Flight flight({.duration_s = 900});
  test::Flight turned = flight;
  const Eigen::Quaterniond q(Eigen::AngleAxisd(2, Eigen::Vector3d(1, 2, 3).normalized()));
  for (StarFix& fix : turned.fixes) {
    fix.q_in_c = q * fix.q_in_c;
  }
  const auto a = test::flown(flight, PairGiven());
  const auto b = test::flown(turned, PairGiven());
  for (int k = 0; k < 2; ++k) {
    EXPECT_LT(alignment_error(a->estimator().gyros()[k], b->estimator().gyros()[k]).norm(), 1e-11);
    EXPECT_LT((a->estimator().gyros()[k].drift_rad_s - b->estimator().gyros()[k].drift_rad_s).norm(), 1e-14);
  }
}

TEST(InvariantEstimator, DoesNotDependOnTheNumbersOfTheGyros) {
  const test::Flight flight({.duration_s = 900});
  test::Flight swapped = flight;
  for (auto& sample : swapped.samples) {
    std::swap(sample.h_b[0], sample.h_b[1]);
  }
  const auto a = test::flown(flight, PairGiven());
  const auto b = test::flown(swapped, PairGiven());
  for (int k = 0; k < 2; ++k) {
    EXPECT_LT(alignment_error(a->estimator().gyros()[k], b->estimator().gyros()[1 - k]).norm(), 1e-11);
    EXPECT_LT((a->estimator().gyros()[k].drift_rad_s - b->estimator().gyros()[1 - k].drift_rad_s).norm(), 1e-14);
  }
}

TEST(InvariantEstimator, AStepInTwoHalvesIsTheStep) {
  const test::Flight flight({.duration_s = 60});
  const auto made = PairGiven().estimator();
  auto& whole = *made;
  FixReadings readings;
  readings.used = all_gyros(2);
  readings.h_b = flight.samples[0].h_b;
  ASSERT_EQ(whole.correct(flight.fixes[0], readings).status, FixStatus::kStarted);
  auto halves = whole;
  for (std::size_t i = 1; i <= 24; ++i) {
    const Eigen::Matrix3d& C_in_c = flight.C_in_c_at_samples[i];
    const GyroSample& sample = flight.samples[i];
    whole.predict(C_in_c, sample.h_b, sample.t, 0.125);
    halves.predict(C_in_c, sample.h_b, sample.t - from_seconds(0.0625), 0.0625);
    halves.predict(C_in_c, sample.h_b, sample.t, 0.0625);
  }
  readings.h_b = flight.samples[24].h_b;
  EXPECT_EQ(whole.correct(flight.fixes[1], readings).status, FixStatus::kUsed);
  EXPECT_EQ(halves.correct(flight.fixes[1], readings).status, FixStatus::kUsed);
  for (int k = 0; k < 2; ++k) {
    EXPECT_LT(alignment_error(whole.gyros()[k], halves.gyros()[k]).norm(), 1e-15);
    EXPECT_LT((whole.gyros()[k].h_in - halves.gyros()[k].h_in).norm(), 1e-15);
  }
}

TEST(InvariantEstimator, FindsOffsetAndRateOfTheClockAndTheErrorAtOrbitalPeriod) {
  test::Flight flight({.duration_s = 5400});
  const Eigen::Vector3d sine(3e-5, -2e-5, 4e-5);
  const Eigen::Vector3d cosine(-1e-5, 5e-5, 2e-5);
  constexpr double kRate = 1.1e-3;
  constexpr double kOffset_s = 0.02;
  constexpr double kClockRate = 1e-5;
  for (StarFix& fix : flight.fixes) {
    const double t_s = to_seconds(fix.t.time_since_epoch());
    const auto at = [&](double time_s) { return Eigen::Quaterniond(test::Flight::attitude(time_s, 0.5)); };
    const Eigen::Vector3d e = sine * std::sin(kRate * t_s) + cosine * std::cos(kRate * t_s);
    const Eigen::Quaterniond noise = at(t_s).conjugate() * fix.q_in_c;
    fix.q_in_c = at(t_s + kOffset_s + kClockRate * t_s) * Eigen::Quaterniond(test::turn(e)) * noise;
  }
  FullGiven given(kWithAll);
  given.setup.orbital_rate_rad_s = kRate;
  const auto on_board = test::flown(flight, given);
  const auto& shared = on_board->estimator().shared();
  const Eigen::MatrixXd root = test::state_root(on_board->estimator());
  Eigen::Matrix<double, 8, 1> truth;
  truth << kOffset_s, kClockRate, sine, cosine;
  for (int i = 0; i < 8; ++i) {
    const double sigma = root.row(kWithAll.shared() + i).norm();
    EXPECT_LT(std::abs(shared(i) - truth(i)), 4 * sigma) << i;
  }
  EXPECT_LT(root.row(kWithAll.clock_offset()).norm(), 1e-3);
  EXPECT_LT(root.row(kWithAll.clock_rate()).norm(), 1e-6);
  EXPECT_LT(root.row(kWithAll.orbital_error()).norm(), 5 * test::kArcsecond);
}

TEST(GyroModel, TakesTheBiasOutOfAReading) {
  GyroModel<Esg7::kSize> gyro;
  gyro.readout_bias = Eigen::Vector3d(3e-5, -5e-5, 8e-5);
  const Eigen::Vector3d h = Eigen::Vector3d(0.3, -0.6, 0.7).normalized();
  const Eigen::Vector3d reading = (h + gyro.readout_bias).normalized();
  EXPECT_LT((gyro.corrected(reading) - h).norm(), 1e-8);
  EXPECT_EQ(GyroModel<Esg7::kSize>().corrected(reading), reading);
  gyro.C_c_b = test::turn(0.1, -0.2, 0.3);
  EXPECT_LT((gyro.in_c(gyro.reading_of(h).normalized()) - h).norm(), 1e-8);
}

/// Readouts with these biases.
void bias(test::Flight& flight, const std::array<Eigen::Vector3d, 2>& biases) {
  for (auto& sample : flight.samples) {
    for (int k = 0; k < 2; ++k) {
      sample.h_b[k] = (sample.h_b[k] + biases[static_cast<std::size_t>(k)]).normalized();
    }
  }
}

TEST(InvariantEstimator, FindsTheBiasOfTheDirectionCosines) {
  test::Flight flight({.duration_s = 3600});
  const std::array<Eigen::Vector3d, 2> truth = {Eigen::Vector3d(5e-5, -7e-5, 9e-5), Eigen::Vector3d(-6e-5, 4e-5, 8e-5)};
  bias(flight, truth);
  const Layout layout{.further = {.readout_bias = true}};
  const auto on_board = test::flown(flight, FullGiven(layout));
  Eigen::VectorXd error(6);
  for (int k = 0; k < 2; ++k) {
    error.segment<3>(3 * k) = on_board->estimator().gyros()[k].readout_bias - truth[static_cast<std::size_t>(k)];
  }
  const Eigen::MatrixXd of_bias = test::error_root(on_board->estimator()).middleRows(layout.readout_bias(0), 6);
  const Eigen::MatrixXd covariance = of_bias * of_bias.transpose();
  EXPECT_LT(test::normalised_square(error, covariance), 28);      // χ² of 6, once in 10 000
  EXPECT_LT(covariance.diagonal().cwiseSqrt().minCoeff(), 1e-6);  // of 1e-4 before
  const auto solution = on_board->navigation_attitude().value();
  const Eigen::Vector3d attitude_error = test::attitude_error(flight.C_in_c_at_samples.back(), solution);
  EXPECT_LT(attitude_error.norm(), 4 * std::sqrt(solution.covariance_rad2.trace()));
}

TEST(OnBoardOfInvariant, NavigatorKnowsTheAttitudeAtACorrectionAsTheEstimatorDoes) {
  const test::Flight flight({.duration_s = 300});
  const auto on_board = test::flown(flight, FullGiven(kWithAll), {.interval = CorrectionPolicy::kEveryFix});
  const auto& estimator = on_board->estimator();
  const Directions& h_b = flight.samples.back().h_b;
  const auto by_gyros = estimator.attitude(estimator.gyros(), h_b, all_gyros(2)).value();
  auto by_errors = attitude_by_states_now<test::FullEstimator::kMaxErrors>(kWithAll, by_gyros, estimator.gyros(), h_b);
  carry_back(kWithAll, estimator.since_fix(), by_errors);
  const Eigen::Matrix3d expected =
      with_covariance(by_gyros, estimator.covariance_of_errors(by_errors), estimator.setup().readout_noise_rad, 2, 0)
          .covariance_rad2;
  const Eigen::Matrix3d found = on_board->navigation_attitude().value().covariance_rad2;
  // But for the noise of the readings, of which the navigator takes several together.
  EXPECT_LT((found - expected).norm(), 0.02 * expected.norm());
}

TEST(InvariantEstimator, SeesThroughItsUncertaintyWhatTheWholeRootSays) {
  const test::Flight flight({.duration_s = 300});
  const auto on_board = test::flown(flight, FullGiven(kWithAll));
  const auto& estimator = on_board->estimator();
  // Of the errors that move an attitude; the root has their rows only.
  test::FullEstimator::Rows3 by_errors = test::FullEstimator::Rows3::Zero(3, kWithAll.size());
  by_errors.leftCols(kWithAll.shared()) = Eigen::MatrixXd::Random(3, kWithAll.shared());
  const Eigen::MatrixXd by_root = by_errors.leftCols(kWithAll.shared()) * test::error_root(estimator);
  const Eigen::Matrix3d expected = by_root * by_root.transpose();
  EXPECT_LT((estimator.covariance_of_errors(by_errors) - expected).norm(), 1e-12 * expected.norm());
}

TEST(InvariantEstimator, FindsTheAlignmentOfAFurtherStarTracker) {
  const test::Flight flight({.duration_s = 1800});
  const Layout layout{.further = {.readout_bias = true}, .star_trackers = 2};
  FullGiven given(layout);
  StarTrackerSetup& second = given.setup.star_trackers[1];
  second.C_c_s = test::turn(1.2, 0, 0);
  second.alignment_sigma_rad = 3e-4;
  const Eigen::Vector3d misalignment(2e-4, -3e-4, 1e-4);
  const auto on_board = given.on_board();
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  long used = 0;
  const auto note = [&](const StepReport& report) { used += report.fix.status == FixStatus::kUsed ? 1 : 0; };
  // Both look at the same time; C_in_c of the second is by its mounting as designed.
  std::vector<StarFix> fixes;
  for (const StarFix& fix : flight.fixes) {
    const Eigen::Vector3d noise_s = second.noise_rad.cwiseProduct(test::white(random, normal));
    const Eigen::Matrix3d C_in_c = test::Flight::attitude(to_seconds(fix.t.time_since_epoch()), 0.5);
    const Eigen::Vector3d error = misalignment + second.C_c_s * noise_s;
    fixes.push_back(fix);
    fixes.push_back({fix.t, Eigen::Quaterniond(C_in_c * test::turn(error)), 1});
  }
  test::fly(flight.samples, fixes, *on_board, note);
  test::flush(*on_board, note);
  EXPECT_EQ(used, 2 * static_cast<long>(flight.fixes.size()) - 1);
  const Eigen::MatrixXd root = test::state_root(on_board->estimator());
  for (int axis = 0; axis < 3; ++axis) {
    const int state = layout.star_tracker(1) + axis;
    const double sigma = root.row(state).norm();
    const double found = on_board->estimator().shared()(state - layout.shared());
    EXPECT_LT(std::abs(found - misalignment(axis)), 4 * sigma);
    EXPECT_LT(sigma, 2 * test::kArcsecond);
  }
}

TEST(InvariantEstimator, OfThreeGyrosIsBetterThanOfTwo) {
  const test::Flight pair({.duration_s = 1800});
  const auto on_board = FullGiven({.gyros = 3}).on_board();
  // The third is a rotor without drift in a case without misalignment, with noise of its own.
  const Eigen::Vector3d h_in = Eigen::Vector3d(0.1, -0.8, 0.6).normalized();
  test::fly(test::with_third_gyro(pair, h_in, 9), pair.fixes, *on_board);
  const auto& truth = pair.C_in_c_at_samples.back();
  const auto three = on_board->navigation_attitude().value();
  EXPECT_LT(test::attitude_error(truth, three).norm(), 4 * std::sqrt(three.covariance_rad2.trace()));
  EXPECT_LT(test::rotation_vector(on_board->estimator().gyros()[2].C_c_b).norm(), 1e-4);
  const auto of_two = test::flown(pair, PairGiven())->navigation_attitude().value();
  EXPECT_LT(three.covariance_rad2.trace(), of_two.covariance_rad2.trace());
}

TEST(InvariantEstimator, RejectsOutliersReopensAndBeginsAnew) {
  test::Flight flight({.duration_s = 1200});
  const auto jump = [&](std::size_t from, std::size_t to, double angle) {
    for (std::size_t i = from; i < to; ++i) {
      flight.fixes[i].q_in_c =
          flight.fixes[i].q_in_c * Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()));
    }
  };
  jump(50, 51, 0.01);     // one outlier
  jump(100, 400, 0.001);  // the tracker turns for good, and again soon
  jump(150, 400, 0.001);
  const auto on_board = PairGiven().on_board();
  std::vector<FixStatus> statuses;
  test::fly(flight, *on_board, [&](const StepReport& report) {
    if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
      statuses.push_back(report.fix.status);
    }
  });
  EXPECT_EQ(statuses[50], FixStatus::kRejectedByGate);
  EXPECT_EQ(statuses[51], FixStatus::kUsed);
  EXPECT_EQ(std::count(statuses.begin(), statuses.end(), FixStatus::kUsedAfterReopening), 1);
  EXPECT_GE(std::count(statuses.begin(), statuses.end(), FixStatus::kRestarted), 1);
  EXPECT_EQ(statuses.back(), FixStatus::kUsed);
}

TEST(InvariantEstimator, BeginsAnewFromThePriorWhereThatExcludesTheEstimates) {
  // The star tracker turns twice within minutes. By then the drift has been found, at several or many of its sigmas.
  for (const double sigma_rad_s : {2e-6, 1e-7}) {
    test::Flight flight({.duration_s = 1200});
    for (std::size_t i = 300; i < flight.fixes.size(); ++i) {
      flight.fixes[i].q_in_c = flight.fixes[i].q_in_c * Eigen::Quaterniond(test::turn(i < 350 ? 0.001 : 0.002, 0, 0));
    }
    PairGiven given;
    for (int k = 0; k < 2; ++k) {
      given.covariance.diagonal().segment<7>(10L * k).setConstant(sigma_rad_s * sigma_rad_s);
    }
    const auto on_board = given.on_board();
    int restarts = 0;
    test::fly(flight, *on_board, [&](const StepReport& report) {
      if (report.fix.status == FixStatus::kRestarted && ++restarts == 1) {
        EXPECT_EQ(on_board->estimator().gyros()[0].drift_rad_s == given.prior[0].drift_rad_s, sigma_rad_s < 1e-6);
      }
    });
    EXPECT_GE(restarts, 1);
  }
}

TEST(InvariantEstimator, RefusesParallelMomenta) {
  const auto made = PairGiven().estimator();
  auto& estimator = *made;
  FixReadings readings;
  readings.used = all_gyros(2);
  readings.h_b[0] = readings.h_b[1] = Eigen::Vector3d::UnitX();
  EXPECT_EQ(estimator.correct({}, readings).status, FixStatus::kRejectedGeometry);
  EXPECT_FALSE(estimator.started());
  readings.h_b[1] = Eigen::Vector3d::UnitY();
  EXPECT_EQ(estimator.correct({}, readings).status, FixStatus::kStarted);
  readings.h_b[1] = readings.h_b[0];
  EXPECT_EQ(estimator.correct({Time(std::chrono::seconds(3)), Eigen::Quaterniond::Identity()}, readings).status,
            FixStatus::kRejectedGeometry);
}

TEST(OnBoardOfInvariant, AttitudeNowIsBetterThanASingleReadingAndHonest) {
  // Corrected at each fix; the samples of the last seconds are taken together.
  double square = 0;
  double normalised = 0;
  constexpr int kRuns = 12;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const test::Flight flight({.duration_s = 3600, .seed = seed});
    const auto on_board = test::flown(flight, PairGiven(), {.interval = CorrectionPolicy::kEveryFix});
    const auto solution = on_board->navigation_attitude().value();
    const Eigen::Vector3d error = test::attitude_error(flight.C_in_c_at_samples.back(), solution);
    square += error.squaredNorm() / (3 * kRuns);
    normalised += test::normalised_square(error, solution.covariance_rad2) / kRuns;
  }
  EXPECT_LT(std::sqrt(square), 1.8 * test::kArcsecond);  // a single reading: 2″ and what is not yet calibrated
  EXPECT_NEAR(normalised, 3, 3.29 * std::sqrt(6.0 / kRuns));
}

TEST(OnBoardOfInvariant, TakesFixesLateAndOutOfTurnOnce) {
  const test::Flight flight({.duration_s = 60});
  const auto on_board = PairGiven().on_board();
  std::vector<std::pair<Time, FixStatus>> dealt;
  const auto note = [&](const StepReport& report) {
    if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
      dealt.emplace_back(report.fix.t, report.fix.status);
    }
  };
  for (std::size_t i = 0; i < flight.samples.size(); ++i) {
    note(on_board->on_gyro(flight.samples[i]));
    if (i == 8) {  // a second late
      EXPECT_EQ(on_board->on_fix(flight.fixes[0]).fix.status, FixStatus::kPending);
      EXPECT_EQ(on_board->on_fix(flight.fixes[0]).fix.status, FixStatus::kRejectedOutOfOrder);  // repeated
    }
    if (i == 30) {  // the one of 3 s while the one of 0 s is long dealt with
      EXPECT_EQ(on_board->on_fix(flight.fixes[1]).fix.status, FixStatus::kPending);
    }
    if (i == 60) {  // too late: the calibration has passed its time
      EXPECT_EQ(on_board->on_fix(flight.fixes[1]).fix.status, FixStatus::kRejectedOutOfOrder);
    }
  }
  ASSERT_EQ(dealt.size(), 2U);
  EXPECT_EQ(dealt[0], std::pair(flight.fixes[0].t, FixStatus::kStarted));
  EXPECT_EQ(dealt[1], std::pair(flight.fixes[1].t, FixStatus::kUsed));
}

TEST(OnBoardOfInvariant, RefusesFixesOfUnknownStarTrackersAndMoreThanCanWait) {
  const test::Flight flight({.duration_s = 60});
  const auto on_board = PairGiven().on_board();
  on_board->on_gyro(flight.samples[0]);
  StarFix fix = flight.fixes[0];
  for (const int head : {1, kMaxStarTrackers, -1}) {
    fix.head = head;
    EXPECT_EQ(on_board->on_fix(fix).fix.status, FixStatus::kRejectedUnknownHead);
  }
  fix.head = 0;
  for (int i = 0; i < FixQueue<1>::kCapacity; ++i) {
    fix.t += std::chrono::milliseconds(1);
    EXPECT_EQ(on_board->on_fix(fix).fix.status, FixStatus::kPending);
  }
  fix.t += std::chrono::milliseconds(1);
  EXPECT_EQ(on_board->on_fix(fix).fix.status, FixStatus::kRejectedBacklog);
  // At the end without a sample after them they cannot be interpolated; none is forgotten.
  for (int i = 0; i < FixQueue<1>::kCapacity; ++i) {
    EXPECT_EQ(on_board->flush().fix.status, FixStatus::kRejectedNoGyro);
  }
  EXPECT_EQ(on_board->flush().fix.status, FixStatus::kNone);
}

TEST(OnBoardOfInvariant, TakesSingleReadingsWhereTheBodyIsNoPolynomial) {
  // The body jerks to and fro by 20″ at 4 Hz: a fit over seconds would miss it by as much.
  test::Flight flight({.duration_s = 300, .noise = 0.5});
  const auto jerked = [](Eigen::Matrix3d& C_in_c, double t_s) {
    C_in_c = C_in_c * test::turn(0, 1e-4 * std::cos(8 * std::numbers::pi * t_s + 0.3), 0);
  };
  for (std::size_t i = 0; i < flight.samples.size(); ++i) {
    const double t_s = 0.125 * static_cast<double>(i);
    const Eigen::Matrix3d smooth = flight.C_in_c_at_samples[i];
    jerked(flight.C_in_c_at_samples[i], t_s);
    const Eigen::Matrix3d turn = flight.C_in_c_at_samples[i].transpose() * smooth;
    for (int k = 0; k < 2; ++k) {
      flight.samples[i].h_b[k] =
          flight.truth[k].C_c_b.transpose() * turn * flight.truth[k].C_c_b * flight.samples[i].h_b[k];
    }
  }
  for (StarFix& fix : flight.fixes) {
    Eigen::Matrix3d C_in_c = fix.q_in_c.toRotationMatrix();
    jerked(C_in_c, to_seconds(fix.t.time_since_epoch()));
    fix.q_in_c = Eigen::Quaterniond(C_in_c);
  }
  const auto on_board = PairGiven().on_board();
  double worst = 0;
  test::fly(flight, *on_board, [&](const StepReport& report) {
    if (report.calibrated && report.fix.t > Time(std::chrono::seconds(100))) {
      const auto i = static_cast<std::size_t>(to_seconds(report.fix.t.time_since_epoch()) * 8 + 0.5);
      worst = std::max(worst, test::attitude_error(flight.C_in_c_at_samples[i], *report.calibrated).norm());
    }
  });
  EXPECT_GT(worst, 0);
  EXPECT_LT(worst, 10 * test::kArcsecond);
}

TEST(OnBoardOfInvariant, KnowsWhatTheBiasThatItHoldsMayDo) {
  // Held: no bias. Nothing else is wrong, so that the error of the attitude is that of the bias, in 20 of its sigmas.
  double sum = 0;
  constexpr int kRuns = 60;
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (int run = 1; run <= kRuns; ++run) {
    test::Flight flight({.duration_s = 60, .seed = static_cast<unsigned>(run)});
    FullGiven given({.further = {.readout_bias = true}});
    given.setup.further_sigma[FurtherState::kReadoutBias] = 2e-4;
    std::array<Eigen::Vector3d, 2> biases;
    for (auto& b : biases) {
      b = given.setup.further_sigma[FurtherState::kReadoutBias] *
          Eigen::Vector3d::NullaryExpr([&] { return normal(random); });
    }
    bias(flight, biases);
    given.know(flight.truth);
    given.covariance *= 1e-8;
    const auto solution = test::flown(flight, given, {.take_parameters = false})->navigation_attitude().value();
    const Eigen::Vector3d error = test::attitude_error(flight.C_in_c_at_samples.back(), solution);
    sum += test::normalised_square(error, solution.covariance_rad2);
  }
  EXPECT_NEAR(sum / kRuns, 3, 1);  // 3 ± 0.32
}

TEST(OnBoardOfInvariant, KnowsHowDriftThatWandersGoesOn) {
  test::Flight flight({.duration_s = 300});
  FullGiven given(kWithAll);
  given.know(flight.truth);
  given.covariance *= 1e-8;
  given.setup.wandering_drift = {1e-5, 100};
  // By the first fix alone nothing is known of it: the variance of ∫w dt is 2 σ² τ² (x − 1 + exp(−x)), x = t/τ.
  const auto by_first = test::flown(flight, given, {.interval = CorrectionPolicy::kOnlyFirst});
  const auto& gyros = by_first->navigator().gyros();
  const auto by_directions =
      by_first->estimator().attitude(gyros, flight.samples.back().h_b, all_gyros(2)).value().by_directions;
  const double variance = 2 * 1e-6 * (2 + std::exp(-3));
  EXPECT_NEAR(
      by_first->navigation_attitude().value().covariance_rad2.trace() / (by_directions.squaredNorm() * variance), 1,
      0.1);
  // What was found of it fades.
  flight.fixes.resize(50);
  const auto on_board = given.on_board({.interval = CorrectionPolicy::kEveryFix});
  std::map<double, double> size;
  test::fly(flight, *on_board, [&](const StepReport& report) {
    if (on_board->navigator().started()) {
      size[to_seconds(report.t.time_since_epoch())] =
          on_board->navigator().gyros()[0].drift_rad_s.segment<3>(kWithAll.wandering_column()).norm();
    }
  });
  EXPECT_GT(size.at(200), 0);
  EXPECT_NEAR(size.at(300) / size.at(200), std::exp(-1), 1e-9);
}

TEST(OnBoardOfInvariant, KnowsDriftThatWandersSoonAfterACorrectionToo) {
  test::Flight flight({.duration_s = 30});
  FullGiven given(kWithAll);
  given.know(flight.truth);
  given.covariance *= 1e-8;
  given.setup.wandering_drift = {1e-4, 100};
  const auto on_board = test::flown(flight, given, {.interval = CorrectionPolicy::kOnlyFirst});
  const auto& gyros = on_board->navigator().gyros();
  const auto by_directions =
      on_board->estimator().attitude(gyros, flight.samples.back().h_b, all_gyros(2)).value().by_directions;
  const double variance = 2e-4 * (0.3 - 1 + std::exp(-0.3));
  EXPECT_NEAR(
      on_board->navigation_attitude().value().covariance_rad2.trace() / (by_directions.squaredNorm() * variance), 1,
      0.03);
}

TEST(OnBoardOfInvariant, LetsDriftThatWandersFadeWhereAFixIsRejected) {
  test::Flight flight({.duration_s = 150});
  flight.fixes[40].q_in_c = flight.fixes[40].q_in_c * Eigen::Quaterniond(test::turn(0.01, 0, 0));
  FullGiven given(kWithAll);
  given.setup.wandering_drift = {1e-5, 100};
  const auto on_board = given.on_board();
  const auto wandering = [&] {
    return on_board->estimator().gyros()[0].drift_rad_s.segment<3>(kWithAll.wandering_column()).norm();
  };
  double before = 0;
  double after = 0;
  test::fly(flight, *on_board, [&](const StepReport& report) {
    before = report.fix.used() && report.fix.t == flight.fixes[39].t ? wandering() : before;
    after = report.fix.status == FixStatus::kRejectedByGate ? wandering() : after;
  });
  EXPECT_GT(before, 0);
  EXPECT_NEAR(after / before, std::exp(-0.03), 1e-9);
}

/// Of the attitude at the last sample of a flight with known parameters: by a variance of each direction, per axis.
double expected_trace(const PairOnBoard& on_board, const test::Flight& flight, double variance_rad2) {
  const auto& gyros = on_board.navigator().gyros();
  return variance_rad2 * on_board.estimator()
                             .attitude(gyros, flight.samples.back().h_b, all_gyros(2))
                             .value()
                             .by_directions.squaredNorm();
}

TEST(OnBoardOfInvariant, KnowsTheRandomWalkSinceTheCorrection) {
  const test::Flight flight({.duration_s = 300});
  PairGiven given;
  given.know(flight.truth);
  given.covariance *= 1e-8;
  given.setup.direction_random_walk_rad_sqrt_s = 1e-4;
  const auto on_board = test::flown(flight, given, {.interval = CorrectionPolicy::kOnlyFirst});
  EXPECT_NEAR(
      on_board->navigation_attitude().value().covariance_rad2.trace() / expected_trace(*on_board, flight, 1e-8 * 300),
      1, 0.02);
}

TEST(OnBoardOfInvariant, KnowsWhatALongStepMayHaveMissed) {
  test::Flight flight({.duration_s = 450});
  const GyroSample before = flight.samples[8 * 300];
  flight.samples.erase(flight.samples.begin() + 8 * 300 + 1, flight.samples.end() - 1);
  PairGiven given;
  given.know(flight.truth);
  given.covariance *= 1e-8;
  const auto on_board = given.on_board({.interval = CorrectionPolicy::kEveryFix});
  test::fly(flight, *on_board);
  double missed_rad = 0;  // by the worse of the two
  for (int k = 0; k < 2; ++k) {
    const double turn_rad = angle_between<double>(before.h_b[k], flight.samples.back().h_b[k]);
    missed_rad = std::max(missed_rad, 150 * flight.truth[k].drift_rad_s.norm() * turn_rad);
  }
  EXPECT_GT(missed_rad, 2e-4);
  EXPECT_NEAR(on_board->navigation_attitude().value().covariance_rad2.trace() /
                  expected_trace(*on_board, flight, missed_rad * missed_rad),
              1, 0.05);
}

TEST(OnBoardOfInvariant, TellsTheAttitudeOfTheNavigatorAtAFixSecondsAgo) {
  const test::Flight flight({.duration_s = 300, .noise = 0});
  PairGiven given;
  given.know(flight.truth);
  given.covariance *= 1e-8;
  const auto on_board = given.on_board({.interval = CorrectionPolicy::kOnlyFirst});
  int told = 0;
  test::fly(flight, *on_board, [&](const StepReport& report) {
    if (report.navigated && !report.corrected) {
      const auto i = static_cast<std::size_t>(8 * to_seconds(report.fix.t.time_since_epoch()) + 0.5);
      EXPECT_LT(test::attitude_error(flight.C_in_c_at_samples[i], *report.navigated).norm(), 1e-6);
      ++told;
    }
  });
  EXPECT_EQ(told, 99);
}

TEST(OnBoardOfInvariant, ForgetsDriftThatWandersInALongGap) {
  // Longer than a correlation time by more than a double can hold.
  test::Flight flight({.duration_s = 300});
  std::erase_if(flight.samples, [](const auto& sample) {
    const double t_s = to_seconds(sample.t.time_since_epoch());
    return t_s > 100 && t_s < 200;
  });
  std::erase_if(flight.fixes, [](const StarFix& fix) {
    const double t_s = to_seconds(fix.t.time_since_epoch());
    return t_s > 95 && t_s < 205;
  });
  FullGiven given(kWithAll);
  given.setup.wandering_drift = {1e-7, 0.1};
  const auto on_board = test::flown(flight, given);
  const Eigen::MatrixXd root = test::error_root(on_board->estimator());
  EXPECT_TRUE(root.allFinite());
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(root.row(kWithAll.wandering(0) + i).norm(), 1e-7, 1e-9);
  }
}

TEST(OnBoardOfInvariant, CannotHoldDriftThatWanders) {
  // Parameters are held from 200 s on, those of the calibration or of the set-up; the last correction is at 300 s.
  test::Flight flight({.duration_s = 600});
  flight.fixes.resize(101);
  FullGiven given(kWithAll);
  given.know(flight.truth);
  given.covariance *= 1e-8;
  given.setup.wandering_drift = {1e-5, 100};
  for (const bool take_parameters : {true, false}) {
    const auto on_board = given.on_board({.interval = CorrectionPolicy::kEveryFix, .take_parameters = take_parameters});
    const auto drift = [&] { return on_board->navigator().gyros()[0].drift_rad_s; };
    const int wandering = kWithAll.wandering_column();
    Eigen::VectorXd held;
    test::fly(flight, *on_board, [&](const StepReport& report) {
      if (report.t == Time(std::chrono::seconds(200))) {
        EXPECT_EQ(drift().segment<3>(wandering).norm() > 0, take_parameters);
        on_board->use_parameters(ParametersInUse::kHeld);
        held = drift().head(wandering);
      }
    });
    EXPECT_EQ(on_board->corrected_t(), Time(std::chrono::seconds(300)));
    EXPECT_EQ(drift().head(wandering), held);
    EXPECT_EQ(drift().segment<3>(wandering).norm(), 0);
    // Nothing is known of the drift that wanders: as above.
    const auto& gyros = on_board->navigator().gyros();
    const auto by_directions =
        on_board->estimator().attitude(gyros, flight.samples.back().h_b, all_gyros(2)).value().by_directions;
    const double variance = 2 * 1e-6 * (2 + std::exp(-3));
    EXPECT_NEAR(
        on_board->navigation_attitude().value().covariance_rad2.trace() / (by_directions.squaredNorm() * variance), 1,
        0.1);
  }
}

TEST(OnBoardOfInvariant, HoldsTheParametersOfTheSetup) {
  const test::Flight flight({.duration_s = 600});
  FullGiven given(kWithAll);
  given.know(flight.truth);
  given.covariance *= 1e-6;
  const auto on_board = test::flown(flight, given, {.take_parameters = false});
  const auto solution = on_board->navigation_attitude().value();
  EXPECT_LT(test::attitude_error(flight.C_in_c_at_samples.back(), solution).norm(),
            4 * std::sqrt(solution.covariance_rad2.trace()));
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(on_board->navigator().gyros()[k].C_c_b, given.prior[k].C_c_b);
  }
}

TEST(OnBoardOfInvariant, HoldsTheParametersOfTheSetupWhereThereAreNoneInUseYet) {
  const test::Flight flight({.duration_s = 300});
  const auto of_set_up = test::flown(flight, PairGiven(), {.take_parameters = false});
  const auto held = PairGiven().on_board();
  held->use_parameters(ParametersInUse::kHeld);
  test::fly(flight, *held, [&](const StepReport& report) {
    if (report.fix.status == FixStatus::kStarted) {  // unknown alignments do not show where the directions were read
      EXPECT_LT(report.navigated->covariance_rad2.trace(), 1.5 * report.calibrated->covariance_rad2.trace());
    }
  });
  test::flush(*held);
  EXPECT_EQ(held->navigator().gyros()[0].C_c_b, PairGiven().prior[0].C_c_b);
  EXPECT_EQ(held->navigation_attitude().value().C_in_c.raw(), of_set_up->navigation_attitude().value().C_in_c.raw());
  EXPECT_EQ(held->navigation_attitude().value().covariance_rad2,
            of_set_up->navigation_attitude().value().covariance_rad2);
}

}  // namespace
}  // namespace trihedron
