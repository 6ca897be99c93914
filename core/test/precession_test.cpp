#include "trihedron/core/precession.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "numerical_jacobian.hpp"
#include "trihedron/core/drift.hpp"

namespace trihedron {
namespace {

constexpr int kColumns = Esg7::kSize;
using Gyro = GyroModel<kColumns>;
using Sensitivities = Sensitivity<kColumns>;

/// Eq. (1) alone.
const DriftModel kEq1;

/// A case turned about a skewed axis at orbital rate.
Eigen::Matrix3d attitude_at(double t_s) {
  return (Rot<In, C>::exp(Vec<In>::assume(0.3, -0.2, 0.9)) *
          Rot<C, C>::exp(Vec<C>::assume(1e-4 * t_s, 1.1e-3 * t_s, 2e-4 * t_s)))
      .raw();
}

/// Momentum after `steps` steps in a case that turns as attitude_at, reading its own direction without noise.
Gyro flown(Gyro gyro, double total_s, int steps, Sensitivities* sensitivity = nullptr) {
  const double dt = total_s / steps;
  for (int i = 0; i < steps; ++i) {
    const Eigen::Matrix3d C_in_c = attitude_at((i + 0.5) * dt);
    // The rotor drifts by the true case axes: alignment is part of the model under test.
    const Eigen::Vector3d h_b = gyro.C_c_b.transpose() * C_in_c.transpose() * gyro.h_in;
    if (sensitivity != nullptr) {
      precess(gyro, *sensitivity, kEq1, C_in_c, h_b, {}, dt);
    } else {
      precess(gyro, kEq1, C_in_c, h_b, {}, dt);
    }
  }
  return gyro;
}

TEST(Precession, MatchesTheClosedFormOfOneDissipativeCoefficient) {
  // Case at rest, momentum at (cos a, sin a, 0), only ν12: da/dt = ν12 cos a sin a, so tan a = tan a0 · exp(ν12 t).
  Gyro gyro;
  const double a0 = 0.4;
  const double nu12 = 2e-6;
  gyro.h_in << std::cos(a0), std::sin(a0), 0;
  gyro.drift_rad_s(Esg7::kNu12) = nu12;
  const double total_s = 5e5;
  const int steps = 5000;
  for (int i = 0; i < steps; ++i) {
    // Reading of the middle of the step, by the closed form itself.
    const double middle = std::atan(std::tan(a0) * std::exp(nu12 * (i + 0.5) * total_s / steps));
    precess(gyro, kEq1, Eigen::Matrix3d::Identity(), {std::cos(middle), std::sin(middle), 0}, {}, total_s / steps);
  }
  const double expected = std::atan(std::tan(a0) * std::exp(nu12 * total_s));
  // Midpoint rule: error of order (ν Δt)² / 24 of the whole turn.
  EXPECT_NEAR(std::atan2(gyro.h_in(1), gyro.h_in(0)), expected, 1e-8);
  EXPECT_NEAR(gyro.h_in.norm(), 1, 1e-15);
}

TEST(Precession, IsExactForConstantAngularVelocity) {
  // The common mode of ν is a constant vector only at one h_b; hold the reading, and the momentum turns about it
  // uniformly.
  Gyro gyro;
  gyro.h_in = Eigen::Vector3d(0.2, 0.9, -0.1).normalized();
  gyro.drift_rad_s << 0, 0, 0, 0, 1e-6, 1e-6, 1e-6;
  const Eigen::Vector3d h_b = Eigen::Vector3d(0.6, 0.5, 0.4).normalized();
  const Eigen::Vector3d omega = Esg7::rate<double>(h_b, gyro.drift_rad_s);
  const Eigen::Vector3d expected = Rot<In, In>::exp(Vec<In>::assume(omega * 1e5)).raw() * gyro.h_in;
  for (int i = 0; i < 10; ++i) {
    precess(gyro, kEq1, Eigen::Matrix3d::Identity(), h_b, {}, 1e4);
  }
  EXPECT_LT((gyro.h_in - expected).norm(), 1e-15);
}

TEST(Precession, SensitivitiesMatchCentralDifferences) {
  Gyro gyro;
  gyro.h_in = Eigen::Vector3d(0.5, 0.6, 0.62).normalized();
  gyro.drift_rad_s << -2e-6, -4e-7, -5e-8, -1.2e-6, 1.8e-6, 7e-7, -8e-7;
  gyro.C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(2e-3, -4e-3, -7e-3)).raw();
  constexpr double kTotal_s = 3000;
  constexpr int kSteps = 24000;

