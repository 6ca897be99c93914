#include "trihedron/core/intake.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "trihedron/core/fix_queue.hpp"
#include "trihedron/core/schedule.hpp"

namespace trihedron {
namespace {

Time second(double t_s) { return Time(from_seconds(t_s)); }

CalibrationSetup intake_setup(int gyros = 2, int star_trackers = 1) {
  CalibrationSetup setup;
  setup.layout.gyros = gyros;
  setup.layout.star_trackers = star_trackers;
  return setup;
}

/// Readings that differ from sample to sample as live ones do.
GyroSample live_sample(double t_s) {
  GyroSample sample;
  sample.t = second(t_s);
  for (int k = 0; k < kMaxGyros; ++k) {
    sample.h_b[k] = Eigen::Vector3d(1, 1e-5 * t_s, 0.1 * k).normalized();
  }
  return sample;
}

using Clock = Intake<>::Clock;

TEST(IntakeClock, RunsOnWithSamplesThatComeLater) {
  Intake intake(intake_setup());
  EXPECT_EQ(intake.look_at_clock(second(5), std::nullopt), Clock::kRunsOn);
  EXPECT_EQ(intake.look_at_clock(second(5.125), second(5)), Clock::kRunsOn);
  EXPECT_EQ(intake.look_at_clock(second(3605), second(5)), Clock::kRunsOn);  // an hour without any
  EXPECT_EQ(intake.look_at_clock(second(5), second(5)), Clock::kOutOfOrder);
  EXPECT_EQ(intake.look_at_clock(second(4), second(5)), Clock::kOutOfOrder);
}

TEST(IntakeClock, BelievesALeapOnlyWhenTheNextSampleConfirmsIt) {
  Intake intake(intake_setup());
  EXPECT_EQ(intake.look_at_clock(second(1e5), second(0)), Clock::kOutOfOrder);
  EXPECT_EQ(intake.look_at_clock(second(2e5), second(0)), Clock::kOutOfOrder);  // another wild one
  EXPECT_EQ(intake.look_at_clock(second(2e5 + 0.1), second(0)), Clock::kRunsOn);
  // One that is good in between takes the suspicion away.
  EXPECT_EQ(intake.look_at_clock(second(1e5), second(0)), Clock::kOutOfOrder);
  EXPECT_EQ(intake.look_at_clock(second(0.1), second(0)), Clock::kRunsOn);
  EXPECT_EQ(intake.look_at_clock(second(1e5 + 0.1), second(0)), Clock::kOutOfOrder);
  // Nor does a wild one confirm another that comes after it in time.
  EXPECT_EQ(intake.look_at_clock(second(2e5), second(0)), Clock::kOutOfOrder);
  EXPECT_EQ(intake.look_at_clock(second(2e5 - 0.1), second(0)), Clock::kOutOfOrder);
  EXPECT_EQ(intake.look_at_clock(second(2e5), second(0)), Clock::kRunsOn);
}

TEST(IntakeClock, IsSetBackBySixteenSamplesThatRunWell) {
  Intake intake(intake_setup());
  const auto behind = [&](double t_s) { return intake.look_at_clock(second(t_s), second(1000)); };
  for (int i = 1; i < Intake<>::kSetBackSamples; ++i) {
    EXPECT_EQ(behind(0.125 * i), Clock::kOutOfOrder) << i;
  }
  EXPECT_EQ(behind(2), Clock::kSetBack);
  // A time from which no difference can be told is none.
  for (const Time t : {Time::min(), Time::max(), Time(kMaxTime + Duration(1))}) {
    EXPECT_EQ(intake.look_at_clock(t, std::nullopt), Clock::kOutOfOrder);
    EXPECT_EQ(intake.look_at_clock(t, second(1000)), Clock::kOutOfOrder);
  }
  // With a gap, or backwards among themselves, they are counted anew.
  for (int i = 0; i < 30; ++i) {
    EXPECT_EQ(behind(10.0 + i), Clock::kOutOfOrder);
    EXPECT_EQ(behind(90.0 - i), Clock::kOutOfOrder);
  }
}

/// However the clock is set, times stay such as differences can be told of.
TEST(Shifted, StaysWithinTheTimesThatAreAccepted) {
  EXPECT_EQ(shifted(second(5), std::chrono::seconds(-8)), second(-3));
  for (const Duration shift : {2 * kMaxTime, kMaxTime, -kMaxTime, -2 * kMaxTime}) {
    const Time end(shift > Duration::zero() ? kMaxTime : -kMaxTime);
    EXPECT_EQ(shifted(end, shift), end);
    EXPECT_EQ(shifted(second(0), shift), end);
  }
  EXPECT_EQ(shifted(Time(kMaxTime), -2 * kMaxTime), Time(-kMaxTime));
}

TEST(Intake, MakesReadingsUnitAndRejectsWhatIsNoDirection) {
  Intake intake(intake_setup());
  GyroSample sample = live_sample(0);
  sample.h_b[0] *= 1 + 0.9 * kNormTolerance;
  EXPECT_EQ(intake.screen(sample), SampleStatus::kUsed);
  EXPECT_NEAR(sample.h_b[0].norm(), 1, 1e-15);
  int i = 1;
  for (const double bad :
       {0.0, 1.01, 0.99, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    sample = live_sample(i++);
    sample.h_b[1] *= bad;
    EXPECT_EQ(intake.screen(sample), SampleStatus::kRejectedNotDirection) << bad;
  }
  // Of a gyro that there is not nothing is asked.
  sample = live_sample(i);
  sample.h_b[2].setZero();
  EXPECT_EQ(intake.screen(sample), SampleStatus::kUsed);
}

TEST(Intake, PutsSomethingFiniteWhereAGyroIsNotUsed) {
  Intake intake(intake_setup(3));
  for (int i = 0; i < 20; ++i) {
    GyroSample sample = live_sample(0.125 * i);
    sample.h_b[2].setConstant(std::numeric_limits<double>::quiet_NaN());
    const SampleStatus status = intake.screen(sample);
    EXPECT_EQ(status, i < 15 ? SampleStatus::kRejectedNotDirection : SampleStatus::kUsed) << i;
    EXPECT_TRUE(i < 15 || sample.h_b[2].allFinite());
  }
  EXPECT_EQ(intake.health().states()[2], GyroState::kStuck);
}

TEST(Intake, RejectsSamplesAndFixesOfTooFewGyros) {
  Intake intake(intake_setup());
  for (int i = 0; i < 20; ++i) {
    GyroSample sample = live_sample(0.125 * i);
    sample.h_b[0] = Eigen::Vector3d::UnitX();
    EXPECT_EQ(intake.screen(sample), i < 15 ? SampleStatus::kUsed : SampleStatus::kRejectedTooFewGyros) << i;
  }
  const StarFix fix{second(2.4), Eigen::Quaterniond::Identity()};
  EXPECT_EQ(intake.look_at(fix, second(2.375), Time::min()), FixStatus::kRejectedTooFewGyros);
}

/// Samples from `from_s` up to `to_s`, in which gyro 1 reads the same all the time if `sticks`.
void look_on(GyroHealth<>& health, double from_s, double to_s, double period_s, bool sticks) {
  for (int i = 0; from_s + i * period_s < to_s; ++i) {
    GyroSample sample = live_sample(from_s + i * period_s);
    if (sticks) {
      sample.h_b[1] = Eigen::Vector3d::UnitY();
    }
    health.look_at(sample);
  }
}

TEST(GyroHealth, IsStuckOnlyAfterASecondHoweverManySamplesThereAre) {
  GyroHealth health(2);
  look_on(health, 0, 0.995, 0.02, true);  // fifty samples
  EXPECT_EQ(health.states()[1], GyroState::kUsed);
  look_on(health, 1, 1.005, 0.02, true);
  EXPECT_EQ(health.states()[1], GyroState::kStuck);
  EXPECT_EQ(health.states()[0], GyroState::kUsed);
}

/// Readings of one gyro at 8 Hz: turning by `rate` rad/s until it stands at `stops_s`; noise in arcseconds, rounded to
/// `resolution`. Calls `look` after each.
template <class Look>
void turning(double rate_rad_s, double stops_s, double resolution, double until_s, Look&& look) {
  constexpr double kNoise_rad = 1e-5;
  GyroHealth health(2);
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, kNoise_rad);
  GyroSample sample;
  for (double t_s = 0; t_s < until_s; t_s += 0.125) {
    sample.t = second(t_s);
    const double angle = rate_rad_s * t_s;
    const Eigen::Vector3d turned(std::cos(angle), std::sin(angle), 0);
    const auto reading = [&](const Eigen::Vector3d& h) {
      Eigen::Vector3d seen = h;
      for (double& x : seen) {
        x = std::round((x + noise(random)) / resolution) * resolution;
      }
      return seen;
    };
    sample.h_b[0] = reading(Eigen::Vector3d::UnitZ());
    sample.h_b[1] = t_s < stops_s ? reading(turned) : sample.h_b[1];
    health.look_at(sample);
    look(t_s, health);
  }
}

/// An orbit of 95 minutes turns by 28″ between two samples: a reading that repeats itself twice is stuck. Rounding
/// alone makes readings repeat themselves, too, moving or not.
TEST(GyroHealth, IsStuckAtOnceWhenAReadingThatMovedStops) {
  constexpr double kOrbital_rad_s = 1.1e-3;
  constexpr double kNever_s = 1e9;
  turning(kOrbital_rad_s, 60, 1e-12, 61, [](double t_s, const GyroHealth<>& health) {
    EXPECT_EQ(health.states()[0], GyroState::kUsed);
    EXPECT_EQ(health.states()[1], t_s >= 60.125 ? GyroState::kStuck
                                  : t_s < 60    ? GyroState::kUsed
                                                : health.states()[1])
        << t_s;
  });
  for (const double resolution : {1e-5, 1e-4, 1e-3}) {
    turning(kOrbital_rad_s, kNever_s, resolution, 600, [&](double t_s, const GyroHealth<>& health) {
      EXPECT_EQ(health.states()[1], GyroState::kUsed) << t_s << " s, rounded to " << resolution;
    });
  }
}

TEST(GyroHealth, TakesStuckStretchesTogetherThatAreNearEachOther) {
  for (const double lives_s : {5.0, 20.0}) {
    GyroHealth health(2);
    look_on(health, 0, 5, 0.125, true);
    look_on(health, 5, 5 + lives_s, 0.125, false);
    look_on(health, 5 + lives_s, 10 + lives_s, 0.125, true);
    const Time between = second(5 + lives_s / 2);
    EXPECT_EQ(health.usable(between, between)[1], lives_s > 10) << lives_s;
    EXPECT_FALSE(health.usable(second(6 + lives_s), second(7 + lives_s))[1]);
  }
}

/// Readings of gyro 1 at 8 Hz, noise of 1e-5, rounded to `resolution` and then to nine decimals, of a body that
/// from `rests_s` on turns once in an orbit about `axis`; one component repeats itself from `sticks_s` to `lives_s`.
template <class Look>
void turning_about(const Eigen::Vector3d& axis, double rests_s, double resolution, int component, double sticks_s,
                   double lives_s, double until_s, Look&& look) {
  constexpr double kOrbital_rad_s = 1.1e-3;
  PerGyro<double> noise_rad;
  noise_rad[0] = noise_rad[1] = 1e-5;
  GyroHealth<> health(2, noise_rad);
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 1e-5);
  double held = 0;
  for (int i = 0; 0.125 * i < until_s; ++i) {
    const double t_s = 0.125 * i;
    GyroSample sample = live_sample(t_s);
    const double angle = kOrbital_rad_s * std::max(t_s - rests_s, 0.0);
    sample.h_b[1] = rotated<double>(Eigen::Vector3d(0.48, 0.6, 0.64), Eigen::Vector3d(-angle * axis));
    for (double& x : sample.h_b[1]) {
      x = std::round(std::round((x + noise(random)) / resolution) * resolution * 1e9) / 1e9;
    }
    double& its = sample.h_b[1](component);
    held = t_s <= sticks_s ? its : held;
    its = t_s > sticks_s && t_s < lives_s ? held : its;
    health.look_at(sample);
    look(t_s, health.states()[1], health);
  }
}

TEST(GyroHealth, IsStuckWhenASingleComponentIs) {
  for (int component = 0; component < 3; ++component) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit((component + 1) % 3);
    const auto expect_stuck = [&](double t_s, GyroState state, const GyroHealth<>& health) {
      const bool is_stuck = t_s > 60 && t_s < 120;
      if (t_s <= 60 || t_s >= 60.75) {
        EXPECT_EQ(state, is_stuck ? GyroState::kStuck : GyroState::kUsed) << t_s << " s, component " << component;
      }
      if (t_s == 61) {  // known since, whatever was said before
        EXPECT_FALSE(health.usable(second(60), second(60))[1]);
        EXPECT_TRUE(health.usable(second(59.875), second(59.875))[1]);
      }
    };
    turning_about(axis, 30, 1e-9, component, 60, 120, 180, expect_stuck);
  }
}

