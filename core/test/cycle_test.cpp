#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "flight.hpp"
#include "trihedron/core/cycles.hpp"

namespace trihedron {
namespace {

using Estimator = PaperEstimator<Esg7>;
using OnBoard = Cycle<Estimator>;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

OnBoard make_cycle(const CorrectionPolicy& policy = {}) {
  return OnBoard::create(test::nominal_setup(), policy).value();
}

/// Everything that a cycle told about fixes and samples.
struct Log {
  std::vector<FixStatus> fixes;
  std::vector<SampleStatus> samples;
  int corrections = 0;
  void operator()(const OnBoard::Report& report) {
    if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
      fixes.push_back(report.fix.status);
    }
    samples.push_back(report.sample);
    corrections += report.corrected;
  }
  [[nodiscard]] auto count(FixStatus status) const { return std::count(fixes.begin(), fixes.end(), status); }
  [[nodiscard]] auto count(SampleStatus status) const { return std::count(samples.begin(), samples.end(), status); }
};

double attitude_error(const OnBoard& cycle, const test::Flight& flight) {
  const auto solution = cycle.navigation_attitude().value();
  return Rot<C, C>::assume(Eigen::Matrix3d(flight.C_in_c_at_samples.back().transpose() * solution.C_in_c.raw()))
      .log()
      .norm();
}

TEST(Cycle, RefusesTheSetupsThatItsEstimatorRefuses) {
  auto setup = test::nominal_setup();
  setup.gate_nis = -1;
  EXPECT_EQ(OnBoard::create(setup, {}).fault(), SetupFault::kGateNotPositive);
}

TEST(Cycle, GivesNoAngleResidualBeforeTheFirstFix) {
  const test::Flight flight({.duration_s = 60});
  auto cycle = make_cycle();
  EXPECT_EQ(cycle.on_gyro(flight.samples[0]).angle_residual, 0);
  EXPECT_FALSE(cycle.navigator().started());
}

TEST(Cycle, FixesBetweenSamplesCalibrateAsWellAsFixesOnThem) {
  double worst = 0;
  for (const double offset : {0.0, 0.05}) {
    const test::Flight flight({.duration_s = 5400, .noise = 0, .fix_offset_s = offset});
    auto cycle = make_cycle();
    Log log;
    test::fly(flight, cycle, std::ref(log));
    // A fix before the first sample has nothing to be interpolated from.
    EXPECT_EQ(log.count(FixStatus::kRejectedNoGyro), 0);
    EXPECT_GE(log.count(FixStatus::kUsed), 1798);
    for (int k = 0; k < 2; ++k) {
      worst = std::max(worst, angle_between<double>(cycle.estimator().gyros()[k].h_in, flight.truth[k].h_in));
    }
  }
  EXPECT_LT(worst, 0.5 * test::kArcsecond);
}

TEST(Cycle, CorrectsTheNavigatorAsOftenAsTold) {
  const test::Flight flight({.duration_s = 1800});
  const auto corrections = [&](const CorrectionPolicy& policy) {
    auto cycle = make_cycle(policy);
    Log log;
    test::fly(flight, cycle, std::ref(log));
    return log.corrections;
  };
  EXPECT_EQ(corrections({.interval = std::chrono::minutes(10)}), 4);  // at 0, 10, 20 and 30 min
  EXPECT_EQ(corrections({.interval = CorrectionPolicy::kOnlyFirst}), 1);
  EXPECT_EQ(corrections({.interval = CorrectionPolicy::kEveryFix}), 601);
  EXPECT_EQ(corrections({.navigate = false}), 0);
}

TEST(Cycle, AttitudeImprovesWithTheParametersTakenOver) {
  const test::Flight flight({.duration_s = 3599});
  auto held = make_cycle({.interval = std::chrono::minutes(20), .take_parameters = false});
  auto taken = make_cycle({.interval = std::chrono::minutes(20)});
  test::fly(flight, held, [](const auto&) {});
  test::fly(flight, taken, [](const auto&) {});
  EXPECT_GT(attitude_error(held, flight), 300 * test::kArcsecond);
  EXPECT_LT(attitude_error(taken, flight), 20 * test::kArcsecond);
  // …and the covariance knows in both: its 3-sigma holds the error.
  for (const OnBoard* cycle : {&held, &taken}) {
    EXPECT_LT(attitude_error(*cycle, flight),
              3 * std::sqrt(cycle->navigation_attitude().value().covariance_rad2.trace()));
  }
}

TEST(Cycle, AttitudeErrorsAreThoseOfItsCovariance) {
  // (error/σ)² of each axis, over seeds and times of the open loop with well-known parameters: its mean is 1.
  double sum = 0;
  double count = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const test::Flight flight({.duration_s = 2400, .seed = seed});
    auto cycle = make_cycle({.interval = std::chrono::minutes(20)});
    std::size_t sample = 0;
    test::fly(flight, cycle, [&](const OnBoard::Report& report) {
      if (report.fix.status != FixStatus::kNone) {
        return;
      }
      // After the first correction with calibrated parameters, once in 200 s so that the readout differs.
      if (report.t > Time(std::chrono::minutes(20)) && sample % 1600 == 0) {
        const auto solution = cycle.navigation_attitude().value();
        const Eigen::Vector3d error =
            Rot<C, C>::assume(Eigen::Matrix3d(solution.C_in_c.raw().transpose() * flight.C_in_c_at_samples[sample]))
                .log()
                .raw();
        sum += error.dot(solution.covariance_rad2.llt().solve(error)) / 3;
        ++count;
      }
      ++sample;
    });
  }
  // Errors within one run are correlated: 40 independent runs of 3 components bound the spread from above.
  EXPECT_NEAR(sum / count, 1, 3.29 * std::sqrt(2.0 / (3 * 40)));
}