  // Readings are what was telemetered: they do not move with the model's errors.
  std::vector<Eigen::Matrix3d> attitudes;
  std::vector<Eigen::Vector3d> readings;
  {
    Gyro g = gyro;
    for (int i = 0; i < kSteps; ++i) {
      const Eigen::Matrix3d C_in_c = attitudes.emplace_back(attitude_at((i + 0.5) * kTotal_s / kSteps));
      readings.emplace_back(g.C_c_b.transpose() * C_in_c.transpose() * g.h_in);
      precess(g, kEq1, C_in_c, readings.back(), {}, kTotal_s / kSteps);
    }
  }
  const auto replay = [&](Gyro g, Sensitivities* s) {
    for (std::size_t i = 0; i < readings.size(); ++i) {
      if (s != nullptr) {
        precess(g, *s, kEq1, attitudes[i], readings[i], {}, kTotal_s / kSteps);
      } else {
        precess(g, kEq1, attitudes[i], readings[i], {}, kTotal_s / kSteps);
      }
    }
    return g.h_in;
  };
  Sensitivities s;
  const Eigen::Vector3d h_end = replay(gyro, &s);
  EXPECT_LT((replay(gyro, nullptr) - h_end).norm(), 1e-15);  // both forms predict the same

  // Δh = φ × h compares what can be seen of φ.
  const Eigen::Matrix3d seen = -skew<double>(h_end);
  const auto by_start = [&](const Eigen::Vector3d& phi) {
    Gyro g = gyro;
    g.h_in = rotated<double>(g.h_in, phi);
    return replay(g, nullptr);
  };
  test::expect_jacobian(seen * s.by_start, test::central_differences(by_start, Eigen::Vector3d(0, 0, 0), 1e-4), 1e-7);
  const Esg7::Coefficients<double> kappa0 = gyro.drift_rad_s;
  const auto by_drift = [&](const Esg7::Coefficients<double>& kappa) {
    Gyro g = gyro;
    g.drift_rad_s = kappa;
    return replay(g, nullptr);
  };
  test::expect_jacobian(seen * s.by_drift.first(kColumns), test::central_differences(by_drift, kappa0, 1e-7), 1e-5);
  const auto by_alignment = [&](const Eigen::Vector3d& delta) {
    Gyro g = gyro;
    g.C_c_b = Rot<C, C>::exp(Vec<C>::assume(delta)).raw() * g.C_c_b;
    return replay(g, nullptr);
  };
  test::expect_jacobian(seen * s.by_alignment, test::central_differences(by_alignment, Eigen::Vector3d(0, 0, 0), 1e-4),
                        1e-5);
}

TEST(Sensitivity, OfTwoStretchesIsTheirChain) {
  Gyro gyro;
  gyro.h_in = Eigen::Vector3d(0.5, 0.6, 0.62).normalized();
  gyro.drift_rad_s << -2e-6, -4e-7, -5e-8, -1.2e-6, 1.8e-6, 7e-7, -8e-7;
  Sensitivities whole;
  flown(gyro, 600, 4800, &whole);
  // The same flight cut in two needs the second half to start where the first ended, in time too.
  Sensitivities first;
  Sensitivities second;
  Gyro g = gyro;
  for (int i = 0; i < 4800; ++i) {
    const Eigen::Matrix3d C_in_c = attitude_at((i + 0.5) * 0.125);
    const Eigen::Vector3d h_b = C_in_c.transpose() * g.h_in;
    precess(g, i < 2000 ? first : second, kEq1, C_in_c, h_b, {}, 0.125);
  }
  Sensitivities chained = first;
  chained.append(second, kColumns);
  EXPECT_LT((chained.by_start - whole.by_start).norm(), 1e-13);
  EXPECT_LT((chained.by_drift.first(kColumns) - whole.by_drift.first(kColumns)).norm(),
            1e-12 * whole.by_drift.first(kColumns).norm());
  EXPECT_LT((chained.by_alignment - whole.by_alignment).norm(), 1e-10 * whole.by_alignment.norm());
}

/// The same bits, but where sanitizers have Eigen add in another order (CMakeLists.txt): there to rounding.
template <class Matrix>
void expect_same_bits(const Matrix& a, const Matrix& b) {
#ifdef EIGEN_UNROLLING_LIMIT
  EXPECT_LT((a - b).norm(), 1e-13 * (1 + b.norm()));
#else
  EXPECT_EQ(a, b);
#endif
}

/// A reading that turns, bias and alignment, and a drift by which a momentum turns by up to half a radian in a step.
TEST(PrecessTwo, GivesTheBitsOfEachGyroAlone) {
  constexpr int kCount = 3;  // two side by side, and one alone
  for (const double times : {1.0, 5e3}) {
    PerGyro<Gyro> together;
    for (int k = 0; k < kCount; ++k) {
      Gyro& gyro = together[k];
      gyro.h_in = Eigen::Vector3d(0.5, 0.6 - k, 0.62).normalized();
      gyro.drift_rad_s << -2e-6, -4e-7, -5e-8, -1.2e-6 * k, 1.8e-6, 7e-7, -8e-7;
      gyro.drift_rad_s *= times;
      gyro.C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(2e-3, -4e-3 * k, -7e-3)).raw();
      gyro.readout_bias << 1e-4, -2e-4 * k, 3e-5;
    }
    PerGyro<Gyro> alone = together;
    PerGyro<Gyro> navigated = together;
    PerGyro<Gyro> navigated_alone = together;
    PerGyro<Gyro> by_rates = together;  // has no coefficients of its own
    PerGyro<Sensitivities> since;
    PerGyro<Sensitivities> since_alone;
    PerGyro<Sensitivities> since_by_rates;
    for (Gyro& gyro : by_rates) {
      gyro.drift_rad_s.setZero();
    }
    const auto no_times = [] { return DriftTimes{}; };
    for (int i = 0; i < 50; ++i) {
      const Eigen::Matrix3d C_in_c = attitude_at(i);
      Directions h_b;
      for (int k = 0; k < kCount; ++k) {
        h_b[k] = C_in_c.transpose() * together[k].h_in;
      }
      const double dt_s = i % 2 == 0 ? 0.125 : 0.1;
      precess_two({together[0], h_b[0]}, {together[1], h_b[1]}, SensitivityOfEq1(since[0]), SensitivityOfEq1(since[1]),
                  C_in_c, dt_s * times);
      precess(together[2], since[2], kEq1, C_in_c, h_b[2], {}, dt_s * times);
      precess_all(navigated, kCount, kEq1, C_in_c, h_b, no_times, dt_s * times);
      Eigen::Vector3d rates[2];
      for (int k = 0; k < 2; ++k) {
        Columns<kColumns> columns;
        kEq1.basis(alone[k].corrected(h_b[k]), {}, columns.view(kColumns));
        rates[k] = columns.view(kColumns).times(alone[k].drift_rad_s.data());
      }
      precess_two({by_rates[0], h_b[0]}, {by_rates[1], h_b[1]}, SensitivityOfEq1(since_by_rates[0]),
                  SensitivityOfEq1(since_by_rates[1]), C_in_c, dt_s * times, rates[0], rates[1]);
      for (int k = 0; k < kCount; ++k) {
        precess(alone[k], since_alone[k], kEq1, C_in_c, h_b[k], {}, dt_s * times);
        precess(navigated_alone[k], kEq1, C_in_c, h_b[k], {}, dt_s * times);
      }
    }
    for (int k = 0; k < kCount; ++k) {
      expect_same_bits(together[k].h_in, alone[k].h_in);
      expect_same_bits(navigated[k].h_in, navigated_alone[k].h_in);
      expect_same_bits(since[k].by_start, since_alone[k].by_start);
      expect_same_bits(since[k].by_alignment, since_alone[k].by_alignment);
      expect_same_bits(since[k].by_drift.first(kColumns).eval(), since_alone[k].by_drift.first(kColumns).eval());
    }
    for (int k = 0; k < 2; ++k) {
      expect_same_bits(by_rates[k].h_in, alone[k].h_in);
      expect_same_bits(since_by_rates[k].by_start, since_alone[k].by_start);
      expect_same_bits(since_by_rates[k].by_alignment, since_alone[k].by_alignment);
      expect_same_bits(since_by_rates[k].by_drift.first(kColumns).eval(),
                       since_alone[k].by_drift.first(kColumns).eval());
    }
  }
}

