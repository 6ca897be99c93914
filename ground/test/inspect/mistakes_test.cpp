#include "trihedron/ground/inspect/mistakes.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "passes.hpp"
#include "trihedron/ground/clocks/clocks.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

using Kind = Mistake::Kind;

/// Slews of an hour and ten minutes; readings each second, which are quickly simulated.
Scenario an_hour(std::uint64_t seed) {
  Scenario scenario = scenario_in_eq1(seed, std::chrono::minutes(70));
  scenario.gyro_period = std::chrono::seconds(1);
  return scenario;
}

const Pass& flown() {
  static const Pass pass = sim::simulate(an_hour(5)).pass;
  return pass;
}

Consistency found_in(const Pass& pass) { return consistency_of(pass, std::nullopt).value(); }

std::string described(const Consistency& consistency) {
  std::string text;
  for (int k = 0; k < 2; ++k) {
    text += std::to_string(consistency.motion_rad[k]) + " of " + std::to_string(consistency.allowed_rad[k]) + " rad\n";
  }
  for (const Mistake& mistake : consistency.mistakes) {
    text += "kind " + std::to_string(static_cast<int>(mistake.kind)) + " of gyro " + std::to_string(mistake.gyro) + ":";
    for (const SignedComponent& part : mistake.components) {
      text += " " + std::to_string(part.from) + (part.sign > 0 ? "+" : "-");
    }
    text += ", " + std::to_string(mistake.motion_rad) + " rad\n";
  }
  return text;
}

/// The one that explains, with what is proposed for it.
void expect_only(const Consistency& consistency, Kind kind, int gyro,
                 const std::array<SignedComponent, 4>& components) {
  EXPECT_FALSE(consistency.is_consistent);
  ASSERT_EQ(consistency.mistakes.size(), 1U) << described(consistency);
  const Mistake& mistake = consistency.mistakes.front();
  EXPECT_EQ(mistake.kind, kind);
  EXPECT_EQ(mistake.gyro, gyro);
  EXPECT_EQ(mistake.components, components);
  EXPECT_LT(mistake.motion_rad, consistency.allowed_rad[gyro]);
}

/// Component i of a fix as it is told: that of the right one, x, y, z, w, from which it comes, with its sign.
using Told = std::array<SignedComponent, 4>;

Pass with_fixes(Pass pass, const Told& told) {
  for (Eigen::Quaterniond& q : pass.star_tracker.q_in_c) {
    const Eigen::Vector4d right = q.coeffs();
    for (int i = 0; i < 4; ++i) {
      const SignedComponent& part = told[static_cast<std::size_t>(i)];
      q.coeffs()(i) = part.sign * right(part.from);
    }
  }
  return pass;
}

/// What mends it.
Told mending(const Told& told) {
  Told mended{};
  for (int i = 0; i < 4; ++i) {
    const SignedComponent& part = told[static_cast<std::size_t>(i)];
    mended[static_cast<std::size_t>(part.from)] = {i, part.sign};
  }
  return mended;
}

Pass with_readings(Pass pass, int gyro, const std::array<SignedComponent, 3>& told) {
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    const Eigen::Vector3d right = pass.gyro.direction(i, gyro);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      pass.gyro.h[(i * static_cast<std::size_t>(pass.gyro.gyros) + static_cast<std::size_t>(gyro)) * 3 + axis] =
          told[axis].sign * right(told[axis].from);
    }
  }
  return pass;
}

struct QuaternionCase {
  const char* name;
  Told told;

  friend void PrintTo(const QuaternionCase& one, std::ostream* out) { *out << one.name; }
};

