#include "trihedron/core/readings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "trihedron/core/frames.hpp"

namespace trihedron {
namespace {

using PairReadings = Readings<2>;

constexpr double kReadingNoise_rad = 1e-5;

Time time_at(double t_s) { return Time(from_seconds(t_s)); }

CalibrationSetup buffer_setup() {
  CalibrationSetup setup;
  setup.readout_noise_rad[0] = setup.readout_noise_rad[1] = kReadingNoise_rad;
  return setup;
}

/// Momenta of a body that turns evenly about z.
constexpr double kRate_rad_s = 0.02;
GyroSample turning_sample(double t_s) {
  GyroSample s;
  s.t = time_at(t_s);
  s.h_b[0] = rotated<double>(Eigen::Vector3d(0.6, 0, 0.8), Eigen::Vector3d(0, 0, -kRate_rad_s * t_s));
  s.h_b[1] = rotated<double>(Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, -kRate_rad_s * t_s));
  return s;
}

/// Samples, the health of their gyros, and gyros whose axes are those of the body.
struct SomeReadings {
  explicit SomeReadings(bool together = true) : readings(buffer_setup(), together) {}
  PairReadings readings;
  GyroHealth<2> health{2};
  PerGyro<GyroModel<7>, 2> gyros;

  void push(double t_s) {
    const GyroSample s = turning_sample(t_s);
    health.look_at(s);
    readings.push(s);
  }
  [[nodiscard]] std::optional<FixReadings> at_time(double t_s) const {
    return readings.at(time_at(t_s), buffer_setup(), health, gyros);
  }
};

double readings_off(const Directions& h_b, double t_s) {
  const GyroSample truth = turning_sample(t_s);
  return std::max(angle_between<double>(h_b[0], truth.h_b[0]), angle_between<double>(h_b[1], truth.h_b[1]));
}

TEST(Readings, KeepTheLatest) {
  SomeReadings buffer;
  EXPECT_EQ(buffer.readings.size(), 0);
  EXPECT_FALSE(buffer.readings.latest());
  for (int i = 0; i < PairReadings::kCapacity + 3; ++i) {
    EXPECT_EQ(buffer.readings.full(), i >= PairReadings::kCapacity);
    buffer.push(i);
  }
  ASSERT_EQ(buffer.readings.size(), PairReadings::kCapacity);
  EXPECT_EQ(buffer.readings.time(0), time_at(3));
  EXPECT_EQ(buffer.readings.latest_t(), time_at(PairReadings::kCapacity + 2));
  EXPECT_EQ(readings_off(buffer.readings.directions(4), 7), 0);
  EXPECT_EQ(buffer.readings.first_after(time_at(7)), 5);
  EXPECT_EQ(buffer.readings.first_after(time_at(7.5)), 5);
  EXPECT_EQ(buffer.readings.first_after(time_at(1)), 0);
  EXPECT_EQ(buffer.readings.first_after(time_at(1e3)), PairReadings::kCapacity);
  buffer.readings.clear();
  EXPECT_EQ(buffer.readings.size(), 0);
}

TEST(Readings, HaveNoRoomForSamplesThatComeTooSoon) {
  SomeReadings buffer;
  EXPECT_FALSE(buffer.readings.too_soon(time_at(0)));
  buffer.push(0);
  EXPECT_TRUE(buffer.readings.too_soon(time_at(0.07)));
  EXPECT_FALSE(buffer.readings.too_soon(time_at(0.075)));
  // What the angles between the momenta wait for: twice the reach to both sides, and the samples of half a fix more.
  EXPECT_GE(PairReadings::kMinSpacing * PairReadings::kCapacity, std::chrono::seconds(6));
}

TEST(Readings, AreThoseOfASampleOrBetweenTwo) {
  SomeReadings buffer(false);
  for (int i = 0; i <= 40; ++i) {
    buffer.push(0.125 * i);
  }
  const auto on_one = buffer.at_time(2.5);
  ASSERT_TRUE(on_one);
  EXPECT_EQ(readings_off(on_one->h_b, 2.5), 0);
  const auto between_two = buffer.at_time(2.55);
  ASSERT_TRUE(between_two);
  EXPECT_LT(readings_off(between_two->h_b, 2.55), 1e-6);  // an arc of 2.5e-3 rad against its chord
  for (const auto& readings : {*on_one, *between_two}) {
    EXPECT_EQ(readings.noise_factor, 1);
    EXPECT_EQ(readings.rate_c.norm(), 0);
    EXPECT_EQ(count(readings.used), 2);
  }
  const FixReadings now = buffer.readings.now(buffer_setup(), buffer.health, buffer.gyros);
  EXPECT_EQ(readings_off(now.h_b, 5), 0);
  EXPECT_EQ(now.noise_factor, 1);
  EXPECT_EQ(count(buffer.at_time(0).value().used), 2);  // nothing before it to be compared with
}

TEST(Readings, TakeTheSamplesRoundATimeTogether) {
  SomeReadings buffer;
  for (int i = 0; i <= 40; ++i) {
    buffer.push(0.125 * i);
  }
  const Eigen::Vector3d rate_c(0, 0, kRate_rad_s);
  const auto readings = buffer.at_time(2.55);
  ASSERT_TRUE(readings);
  EXPECT_LT(readings_off(readings->h_b, 2.55), 1e-8);
  EXPECT_NEAR(readings->noise_factor, 0.32, 0.02);  // of 22 samples, a cubic: 3/2 of 1/√22
  EXPECT_LT((readings->rate_c - rate_c).norm(), 1e-6);
  const FixReadings now = buffer.readings.now(buffer_setup(), buffer.health, buffer.gyros);
  EXPECT_LT(readings_off(now.h_b, 5), 1e-6);  // a parabola leaves the third power of an arc of 0.05 rad
  EXPECT_LT(now.noise_factor, 0.7);
  EXPECT_LT((now.rate_c - rate_c).norm(), 1e-4);
}

TEST(Readings, AreNotThoseOverAGap) {
  SomeReadings buffer;
  for (int i = 0; i <= 80; ++i) {
    if (i <= 20 || i >= 60) {
      buffer.push(0.125 * i);
    }
  }
  EXPECT_FALSE(buffer.at_time(-0.1));  // before the first
  EXPECT_FALSE(buffer.at_time(4));     // in the gap
  EXPECT_FALSE(buffer.at_time(10.1));  // after the last
  // Beside it only the samples of the same side are taken.
  const auto beside = buffer.at_time(7.5);
  ASSERT_TRUE(beside);
  EXPECT_LT(readings_off(beside->h_b, 7.5), 1e-7);
}

TEST(Readings, BesideAGapAreThoseOfTheSamplesOfThatSideAlone) {
  // A gap that is short enough for the samples beyond it to be within reach.
  SomeReadings both;
  SomeReadings before;
  SomeReadings after;
  for (int i = 0; i <= 80; ++i) {
    const double t_s = 0.125 * i;
    if (t_s <= 4 || t_s >= 5) {
      both.push(t_s);
      (t_s < 4.5 ? before : after).push(t_s);
    }
  }
  for (const auto& [side, t_s] : {std::pair(&before, 3.6), {&after, 5.3}}) {
    const auto expected = side->at_time(t_s);
    const auto readings = both.at_time(t_s);
    ASSERT_TRUE(expected && readings);
    EXPECT_LT(readings->noise_factor, 1);
    EXPECT_EQ(readings->noise_factor, expected->noise_factor);
    EXPECT_EQ(readings->h_b[0], expected->h_b[0]);
    EXPECT_EQ(readings->rate_c, expected->rate_c);
  }
}

TEST(Readings, AreSingleWhereNoPolynomialExplainsThem) {
  SomeReadings buffer;
  for (int i = 0; i <= 40; ++i) {
    GyroSample s = turning_sample(0.125 * i);
    s.h_b[0] = rotated<double>(s.h_b[0], Eigen::Vector3d(0, (i % 2) * 1e-3, 0));
    buffer.readings.push(s);
  }
  const auto readings = buffer.at_time(2.5);
  ASSERT_TRUE(readings);
  EXPECT_EQ(readings->noise_factor, 1);
  EXPECT_EQ(readings_off(readings->h_b, 2.5), 0);
}

TEST(Readings, OfAStuckGyroAreNotUsed) {
  SomeReadings buffer;
  for (int i = 0; i <= 40; ++i) {
    GyroSample s = turning_sample(0.125 * i);
    s.h_b[1] = Eigen::Vector3d::UnitY();
    buffer.health.look_at(s);
    buffer.readings.push(s);
  }
  const auto readings = buffer.at_time(2.5);
  ASSERT_TRUE(readings);
  EXPECT_TRUE(readings->used[0]);
  EXPECT_FALSE(readings->used[1]);
}

/// Samples every 0.125 s up to 5 s, some of them spoilt by spikes of one gyro, without noise.
struct Spiked {
  SomeReadings buffer;