TEST(GyroHealth, ToldOfASingleComponentOnlyWhereItMatters) {
  // It sticks on a body at rest, and is wrong from when that turns.
  turning_about(Eigen::Vector3d::UnitY(), 60, 1e-9, 0, 30, 1e9, 120,
                [](double t_s, GyroState state, const GyroHealth<>&) {
                  if (t_s <= 31 || t_s >= 61) {
                    EXPECT_EQ(state, t_s >= 61 ? GyroState::kStuck : GyroState::kUsed) << t_s;
                  }
                });
}

/// That of a body that turns about its axis keeps its value but for noise, and rounding may hide that; so it may where
/// the component is at its largest.
TEST(GyroHealth, IsNotStuckWhereAComponentMayStandStill) {
  for (int component = 0; component < 3; ++component) {
    for (const double resolution : {1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3}) {
      turning_about(Eigen::Vector3d::Unit(component), 0, resolution, component, 1e9, 1e9, 300,
                    [&](double t_s, GyroState state, const GyroHealth<>&) {
                      EXPECT_EQ(state, GyroState::kUsed) << t_s << " s, rounded to " << resolution;
                    });
      turning_about(Eigen::Vector3d(0.6, 0, -0.8), 0, resolution, component, 1e9, 1e9, 1500,
                    [&](double t_s, GyroState state, const GyroHealth<>&) {
                      EXPECT_EQ(state, GyroState::kUsed) << t_s << " s, rounded to " << resolution;
                    });
    }
  }
}

