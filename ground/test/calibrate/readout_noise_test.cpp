#include "calibrate/readout_noise.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>

#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"

namespace trihedron::ground {
namespace {

constexpr double kTold_rad = 1e-5;

/// Momenta in a body that goes round once in 94 min and slews for a tenth of the time. `noise_rad(gyro)` is added to
/// every component.
template <class Noise>
Pass turning(Duration period, Duration length, Noise noise_rad) {
  Pass pass;
  pass.settings.gyro_period = period;
  pass.settings.gyros.resize(2);
  pass.gyro.gyros = 2;
  for (int k = 0; k < 2; ++k) {
    pass.settings.gyros[static_cast<std::size_t>(k)].readout_noise_rad = kTold_rad;
  }
  double angle = 0;
  double across = 0;
  for (Time t{}; t < Time{} + length; t += period) {
    const double dt_s = to_seconds(period);
    angle += 1.11e-3 * dt_s;
    across += std::fmod(to_seconds(t - Time{}), 600) < 60 ? 0.01 * dt_s : 0;
    pass.gyro.t.push_back(t);
    const Eigen::Matrix3d turn =
        (Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(across, Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    const Eigen::Vector3d axes[] = {{0.98, 0.1, 0.17}, {0.14, 0.98, 0.1}};
    for (int k = 0; k < 2; ++k) {
      Eigen::Vector3d h = turn.transpose() * axes[k].normalized();
      for (double& component : h) {
        component += noise_rad(k);
      }
      h.normalize();
      pass.gyro.h.insert(pass.gyro.h.end(), h.begin(), h.end());
    }
  }
  return pass;
}

struct White {
  std::array<double, 2> sigma_rad;
  std::mt19937_64 random{7};
  std::normal_distribution<double> normal{};
  double operator()(int gyro) { return sigma_rad.at(static_cast<std::size_t>(gyro)) * normal(random); }
};

TEST(ReadoutNoise, IsFoundForEachGyro) {
  for (const Duration period : {Duration(std::chrono::milliseconds(125)), Duration(std::chrono::seconds(1))}) {
    const auto noise = other_readout_noise(turning(period, std::chrono::hours(2), White{.sigma_rad = {1.02e-5, 1e-4}}));
    ASSERT_TRUE(noise);
    EXPECT_EQ(noise->gyros, 2);
    EXPECT_NEAR(noise->found_rad[0], 1.02e-5, 0.03e-5);
    EXPECT_NEAR(noise->found_rad[1], 1e-4, 0.03e-4);
    EXPECT_EQ(noise->told_rad[1], kTold_rad);
  }
  const auto less = other_readout_noise(
      turning(std::chrono::milliseconds(125), std::chrono::hours(1), White{.sigma_rad = {1e-6, 1e-6}}));
  ASSERT_TRUE(less);
  EXPECT_NEAR(less->found_rad[0], 1e-6, 0.03e-6);
}

TEST(ReadoutNoise, OfOneAxisIsFoundWhateverItDoesToTheAngleBetweenTheMomenta) {
  struct OfAxis {
    int axis;
    std::size_t calls = 0;
    White white{.sigma_rad = {1e-5, 1e-5}};
    double operator()(int gyro) {
      const int its = static_cast<int>(calls++ % 3);
      return (gyro == 0 && its == axis ? 5 : 1) * white(gyro);
    }
  };
  for (const int axis : {1, 2}) {  // the momentum lies along the other
    const auto noise =
        other_readout_noise(turning(std::chrono::milliseconds(125), std::chrono::hours(2), OfAxis{.axis = axis}));
    ASSERT_TRUE(noise);
    EXPECT_GT(noise->found_rad[0], 3e-5) << axis;
    EXPECT_LT(noise->found_rad[0], 4e-5) << axis;  // the root of the mean square of 5e-5 and 1e-5 is 3.6e-5
    EXPECT_NEAR(noise->found_rad[1], 1e-5, 0.03e-5);
  }
}

TEST(ReadoutNoise, IsThatOfTheSettingsWhereThePassShowsThatOrTooLittle) {
  const White as_told{.sigma_rad = {1.1e-5, 0.9e-5}};
  EXPECT_FALSE(other_readout_noise(turning(std::chrono::milliseconds(125), std::chrono::hours(2), as_told)));
  const White more{.sigma_rad = {1e-4, 1e-4}};
  EXPECT_FALSE(other_readout_noise(turning(std::chrono::seconds(2), std::chrono::hours(2), more)));  // a slew bends
  EXPECT_FALSE(other_readout_noise(turning(std::chrono::milliseconds(125), std::chrono::seconds(50), more)));
  Pass uneven = turning(std::chrono::milliseconds(125), std::chrono::hours(1), more);
  std::mt19937 random(5);
  for (Time& t : uneven.gyro.t) {
    t += std::chrono::milliseconds(random() % 60);
  }
  EXPECT_FALSE(other_readout_noise(uneven));
  EXPECT_FALSE(other_readout_noise(Pass{}));
}

TEST(ReadoutNoise, IsNotMovedBySpikesGapsAndReadingsThatStandStill) {
  const double nan = std::nan("");
  Pass pass = turning(std::chrono::milliseconds(125), std::chrono::hours(3), White{.sigma_rad = {3e-5, 1e-5}});
  std::mt19937_64 random(3);
  const std::size_t size = pass.gyro.size();
  for (std::size_t i = 0; i < size; ++i) {
    double* h = &pass.gyro.h[6 * i];
    if (random() % 200 == 0) {
      h[0] += 1e-2;
    } else if (random() % 200 == 0) {
      h[1] = nan;
    } else if (i > size / 3 && i < 2 * size / 3) {
      std::copy_n(&pass.gyro.h[6 * (i - 1)], 3, h);
    }
  }
  const auto noise = other_readout_noise(pass);
  ASSERT_TRUE(noise);
  EXPECT_NEAR(noise->found_rad[0], 3e-5, 0.1e-5);
  EXPECT_NEAR(noise->found_rad[1], 1e-5, 0.03e-5);
}

TEST(ReadoutNoise, ThatIsMoreForAnHourIsTold) {
  struct Growing {
    White white{.sigma_rad = {1e-5, 1e-5}};
    std::size_t calls = 0;
    double operator()(int gyro) {
      const bool last = calls++ / 6 >= 3 * 3600 * 8;
      return (last && gyro == 1 ? 3 : 1) * white(gyro);
    }
  };
  const auto noise = other_readout_noise(turning(std::chrono::milliseconds(125), std::chrono::hours(4), Growing{}));
  ASSERT_TRUE(noise);
  EXPECT_FALSE(noise->is_steady());
  EXPECT_NEAR(noise->found_rad[1], 1e-5, 0.03e-5);
  EXPECT_NEAR(noise->most_rad[1], 3e-5, 0.1e-5);
  EXPECT_NEAR(noise->most_rad[0], 1e-5, 0.05e-5);
}

bool slews(Time t) { return std::fmod(to_seconds(t - Time{}), 600) < 60; }

TEST(ReadoutNoise, ThatIsMoreInSlewsIsTold) {
  struct InSlews {
    double times;
    White white{.sigma_rad = {1e-5, 1e-5}};
    std::size_t calls = 0;
    double operator()(int gyro) {
      const Time t = Time{} + static_cast<long>(calls++ / 6) * std::chrono::milliseconds(125);
      return (slews(t) && gyro == 1 ? times : 1) * white(gyro);
    }
  };
  const auto by = [](double times) {
    return other_readout_noise(turning(std::chrono::milliseconds(125), std::chrono::hours(2), InSlews{.times = times}));
  };
  const auto noise = by(5);
  ASSERT_TRUE(noise);
  EXPECT_FALSE(noise->is_steady());
  EXPECT_NEAR(noise->in_slews, std::sqrt((25 + 1) / 2.0), 0.15);  // known to 3 % by the windows in slews
  EXPECT_NEAR(noise->found_rad[1], 1.2e-5, 0.1e-5);               // a tenth of the time is in slews
  EXPECT_FALSE(by(1.5));                                          // √((1.5² + 1)/2) of the angle
}

TEST(ReadoutNoise, IsNotWhatShakesTheBody) {
  const Pass still = turning(std::chrono::milliseconds(125), std::chrono::hours(2), White{.sigma_rad = {1e-5, 1e-5}});
  for (const bool in_slews : {false, true}) {
    Pass pass = still;
    for (std::size_t i = 0; i < pass.gyro.t.size(); ++i) {
      const Time t = pass.gyro.t[i];
      const bool is_shaken = !in_slews || slews(t);
      const double rad = is_shaken ? 3e-5 * std::sin(2 * std::numbers::pi * 1.1 * to_seconds(t - Time{})) : 0;
      const Eigen::Matrix3d turn = Eigen::AngleAxisd(rad, Eigen::Vector3d(2, 1, 2) / 3).toRotationMatrix();
      for (int k = 0; k < 2; ++k) {
        Eigen::Map<Eigen::Vector3d> h(&pass.gyro.h[6 * i + 3 * static_cast<std::size_t>(k)]);
        h = (turn * h).eval();
      }
    }
    EXPECT_FALSE(other_readout_noise(pass)) << in_slews;
  }
}

TEST(ReadoutNoise, ThatHasPassedAFilterIsThatOfReadingsTogether) {
  // The mean of the last four: half the noise, of which neighbours share most, and together no less than before.
  Scenario scenario = scenario_in_eq1(5, std::chrono::hours(2));
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.readout.noise_rad = 1e-9;
  }
  Pass pass = sim::simulate(scenario).pass;
  std::array<std::array<double, 4>, 6> last{};  // of each component
  White white{.sigma_rad = {2e-5, 2e-5}};
  for (std::size_t i = 0; i < pass.gyro.h.size(); ++i) {
    std::array<double, 4>& its = last.at(i % 6);
    its.at(i / 6 % 4) = white(0);
    pass.gyro.h[i] += (its[0] + its[1] + its[2] + its[3]) / 4;
  }
  const auto noise = other_readout_noise(pass);
  ASSERT_TRUE(noise);
  for (const int gyro : {0, 1}) {
    EXPECT_NEAR(noise->found_rad[gyro], 1.8e-5, 0.15e-5);  // of a mean 2e-5, but these are parabolas
    EXPECT_NEAR(noise->lasting[gyro], 1.8, 0.15);
  }
  EXPECT_TRUE(noise->is_steady());
}

TEST(ReadoutNoise, OfReadingsTogetherIsNotMovedBySpikes) {
  Pass pass = two_hours().pass;
  std::mt19937_64 random(2);
  for (double& component : pass.gyro.h) {
    component += random() % 600 == 0 ? 1e-3 : 0;
  }
  EXPECT_FALSE(other_readout_noise(pass));
}

TEST(ReadoutNoise, ThatLastsIsFoundAndNamed) {
  sim::SimulatedPass simulated = two_hours();
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::array<double, 6> lasting{};
  const double kept = std::exp(-0.125);  // over 1 s
  for (std::size_t i = 0; i < simulated.pass.gyro.h.size(); ++i) {
    double& its = lasting.at(i % 6);
    its = kept * its + std::sqrt(1 - kept * kept) * normal(random);
    simulated.pass.gyro.h[i] += 2 * kArcsecond * its;
  }
  const CalibrationRun run = calibrate(simulated.pass, {});
  ASSERT_TRUE(run.readout_noise);
  EXPECT_GT(run.readout_noise->lasting[0], 1.5);
  EXPECT_GT(run.readout_noise->found_rad[0], 4 * kArcsecond);
  EXPECT_LT(nees_of(simulated.truth, run.calibration), 45);
  const auto& findings = run.calibration.verdict.findings;
  const auto is_it = [](const Finding& its) { return its.code == FindingCode::kReadoutNoise; };
  const auto finding = std::ranges::find_if(findings, is_it);
  ASSERT_NE(finding, findings.end());
  EXPECT_NE(finding->evidence.find("their noise lasts"), std::string::npos);
  EXPECT_TRUE(run.calibration.verdict.trustworthy);
}

TEST(ReadoutNoise, ToldWrongIsReplacedByThatFoundAndNamed) {
  Pass pass = two_hours().pass;
  const CalibrationRun right = calibrate(pass, {});
  EXPECT_FALSE(right.readout_noise);
  for (const double factor : {0.1, 5.0}) {
    pass.settings.gyros[0].readout_noise_rad = factor * two_hours().pass.settings.gyros[0].readout_noise_rad;
    const CalibrationRun run = calibrate(pass, {});
    EXPECT_NEAR(run.calibration.statistics.nis_mean.value(), right.calibration.statistics.nis_mean.value(), 0.02);
    EXPECT_NEAR(run.calibration.covariance.diagonal().sum(), right.calibration.covariance.diagonal().sum(),
                0.05 * right.calibration.covariance.diagonal().sum());
    const auto is_it = [](const Finding& finding) { return finding.code == FindingCode::kReadoutNoise; };
    EXPECT_EQ(std::ranges::count_if(run.calibration.verdict.findings, is_it), 1) << factor;
    EXPECT_EQ(run.calibration.verdict.trustworthy, right.calibration.verdict.trustworthy);
    CalibrationOptions told;
    told.find_noise = false;
    EXPECT_FALSE(calibrate(pass, told).readout_noise);
    pass.settings.prior = run.calibration;
    const NavigationRun flown = navigate(pass, {});
    pass.settings.prior.reset();
    ASSERT_TRUE(flown.readout_noise);
    EXPECT_EQ(std::ranges::count_if(flown.verdict.findings, is_it), 1) << factor;
  }
}

}  // namespace
}  // namespace trihedron::ground
