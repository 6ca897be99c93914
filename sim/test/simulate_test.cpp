#include "trihedron/sim/simulate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <future>
#include <thread>

#include "statistics.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Vector3d;

Scenario short_scenario(std::uint64_t seed = 0) {
  Scenario scenario;
  scenario.seed = seed;
  scenario.duration = std::chrono::minutes{10};
  return scenario;
}

Vector3d momentum_in(const Truth& truth, std::size_t fix, std::size_t gyro) {
  return Vector3d(&truth.h_in[(fix * truth.gyros.size() + gyro) * 3]);
}

/// h_b of the truth at the epoch of a fix.
Vector3d true_direction(const Truth& truth, std::size_t fix, std::size_t gyro) {
  const Rot<C, B<0>> C_c_b = Rot<C, B<0>>::exp(Vec<C>::assume(truth.gyros[gyro].alignment_rotation_vector_rad));
  const Rot<In, C> C_in_c = Rot<In, C>::assume(truth.q_in_c[fix]);
  return (C_c_b.inverse() * (C_in_c.inverse() * Vec<In>::assume(momentum_in(truth, fix, gyro)))).raw();
}

bool same(const SimulatedPass& a, const SimulatedPass& b) {
  const auto same_q = [](const Eigen::Quaterniond& p, const Eigen::Quaterniond& q) { return p.coeffs() == q.coeffs(); };
  return a.pass.gyro.t == b.pass.gyro.t && a.pass.gyro.h == b.pass.gyro.h &&
         a.pass.star_tracker.t == b.pass.star_tracker.t && a.truth.h_in == b.truth.h_in &&
         std::equal(a.pass.star_tracker.q_in_c.begin(), a.pass.star_tracker.q_in_c.end(),
                    b.pass.star_tracker.q_in_c.begin(), b.pass.star_tracker.q_in_c.end(), same_q);
}