/// Readings of gyro 1 at 8 Hz, turned by an angle about z from some sample to another.
template <class Look>
void leaping(double angle_rad, int from, int to, int until, Look&& look) {
  GyroHealth<> health(2);
  for (int i = 0; i < until; ++i) {
    GyroSample sample = live_sample(0.125 * i);
    const double turn = 0.125 * i * 1.1e-3 + (i >= from && i < to ? angle_rad : 0);
    sample.h_b[1] = rotated<double>(sample.h_b[1], Eigen::Vector3d(0, 0, turn));
    health.look_at(sample);
    look(i, health);
  }
}

TEST(GyroHealth, HasLeaptWhenNoBodyTurnsSoFar) {
  const int end = 8 * 60 * 10;
  for (const double angle_rad : {0.2, 1.5, 3.0}) {
    leaping(angle_rad, 100, end, end + 100, [&](int i, const GyroHealth<>& health) {
      EXPECT_EQ(health.states()[1], i > 100 && i < end ? GyroState::kLeapt : GyroState::kUsed) << i;
      EXPECT_EQ(health.states()[0], GyroState::kUsed);
      if (i == 101) {  // the first one is known by the second
        EXPECT_FALSE(health.usable(second(12.5), second(12.5))[1]);
        EXPECT_TRUE(health.usable(second(12.375), second(12.375))[1]);
      }
    });
  }
}

