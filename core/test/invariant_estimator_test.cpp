#include "trihedron/core/invariant_estimator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "flight.hpp"
#include "numerical_jacobian.hpp"
#include "trihedron/core/cycles.hpp"

namespace trihedron {
namespace {

using Invariant = InvariantEstimator<Esg7, 2>;
using WithAll = InvariantEstimator<Esg7, 2, kAllFurtherStates>;

template <class E = Invariant>
typename E::Setup nominal() {
  typename E::Setup setup;
  static_cast<CalibrationSetup<Esg7, 2>&>(setup) = test::nominal_setup();
  setup.wandering_sigma_rad_s = 1e-9;
  return setup;
}

/// Rotation vector by which the estimated alignment is off, rad.
template <class Gyro>
Eigen::Vector3d alignment_error(const GyroModel<Esg7>& truth, const Gyro& estimate) {
  return Rot<C, C>::assume(Eigen::Matrix3d(truth.C_c_b * estimate.C_c_b.transpose())).log().raw();
}

TEST(InvariantMeasurement, JacobianIsThatOfTheInnovation) {
  // y of a fix and readings that are true, as a function of how far the estimates are from the truth.
  const Eigen::Matrix3d C_in_c = Rot<In, C>::exp(Vec<In>::assume(0.3, -0.2, 0.9)).raw();
  WithAll::Gyros gyros;
  gyros[0].h_in = Eigen::Vector3d(0.51, 0.59, 0.63).normalized();
  gyros[1].h_in = Eigen::Vector3d(-0.72, 0.49, 0.49).normalized();
  WithAll::Directions h_b;
  for (int k = 0; k < 2; ++k) {
    gyros[k].drift_rad_s.setZero();
    gyros[k].C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(0.1, -0.2, 0.3 * (k + 1))).raw();
    h_b[k] = gyros[k].C_c_b.transpose() * C_in_c.transpose() * gyros[k].h_in;
  }
  const Eigen::Vector3d rate_c(1e-3, -2e-3, 5e-4);
  WithAll::FixBySharedStates by_shared = WithAll::FixBySharedStates::Zero();
  by_shared.col(0) = rate_c;
  by_shared.middleCols<3>(1) = 0.6 * Eigen::Matrix3d::Identity();
  by_shared.middleCols<3>(4) = 0.8 * Eigen::Matrix3d::Identity();
  PerGyro<double, 2> noise;
  noise[0] = noise[1] = 1e-5;
  using State = Eigen::Matrix<double, WithAll::Layout::kStates, 1>;
  // Errors x: truth = estimate ⊕ x. The estimate moves the other way; the fix carries its shared error.
  const auto measured = [&](const State& x) {
    WithAll::Gyros estimate = gyros;
    for (int k = 0; k < 2; ++k) {
      estimate[k].h_in = rotated<double>(gyros[k].h_in, -x.segment<3>(WithAll::Layout::direction(k)));
      const Eigen::Vector3d delta = -x.segment<3>(WithAll::Layout::alignment(k));
      estimate[k].C_c_b = Rot<C, C>::exp(Vec<C>::assume(delta)).raw() * gyros[k].C_c_b;
      estimate[k].readout_bias = -x.segment<3>(WithAll::Layout::readout_bias(k));
    }
    const Eigen::Vector3d error = by_shared * x.tail<WithAll::kFurther.shared()>();
    const Eigen::Matrix3d given = C_in_c * Rot<C, C>::exp(Vec<C>::assume(error)).raw();
    return WithAll::measure(estimate, given, C_in_c, h_b, Eigen::Matrix3d::Identity(), by_shared, noise).y;
  };
  // Seconds and radians alike are steps of 1e-5 here: the clock offset acts as 1e-3 of it.
  const auto numerical =
      test::central_differences<decltype(measured)&, WithAll::Layout::kStates>(measured, State::Zero(), 1e-5);
  const auto m = WithAll::measure(gyros, C_in_c, C_in_c, h_b, Eigen::Matrix3d::Identity(), by_shared, noise);
  test::expect_jacobian(m.H, numerical, 1e-8);
  test::expect_jacobian(m.H.col(WithAll::Layout::clock_offset()).eval(),
                        numerical.col(WithAll::Layout::clock_offset()).eval(), 1e-6);
  EXPECT_LT(m.y.norm(), 1e-15);
}

TEST(InvariantMeasurement, NoiseIsThatOfFixAndReadouts) {
  const test::Flight flight({.duration_s = 3, .noise = 0});
  Invariant::Gyros gyros = flight.truth;
  const Eigen::Matrix3d C_in_c = flight.C_in_c_at_samples.back();
  Eigen::Matrix3d R_c;
  R_c << 4, 1, 0, 1, 9, 2, 0, 2, 25;
  PerGyro<double, 2> sigma;
  sigma[0] = 1.5;
  sigma[1] = 0.5;
  const auto at = [&](const Eigen::Matrix<double, 9, 1>& cause) {
    Invariant::Directions h_b = flight.samples.back().h_b;
    for (int k = 0; k < 2; ++k) {
      h_b[k] += cause.segment<3>(3 + 3 * k);
    }
    const Eigen::Matrix3d given = C_in_c * Rot<C, C>::exp(Vec<C>::assume(Eigen::Vector3d(cause.head<3>()))).raw();
    return Invariant::measure(gyros, given, C_in_c, h_b, R_c, {}, sigma).y;
  };
  const auto by_cause = test::central_differences<decltype(at)&, 9>(at, Eigen::Matrix<double, 9, 1>::Zero(), 1e-5);
  Eigen::Matrix<double, 9, 9> causes = Eigen::Matrix<double, 9, 9>::Zero();
  causes.topLeftCorner<3, 3>() = R_c;
  causes.diagonal().tail<6>() << 2.25, 2.25, 2.25, 0.25, 0.25, 0.25;
  const Eigen::Matrix4d expected = by_cause * causes * by_cause.transpose();
  test::expect_jacobian(Invariant::measure(gyros, C_in_c, C_in_c, flight.samples.back().h_b, R_c, {}, sigma).R,
                        expected, 1e-6);
}

TEST(InvariantEstimator, GainsNothingAboutTheAxisOfASteadyTurnInTenThousandSteps) {
  // An axis n fixed in the body and in space; everything else at random. Readings agree with the estimates, so that
  // the attitude in H is the true one.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  auto setup = nominal();
  for (int k = 0; k < 2; ++k) {
    setup.prior[k].drift_rad_s << 1e-5, -2e-5, 1e-5, 3e-5, -1e-5, 2e-5, 1e-5;
    setup.prior[k].C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(vector())).raw();
  }
  auto estimator = Invariant::create(setup).value();
  const Eigen::Vector3d n = vector().normalized();
  const Eigen::Matrix3d first = Rot<In, C>::exp(Vec<In>::assume(vector())).raw();
  Eigen::Matrix3d C_in_c = first;
  const auto readings = [&] {
    FixReadings<2> r;
    for (int k = 0; k < 2; ++k) {
      r.h_b[k] = estimator.gyros()[k].C_c_b.transpose() * C_in_c.transpose() * estimator.gyros()[k].h_in;
    }
    return r;
  };
  FixReadings<2> start;
  start.h_b[0] = estimator.gyros()[0].C_c_b.transpose() * Eigen::Vector3d(0.8, 0.1, 0.6).normalized();
  start.h_b[1] = estimator.gyros()[1].C_c_b.transpose() * Eigen::Vector3d(-0.1, 0.9, 0.4).normalized();
  ASSERT_EQ(estimator.correct({Time{}, Eigen::Quaterniond(C_in_c)}, start).status, FixStatus::kStarted);