/// Gyros as they precess on board, beside the same ones step by step.
struct BesideStepByStep {
  static constexpr int kCount = 3;  // two side by side, and one alone
  PerGyro<Gyro> gyros;
  SensitivitiesOfAll<kColumns, kMaxGyros> since;
  PerGyro<Gyro> alone;
  PerGyro<Sensitivities> since_alone;

  explicit BesideStepByStep(double drift) {
    for (int k = 0; k < kCount; ++k) {
      gyros[k].h_in = Eigen::Vector3d(0.5, 0.6 - k, 0.62).normalized();
      gyros[k].drift_rad_s << -2e-6, -4e-7, -5e-8, -1.2e-6 * k, 1.8e-6, 7e-7, -8e-7;
      gyros[k].drift_rad_s *= drift;
      gyros[k].C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(2e-3, -4e-3 * k, -7e-3)).raw();
    }
    alone = gyros;
    since.begin(kColumns);
  }
  /// A step in which the body has turned by `turned` of the usual.
  void step(double turned, double dt_s) {
    const Eigen::Matrix3d C_in_c = attitude_at(turned);
    Directions h_b;
    for (int k = 0; k < kCount; ++k) {
      h_b[k] = C_in_c.transpose() * alone[k].h_in;
      precess(alone[k], since_alone[k], kEq1, C_in_c, h_b[k], {}, dt_s);
    }
    since.precess_all(
        gyros, kCount, kEq1, C_in_c, h_b, [] { return DriftTimes{}; }, dt_s);
  }
  /// How far the sensitivities are from those step by step, at most, each as a part of itself.
  [[nodiscard]] double farthest() const {
    const auto now = since.at_present();
    double most = 0;
    for (int k = 0; k < kCount; ++k) {
      const Sensitivities& a = since_alone[k];
      for (const double off :
           {(now[k].by_start - a.by_start).norm() / (a.by_start - Eigen::Matrix3d::Identity()).norm(),
            (now[k].by_alignment - a.by_alignment).norm() / a.by_alignment.norm(),
            (now[k].by_drift.first(kColumns) - a.by_drift.first(kColumns)).norm() /
                a.by_drift.first(kColumns).norm()}) {
        most = off <= most ? most : off;  // also what is no number
      }
    }
    return most;
  }
};