TEST(GyroHealth, HasNotLeaptWhereABodyMayHaveTurned) {
  const auto expect_used = [](int i, const GyroHealth<>& health) {
    EXPECT_EQ(health.states()[1], GyroState::kUsed) << i;
  };
  leaping(0.06, 100, 200, 300, expect_used);                           // half a radian in a second
  leaping(3.0, 100, 101, 300, expect_used);                            // a single one is left to others
  leaping(3.0, 0, 1, 300, expect_used);                                // the first of all is off
  leaping(3.0, 5, 1000, 2000, [](int i, const GyroHealth<>& health) {  // hardly begun: any may be the right ones
    EXPECT_EQ(health.states()[1], i > 1000 ? GyroState::kLeapt : GyroState::kUsed) << i;
  });
}

TEST(GyroHealth, OfReadingsThatHaveLeaptIsGoodAgainAfterAnHourOrOnceSelected) {
  GyroHealth<> health(2);
  const auto look = [&](double from_s, double to_s, const Eigen::Vector3d& turn) {
    for (double t_s = from_s; t_s < to_s; t_s += 1) {
      GyroSample sample = live_sample(t_s);
      sample.h_b[1] = rotated<double>(sample.h_b[1], turn);
      health.look_at(sample);
    }
  };
  const Eigen::Vector3d away(0, 0, 2);
  look(0, 20, Eigen::Vector3d::Zero());
  look(20, 3620, away);
  EXPECT_EQ(health.states()[1], GyroState::kLeapt);
  look(3620, 3621, away);
  EXPECT_EQ(health.states()[1], GyroState::kUsed);
  look(3621, 3640, away);
  look(3640, 3700, Eigen::Vector3d::Zero());
  EXPECT_EQ(health.states()[1], GyroState::kLeapt);
  health.select(all_gyros(2));
  EXPECT_EQ(health.states()[1], GyroState::kUsed);
  // One that was stuck comes back wherever the body has turned to; so it does after a gap.
  for (int i = 0; i < 40; ++i) {
    GyroSample sample = live_sample(3700 + i);
    sample.h_b[1] = Eigen::Vector3d(0.6, 0, 0.8);
    health.look_at(sample);
  }
  look(3740, 3742, away);
  EXPECT_EQ(health.states()[1], GyroState::kUsed);
  look(3742, 3760, away);
  look(3762, 3764, Eigen::Vector3d::Zero());
  EXPECT_EQ(health.states()[1], GyroState::kUsed);
}