  // Of one gyro alone, φ = n and δ = C_c_in n change no measurement of it, whatever the other does.
  const auto information_about = [&](int gyro) {
    Invariant::Information::Vector v = Invariant::Information::Vector::Zero();
    v.segment<3>(Invariant::Layout::direction(gyro)) = n;
    v.segment<3>(Invariant::Layout::alignment(gyro)) = first.transpose() * n;
    return (estimator.information().root() * v).squaredNorm();
  };
  const double before[2] = {information_about(0), information_about(1)};
  for (int step = 1; step <= 10'000; ++step) {
    C_in_c = Rot<In, In>::exp(Vec<In>::assume(Eigen::Vector3d(3 * uniform(random) * n))).raw() * C_in_c;
    estimator.predict(C_in_c, readings().h_b, 0.1 + 0.1 * uniform(random));
    if (step % 5 == 0) {
      const Time t(from_seconds(step));
      ASSERT_EQ(estimator.correct({t, Eigen::Quaterniond(C_in_c)}, readings()).status, FixStatus::kUsed);
    }
  }
  // The prior's information, to the rounding of 2000 fixes whose own is 1e9 times as large.
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(information_about(k) / before[k], 1, 1e-6) << k;
  }
  // About another axis there is plenty.
  Invariant::Information::Vector other = Invariant::Information::Vector::Zero();
  other.segment<3>(Invariant::Layout::alignment(0)) = first.transpose() * n.unitOrthogonal();
  other.segment<3>(Invariant::Layout::direction(0)) = n.unitOrthogonal();
  EXPECT_GT((estimator.information().root() * other).squaredNorm(), 1e6 * before[0]);
}

struct MeanOutcome {
  double nees = 0;
  double nis = 0;
  double rejected = 0;
};