TEST(SensitivitiesOfAll, AgreeWithThoseStepByStep) {
  BesideStepByStep its(1);
  for (int i = 0; i < 1000; ++i) {
    its.step(0.05 * i, i % 3 == 0 ? 0.1 : 0.125);
    ASSERT_LT(its.farthest(), 1e-7) << i;
  }
  for (int k = 0; k < BesideStepByStep::kCount; ++k) {
    EXPECT_LT((its.gyros[k].h_in - its.alone[k].h_in).norm(), 1e-14) << k;
  }
}

TEST(SensitivitiesOfAll, AgreeWhereTheyAreSettledAtAnyTime) {
  BesideStepByStep its(1);
  for (int i = 0; i < 300; ++i) {
    its.step(0.05 * i, 0.125);
    if (i % 7 == 0 || i % 11 == 0) {
      its.since.settle();
    }
  }
  EXPECT_LT(its.farthest(), 1e-7);
}

TEST(SensitivitiesOfAll, TakeLongStepsAndLargeDriftOneByOne) {
  BesideStepByStep fast(5e3);
  for (int i = 0; i < 50; ++i) {
    fast.step(i, 1);
  }
  EXPECT_LT(fast.farthest(), 1e-15);
  // An hour between short steps: what was summed before it must turn with it.
  BesideStepByStep its(1);
  for (int i = 0; i < 30; ++i) {
    its.step(0.1 * i, i % 10 == 5 ? 3600 : 0.125);
  }
  EXPECT_LT(its.farthest(), 1e-7);
}