TEST(GyroHealth, IsNotThatOfAFaultWhileNowThisGyroIsSuspectedAndNowThat) {
  GyroHealth health(3);
  for (int i = 0; i < 10 * GyroHealth<>::kVerdicts; ++i) {
    health.judge(i % 5 == 4 ? kNoGyro : i / 4 % 3);
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(health.states()[k], GyroState::kUsed);
  }
}

TEST(GyroHealth, OfAnIsolatedGyroIsGoodAgainOnceItIsSelected) {
  GyroHealth health(3);
  for (int i = 0; i < GyroHealth<>::kVerdicts; ++i) {
    EXPECT_EQ(health.states()[2], GyroState::kUsed);
    health.judge(2);
  }
  EXPECT_EQ(health.states()[2], GyroState::kIsolated);
  health.select(all_gyros(2));
  EXPECT_EQ(health.states()[2], GyroState::kNotSelected);
  EXPECT_EQ(count(health.usable(second(0), second(1))), 2);
  health.select(all_gyros(3));
  EXPECT_EQ(health.states()[2], GyroState::kUsed);
  EXPECT_EQ(count(health.usable(second(0), second(1))), 3);
}

TEST(Intake, LooksAtFixes) {
  Intake intake(intake_setup(2, 2));
  const auto look = [&](const StarFix& fix, std::optional<Time> latest = second(10), Time until = second(8)) {
    return intake.look_at(fix, latest, until);
  };
  const Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  EXPECT_EQ(look({second(9), q}), FixStatus::kPending);
  EXPECT_EQ(look({second(9), q, 1}), FixStatus::kPending);
  for (const int head : {2, 4, -1}) {
    EXPECT_EQ(look({second(9), q, head}), FixStatus::kRejectedUnknownHead) << head;
  }
  for (const double bad : {0.0, 1.01, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(look({second(9), Eigen::Quaterniond(bad * q.coeffs())}), FixStatus::kRejectedNotRotation) << bad;
  }
  EXPECT_EQ(look({second(9), q}, std::nullopt), FixStatus::kRejectedNoGyro);
  EXPECT_EQ(look({second(10.5), q}), FixStatus::kPending);
  EXPECT_EQ(look({second(10.6), q}), FixStatus::kRejectedNoGyro);
  EXPECT_EQ(look({second(7.9), q}), FixStatus::kRejectedOutOfOrder);
  EXPECT_EQ(look({Time::min(), q}), FixStatus::kRejectedOutOfOrder);
  EXPECT_EQ(look({Time::max(), q}), FixStatus::kRejectedOutOfOrder);
  // One that was used is not used again, nor one of the same star tracker before it.
  intake.mark_used({second(9), q, 1});
  EXPECT_EQ(look({second(9), q, 1}), FixStatus::kRejectedOutOfOrder);
  EXPECT_EQ(look({second(8.5), q, 1}), FixStatus::kRejectedOutOfOrder);
  EXPECT_EQ(look({second(8.5), q, 0}), FixStatus::kPending);
  intake.set_clock(second(0));
  EXPECT_EQ(look({second(8.5), q, 1}), FixStatus::kPending);
}

TEST(FixQueue, GivesFixesInTheOrderOfTheirTimes) {
  FixQueue<2> queue;
  EXPECT_EQ(queue.next_t(), Time::max());
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()));
  for (const double t_s : {3.0, 1.0, 2.0, 5.0, 4.0}) {
    EXPECT_EQ(queue.push({second(t_s), q}), FixStatus::kPending);
  }
  EXPECT_EQ(queue.push({second(3), q, 1}), FixStatus::kPending);  // of another star tracker at the same time
  EXPECT_EQ(queue.push({second(3), q, 1}), FixStatus::kRejectedOutOfOrder);
  EXPECT_EQ(queue.push({second(3), q, 0}), FixStatus::kRejectedOutOfOrder);
  double before_s = 0;
  for (const int head : {0, 0, 0, 1, 0, 0}) {
    const Time next_t = queue.next_t();
    const StarFix fix = queue.pop();
    EXPECT_EQ(fix.t, next_t);
    EXPECT_EQ(fix.head, head);
    EXPECT_EQ(fix.q_in_c.coeffs(), q.coeffs());
    EXPECT_GE(to_seconds(fix.t.time_since_epoch()), before_s);
    before_s = to_seconds(fix.t.time_since_epoch());
  }
  EXPECT_EQ(queue.size(), 0);
}