/// Means over flights whose priors are drawn about the truth.
template <class E = Invariant>
MeanOutcome fly_many(int runs, double alignment_sigma_rad, const test::FlightPlan& plan) {
  MeanOutcome mean;
  double fixes = 0;
  for (int run = 1; run <= runs; ++run) {
    test::FlightPlan own = plan;
    own.seed = static_cast<unsigned>(run);
    const test::Flight flight(own);
    auto setup = nominal<E>();
    std::mt19937 random(static_cast<unsigned>(run) + 1000);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 2; ++k) {
      setup.prior[k].drift_rad_s =
          flight.truth[k].drift_rad_s + 2e-6 * Esg7::Coefficients<double>::NullaryExpr([&] { return normal(random); });
      setup.prior_covariance.diagonal()
          .template segment<3>(10 * k + 7)
          .setConstant(alignment_sigma_rad * alignment_sigma_rad);
      const Eigen::Vector3d delta = alignment_sigma_rad * Eigen::Vector3d::NullaryExpr([&] { return normal(random); });
      setup.prior[k].C_c_b = Rot<C, C>::exp(Vec<C>::assume(delta)).raw() * flight.truth[k].C_c_b;
    }
    auto cycle = std::make_unique<Cycle<E>>(Cycle<E>::create(setup, {}).value());
    test::fly(flight, *cycle, [&](const auto& report) {
      if (report.fix.status == FixStatus::kUsed) {
        mean.nis += report.fix.nis;
        ++fixes;
      }
      mean.rejected += report.fix.status == FixStatus::kRejectedByGate ? 1 : 0;
    });
    Eigen::Matrix<double, 20, 1> error;
    Eigen::Matrix<double, 20, E::ErrorRoot::ColsAtCompileTime> root;
    const typename E::ErrorRoot all = cycle->estimator().error_root();
    for (int k = 0; k < 2; ++k) {
      const auto& estimate = cycle->estimator().gyros()[k];
      error.template segment<7>(10 * k) = flight.truth[k].drift_rad_s - estimate.drift_rad_s.template head<7>();
      error.template segment<3>(10 * k + 7) = alignment_error(flight.truth[k], estimate);
      root.template middleRows<7>(10 * k) = all.template middleRows<7>(E::Errors::drift(k));
      root.template middleRows<3>(10 * k + 7) = all.template middleRows<3>(E::Errors::alignment(k));
    }
    mean.nees += error.dot((root * root.transpose()).llt().solve(error)) / runs;
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

TEST(InvariantEstimator, IsConsistentFromFiveDegrees) {
  const MeanOutcome mean = fly_many(20, 0.087, {.duration_s = 1800});
  EXPECT_NEAR(mean.nees, 20, nees_band(20));
}

TEST(InvariantEstimator, IsConsistentInSteadyFlight) {
  const MeanOutcome mean = fly_many(20, 8e-3, {.duration_s = 1800, .slews_rad = 0});
  EXPECT_NEAR(mean.nees, 20, nees_band(20));
  EXPECT_NEAR(mean.nis, 4, 0.085);
}

/// The whole flight through a cycle.
template <class E>
std::unique_ptr<Cycle<E>> flown(const test::Flight& flight, const typename E::Setup& setup,
                                const CorrectionPolicy& policy = {}) {
  auto cycle = std::make_unique<Cycle<E>>(Cycle<E>::create(setup, policy).value());
  test::fly(flight, *cycle, [](const auto&) {});
  while (cycle->flush().fix.status != FixStatus::kNone) {
  }
  return cycle;
}

TEST(InvariantEstimator, DoesNotDependOnTheInertialFrame) {
  const test::Flight flight({.duration_s = 900});
  test::Flight turned = flight;
  const Eigen::Quaterniond q(Eigen::AngleAxisd(2, Eigen::Vector3d(1, 2, 3).normalized()));
  for (StarFix& fix : turned.fixes) {
    fix.q_in_c = q * fix.q_in_c;
  }
  const auto a = flown<Invariant>(flight, nominal());
  const auto b = flown<Invariant>(turned, nominal());
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
  const auto a = flown<Invariant>(flight, nominal());
  const auto b = flown<Invariant>(swapped, nominal());
  for (int k = 0; k < 2; ++k) {
    EXPECT_LT(alignment_error(a->estimator().gyros()[k], b->estimator().gyros()[1 - k]).norm(), 1e-11);
    EXPECT_LT((a->estimator().gyros()[k].drift_rad_s - b->estimator().gyros()[1 - k].drift_rad_s).norm(), 1e-14);
  }
}

TEST(InvariantEstimator, AStepInTwoHalvesIsTheStep) {
  const test::Flight flight({.duration_s = 60});
  auto whole = Invariant::create(nominal()).value();
  FixReadings<2> readings;
  readings.h_b = flight.samples[0].h_b;
  ASSERT_EQ(whole.correct(flight.fixes[0], readings).status, FixStatus::kStarted);
  auto halves = whole;
  for (std::size_t i = 1; i <= 24; ++i) {
    const Eigen::Matrix3d& C_in_c = flight.C_in_c_at_samples[i];
    whole.predict(C_in_c, flight.samples[i].h_b, 0.125);
    halves.predict(C_in_c, flight.samples[i].h_b, 0.0625);
    halves.predict(C_in_c, flight.samples[i].h_b, 0.0625);
  }
  readings.h_b = flight.samples[24].h_b;
  EXPECT_EQ(whole.correct(flight.fixes[1], readings).status, FixStatus::kUsed);
  EXPECT_EQ(halves.correct(flight.fixes[1], readings).status, FixStatus::kUsed);
  for (int k = 0; k < 2; ++k) {
    EXPECT_LT(alignment_error(whole.gyros()[k], halves.gyros()[k]).norm(), 1e-15);
    EXPECT_LT((whole.gyros()[k].h_in - halves.gyros()[k].h_in).norm(), 1e-15);
  }
}

TEST(InvariantEstimator, FindsTheClockOffsetAndTheErrorAtOrbitalPeriod) {
  test::Flight flight({.duration_s = 5400});
  const Eigen::Vector3d sine(3e-5, -2e-5, 4e-5);
  const Eigen::Vector3d cosine(-1e-5, 5e-5, 2e-5);
  constexpr double kRate = 1.1e-3;
  constexpr double kOffset_s = 0.02;
  for (StarFix& fix : flight.fixes) {
    const double t_s = to_seconds(fix.t.time_since_epoch());
    const auto at = [&](double time_s) { return Eigen::Quaterniond(test::Flight::attitude(time_s, 0.5)); };
    const Eigen::Vector3d e = sine * std::sin(kRate * t_s) + cosine * std::cos(kRate * t_s);
    const Eigen::Quaterniond noise = at(t_s).conjugate() * fix.q_in_c;
    fix.q_in_c = at(t_s + kOffset_s) * Rot<C, C>::exp(Vec<C>::assume(e)).quaternion() * noise;
  }
  auto setup = nominal<WithAll>();
  setup.orbital_rate_rad_s = kRate;
  const auto cycle = flown<WithAll>(flight, setup);
  const auto& shared = cycle->estimator().shared();
  const auto root = cycle->estimator().information().inverse_root();
  Eigen::Matrix<double, 7, 1> truth;
  truth << kOffset_s, sine, cosine;
  for (int i = 0; i < 7; ++i) {
    const double sigma = root.row(WithAll::Layout::kShared + i).norm();
    EXPECT_LT(std::abs(shared(i) - truth(i)), 4 * sigma) << i;
  }
  EXPECT_LT(root.row(WithAll::Layout::kShared).norm(), 1e-3);
  EXPECT_LT(root.row(WithAll::Layout::kShared + 1).norm(), 5 * test::kArcsecond);
}

TEST(GyroModel, TakesTheBiasOutOfAReading) {
  GyroModel<Esg7> gyro;
  gyro.readout_bias = Eigen::Vector3d(3e-5, -5e-5, 8e-5);
  const Eigen::Vector3d h = Eigen::Vector3d(0.3, -0.6, 0.7).normalized();
  const Eigen::Vector3d reading = (h + gyro.readout_bias).normalized();
  EXPECT_LT((gyro.unbiased(reading) - h).norm(), 1e-8);
  EXPECT_EQ(GyroModel<Esg7>().unbiased(reading), reading);
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
  auto setup = nominal<WithAll>();
  setup.clock_offset_sigma_s = 1e-9;
  setup.orbital_error_sigma_rad = 1e-12;
  setup.wandering_sigma_rad_s = 1e-14;
  const auto cycle = flown<WithAll>(flight, setup);
  const auto root = cycle->estimator().error_root();
  Eigen::Matrix<double, 6, 1> error;
  for (int k = 0; k < 2; ++k) {
    error.segment<3>(3 * k) = cycle->estimator().gyros()[k].readout_bias - truth[static_cast<std::size_t>(k)];
  }
  const Eigen::Matrix<double, 6, WithAll::Layout::kStates> of_bias = root.bottomRows<6>();
  const Eigen::Matrix<double, 6, 6> covariance = of_bias * of_bias.transpose();
  EXPECT_LT(error.dot(covariance.llt().solve(error)), 28);        // χ² of 6, once in 10 000
  EXPECT_LT(covariance.diagonal().cwiseSqrt().minCoeff(), 1e-6);  // of 1e-4 before
  const auto solution = cycle->navigation_attitude().value();
  const Eigen::Matrix3d off = flight.C_in_c_at_samples.back().transpose() * solution.C_in_c.raw();
  const Eigen::Vector3d attitude_error = Rot<C, C>::assume(off).log().raw();
  EXPECT_LT(attitude_error.norm(), 4 * std::sqrt(solution.covariance_rad2.trace()));
}

TEST(InvariantEstimator, SeesThroughItsUncertaintyWhatTheWholeRootSays) {
  const test::Flight flight({.duration_s = 300});
  const auto cycle = flown<WithAll>(flight, nominal<WithAll>());
  const auto by_errors = Eigen::Matrix<double, 3, WithAll::Errors::kSize>::Random().eval();
  const auto through = cycle->estimator().through_uncertainty(by_errors);
  const auto by_root = (by_errors * cycle->estimator().error_root()).eval();
  const Eigen::Matrix3d expected = by_root * by_root.transpose();
  EXPECT_LT((through * through.transpose() - expected).norm(), 1e-12 * expected.norm());
}

TEST(InvariantEstimator, FindsTheAlignmentOfAFurtherHead) {
  using TwoHeads = WithAll;
  const test::Flight flight({.duration_s = 1800});
  auto setup = nominal<TwoHeads>();
  setup.clock_offset_sigma_s = 1e-9;
  setup.orbital_error_sigma_rad = 1e-12;
  setup.wandering_sigma_rad_s = 1e-14;
  HeadSetup& head = setup.further_heads[0];
  head.C_c_s = Rot<C, C>::exp(Vec<C>::assume(1.2, 0, 0)).raw();
  head.noise_rad = setup.star_tracker_noise_rad;
  head.alignment_sigma_rad = 3e-4;
  const Eigen::Vector3d misalignment(2e-4, -3e-4, 1e-4);
  auto cycle = std::make_unique<Cycle<TwoHeads>>(Cycle<TwoHeads>::create(setup, {}).value());
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  long used = 0;
  const auto note = [&](const auto& report) { used += report.fix.status == FixStatus::kUsed ? 1 : 0; };
  std::size_t fix = 0;
  for (const auto& sample : flight.samples) {
    note(cycle->on_gyro(sample));
    if (fix < flight.fixes.size() && flight.fixes[fix].t == sample.t) {
      note(cycle->on_fix(flight.fixes[fix]));
      // Both heads look at the same time; C_in_c of the second is by its mounting as designed.
      const Eigen::Vector3d noise_s =
          head.noise_rad.cwiseProduct(Eigen::Vector3d(normal(random), normal(random), normal(random)));
      const Eigen::Vector3d error = misalignment + head.C_c_s * noise_s;
      const Eigen::Matrix3d C_in_c =
          flight.C_in_c_at_samples[static_cast<std::size_t>(&sample - flight.samples.data())];
      note(cycle->on_fix({sample.t, Eigen::Quaterniond(C_in_c * Rot<C, C>::exp(Vec<C>::assume(error)).raw()), 1}));
      ++fix;
    }
  }
  while (true) {
    const auto report = cycle->flush();
    note(report);
    if (report.fix.status == FixStatus::kNone) {
      break;
    }
  }
  EXPECT_EQ(used, 2 * static_cast<long>(flight.fixes.size()) - 1);
  const auto root = cycle->estimator().information().inverse_root();
  for (int axis = 0; axis < 3; ++axis) {
    const int state = TwoHeads::Layout::head(1) + axis;
    const double sigma = root.row(state).norm();
    const double found = cycle->estimator().shared()(state - TwoHeads::Layout::kShared);
    EXPECT_LT(std::abs(found - misalignment(axis)), 4 * sigma);
    EXPECT_LT(sigma, 2 * test::kArcsecond);
  }
}

TEST(InvariantEstimator, OfThreeGyrosIsBetterThanOfTwo) {
  const test::Flight pair({.duration_s = 1800});
  using Three = InvariantEstimator<Esg7, 3>;
  Three::Setup setup;
  const auto two = nominal();
  setup.star_tracker_noise_rad = two.star_tracker_noise_rad;
  for (int k = 0; k < 3; ++k) {
    setup.readout_noise_rad[k] = two.readout_noise_rad[0];
    setup.prior_covariance.block<10, 10>(10 * k, 10 * k) = two.prior_covariance.block<10, 10>(0, 0);
  }
  auto cycle = std::make_unique<Cycle<Three>>(Cycle<Three>::create(setup, {}).value());
  // The third is as the first, half a turn about z further in its case, with noise of its own.
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  std::size_t fix = 0;
  for (const auto& sample : pair.samples) {
    GyroSample<3> three;
    three.t = sample.t;
    three.h_b[0] = sample.h_b[0];
    three.h_b[1] = sample.h_b[1];
    const std::size_t i = static_cast<std::size_t>(&sample - pair.samples.data());
    const Eigen::Vector3d h_in = Eigen::Vector3d(0.1, -0.8, 0.6).normalized();  // a rotor without drift
    three.h_b[2] = pair.C_in_c_at_samples[i].transpose() * h_in +
                   test::Flight::kReadout_rad * Eigen::Vector3d(normal(random), normal(random), normal(random));
    cycle->on_gyro(three);
    for (; fix < pair.fixes.size() && pair.fixes[fix].t == sample.t; ++fix) {
      cycle->on_fix(pair.fixes[fix]);
    }
  }
  const auto error = [&](const auto& solution) {
    return Rot<C, C>::assume(Eigen::Matrix3d(pair.C_in_c_at_samples.back().transpose() * solution.C_in_c.raw())).log();
  };
  const auto three = cycle->navigation_attitude().value();
  EXPECT_LT(error(three).norm(), 4 * std::sqrt(three.covariance_rad2.trace()));
  EXPECT_LT(alignment_error(GyroModel<Esg7>{}, cycle->estimator().gyros()[2]).norm(), 1e-4);
  const auto of_two = flown<Invariant>(pair, nominal())->navigation_attitude().value();
  EXPECT_LT(three.covariance_rad2.trace(), of_two.covariance_rad2.trace());
}

TEST(InvariantEstimator, RefusesSetupsThatCannotWork) {
  auto setup = nominal<WithAll>();
  EXPECT_TRUE(WithAll::create(setup).ok());
  setup.prior_covariance(3, 3) = 0;
  EXPECT_EQ(WithAll::create(setup).fault(), SetupFault::kPriorNotPositiveDefinite);
  setup = nominal<WithAll>();
  setup.readout_noise_rad[0] = 0;
  EXPECT_EQ(WithAll::create(setup).fault(), SetupFault::kNoiseNotPositive);
  setup = nominal<WithAll>();
  setup.gate_nis = 0;
  EXPECT_EQ(WithAll::create(setup).fault(), SetupFault::kGateNotPositive);
  setup = nominal<WithAll>();
  setup.prior[0].C_c_b *= 2;
  EXPECT_EQ(WithAll::create(setup).fault(), SetupFault::kPriorMeanNotUsable);
  setup = nominal<WithAll>();
  setup.prior[1].readout_bias.y() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(WithAll::create(setup).fault(), SetupFault::kPriorMeanNotUsable);
  setup = nominal<WithAll>();
  for (double* further : {&setup.clock_offset_sigma_s, &setup.orbital_error_sigma_rad, &setup.wandering_sigma_rad_s,
                          &setup.wandering_time_s, &setup.readout_bias_sigma}) {
    setup.prior[0].C_c_b.setIdentity();
    const double good = *further;
    for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
      *further = bad;
      EXPECT_EQ(WithAll::create(setup).fault(), SetupFault::kPriorNotPositiveDefinite);
    }
    *further = good;
  }
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
  auto cycle = std::make_unique<Cycle<Invariant>>(Cycle<Invariant>::create(nominal(), {}).value());
  std::vector<FixStatus> statuses;
  test::fly(flight, *cycle, [&](const auto& report) {
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

TEST(InvariantEstimator, RefusesParallelMomenta) {
  auto estimator = Invariant::create(nominal()).value();
  FixReadings<2> readings;
  readings.h_b[0] = readings.h_b[1] = Eigen::Vector3d::UnitX();
  EXPECT_EQ(estimator.correct({}, readings).status, FixStatus::kRejectedGeometry);
  EXPECT_FALSE(estimator.started());
  readings.h_b[1] = Eigen::Vector3d::UnitY();
  EXPECT_EQ(estimator.correct({}, readings).status, FixStatus::kStarted);
  readings.h_b[1] = readings.h_b[0];
  EXPECT_EQ(estimator.correct({Time(std::chrono::seconds(3)), Eigen::Quaterniond::Identity()}, readings).status,
            FixStatus::kRejectedGeometry);
}

TEST(CycleOfInvariant, AttitudeNowIsBetterThanASingleReadingAndHonest) {
  // Corrected at each fix; the samples of the last seconds are taken together.
  double square = 0;
  double normalised = 0;
  constexpr int kRuns = 12;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const test::Flight flight({.duration_s = 3600, .seed = seed});
    const auto cycle = flown<Invariant>(flight, nominal(), {.interval = CorrectionPolicy::kEveryFix});
    const auto solution = cycle->navigation_attitude().value();
    const Eigen::Vector3d error =
        Rot<C, C>::assume(Eigen::Matrix3d(flight.C_in_c_at_samples.back().transpose() * solution.C_in_c.raw()))
            .log()
            .raw();
    square += error.squaredNorm() / (3 * kRuns);
    normalised += error.dot(solution.covariance_rad2.llt().solve(error)) / kRuns;
  }
  EXPECT_LT(std::sqrt(square), 1.8 * test::kArcsecond);  // a single reading: 2″ and what is not yet calibrated
  EXPECT_NEAR(normalised, 3, 3.29 * std::sqrt(6.0 / kRuns));
}

TEST(CycleOfInvariant, TakesFixesLateAndOutOfTurnOnce) {
  const test::Flight flight({.duration_s = 60});
  auto cycle = std::make_unique<Cycle<Invariant>>(Cycle<Invariant>::create(nominal(), {}).value());
  std::vector<std::pair<Time, FixStatus>> dealt;
  const auto note = [&](const auto& report) {
    if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
      dealt.emplace_back(report.fix.t, report.fix.status);
    }
  };
  for (std::size_t i = 0; i < flight.samples.size(); ++i) {
    note(cycle->on_gyro(flight.samples[i]));
    if (i == 8) {  // a second late
      EXPECT_EQ(cycle->on_fix(flight.fixes[0]).fix.status, FixStatus::kPending);
      EXPECT_EQ(cycle->on_fix(flight.fixes[0]).fix.status, FixStatus::kRejectedOutOfOrder);  // repeated
    }
    if (i == 30) {  // the one of 3 s while the one of 0 s is long dealt with
      EXPECT_EQ(cycle->on_fix(flight.fixes[1]).fix.status, FixStatus::kPending);
    }
    if (i == 60) {  // too late: the calibration has passed its time
      EXPECT_EQ(cycle->on_fix(flight.fixes[1]).fix.status, FixStatus::kRejectedOutOfOrder);
    }
  }
  ASSERT_EQ(dealt.size(), 2U);
  EXPECT_EQ(dealt[0], std::pair(flight.fixes[0].t, FixStatus::kStarted));
  EXPECT_EQ(dealt[1], std::pair(flight.fixes[1].t, FixStatus::kUsed));
}

TEST(CycleOfInvariant, RefusesFixesOfUnknownStarTrackersAndMoreThanCanWait) {
  const test::Flight flight({.duration_s = 60});
  auto cycle = std::make_unique<Cycle<Invariant>>(Cycle<Invariant>::create(nominal(), {}).value());
  cycle->on_gyro(flight.samples[0]);
  StarFix fix = flight.fixes[0];
  fix.head = 1;
  EXPECT_EQ(cycle->on_fix(fix).fix.status, FixStatus::kRejectedUnknownHead);
  fix.head = 0;
  for (int i = 0; i < Cycle<Invariant>::kBufferedFixes; ++i) {
    fix.t += std::chrono::milliseconds(1);
    EXPECT_EQ(cycle->on_fix(fix).fix.status, FixStatus::kPending);
  }
  fix.t += std::chrono::milliseconds(1);
  EXPECT_EQ(cycle->on_fix(fix).fix.status, FixStatus::kRejectedBacklog);
  // At the end without a sample after them they cannot be interpolated; none is forgotten.
  for (int i = 0; i < Cycle<Invariant>::kBufferedFixes; ++i) {
    EXPECT_EQ(cycle->flush().fix.status, FixStatus::kRejectedNoGyro);
  }
  EXPECT_EQ(cycle->flush().fix.status, FixStatus::kNone);
}

TEST(CycleOfInvariant, TakesSingleReadingsWhereTheBodyIsNoPolynomial) {
  // The body jerks to and fro by 20″ at 4 Hz: a fit over seconds would miss it by as much.
  test::Flight flight({.duration_s = 300, .noise = 0.5});
  const auto jerked = [](Eigen::Matrix3d& C_in_c, double t_s) {
    C_in_c = C_in_c * Rot<C, C>::exp(Vec<C>::assume(0, 1e-4 * std::cos(8 * std::numbers::pi * t_s + 0.3), 0)).raw();
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
  auto cycle = std::make_unique<Cycle<Invariant>>(Cycle<Invariant>::create(nominal(), {}).value());
  double worst = 0;
  test::fly(flight, *cycle, [&](const auto& report) {
    if (report.calibrated && report.fix.t > Time(std::chrono::seconds(100))) {
      const auto i = static_cast<std::size_t>(to_seconds(report.fix.t.time_since_epoch()) * 8 + 0.5);
      const Eigen::Matrix3d off = flight.C_in_c_at_samples[i].transpose() * report.calibrated->C_in_c.raw();
      worst = std::max(worst, Rot<C, C>::assume(off).log().norm());
    }
  });
  EXPECT_GT(worst, 0);
  EXPECT_LT(worst, 10 * test::kArcsecond);
}

TEST(CycleOfInvariant, KnowsWhatTheBiasThatItHoldsMayDo) {
  // Held: no bias. Nothing else is wrong, so that the error of the attitude is that of the bias, in 20 of its sigmas.
  double sum = 0;
  constexpr int kRuns = 60;
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (int run = 1; run <= kRuns; ++run) {
    test::Flight flight({.duration_s = 60, .seed = static_cast<unsigned>(run)});
    auto setup = nominal<WithAll>();
    setup.clock_offset_sigma_s = 1e-9;
    setup.orbital_error_sigma_rad = 1e-12;
    setup.readout_bias_sigma = 2e-4;
    std::array<Eigen::Vector3d, 2> biases;
    for (auto& b : biases) {
      b = setup.readout_bias_sigma * Eigen::Vector3d::NullaryExpr([&] { return normal(random); });
    }
    bias(flight, biases);
    for (int k = 0; k < 2; ++k) {
      setup.prior[k] = flight.truth[k];
    }
    setup.prior_covariance *= 1e-8;
    const auto solution = flown<WithAll>(flight, setup, {.take_parameters = false})->navigation_attitude().value();
    const Eigen::Vector3d error =
        Rot<C, C>::assume(Eigen::Matrix3d(flight.C_in_c_at_samples.back().transpose() * solution.C_in_c.raw()))
            .log()
            .raw();
    sum += error.dot(solution.covariance_rad2.llt().solve(error));
  }
  EXPECT_NEAR(sum / kRuns, 3, 1);  // 3 ± 0.32
}

TEST(CycleOfInvariant, KnowsHowDriftThatWandersGoesOn) {
  test::Flight flight({.duration_s = 300});
  auto setup = nominal<WithAll>();
  for (int k = 0; k < 2; ++k) {
    setup.prior[k] = flight.truth[k];
  }
  setup.prior_covariance *= 1e-8;
  setup.wandering_sigma_rad_s = 1e-5;
  setup.wandering_time_s = 100;
  // By the first fix alone nothing is known of it: the variance of ∫w dt is 2 σ² τ² (x − 1 + exp(−x)), x = t/τ.
  const auto by_first = flown<WithAll>(flight, setup, {.interval = CorrectionPolicy::kOnlyFirst});
  const auto& gyros = by_first->navigator().gyros();
  const auto by_directions = WithAll::attitude(gyros, flight.samples.back().h_b).value().by_directions;
  const double variance = 2 * 1e-6 * (2 + std::exp(-3));
  EXPECT_NEAR(
      by_first->navigation_attitude().value().covariance_rad2.trace() / (by_directions.squaredNorm() * variance), 1,
      0.1);
  // What was found of it fades.
  flight.fixes.resize(50);
  auto cycle = std::make_unique<Cycle<WithAll>>(
      Cycle<WithAll>::create(setup, {.interval = CorrectionPolicy::kEveryFix}).value());
  std::map<double, double> size;
  test::fly(flight, *cycle, [&](const auto& report) {
    size[to_seconds(report.t.time_since_epoch())] = cycle->navigator().gyros()[0].drift_rad_s.template tail<3>().norm();
  });
  EXPECT_GT(size.at(200), 0);
  EXPECT_NEAR(size.at(300) / size.at(200), std::exp(-1), 1e-9);
}

TEST(CycleOfInvariant, ForgetsDriftThatWandersInALongGap) {
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
  auto setup = nominal<WithAll>();
  setup.wandering_sigma_rad_s = 1e-7;
  setup.wandering_time_s = 0.1;
  const auto cycle = flown<WithAll>(flight, setup, {});
  const Eigen::MatrixXd root = cycle->estimator().error_root();
  EXPECT_TRUE(root.allFinite());
  const int row = WithAll::Errors::drift(0) + Esg7::kSize;
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(root.row(row + i).norm(), 1e-7, 1e-9);
  }
}

TEST(CycleOfInvariant, HoldsTheParametersOfTheSetup) {
  const test::Flight flight({.duration_s = 600});
  auto setup = nominal<WithAll>();
  for (int k = 0; k < 2; ++k) {
    setup.prior[k] = flight.truth[k];
    setup.prior_covariance.block<10, 10>(10 * k, 10 * k) *= 1e-6;
  }
  const auto cycle = flown<WithAll>(flight, setup, {.take_parameters = false});
  const auto solution = cycle->navigation_attitude().value();
  const Eigen::Vector3d error =
      Rot<C, C>::assume(Eigen::Matrix3d(flight.C_in_c_at_samples.back().transpose() * solution.C_in_c.raw()))
          .log()
          .raw();
  EXPECT_LT(error.norm(), 4 * std::sqrt(solution.covariance_rad2.trace()));
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(cycle->navigator().gyros()[k].C_c_b, setup.prior[k].C_c_b);
  }
}

}  // namespace
}  // namespace trihedron