  Spiked(const std::vector<int>& spikes, int gyro, const Eigen::Vector3d& axis, int last = 40,
         double size_rad = 0.017) {
    for (int i = 0; i <= last; ++i) {
      GyroSample s = turning_sample(0.125 * i);
      if (std::ranges::find(spikes, i) != spikes.end()) {
        s.h_b[gyro] = rotated<double>(s.h_b[gyro], size_rad * axis);
      }
      buffer.readings.push(s);
    }
  }
  [[nodiscard]] GyroMask used_at(double t_s) const { return buffer.at_time(t_s).value().used; }
  [[nodiscard]] GyroMask used_now() const {
    return buffer.readings.now(buffer_setup(), buffer.health, buffer.gyros).used;
  }
};

TEST(Readings, OfASpikeAreNotUsedNow) {
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  EXPECT_FALSE(Spiked({40}, 0, y).used_now()[0]);
  EXPECT_TRUE(Spiked({40}, 0, y).used_now()[1]);
  EXPECT_FALSE(Spiked({40}, 1, z).used_now()[1]);
  EXPECT_TRUE(Spiked({40}, 1, z).used_now()[0]);
  EXPECT_EQ(count(Spiked({}, 0, y).used_now()), 2);
  // Spikes before it do not count, …
  for (int spike = 20; spike < 40; ++spike) {
    EXPECT_EQ(count(Spiked({spike}, 0, y).used_now()), 2) << spike;
    EXPECT_FALSE(Spiked({spike, 40}, 0, y).used_now()[0]) << spike;  // also where it is the same again
  }
  EXPECT_EQ(count(Spiked({30, 36, 38}, 0, y).used_now()), 2);
  EXPECT_FALSE(Spiked({31, 37, 40}, 0, y).used_now()[0]);
  // … and of two in a row the second is known by the angle to the other momentum.
  EXPECT_FALSE(Spiked({39, 40}, 1, z).used_now()[1]);
  // The first samples are compared with nothing.
  EXPECT_EQ(count(Spiked({2}, 0, y, 2).used_now()), 2);
  EXPECT_FALSE(Spiked({3}, 0, y, 3).used_now()[0]);
}

TEST(Readings, OfASpikeAreNotUsedAtAFix) {
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  // At the time of the fix, or one of the two that it lies between.
  for (const auto& [spike, t_s] : {std::pair(20, 2.5), {20, 2.55}, {21, 2.55}}) {
    const GyroMask first = Spiked({spike}, 0, y).used_at(t_s);
    EXPECT_FALSE(first[0]) << spike << ' ' << t_s;
    EXPECT_TRUE(first[1]) << spike << ' ' << t_s;
    EXPECT_FALSE(Spiked({spike}, 1, z).used_at(t_s)[1]) << spike << ' ' << t_s;
  }
  // Those further away do no harm, …
  for (int spike = 9; spike <= 31; ++spike) {
    if (spike != 20) {
      EXPECT_EQ(count(Spiked({spike}, 0, y).used_at(2.5)), 2) << spike;
      EXPECT_FALSE(Spiked({spike, 20}, 0, y).used_at(2.5)[0]) << spike;
    }
  }
  EXPECT_EQ(count(Spiked({17, 18, 19}, 0, y).used_at(2.5)), 2);  // it agrees with those behind it
  EXPECT_FALSE(Spiked({20, 21}, 0, y).used_at(2.55)[0]);
  EXPECT_FALSE(Spiked({19, 20}, 0, y).used_at(2.5)[0]);
  EXPECT_FALSE(Spiked({19, 20, 21}, 1, z).used_at(2.5)[1]);  // by the angle to the other momentum
  // … and neither does one that nothing can be compared with.
  EXPECT_EQ(count(Spiked({2}, 0, y, 2).used_at(0.25)), 2);
}

TEST(Readings, OfASpikeOfFifteenSigmasAreNotUsed) {
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  constexpr double kFifteenSigmas_rad = 15 * kReadingNoise_rad;
  constexpr int kLast = 40;
  EXPECT_FALSE(Spiked({kLast}, 0, y, kLast, kFifteenSigmas_rad).used_now()[0]);
  EXPECT_TRUE(Spiked({kLast}, 0, y, kLast, kFifteenSigmas_rad).used_now()[1]);
  EXPECT_FALSE(Spiked({20}, 0, y, kLast, kFifteenSigmas_rad).used_at(2.5)[0]);
  // By the half of the samples before it that has none, …
  EXPECT_FALSE(Spiked({kLast - 12, kLast}, 0, y, kLast, kFifteenSigmas_rad).used_now()[0]);
  // … but not where every stretch has one: by three of them alone it may be noise.
  EXPECT_TRUE(Spiked({kLast - 3, kLast}, 0, y, kLast, kFifteenSigmas_rad).used_now()[0]);
}

/// Samples of three gyros, the third of which is not selected; those of the first two from `first` on are turned, each
/// about its axis.
GyroMask used_of_three(int first, const std::array<Eigen::Vector3d, 3>& axes) {
  CalibrationSetup setup = buffer_setup();
  setup.layout.gyros = 3;
  setup.readout_noise_rad[2] = kReadingNoise_rad;
  Readings<3> readings(setup, true);
  GyroHealth<3> health(3);
  health.select(all_gyros(2));
  for (int i = 0; i <= 40; ++i) {
    GyroSample s = turning_sample(0.125 * i);
    s.h_b[2] = rotated<double>(Eigen::Vector3d(0, 0.8, 0.6), Eigen::Vector3d(0, 0, -kRate_rad_s * 0.125 * i));
    for (int k = 0; k < 3 && i >= first; ++k) {
      s.h_b[k] = rotated<double>(s.h_b[k], 0.017 * axes[static_cast<std::size_t>(k)]);
    }
    health.look_at(s);
    readings.push(s);
  }
  return readings.now(setup, health, PerGyro<GyroModel<7>, 3>()).used;
}

TEST(Readings, OfASpikeAreJudgedByTheGyrosThatAreUsed) {
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const auto expect_used = [](const GyroMask& used, bool first, bool second) {
    EXPECT_EQ(used[0], first);
    EXPECT_EQ(used[1], second);
    EXPECT_FALSE(used[2]);
  };
  expect_used(used_of_three(40, {y, none, none}), false, true);
  // Two spikes in a row of the first, which the third shares: its angle to that one says nothing.
  expect_used(used_of_three(39, {y, none, y}), false, true);
  // The body begins to move in another way.
  expect_used(used_of_three(39, {y, y, y}), true, true);
}

TEST(Readings, OfTwoPaperSamplesAreHeldAgainstThoseBeforeThem) {
  SomeReadings buffer(false);  // not fitted together
  for (int i = 0; i <= 40; ++i) {
    buffer.push(0.125 * i);
  }
  GyroSample spike = turning_sample(5.125);
  spike.h_b[0] = rotated<double>(spike.h_b[0], Eigen::Vector3d(0, 0.017, 0));
  buffer.readings.push(spike);
  EXPECT_FALSE(buffer.readings.now(buffer_setup(), buffer.health, buffer.gyros).used[0]);
}

TEST(Readings, AreNotHeldAgainstThoseFarAway) {
  SomeReadings buffer;
  buffer.push(0);
  for (const double t_s : {3.0, 6.0, 9.0}) {  // further apart than readings are compared
    GyroSample s = turning_sample(t_s);
    s.h_b[0] = rotated<double>(s.h_b[0], Eigen::Vector3d(0, 0.017 * t_s * t_s * t_s, 0));
    buffer.readings.push(s);
  }
  EXPECT_EQ(count(buffer.at_time(9).value().used), 2);
  EXPECT_EQ(count(buffer.readings.now(buffer_setup(), buffer.health, buffer.gyros).used), 2);
}

TEST(Readings, OfABodyThatShakesAreUsed) {
  // 0.01 rad to and fro at each sample, all gyros alike: no polynomial explains it, but the momenta stay as they are.
  SomeReadings buffer;
  GyroMask used{};
  int unused = 0;
  for (int i = 0; i <= 80; ++i) {
    GyroSample s = turning_sample(0.125 * i);
    const double shaken_rad = i < 20 ? 0 : 0.01 * std::sin(2.0 * i);
    for (int k = 0; k < 2; ++k) {
      s.h_b[k] = rotated<double>(s.h_b[k], Eigen::Vector3d(shaken_rad, 0, 0));
    }
    buffer.readings.push(s);
    used = buffer.readings.now(buffer_setup(), buffer.health, buffer.gyros).used;
    unused += count(used) < 2 ? 1 : 0;
  }
  EXPECT_EQ(count(used), 2);
  EXPECT_GE(unused, 1);  // as it begins
  EXPECT_LE(unused, 8);
  EXPECT_EQ(count(buffer.at_time(7.5).value().used), 2);
  EXPECT_EQ(count(buffer.at_time(7.55).value().used), 2);
}

TEST(Between, GoesFromOneDirectionToTheOther) {
  const Directions a = turning_sample(0).h_b;
  const Directions b = turning_sample(5).h_b;
  for (const double fraction : {0.0, 0.3, 1.0}) {
    const Directions h = between(a, b, fraction, 2);
    EXPECT_NEAR(h[0].norm(), 1, 1e-15);
    EXPECT_NEAR(angle_between<double>(h[1], a[1]), 0.1 * fraction, 1e-4);
  }
}

}  // namespace
}  // namespace trihedron