TEST(FixQueue, KeepsTheCovarianceOfEachFix) {
  FixQueue<1, true> queue;
  for (const double t_s : {3.0, 1.0, 2.0}) {
    EXPECT_EQ(queue.push({second(t_s), Eigen::Quaterniond::Identity(), 0, {{t_s, 0, 0, 0, 0, -t_s}}}),
              FixStatus::kPending);
  }
  for (const double t_s : {1.0, 2.0, 3.0}) {
    const StarFix fix = queue.pop();
    EXPECT_EQ(fix.covariance.rad2.front(), t_s);
    EXPECT_EQ(fix.covariance.rad2.back(), -t_s);
  }
  // Where there is no room for them, none is told.
  FixQueue<1> without;
  EXPECT_EQ(without.push({second(1), Eigen::Quaterniond::Identity(), 0, {{1, 1, 1, 0, 0, 0}}}), FixStatus::kPending);
  EXPECT_FALSE(without.pop().covariance.is_told());
}

TEST(FixQueue, HasRoomForSoMany) {
  FixQueue<1> queue;
  const Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  for (int round = 0; round < 3; ++round) {  // from any place of the ring on
    for (int i = 0; i < FixQueue<1>::kCapacity; ++i) {
      ASSERT_EQ(queue.push({second(1000 * round + i), q}), FixStatus::kPending);
    }
    EXPECT_EQ(queue.push({second(1e6), q}), FixStatus::kRejectedBacklog);
    EXPECT_EQ(queue.size(), FixQueue<1>::kCapacity);
    if (round == 1) {
      EXPECT_EQ(queue.clear(), FixQueue<1>::kCapacity);
    }
    for (int i = 0; queue.size() > 0; ++i) {
      EXPECT_EQ(queue.pop().t, second(1000 * round + i));
    }
    EXPECT_EQ(queue.push({second(1000 * round - 1), q}), FixStatus::kPending);
    static_cast<void>(queue.pop());
  }
}