TEST(SensitivitiesOfAll, AreOffByHalfOfTheTurnAtMostWhereOneStepIsMuchLonger) {
  for (const double long_s : {0.5, 1.0, 2.0, 5.0}) {
    BesideStepByStep its(1);
    for (int i = 0; i < 8; ++i) {
      its.step(0.1 * i, i == 5 ? long_s : 0.125);
      ASSERT_LT(its.farthest(), 0.5 * StepsOfTwo::kMostTurn_rad) << long_s << ' ' << i;
    }
  }
}

TEST(LongStep, MissesTheDriftTimesTheTurnThatMayHaveBeen) {
  const Eigen::Vector3d from = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d to(std::cos(0.4), std::sin(0.4), 0);
  EXPECT_NEAR(missed_by_long_step_rad(1e-3, from, to, 60), 4e-4, 1e-15);
  EXPECT_EQ(missed_by_long_step_rad(1e-3, from, from, 60), 0);
  // In longer than a quarter of an orbit the body may have turned right round.
  EXPECT_EQ(missed_by_long_step_rad(1e-3, from, from, 0.99 * kQuarterOrbit_s), 0);
  EXPECT_NEAR(missed_by_long_step_rad(1e-3, from, from, 1.01 * kQuarterOrbit_s), 1e-3 * std::numbers::pi, 1e-15);
}

TEST(CourseOfChange, IsTheWholeOverItsTime) {
  const Time begin{from_seconds(1000)};
  const auto at = [&](double s) { return begin + from_seconds(s); };
  for (const auto kind : {CourseOfChange::Kind::kEven, CourseOfChange::Kind::kWarmUp, CourseOfChange::Kind::kJump}) {
    CourseOfChange course{.kind = kind, .begin = begin, .duration_s = 3000, .time_s = 700, .zero_at = begin};
    EXPECT_EQ(course.part(begin), 0);
    EXPECT_NEAR(course.part(at(3000)), 1, 1e-14);
    course.zero_at = at(3000);
    EXPECT_NEAR(course.part(begin), -1, 1e-14);
    EXPECT_NEAR(course.mean_part(at(100), at(104)), course.part(at(102)), 1e-14);
  }
}

TEST(CourseOfChange, OfAWarmUpDecays) {
  const CourseOfChange course{.kind = CourseOfChange::Kind::kWarmUp, .duration_s = 3000, .time_s = 700};
  const auto left = [&](double s) { return course.part(Time(from_seconds(1e6))) - course.part(Time(from_seconds(s))); };
  EXPECT_NEAR(left(700) / left(0), std::exp(-1.0), 1e-14);
  EXPECT_NEAR(left(2100) / left(700), std::exp(-2.0), 1e-13);
  EXPECT_EQ(course.part(Time(from_seconds(-1e9))), 0);  // before it, nothing has changed
}

