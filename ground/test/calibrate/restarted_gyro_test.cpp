#include "calibrate/restarted_gyro.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

using std::chrono::minutes;
using testing::HasSubstr;

/// The readings of gyro 2 between two times as of a momentum turned by this angle.
Pass with_turned_momentum(double angle_rad, Duration from, Duration until) {
  Pass pass = two_hours().pass;
  const Truth& truth = two_hours().truth;
  // Across the momentum, in inertial axes.
  const auto& h = truth.h_in;
  const Eigen::Vector3d axis = Eigen::Vector3d(h[3], h[4], h[5]).unitOrthogonal();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle_rad, axis));
  const auto C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(truth.gyros[1].alignment_rotation_vector_rad)).raw();
  std::size_t row = 0;
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    while (row + 1 < truth.t.size() && truth.t[row] < pass.gyro.t[i]) {
      ++row;
    }
    const Duration t = pass.gyro.t[i] - pass.settings.epoch;
    if (t >= from && t < until) {
      const Eigen::Matrix3d C_in_b = truth.q_in_c[row] * C_c_b;
      Eigen::Map<Eigen::Vector3d>(&pass.gyro.h[(2 * i + 1) * 3]) =
          C_in_b.transpose() * (turn * (C_in_b * pass.gyro.direction(i, 1)));
    }
  }
  return pass;
}

TEST(RestartedGyro, IsRefusedWithTheTimeToCutThePass) {
  for (const double angle_rad : {0.05, -1.0}) {
    try {
      static_cast<void>(calibrate(with_turned_momentum(angle_rad, minutes(50), minutes(200)), {}));
      FAIL() << "it is taken";
    } catch (const SetupError& refusal) {
      EXPECT_THAT(refusal.what(),
                  HasSubstr("momentum of gyro 2 turns by " + std::string(angle_rad > 0 ? "2." : "57.")));
      EXPECT_THAT(refusal.what(), HasSubstr("between t = 2997 s and 3000 s"));
      EXPECT_THAT(refusal.cure(), HasSubstr("import PASS --to 2009-05-20T00:49:57 -o"));
      EXPECT_THAT(refusal.cure(), HasSubstr("import PASS --from 2009-05-20T00:50:00 -o"));
    }
  }
}

/// Reason and cure; both empty where it is taken.
std::pair<std::string, std::string> refusal_of_restart(const Pass& pass) {
  try {
    refuse_restarted_gyro(pass);
    return {};
  } catch (const SetupError& refusal) {
    return {refusal.what(), refusal.cure()};
  }
}

void expect_restart_of(const Pass& pass, const std::string& gyro) {
  EXPECT_THAT(refusal_of_restart(pass).first, HasSubstr("momentum of " + gyro + " turns"));
}

/// Nothing of the other part is left in either, whatever the fractions of a second are.
TEST(RestartedGyro, IsCutAtWholeSecondsBetweenTheFixes) {
  Pass pass = with_turned_momentum(0.05, minutes(50), minutes(200));
  const auto later = std::chrono::milliseconds(300);
  for (std::vector<Time>* times : {&pass.gyro.t, &pass.star_tracker.t}) {
    std::ranges::for_each(*times, [&](Time& t) { t += later; });
  }
  const std::string cure = refusal_of_restart(pass).second;
  EXPECT_THAT(cure, HasSubstr("--to 2009-05-20T00:49:57 "));
  EXPECT_THAT(cure, HasSubstr("--from 2009-05-20T00:50:01 "));
}

TEST(RestartedGyro, IsFoundBesideOneThatIsSilent) {
  const Pass two = with_turned_momentum(0.05, minutes(50), minutes(200));
  Pass three = two;
  three.settings.gyros.push_back(two.settings.gyros[0]);
  three.gyro.gyros = 3;
  three.gyro.h.clear();
  for (std::size_t i = 0; i < two.gyro.size(); ++i) {
    for (const Eigen::Vector3d& h : {Eigen::Vector3d(two.gyro.direction(i, 0)), Eigen::Vector3d(std::nan(""), 0, 0),
                                     Eigen::Vector3d(two.gyro.direction(i, 1))}) {
      three.gyro.h.insert(three.gyro.h.end(), h.begin(), h.end());
    }
  }
  expect_restart_of(three, "gyro 3");
}

TEST(RestartedGyro, IsNotWhatIsSaidOfReadingsThatChangeTheirSign) {
  Pass pass = two_hours().pass;
  for (std::size_t i = pass.gyro.size() / 2; i < pass.gyro.size(); ++i) {
    Eigen::Map<Eigen::Vector3d>(&pass.gyro.h[(2 * i + 1) * 3]) *= -1;
  }
  const std::string reason = refusal_of_restart(pass).first;
  EXPECT_THAT(reason, HasSubstr("gyro 2 turns by 180.0 deg"));
  EXPECT_THAT(reason, HasSubstr("with another sign"));
}

/// The case turns with the body, which no rotor does.
TEST(RestartedGyro, IsNoneOfReadingsThatDoNotChangeOrAreOfOtherAxes) {
  Pass dead = two_hours().pass;
  Pass swapped = dead;
  for (std::size_t i = dead.gyro.size() / 2; i < dead.gyro.size(); ++i) {
    Eigen::Map<Eigen::Vector3d>(&dead.gyro.h[(2 * i + 1) * 3]) =
        (Eigen::Vector3d(0.6, 0, 0.8) + 1e-5 * Eigen::Vector3d(dead.gyro.direction(i, 1))).normalized();
    const Eigen::Vector3d h = swapped.gyro.direction(i, 1);
    Eigen::Map<Eigen::Vector3d>(&swapped.gyro.h[(2 * i + 1) * 3]) = Eigen::Vector3d(h.y(), h.x(), h.z());
  }
  refuse_restarted_gyro(dead);
  refuse_restarted_gyro(swapped);
}

/// Which moves it as far while no fix comes.
TEST(RestartedGyro, IsNoneWhereDriftExplainsTheTurn) {
  Scenario scenario = scenario_in_eq1(5, std::chrono::hours(3));
  scenario.star_tracker.outages = {{3600, 3600 + 45 * 60}};
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.prior_sigma_rad_s = 6e-5;
    gyro.drift.kappa_rad_s.emplace().fill(0);
  }
  scenario.gyros[1].drift.kappa_rad_s->at(5) = 6e-5;
  refuse_restarted_gyro(sim::simulate(scenario).pass);
}

TEST(RestartedGyro, IsNoneWhereTheReadingsComeBackOrTheStarTrackerIsOff) {
  refuse_restarted_gyro(two_hours().pass);
  refuse_restarted_gyro(with_turned_momentum(0.05, minutes(50), minutes(55)));
  refuse_restarted_gyro(with_turned_momentum(0.05, minutes(115), minutes(200)));  // too late to be told
  Pass pass = two_hours().pass;
  for (std::size_t i = pass.star_tracker.size() / 2; i < pass.star_tracker.size(); ++i) {
    pass.star_tracker.q_in_c[i] =
        pass.star_tracker.q_in_c[i] * Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::Ones().normalized()));
  }
  refuse_restarted_gyro(pass);
  pass.star_tracker = {};
  refuse_restarted_gyro(pass);
  // Stamps that are off turn both, one of which may lie along the axis of the turn.
  pass = two_hours().pass;
  for (std::size_t i = pass.gyro.size() / 2; i < pass.gyro.size(); ++i) {
    pass.gyro.t[i] -= minutes(10);
  }
  refuse_restarted_gyro(pass);
}

}  // namespace
}  // namespace trihedron::ground