TEST(Schedule, DoesTheEarliestThingFirst) {
  using Next = Schedule::Next;
  constexpr Time kNone = Time::max();
  Schedule schedule(std::chrono::milliseconds(1400), std::chrono::minutes(1));
  EXPECT_EQ(schedule.next(second(10), kNone, kNone), Next::kNothing);
  EXPECT_EQ(schedule.next(second(10), second(9), kNone), Next::kSample);
  EXPECT_EQ(schedule.next(second(10), second(11), kNone), Next::kNothing);
  EXPECT_EQ(schedule.next(second(10), second(9), second(8)), Next::kFix);
  EXPECT_EQ(schedule.next(second(10), second(9), second(9)), Next::kSample);  // the sample at the fix goes before it
  EXPECT_EQ(schedule.next(second(10), kNone, second(8)), Next::kFix);
  EXPECT_EQ(schedule.next(second(10), second(12), second(11)), Next::kNothing);
  // A minute after the last fix the angles are due, as soon as no fix can come that would share their samples.
  schedule.fix_used(second(0));
  EXPECT_EQ(schedule.angles_t(), second(60));
  EXPECT_EQ(schedule.next(second(61), second(60.1), kNone), Next::kNothing);
  EXPECT_EQ(schedule.next(second(62.8), second(60.1), kNone), Next::kAngles);
  EXPECT_EQ(schedule.next(second(62.8), second(60.1), second(62)), Next::kSample);  // a fix is before them
  EXPECT_EQ(schedule.next(second(62.8), second(60.1), second(62.8)), Next::kAngles);
  schedule.angles_used(second(60));
  EXPECT_EQ(schedule.angles_t(), second(63));
  EXPECT_EQ(schedule.taken_until(), second(62.8));
  // The clock is set back by 100 s.
  schedule.set_clock(-std::chrono::seconds(100));
  EXPECT_EQ(schedule.angles_t(), second(-37));
  EXPECT_EQ(schedule.taken_until(), Time::min());
  schedule.no_angles();
  schedule.set_clock(-std::chrono::seconds(100));
  EXPECT_EQ(schedule.angles_t(), Time::max());
}

TEST(Schedule, WithoutAnglesNeverAsksForThem) {
  Schedule schedule(std::chrono::milliseconds(1400), Duration::max());
  schedule.fix_used(second(0));
  EXPECT_EQ(schedule.next(second(1e6), second(1e5), Time::max()), Schedule::Next::kSample);
}

}  // namespace
}  // namespace trihedron