TEST(CourseOfChange, OfAJumpIsAllAtOnce) {
  const CourseOfChange course{.kind = CourseOfChange::Kind::kJump, .time_s = 700};
  EXPECT_EQ(course.part(Time(from_seconds(699.9))), 0);
  EXPECT_EQ(course.part(Time(from_seconds(700))), 1);
  EXPECT_NEAR(course.mean_part(Time(from_seconds(699)), Time(from_seconds(703))), 0.75, 1e-14);
}

TEST(Polhode, TurnsByTheIntegralOverItsPeriod) {
  for (const float rate : {0.0F, 0.02F, -0.02F, 1e-9F}) {
    const Polhode polhode{7200, rate};
    for (const double end_s : {-9000.0, 0.0, 700.0, 32400.0, 150000.0}) {
      constexpr int kPieces = 1000;
      double turned = 0;
      for (int i = 0; i < kPieces; ++i) {
        const double at_s = (i + 0.5) * end_s / kPieces;
        const double period_s = 7200 + static_cast<double>(rate) * at_s;
        turned += 2 * std::numbers::pi * end_s / kPieces / period_s;
      }
      EXPECT_NEAR(polhode.angle_rad(end_s), turned, 2e-6 * std::abs(turned)) << rate << " " << end_s;
      // From another time on, the period as it is then.
      const double more = polhode.angle_rad(end_s + 5000) - polhode.angle_rad(end_s);
      EXPECT_NEAR(polhode.after(end_s).angle_rad(5000), more, 1e-6) << rate << " " << end_s;
    }
  }
}

TEST(Polhode, ItsPeriodStaysBetweenHalfAndTwiceWhatItWas) {
  for (const double times : {0.5, 2.0}) {
    const double rate = times > 1 ? 0.1 : -0.05;
    const Polhode polhode{7200, static_cast<float>(rate)};
    const double reached_s = 7200 * (times - 1) / rate;
    const double from = polhode.angle_rad(reached_s);
    EXPECT_NEAR(from, 2 * std::numbers::pi * std::log(times) / rate, 1e-5);
    EXPECT_NEAR(polhode.angle_rad(reached_s + 7200 * times) - from, 2 * std::numbers::pi, 1e-9);
    EXPECT_NEAR(polhode.angle_rad(reached_s + 7200000 * times) - from, 2000 * std::numbers::pi, 1e-6);
  }
}

/// dw = −w/T dt + dn: a value decays exponentially, and the noise of density 2σ²/T that comes meanwhile is that decayed
/// too, here summed up over a thousand small pieces.
TEST(GaussMarkov, IsTheSolutionOfItsDifferentialEquation) {
  const GaussMarkov process{.sigma = 3, .time_s = 700};
  for (const double dt_s : {1.0, 30.0, 700.0, 4000.0}) {
    const double kept = process.kept(dt_s);
    EXPECT_NEAR(kept, std::exp(-dt_s / process.time_s), 1e-14);
    constexpr int kPieces = 1000;
    double variance = 0;
    for (int i = 0; i < kPieces; ++i) {
      const double age_s = (i + 0.5) * dt_s / kPieces;
      variance += 2 * 9 / 700.0 * std::exp(-2 * age_s / 700) * dt_s / kPieces;
    }
    EXPECT_NEAR(process.noise(kept) * process.noise(kept), variance, 1e-4 * variance) << dt_s;
  }
  EXPECT_EQ(process.kept(1e9), 1e-6);
  EXPECT_EQ(process.noise(1), 0);
}

}  // namespace
}  // namespace trihedron