TEST(Simulate, DefaultIsThePapersExperiment) {
  const SimulatedPass result = simulate({});
  const PassSettings& settings = result.pass.settings;
  EXPECT_EQ(settings.duration, std::chrono::hours{9});
  EXPECT_EQ(settings.gyro_period, std::chrono::milliseconds{125});
  EXPECT_EQ(settings.star_tracker_period, std::chrono::seconds{3});
  EXPECT_EQ(settings.gyros.size(), 2U);
  EXPECT_DOUBLE_EQ(settings.gyros[0].readout_noise_rad, 2 * kArcsecond);
  EXPECT_EQ(result.pass.gyro.size(), 259'201U);
  EXPECT_EQ(result.pass.gyro.h.size(), 259'201U * 6);
  EXPECT_EQ(result.pass.star_tracker.size(), 10'801U);
  EXPECT_EQ(result.truth.t.size(), 10'801U);
  EXPECT_EQ(result.truth.h_in.size(), 10'801U * 6);
  EXPECT_TRUE(result.events.empty());
  for (const Truth::Gyro& gyro : result.truth.gyros) {
    EXPECT_NEAR(gyro.alignment_rotation_vector_rad.norm(), 30 * kArcminute, 1e-12);
    EXPECT_EQ(gyro.unmodelled_rad_s.size(), 12U);
    ASSERT_EQ(gyro.drift_rad_s.size(), 7U);
    EXPECT_EQ(gyro.drift_rad_s[0].first, DriftCoefficient::of_eq1(Esg7::kK0));
    EXPECT_EQ(gyro.drift_rad_s[6].first, DriftCoefficient::of_eq1(Esg7::kNu31));
  }
}

TEST(Simulate, TelemetryIsTheTruthPlusNoise) {
  const SimulatedPass result = simulate({});
  test::Sequence gyro_errors;
  test::Sequence roll_errors;
  for (std::size_t fix = 0; fix < result.truth.t.size(); ++fix) {
    const std::size_t sample = fix * 24;
    ASSERT_EQ(result.pass.gyro.t[sample], result.truth.t[fix]);
    ASSERT_EQ(result.pass.star_tracker.t[fix], result.truth.t[fix]);
    for (std::size_t gyro = 0; gyro < 2; ++gyro) {
      const Vector3d h = true_direction(result.truth, fix, gyro);
      const Vector3d error = result.pass.gyro.direction(sample, static_cast<int>(gyro)) - h;
      const Vector3d u = h.unitOrthogonal();
      gyro_errors.push_back(u.dot(error));
      gyro_errors.push_back(h.cross(u).dot(error));
      ASSERT_NEAR(momentum_in(result.truth, fix, gyro).norm(), 1, 1e-11);
    }
    const Rot<In, C> truth = Rot<In, C>::assume(result.truth.q_in_c[fix]);
    roll_errors.push_back((truth.inverse() * Rot<In, C>::assume(result.pass.star_tracker.q_in_c[fix])).log().raw().x());
  }
  EXPECT_NEAR(test::mean_square(gyro_errors) / std::pow(2 * kArcsecond, 2), 1,
              test::kBand * test::mean_square_sigma(gyro_errors.size()));
  EXPECT_NEAR(test::mean_square(roll_errors) / std::pow(3 * kArcsecond, 2), 1,
              test::kBand * test::mean_square_sigma(roll_errors.size()));
}

TEST(Simulate, GivesTheSamePassOnAnyThread) {
  Scenario scenario = short_scenario(5);
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.direction_walk_rad_sqrt_s = 1e-8;
    gyro.drift.markov_sigma_rad_s = 1e-7;
    gyro.readout.spike_probability = 0.01;
  }
  const SimulatedPass here = simulate(scenario);
  std::vector<std::future<SimulatedPass>> elsewhere;
  for (int i = 0; i < 4; ++i) {
    elsewhere.push_back(std::async(std::launch::async, simulate, scenario));
  }
  for (std::future<SimulatedPass>& pass : elsewhere) {
    EXPECT_TRUE(same(here, pass.get()));
  }
}

TEST(Simulate, GivesEachPassAsAloneWhileOthersAreMade) {
  std::vector<Scenario> scenarios;
  for (const std::uint64_t seed : {0U, 1U, 0U, 2U}) {
    scenarios.push_back(short_scenario(seed));
    scenarios.back().star_tracker.aberration = StarTrackerScenario::Aberration::kUncorrected;
  }
  scenarios.back().gyros[0].drift.outside_sigma_rad_s = 1e-7;
  std::vector<SimulatedPass> alone;
  for (const Scenario& scenario : scenarios) {
    alone.push_back(simulate(scenario));
  }
  for (const std::size_t threads : {2U, 4U}) {
    std::vector<SimulatedPass> together(scenarios.size());
    std::vector<std::jthread> running;
    for (std::size_t first = 0; first < threads; ++first) {
      running.emplace_back([&, first] {
        for (std::size_t i = first; i < scenarios.size(); i += threads) {
          together[i] = simulate(scenarios[i]);
        }
      });
    }
    running.clear();  // waits for all
    for (std::size_t i = 0; i < scenarios.size(); ++i) {
      EXPECT_TRUE(same(alone[i], together[i])) << i << " of " << threads << " threads";
    }
  }
  EXPECT_TRUE(same(alone[0], alone[2]));
}

TEST(Simulate, SeedsDiffer) {
  const SimulatedPass zero = simulate(short_scenario(0));
  const SimulatedPass one = simulate(short_scenario(1));
  EXPECT_TRUE(same(zero, simulate(short_scenario(0))));
  EXPECT_FALSE(same(zero, one));
  for (std::size_t gyro = 0; gyro < 2; ++gyro) {
    EXPECT_NE(zero.truth.gyros[gyro].drift_rad_s[0].second, one.truth.gyros[gyro].drift_rad_s[0].second);
  }
  EXPECT_NE(zero.truth.gyros[0].drift_rad_s[0].second, zero.truth.gyros[1].drift_rad_s[0].second);
}

TEST(Simulate, AnotherSourceOfErrorLeavesTheNoiseOfTheOthersAsItWas) {
  const SimulatedPass clean = simulate(short_scenario());
  Scenario scenario = short_scenario();
  scenario.gyros[0].readout.bias_rad.setConstant(1e-4);
  scenario.gyros[0].drift.outside_sigma_rad_s = 1e-7;
  scenario.star_tracker.field_error_rad.setConstant(1e-5);
  const SimulatedPass other = simulate(scenario);
  EXPECT_FALSE(same(clean, other));
  for (std::size_t sample = 0; sample < clean.pass.gyro.size(); ++sample) {
    ASSERT_EQ(clean.pass.gyro.direction(sample, 1), other.pass.gyro.direction(sample, 1));
  }
  EXPECT_EQ(clean.truth.gyros[0].drift_rad_s, other.truth.gyros[0].drift_rad_s);
}

TEST(Simulate, FourGyrosAreFourGyros) {
  Scenario scenario = short_scenario();
  scenario.gyros.assign(4, GyroScenario{});
  const SimulatedPass result = simulate(scenario);
  EXPECT_EQ(result.pass.gyro.gyros, 4);
  EXPECT_EQ(result.truth.gyros.size(), 4U);
  EXPECT_EQ(result.pass.settings.gyros.size(), 4U);
  for (std::size_t gyro = 0; gyro < 4; ++gyro) {
    const Vector3d h = true_direction(result.truth, 100, gyro);
    EXPECT_LT((result.pass.gyro.direction(2400, static_cast<int>(gyro)) - h).norm(), 20 * kArcsecond);
    // All start in the same direction; each reads it in its own misaligned case.
    EXPECT_NEAR(momentum_in(result.truth, 0, gyro).dot(momentum_in(result.truth, 0, 0)), 1, 1e-15);
  }
}

TEST(Simulate, GapsHoldNoGyroSampleAndTruthGoesOn) {
  Scenario scenario = short_scenario();
  scenario.gyro_gaps = {{60, 120}};
  scenario.star_tracker.outages = {{30, 90}};
  const SimulatedPass result = simulate(scenario);
  EXPECT_EQ(result.pass.gyro.size(), 4801U - 480);
  EXPECT_EQ(result.pass.star_tracker.size(), 201U - 20);
  EXPECT_EQ(result.truth.t.size(), 201U);
  EXPECT_EQ(result.events.size(), 500U);
  for (std::size_t i = 1; i < result.pass.gyro.size(); ++i) {
    ASSERT_GT(result.pass.gyro.t[i], result.pass.gyro.t[i - 1]);
  }
}

TEST(Simulate, GapsBeginAndEndExactlyAtAnyTime) {
  for (int begin_s = 1; begin_s < 600; begin_s += 7) {
    Scenario scenario = short_scenario();
    scenario.gyro_period = std::chrono::seconds{1};
    scenario.gyro_gaps = {{static_cast<double>(begin_s), static_cast<double>(begin_s + 1)}};
    const SimulatedPass result = simulate(scenario);
    ASSERT_EQ(result.events.size(), 1U);
    ASSERT_EQ(result.events[0].t - scenario.epoch, std::chrono::seconds{begin_s});
  }
}

TEST(Simulate, PriorsAreWhatTheScenarioTellsAndNotTheTruth) {
  Scenario scenario = short_scenario();
  scenario.gyros[1].mounting_rotation_vector_rad << 0.1, 0.2, 0.3;
  const SimulatedPass result = simulate(scenario);
  const GyroPrior& prior = result.pass.settings.gyros[1];
  EXPECT_EQ(prior.alignment_rotation_vector_rad, scenario.gyros[1].mounting_rotation_vector_rad);
  EXPECT_TRUE(prior.drift_rad_s.empty());
  EXPECT_EQ(prior.drift_common_sigma_rad_s, scenario.gyros[1].drift.prior_sigma_rad_s);
  EXPECT_EQ(prior.alignment_sigma_rad, Vector3d::Constant(30 * kArcminute));
}

TEST(Simulate, RefusesWhatMakesNoSenseAndNamesTheField) {
  const auto refusal = [](auto change) -> std::string {
    Scenario scenario = short_scenario();
    change(scenario);
    try {
      static_cast<void>(simulate(scenario));
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  const auto names = [&](const char* field, auto change) {
    EXPECT_NE(refusal(change).find(field), std::string::npos) << field << ": " << refusal(change);
  };
  names("duration", [](Scenario& s) { s.duration = Duration{0}; });
  names("the period of [star_tracker]", [](Scenario& s) { s.star_tracker_period = std::chrono::milliseconds{3001}; });
  names("gyros", [](Scenario& s) { s.gyros.resize(1); });
  names("gyros", [](Scenario& s) { s.gyros.resize(5); });
  names("gyros[1].readout.noise_rad", [](Scenario& s) { s.gyros[1].readout.noise_rad = std::nan(""); });
  names("gyros[0].drift.markov_time_s", [](Scenario& s) { s.gyros[0].drift.markov_time_s = 0; });
  names("start direction", [](Scenario& s) { s.gyros[0].start_direction_c.setZero(); });
  names("drift harmonic W(2,5)", [](Scenario& s) { s.gyros[0].drift.harmonics = {{.degree = 2, .order = 5}}; });
  names("star_tracker.outlier_probability", [](Scenario& s) { s.star_tracker.outlier_probability = 1.1; });
  names("attitude.jitter_rad", [](Scenario& s) { s.attitude.jitter_rad = -1; });
  names("orbit", [](Scenario& s) { s.orbit.perigee_altitude_m = 1e9; });
  names("recorded", [](Scenario& s) { s.attitude.reference = AttitudeScenario::Reference::kRecorded; });
}

}  // namespace
}  // namespace trihedron::sim