const std::vector<QuaternionCase> kQuaternionCases = {
    {"ScalarFirst", {{{3, 1}, {0, 1}, {1, 1}, {2, 1}}}},
    {"ScalarLastToldAsFirst", {{{1, 1}, {2, 1}, {3, 1}, {0, 1}}}},
    {"Conjugate", {{{0, -1}, {1, -1}, {2, -1}, {3, 1}}}},
    {"ScalarFirstConjugate", {{{3, 1}, {0, -1}, {1, -1}, {2, -1}}}},
    {"AxesInTurn", {{{1, 1}, {2, 1}, {0, 1}, {3, 1}}}},
    {"AxesInTurnTheOtherWay", {{{2, 1}, {0, 1}, {1, 1}, {3, 1}}}},
    {"AxesExchanged", {{{1, 1}, {0, 1}, {2, 1}, {3, 1}}}},
    {"MirroredAlongX", {{{0, -1}, {1, 1}, {2, 1}, {3, 1}}}},
    {"MirroredAlongZ", {{{0, 1}, {1, 1}, {2, -1}, {3, 1}}}},
};

class QuaternionsOfAPass : public testing::TestWithParam<QuaternionCase> {};

TEST_P(QuaternionsOfAPass, ThatAreMistakenAreRecognised) {
  const Told& told = GetParam().told;
  expect_only(found_in(with_fixes(flown(), told)), Kind::kQuaternion, 0, mending(told));
}

/// In steady flight about c y, what turns the fixes round y cannot be told from what they are.
TEST_P(QuaternionsOfAPass, AreNeverMendedWronglyInSteadyFlight) {
  Scenario scenario = an_hour(5);
  scenario.attitude.slews = std::vector<Slew>{};
  static const Pass pass = sim::simulate(scenario).pass;
  const Told& told = GetParam().told;
  const Consistency consistency = found_in(with_fixes(pass, told));
  if (consistency.mistakes.size() == 1) {
    EXPECT_EQ(consistency.mistakes.front().kind, Kind::kQuaternion);
    EXPECT_EQ(consistency.mistakes.front().components, mending(told));
  }
}

INSTANTIATE_TEST_SUITE_P(All, QuaternionsOfAPass, testing::ValuesIn(kQuaternionCases),
                         [](const auto& one) { return one.param.name; });

struct AxesCase {
  const char* name;
  std::array<SignedComponent, 3> told;

  friend void PrintTo(const AxesCase& one, std::ostream* out) { *out << one.name; }
};

class AxesOfAGyro : public testing::TestWithParam<AxesCase> {};

TEST_P(AxesOfAGyro, ThatAreMistakenAreRecognised) {
  const std::array<SignedComponent, 3>& told = GetParam().told;
  Told mended{};
  for (int i = 0; i < 3; ++i) {
    const SignedComponent& part = told[static_cast<std::size_t>(i)];
    mended[static_cast<std::size_t>(part.from)] = {i, part.sign};
  }
  for (const int gyro : {0, 1}) {
    expect_only(found_in(with_readings(flown(), gyro, told)), Kind::kGyroAxes, gyro, mended);
  }
}

INSTANTIATE_TEST_SUITE_P(All, AxesOfAGyro,
                         testing::Values(AxesCase{"InTurn", {{{1, 1}, {2, 1}, {0, 1}}}},
                                         AxesCase{"Exchanged", {{{1, 1}, {0, 1}, {2, 1}}}},
                                         AxesCase{"MirroredAlongX", {{{0, -1}, {1, 1}, {2, 1}}}},
                                         AxesCase{"MirroredAlongZ", {{{0, 1}, {1, 1}, {2, -1}}}}),
                         [](const auto& one) { return one.param.name; });