TEST(Cycle, RejectsSamplesThatAreNoDirectionsAndGoesOn) {
  test::Flight flight({.duration_s = 600});
  flight.samples[100].h_b[1](2) = kNaN;
  flight.samples[101].h_b[0].setZero();
  flight.samples[102].h_b[0] *= 1.01;
  auto cycle = make_cycle();
  Log log;
  test::fly(flight, cycle, std::ref(log));
  EXPECT_EQ(log.count(SampleStatus::kRejectedNotDirection), 3);
  EXPECT_EQ(log.count(FixStatus::kUsed), 200);
}

TEST(Cycle, RejectsSamplesOutOfOrder) {
  const test::Flight flight({.duration_s = 60});
  auto cycle = make_cycle();
  EXPECT_EQ(cycle.on_gyro(flight.samples[1]).sample, SampleStatus::kUsed);
  EXPECT_EQ(cycle.on_gyro(flight.samples[1]).sample, SampleStatus::kRejectedOutOfOrder);
  EXPECT_EQ(cycle.on_gyro(flight.samples[0]).sample, SampleStatus::kRejectedOutOfOrder);
  EXPECT_EQ(cycle.t(), flight.samples[1].t);
}

TEST(Cycle, RejectsFixesThatAreNoRotations) {
  const test::Flight flight({.duration_s = 60});
  auto cycle = make_cycle();
  cycle.on_gyro(flight.samples[0]);
  StarFix fix = flight.fixes[0];
  for (const double bad : {kNaN, 0.0, 2.0}) {
    fix.q_in_c.coeffs() = flight.fixes[0].q_in_c.coeffs() * bad;
    EXPECT_EQ(cycle.on_fix(fix).fix.status, FixStatus::kRejectedNotRotation) << bad;
  }
  EXPECT_EQ(cycle.on_fix(flight.fixes[0]).fix.status, FixStatus::kStarted);
}

TEST(Cycle, TakesAQuaternionOfEitherSign) {
  test::Flight flight({.duration_s = 600});
  auto plain = make_cycle();
  test::fly(flight, plain, [](const auto&) {});
  for (std::size_t i = 0; i < flight.fixes.size(); i += 2) {
    flight.fixes[i].q_in_c.coeffs() *= -1;
  }
  auto flipped = make_cycle();
  test::fly(flight, flipped, [](const auto&) {});
  EXPECT_EQ(plain.estimator().gyros()[0].drift_rad_s, flipped.estimator().gyros()[0].drift_rad_s);
}

TEST(Cycle, BelievesATimeFarAheadOnlyWhenASecondSampleConfirmsIt) {
  const test::Flight flight({.duration_s = 60});
  const auto sample_at = [&](double t_s) {
    GyroSample<2> sample = flight.samples[0];
    sample.t = Time(from_seconds(t_s));
    return sample;
  };
  auto cycle = make_cycle();
  cycle.on_gyro(sample_at(0));
  EXPECT_EQ(cycle.on_gyro(sample_at(1e6)).sample, SampleStatus::kRejectedOutOfOrder);
  EXPECT_EQ(cycle.on_gyro(sample_at(0.125)).sample, SampleStatus::kUsed);  // no harm done
  EXPECT_EQ(cycle.on_gyro(sample_at(8000)).sample, SampleStatus::kRejectedOutOfOrder);
  EXPECT_EQ(cycle.on_gyro(sample_at(8000.125)).sample, SampleStatus::kUsed);
}

TEST(Cycle, NavigatorDoesNotRestOnAFirstFixThatAllOthersContradict) {
  test::Flight flight({.duration_s = 600});
  flight.fixes[0].q_in_c =
      flight.fixes[0].q_in_c * Eigen::Quaterniond(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX()));
  auto setup = test::nominal_setup();
  setup.prior = flight.truth;
  setup.prior_covariance *= 1e-6;  // well known: only the first fix is wrong
  for (const bool take : {true, false}) {
    auto cycle = OnBoard::create(setup, {.interval = CorrectionPolicy::kOnlyFirst, .take_parameters = take}).value();
    Log log;
    test::fly(flight, cycle, std::ref(log));
    EXPECT_EQ(log.corrections, 2);
    EXPECT_LT(attitude_error(cycle, flight), 120 * test::kArcsecond);
  }
}

TEST(Cycle, RejectsFixesOutOfOrder) {
  const test::Flight flight({.duration_s = 60});
  auto cycle = make_cycle();
  for (std::size_t i = 0; i <= 24; ++i) {
    cycle.on_gyro(flight.samples[i]);
  }
  EXPECT_EQ(cycle.on_fix(flight.fixes[0]).fix.status, FixStatus::kRejectedOutOfOrder);  // before the latest sample
  EXPECT_EQ(cycle.on_fix(flight.fixes[1]).fix.status, FixStatus::kStarted);
  EXPECT_EQ(cycle.on_fix(flight.fixes[1]).fix.status, FixStatus::kRejectedOutOfOrder);  // repeated
}

TEST(Cycle, RejectsFixesWithoutGyroSamplesRoundThem) {
  const test::Flight flight({.duration_s = 60});
  const auto fix_at = [&](double t_s) {
    return StarFix{Time(from_seconds(t_s)), Eigen::Quaterniond(test::Flight::attitude(t_s, 0.5))};
  };
  auto cycle = make_cycle();
  EXPECT_EQ(cycle.on_fix(fix_at(0)).fix.status, FixStatus::kRejectedNoGyro);  // no sample yet
  cycle.on_gyro(flight.samples[0]);
  // A wild time stamp is rejected, and does no harm to the fixes after it.
  EXPECT_EQ(cycle.on_fix(fix_at(1e6)).fix.status, FixStatus::kRejectedNoGyro);
  EXPECT_EQ(cycle.on_fix(fix_at(0.3)).fix.status, FixStatus::kPending);
  EXPECT_EQ(cycle.on_fix(fix_at(0.4)).fix.status, FixStatus::kPending);  // a second one before the next sample
  // It waits for the first sample that is not before it.
  EXPECT_EQ(cycle.on_gyro(flight.samples[1]).fix.status, FixStatus::kNone);
  EXPECT_EQ(cycle.on_gyro(flight.samples[2]).fix.status, FixStatus::kNone);
  EXPECT_EQ(cycle.on_gyro(flight.samples[3]).fix.status, FixStatus::kStarted);
  // The gyros fall silent: nothing to interpolate between.
  EXPECT_EQ(cycle.on_gyro(flight.samples[4]).fix.status, FixStatus::kUsed);
  EXPECT_EQ(cycle.on_fix(fix_at(0.55)).fix.status, FixStatus::kPending);
  EXPECT_EQ(cycle.on_gyro(flight.samples[60]).fix.status, FixStatus::kRejectedNoGyro);
  EXPECT_EQ(cycle.on_fix(fix_at(7.5)).fix.status, FixStatus::kUsed);
}

TEST(Cycle, BridgesAGapOfTheGyrosAndWidensItsUncertainty) {
  test::Flight flight({.duration_s = 3600});
  const auto first = flight.samples.begin() + 8 * 2400;
  flight.samples.erase(first, first + 8 * 300);
  auto cycle = make_cycle();
  Log log;
  double sigma_before = 0;
  double sigma_after = 0;
  test::fly(flight, cycle, [&](const OnBoard::Report& report) {
    log(report);
    if (report.fix.status == FixStatus::kNone && cycle.navigator().started()) {
      double& sigma = report.t < Time(std::chrono::seconds(2400)) ? sigma_before : sigma_after;
      sigma = sigma_after == 0 ? std::sqrt(cycle.navigation_attitude().value().covariance_rad2.trace()) : sigma;
    }
  });
  EXPECT_GT(sigma_after, sigma_before);
  EXPECT_EQ(log.count(FixStatus::kRejectedByGate), 0);
  EXPECT_GE(log.count(FixStatus::kRejectedNoGyro), 99);
  EXPECT_LT(angle_between<double>(cycle.estimator().gyros()[0].h_in, flight.truth[0].h_in), 2 * test::kArcsecond);
}

TEST(Cycle, RejectsOutliersAndKeepsTheGoodFixes) {
  test::Flight flight({.duration_s = 1800});
  int outliers = 0;
  for (std::size_t i = 5; i < flight.fixes.size(); i += 50) {
    flight.fixes[i].q_in_c =
        flight.fixes[i].q_in_c * Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d(1, 1, 0).normalized()));
    ++outliers;
  }
  auto cycle = make_cycle();
  Log log;
  test::fly(flight, cycle, std::ref(log));
  EXPECT_EQ(log.count(FixStatus::kRejectedByGate), outliers);
  EXPECT_EQ(log.count(FixStatus::kUsed), static_cast<long>(flight.fixes.size()) - outliers - 1);
}