TEST(Mistakes, GyrosWithEachOthersReadingsAreRecognisedByTheirAlignments) {
  Pass pass = flown();
  const Eigen::Vector3d turn(0, 0.4, 0.3);
  const Eigen::AngleAxisd mounting(turn.norm(), turn.normalized());
  pass.settings.gyros[1].alignment_rotation_vector_rad = turn;
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    const Eigen::Vector3d first = pass.gyro.direction(i, 0);
    const Eigen::Vector3d second = mounting.inverse() * pass.gyro.direction(i, 1);
    std::copy_n(second.data(), 3, &pass.gyro.h[i * 6]);
    std::copy_n(first.data(), 3, &pass.gyro.h[i * 6 + 3]);
  }
  const Consistency consistency = found_in(pass);
  ASSERT_EQ(consistency.mistakes.size(), 1U);
  EXPECT_EQ(consistency.mistakes.front().kind, Kind::kGyrosExchanged);
}

TEST(Mistakes, AStarTrackerTenMinutesLateIsRecognised) {
  Scenario scenario = an_hour(7);
  for (const double offset_s : {-590.0, 20.0}) {
    scenario.star_tracker.clock_offset_s = offset_s;
    const Pass pass = sim::simulate(scenario).pass;
    const auto consistency = consistency_of(pass, ground::clocks_of(pass));
    ASSERT_TRUE(consistency);
    ASSERT_EQ(consistency->mistakes.size(), 1U) << offset_s;
    EXPECT_EQ(consistency->mistakes.front().kind, Kind::kClock);
    EXPECT_NEAR(consistency->mistakes.front().offset_s, offset_s, 0.05);
  }
}

/// Of the same orbit, with slews at other times.
TEST(Mistakes, FixesOfAnotherPassAreNotMended) {
  Pass pass = flown();
  const Pass other = sim::simulate(an_hour(6)).pass;
  pass.star_tracker = other.star_tracker;
  const std::optional<Consistency> consistency = consistency_of(pass, ground::clocks_of(pass));
  ASSERT_TRUE(consistency);
  EXPECT_FALSE(consistency->is_consistent);
  ASSERT_EQ(consistency->mistakes.size(), 1U);
  EXPECT_EQ(consistency->mistakes.front().kind, Kind::kNothingTried);
}

Pass right_pass(const std::string& kind) {
  Scenario scenario = an_hour(11);
  if (kind == "steady") {
    scenario.attitude.slews = std::vector<Slew>{};
  } else if (kind == "three gyros") {
    scenario.gyros.push_back(scenario.gyros.front());
    scenario.gyros[2].start_direction_c = Eigen::Vector3d(0.1, 0.2, 0.97).normalized();
  } else if (kind == "outliers") {
    scenario.star_tracker.outlier_probability = 0.1;
  } else if (kind == "outside") {
    for (GyroScenario& gyro : scenario.gyros) {
      gyro.drift.outside_sigma_rad_s = 1e-7;
    }
  } else if (kind == "short") {
    scenario.duration = std::chrono::minutes(12);
  } else if (kind == "rough alignment") {
    for (GyroScenario& gyro : scenario.gyros) {
      gyro.alignment_prior_sigma_rad = 0.05;
    }
  }
  return sim::simulate(scenario).pass;
}

TEST(Mistakes, AreNotSeenInRightPasses) {
  for (const char* const kind : {"slews", "steady", "three gyros", "outliers", "outside", "short", "rough alignment"}) {
    const Pass pass = right_pass(kind);
    const std::optional<Consistency> consistency = consistency_of(pass, ground::clocks_of(pass));
    ASSERT_TRUE(consistency) << kind;
    EXPECT_TRUE(consistency->is_consistent)
        << kind << " " << consistency->motion_rad[0] << " " << consistency->motion_rad[1];
    EXPECT_TRUE(consistency->mistakes.empty()) << kind;
  }
}

TEST(Mistakes, NeedFixesWithReadingsBesideThem) {
  Pass pass = flown();
  pass.star_tracker.t.resize(5);
  pass.star_tracker.q_in_c.resize(5);
  EXPECT_FALSE(consistency_of(pass, std::nullopt));
  pass.star_tracker = {};
  EXPECT_FALSE(consistency_of(pass, std::nullopt));
}

}  // namespace
}  // namespace trihedron::ground