TEST(Cycle, ReopensWhenTheModelHasLostTheMomenta) {
  test::Flight flight({.duration_s = 1800});
  // The tracker is turned in its mount by 2′ for good: no single fix is at fault.
  const Eigen::Quaterniond jump(Eigen::AngleAxisd(120 * test::kArcsecond, Eigen::Vector3d::UnitX()));
  for (std::size_t i = 300; i < flight.fixes.size(); ++i) {
    flight.fixes[i].q_in_c = flight.fixes[i].q_in_c * jump;
  }
  auto cycle = make_cycle();
  Log log;
  test::fly(flight, cycle, std::ref(log));
  EXPECT_EQ(log.count(FixStatus::kRejectedByGate), 19);
  EXPECT_EQ(log.count(FixStatus::kUsedAfterReopening), 1);
  EXPECT_EQ(log.fixes.back(), FixStatus::kUsed);
}

TEST(Cycle, StartsAnewWhenItsInformationIsAboutAFarWrongEstimate) {
  // Misalignments of degrees, seen in steady flight only: the filter gathers false information about the axis of the
  // turn, and the first slews contradict it.
  int restarts = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const test::Flight flight({.duration_s = 5400, .steady_until_s = 1800, .misalignment = 4, .seed = seed});
    auto setup = test::nominal_setup();
    for (int k = 0; k < 2; ++k) {
      setup.prior_covariance.diagonal().segment<3>(10 * k + 7).setConstant(16 * 7.6e-5);
    }
    auto cycle = OnBoard::create(setup, {}).value();
    Log log;
    test::fly(flight, cycle, std::ref(log));
    restarts += static_cast<int>(log.count(FixStatus::kRestarted));
    for (int k = 0; k < 2; ++k) {
      const Eigen::Matrix3d off = flight.truth[k].C_c_b * cycle.estimator().gyros()[k].C_c_b.transpose();
      // A hundredth of what it is without the restart; the early linearisation still costs some arcseconds.
      EXPECT_LT((Rot<C, C>::assume(off).log().norm()), 30 * test::kArcsecond) << seed;
    }
  }
  EXPECT_GT(restarts, 0);
}

TEST(Cycle, RefusesParallelMomentaWithoutLosingItself) {
  test::Flight flight({.duration_s = 60});
  auto cycle = make_cycle();
  // At the start no trihedron can be made.
  GyroSample<2> parallel = flight.samples[0];
  parallel.h_b[1] = parallel.h_b[0];
  EXPECT_EQ(cycle.on_gyro(parallel).sample, SampleStatus::kUsed);
  EXPECT_EQ(cycle.on_fix(flight.fixes[0]).fix.status, FixStatus::kRejectedGeometry);
  // Later: readings that agree with each other but not with the model give no attitude for the step.
  for (std::size_t i = 1; i <= 24; ++i) {
    cycle.on_gyro(flight.samples[i]);
  }
  ASSERT_EQ(cycle.on_fix(flight.fixes[1]).fix.status, FixStatus::kStarted);
  parallel.t = flight.samples[25].t;
  parallel.h_b[1] = parallel.h_b[0] = (flight.samples[24].h_b[0] - flight.samples[24].h_b[1]).normalized();
  parallel.h_b[0] = -flight.samples[24].h_b[1] + 1e-3 * flight.samples[24].h_b[0];
  parallel.h_b[0].normalize();
  parallel.h_b[1] = -flight.samples[24].h_b[0];
  const auto bad = cycle.on_gyro(parallel);
  EXPECT_EQ(bad.sample, SampleStatus::kRejectedGeometry);
  EXPECT_EQ(cycle.t(), flight.samples[24].t);
  EXPECT_EQ(cycle.on_gyro(flight.samples[26]).sample, SampleStatus::kUsed);
}

TEST(Cycle, AngleResidualShowsAJumpOfOneGyro) {
  test::Flight flight({.duration_s = 1800});
  auto cycle = make_cycle();
  double before = 0;
  test::fly(flight, cycle,
            [&](const OnBoard::Report& report) { before = std::max(before, std::abs(report.angle_residual)); });
  GyroSample<2> jumped = flight.samples.back();
  jumped.t += std::chrono::milliseconds(125);
  jumped.h_b[0] = rotated<double>(jumped.h_b[0], 1e-3 * jumped.h_b[0].cross(jumped.h_b[1]).normalized());
  EXPECT_GT(std::abs(cycle.on_gyro(jumped).angle_residual), 5e-4);
  EXPECT_LT(before, 1e-2);
}

}  // namespace
}  // namespace trihedron
