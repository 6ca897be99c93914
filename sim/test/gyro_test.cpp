#include "trihedron/sim/gyro.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "statistics.hpp"
#include "trihedron/sim/attitude.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Vector3d;
using test::Sequence;

constexpr double kStep_s = 0.125;
constexpr Duration kGyroPeriod = std::chrono::milliseconds{125};
constexpr std::size_t kSamples = 100'000;

/// Two directions across h.
struct Across {
  explicit Across(const Vector3d& h) : u(h.unitOrthogonal()), v(h.cross(u)) {}
  Vector3d u;
  Vector3d v;
};

const Vec<Case> kDirection = Vec<Case>::assume(0.6, -0.3, 0.8).normalized();

std::vector<Vector3d> readings(const ReadoutScenario& scenario, std::vector<Event>* events = nullptr,
                               std::uint64_t seed = 1, int gyro = 0, std::size_t n = kSamples) {
  Readout readout(scenario, kGyroPeriod, seed, gyro);
  std::vector<Event> ignored;
  std::vector<Vector3d> result;
  for (std::size_t i = 0; i < n; ++i) {
    result.push_back(
        readout.read(Time{} + kGyroPeriod * static_cast<std::int64_t>(i), kDirection, events ? *events : ignored));
  }
  return result;
}

/// The errors across h of telemetered directions.
std::pair<Sequence, Sequence> errors_across(const std::vector<Vector3d>& readings) {
  const Across across(kDirection.raw());
  Sequence u;
  Sequence v;
  for (const Vector3d& reading : readings) {
    u.push_back(across.u.dot(reading));
    v.push_back(across.v.dot(reading));
  }
  return {u, v};
}

ReadoutScenario silent() {
  ReadoutScenario scenario;
  scenario.noise_rad = 0;
  return scenario;
}

TEST(Readout, NoiseHasItsSigmaAcrossTheMomentumAndIsWhite) {
  const ReadoutScenario scenario;
  const auto [u, v] = errors_across(readings(scenario));
  const double band = test::kBand * test::mean_square_sigma(kSamples);
  EXPECT_NEAR(test::mean_square(u) / std::pow(scenario.noise_rad, 2), 1, band);
  EXPECT_NEAR(test::mean_square(v) / std::pow(scenario.noise_rad, 2), 1, band);
  const double correlation_band = test::kBand * test::correlation_sigma(kSamples);
  EXPECT_NEAR(test::correlation(u, v), 0, correlation_band);
  for (std::size_t lag = 1; lag <= 8; ++lag) {
    EXPECT_NEAR(test::correlation(u, u, lag), 0, correlation_band) << lag;
  }
}

TEST(Readout, NoiseHasTheAllanVarianceOfWhiteNoise) {
  const ReadoutScenario scenario;
  const Sequence u = errors_across(readings(scenario)).first;
  for (const std::size_t m : {1U, 8U, 64U, 512U}) {
    const double expected = std::pow(scenario.noise_rad, 2) / static_cast<double>(m);
    EXPECT_NEAR(test::allan_variance(u, m) / expected, 1, test::kBand * test::allan_variance_sigma(kSamples / m)) << m;
  }
}

TEST(Readout, NoiseOfGyrosAndSeedsIsIndependent) {
  const Sequence gyro0 = errors_across(readings({}, nullptr, 0, 0)).first;
  const Sequence gyro1 = errors_across(readings({}, nullptr, 0, 1)).first;
  const Sequence seed1 = errors_across(readings({}, nullptr, 1, 0)).first;
  const double band = test::kBand * test::correlation_sigma(kSamples);
  EXPECT_NEAR(test::correlation(gyro0, gyro1), 0, band);
  EXPECT_NEAR(test::correlation(gyro0, seed1), 0, band);
}

TEST(Readout, DirectionsAreUnit) {
  for (const Vector3d& reading : readings({}, nullptr, 1, 0, 1000)) {
    ASSERT_NEAR(reading.norm(), 1, 1e-15);
  }
}

TEST(Readout, QuantisationRoundsToItsMultiplesWithTheVarianceOfEvenError) {
  ReadoutScenario scenario;
  scenario.quantum_rad = 0.5 * kArcsecond;
  const std::vector<Vector3d> quantised = readings(scenario);
  scenario.quantum_rad = 0;
  const std::vector<Vector3d> fine = readings(scenario);
  Sequence error;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const Vector3d steps = quantised[i] / (0.5 * kArcsecond);
    // Of 4e5 steps the last digit is 6e-11.
    ASSERT_LT((steps - steps.array().round().matrix()).cwiseAbs().maxCoeff(), 1e-9);
    error.push_back(quantised[i].x() - fine[i].x());
  }
  // q²/12; an even error's mean square has the relative chance √(4/5 / n).
  EXPECT_NEAR(test::mean_square(error) * 12 / std::pow(0.5 * kArcsecond, 2), 1,
              test::kBand * std::sqrt(0.8 / static_cast<double>(kSamples)));
}

TEST(Readout, QuantisationErrorIsWhiteAndHasNothingOfTheNoise) {
  ReadoutScenario scenario;
  scenario.quantum_rad = 0.5 * kArcsecond;  // a quarter of the noise, which makes the errors of neighbours independent
  const std::vector<Vector3d> quantised = readings(scenario);
  scenario.quantum_rad = 0;
  const std::vector<Vector3d> fine = readings(scenario);
  Sequence error;
  Sequence noise;
  for (std::size_t i = 0; i < kSamples; ++i) {
    error.push_back(quantised[i].x() - fine[i].x());
    noise.push_back(fine[i].x() - kDirection.raw().x());
  }
  const double band = test::kBand * test::correlation_sigma(kSamples);
  EXPECT_NEAR(test::correlation(error, noise), 0, band);
  for (std::size_t lag = 1; lag <= 8; ++lag) {
    EXPECT_NEAR(test::correlation(error, error, lag), 0, band) << lag;
  }
}

TEST(Readout, BiasAndScaleDistortTheDirectionCosines) {
  ReadoutScenario scenario = silent();
  scenario.bias_rad << 1e-5, -2e-5, 3e-5;
  scenario.scale << 1e-4, 0, -2e-4;
  const Vector3d h = kDirection.raw();
  const Vector3d expected = (h + scenario.scale.cwiseProduct(h) + scenario.bias_rad).normalized();
  EXPECT_LT((readings(scenario, nullptr, 1, 0, 1).front() - expected).norm(), 1e-15);
}

TEST(Readout, DropoutsAreNanAtTheirRateAndReported) {
  ReadoutScenario scenario = silent();
  scenario.dropout_probability = 0.02;
  std::vector<Event> events;
  std::size_t dropped = 0;
  for (const Vector3d& reading : readings(scenario, &events)) {
    dropped += reading.hasNaN() ? 1U : 0U;
  }
  const double n = static_cast<double>(kSamples);
  EXPECT_NEAR(static_cast<double>(dropped), 0.02 * n, test::kBand * std::sqrt(0.02 * n));
  EXPECT_EQ(events.size(), dropped);
  EXPECT_EQ(events.front().fault, Fault::kReadoutDropout);
  EXPECT_EQ(events.front().gyro, 0);
}

TEST(Readout, SpikesAreOnOneAxisWithinTheirLimit) {
  ReadoutScenario scenario = silent();
  scenario.spike_probability = 0.01;
  std::vector<Event> events;
  const std::vector<Vector3d> all = readings(scenario, &events);
  double largest = 0;
  std::size_t spikes = 0;
  for (const Vector3d& reading : all) {
    const Vector3d error = (reading - kDirection.raw()).cwiseAbs();
    // What is not spiked differs by the rounding of normalisation.
    const auto off = (error.array() > 1e-12).count();
    ASSERT_LE(off, 1);
    spikes += static_cast<std::size_t>(off);
    largest = std::max(largest, error.maxCoeff());
  }
  const double n = static_cast<double>(kSamples);
  EXPECT_NEAR(static_cast<double>(spikes), 0.01 * n, test::kBand * std::sqrt(0.01 * n));
  EXPECT_EQ(events.size(), spikes);
  EXPECT_LE(largest, scenario.spike_rad);
  EXPECT_GT(largest, 0.98 * scenario.spike_rad);  // of 1000 even draws: short of the limit by 1/1000 on average
}

TEST(Readout, SpikesAreEvenWithinTheirLimitAndOverTheAxes) {
  ReadoutScenario scenario = silent();
  scenario.spike_probability = 1;
  std::array<double, 3> count{};
  Sequence size;
  for (const Vector3d& reading : readings(scenario)) {
    const Vector3d error = reading - kDirection.raw();
    Eigen::Index axis = 0;
    error.cwiseAbs().maxCoeff(&axis);
    ++count[static_cast<std::size_t>(axis)];
    size.push_back(error(axis) / scenario.spike_rad);
  }
  const double n = static_cast<double>(kSamples);
  for (const double spikes : count) {
    EXPECT_NEAR(spikes, n / 3, test::kBand * std::sqrt(n * 2 / 9));
  }
  // Even in ±1: mean square 1/3, that of the square 1/5; the mean is 0.
  EXPECT_NEAR(test::mean(size), 0, test::kBand / std::sqrt(3 * n));
  EXPECT_NEAR(test::mean_square(size), 1.0 / 3, test::kBand * std::sqrt((1.0 / 5 - 1.0 / 9) / n));
  for (std::size_t lag = 1; lag <= 4; ++lag) {
    EXPECT_NEAR(test::correlation(size, size, lag), 0, test::kBand * test::correlation_sigma(kSamples)) << lag;
  }
}

TEST(Readout, StuckSamplesRepeatForTheirTime) {
  ReadoutScenario scenario;
  scenario.stuck_probability = 0.001;
  scenario.stuck_s = 1;
  std::vector<Event> events;
  const std::vector<Vector3d> all = readings(scenario, &events);
  std::size_t repeats = 0;
  std::size_t run = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    run = all[i] == all[i - 1] ? run + 1 : 0;
    repeats += run > 0 ? 1U : 0U;
    ASSERT_LE(run, 8U);
  }
  EXPECT_EQ(repeats, events.size());
  // Starts at 1 ‰ of the samples that are not repeats.
  const double starts = 0.001 * static_cast<double>(kSamples - repeats);
  EXPECT_NEAR(static_cast<double>(repeats) / 8, starts, test::kBand * std::sqrt(starts));
}

TEST(Readout, AFaultLeavesTheNoiseOfOtherSamplesAsItWas) {
  ReadoutScenario scenario;
  const std::vector<Vector3d> clean = readings(scenario);
  scenario.dropout_probability = 0.1;
  scenario.spike_probability = 0.1;
  const std::vector<Vector3d> dirty = readings(scenario);
  std::size_t same = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    same += clean[i] == dirty[i] ? 1U : 0U;
  }
  const double expected = 0.81 * static_cast<double>(kSamples);
  EXPECT_NEAR(static_cast<double>(same), expected, test::kBand * std::sqrt(0.19 * expected));
}

/// κ = 0 and nothing outside eq. (1) unless told.
DriftScenario no_drift() {
  DriftScenario scenario;
  scenario.kappa_rad_s.emplace();
  scenario.outside_sigma_rad_s = 0;
  return scenario;
}

TEST(Drift, UnknownCoefficientsHaveTheSigmaThatTheEstimatorIsTold) {
  const DriftScenario scenario;
  Sequence kappa;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    const Drift drift(scenario, seed, 1);
    kappa.insert(kappa.end(), drift.kappa_rad_s().begin(), drift.kappa_rad_s().end());
  }
  EXPECT_NEAR(test::mean_square(kappa) / std::pow(scenario.prior_sigma_rad_s, 2), 1,
              test::kBand * test::mean_square_sigma(kappa.size()));
}

TEST(Drift, MembersOutsideEq1HaveTheirSigma) {
  DriftScenario scenario = no_drift();
  scenario.outside_sigma_rad_s = 1e-7;
  scenario.harmonics = {{DriftHarmonic::Potential::kW, 3, 0, 5e-7}};
  Sequence amplitudes;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    const Drift drift(scenario, seed, 0);
    ASSERT_EQ(drift.outside().members().size(), 13U);
    EXPECT_EQ(drift.outside().members().front().amplitude_rad_s, 5e-7);
    for (std::size_t i = 1; i < 13; ++i) {
      amplitudes.push_back(drift.outside().members()[i].amplitude_rad_s);
    }
  }
  EXPECT_NEAR(test::mean_square(amplitudes) / 1e-14, 1, test::kBand * test::mean_square_sigma(amplitudes.size()));
}

TEST(Drift, RateIsEq1PlusTheOtherMembers) {
  DriftScenario scenario = no_drift();
  scenario.kappa_rad_s = {1e-6, 2e-6, -3e-6, 4e-6, 5e-6, -6e-6, 7e-6};
  scenario.harmonics = {{DriftHarmonic::Potential::kD, 2, -1, 1e-7}};
  const Drift drift(scenario, 0, 0);
  const Esg7::Coefficients<double> kappa(scenario.kappa_rad_s->data());
  const Vector3d expected =
      Esg7::rate<double>(kDirection.raw(), kappa) + HarmonicField(scenario.harmonics).rate(kDirection.raw());
  EXPECT_LT((drift.rate(kDirection).raw() - expected).norm(), 1e-20);
}

TEST(Drift, CoefficientsWalkAsTheRootOfTime) {
  DriftScenario scenario = no_drift();
  scenario.coefficient_walk_rad_s_sqrt_s = 1e-9;
  Sequence after_100s;
  Sequence next_300s;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    Drift drift(scenario, seed, 0);
    const auto walk = [&](int steps) {
      for (int i = 0; i < steps; ++i) {
        drift.next_step(0, kStep_s);
      }
      return drift.kappa_rad_s();
    };
    const Esg7::Coefficients<double> early = walk(800);
    const Esg7::Coefficients<double> late = walk(2400) - early;
    after_100s.insert(after_100s.end(), early.begin(), early.end());
    next_300s.insert(next_300s.end(), late.begin(), late.end());
  }
  const double band = test::kBand * test::mean_square_sigma(after_100s.size());
  EXPECT_NEAR(test::mean_square(after_100s) / (100 * 1e-18), 1, band);
  EXPECT_NEAR(test::mean_square(next_300s) / (300 * 1e-18), 1, band);
  EXPECT_NEAR(test::correlation(after_100s, next_300s), 0, test::kBand * test::correlation_sigma(after_100s.size()));
}

TEST(Drift, WarmUpDecaysExponentially) {
  DriftScenario scenario = no_drift();
  scenario.kappa_rad_s->front() = 2e-6;
  scenario.warm_up_fraction = 0.5;
  scenario.warm_up_time_s = 1000;
  Drift drift(scenario, 0, 0);
  for (const double t : {0.0, 500.0, 1000.0, 5000.0}) {
    drift.next_step(t, kStep_s);
    EXPECT_NEAR(drift.kappa_rad_s()(0), 2e-6 * (1 + 0.5 * std::exp(-t / 1000)), 1e-20);
  }
}

TEST(Drift, MarkovDriftIsStationaryWithItsCorrelationTimeAndAllanVariance) {
  DriftScenario scenario = no_drift();
  scenario.markov_sigma_rad_s = 1e-7;
  scenario.markov_time_s = 10;
  Drift drift(scenario, 1, 0);
  Sequence start;
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    start.push_back(Drift(scenario, seed, 0).markov_rad_s().x());
  }
  EXPECT_NEAR(test::mean_square(start) / 1e-14, 1, test::kBand * test::mean_square_sigma(start.size()));

  const std::size_t n = 1'000'000;
  Sequence x;
  Sequence y;
  for (std::size_t i = 0; i < n; ++i) {
    drift.next_step(0, kStep_s);
    x.push_back(drift.markov_rad_s().x());
    y.push_back(drift.markov_rad_s().y());
  }
  // Correlated samples: as many independent ones as there are correlation times.
  const double independent = static_cast<double>(n) * kStep_s / scenario.markov_time_s;
  EXPECT_NEAR(test::mean_square(x) / 1e-14, 1, test::kBand * std::sqrt(2 / independent));
  EXPECT_NEAR(test::correlation(x, y), 0, test::kBand / std::sqrt(independent));
  for (const std::size_t lag : {1U, 40U, 80U, 160U}) {
    EXPECT_NEAR(test::correlation(x, x, lag), std::exp(-static_cast<double>(lag) * kStep_s / 10),
                test::kBand / std::sqrt(independent))
        << lag;
  }
  // IEEE Std 952 for τ ≫ T: 2 σ² T / τ × (1 − T/(2τ) (3 − …)).
  const double ratio = 10.0 / 125.0;  // T / τ
  const double expected = 2e-14 * ratio * (1 - ratio / 2 * 3);
  EXPECT_NEAR(test::allan_variance(x, 1000) / expected, 1, test::kBand * test::allan_variance_sigma(n / 1000));
}

GyroScenario walking(double walk_rad_sqrt_s) {
  GyroScenario scenario;
  scenario.drift = no_drift();
  scenario.drift.direction_walk_rad_sqrt_s = walk_rad_sqrt_s;
  return scenario;
}

TEST(Gyro, DirectionWalksAsTheRootOfTimeWithTheAllanVarianceOfWhiteRate) {
  const double walk = 2e-8;
  Gyro gyro(walking(walk), {}, 1, 0);
  const Across across(gyro.momentum().raw());
  Sequence rate_u;
  Sequence rate_v;
  Vector3d before = gyro.momentum().raw();
  for (std::size_t i = 0; i < kSamples; ++i) {
    gyro.advance(0, kStep_s, {}, {});
    const Vector3d change = (gyro.momentum().raw() - before) / kStep_s;
    before = gyro.momentum().raw();
    rate_u.push_back(across.u.dot(change));
    rate_v.push_back(across.v.dot(change));
  }
  EXPECT_NEAR(test::correlation(rate_u, rate_v), 0, test::kBand * test::correlation_sigma(kSamples));
  for (const std::size_t m : {1U, 16U, 256U}) {
    const double expected = walk * walk / (static_cast<double>(m) * kStep_s);  // N²/τ
    const double band = test::kBand * test::allan_variance_sigma(kSamples / m);
    EXPECT_NEAR(test::allan_variance(rate_u, m) / expected, 1, band) << m;
    EXPECT_NEAR(test::allan_variance(rate_v, m) / expected, 1, band) << m;
  }
  EXPECT_NEAR(gyro.momentum().norm(), 1, 1e-11);
}

TEST(Gyro, CaseThatSlipsReadsAMomentumThatStaysWhereItIs) {
  GyroScenario scenario;
  scenario.drift = no_drift();
  scenario.misalignment_rad = Vector3d::Zero();
  const Vector3d step(0, 0, 1e-3);
  scenario.mounting_change = {.step_rad = step, .step_at_s = 2 * kStep_s};
  Gyro gyro(scenario, {}, 1, 0);
  const Vector3d before = gyro.momentum_in_case().raw();
  gyro.advance(0, kStep_s, {}, {});
  EXPECT_LT((gyro.momentum_in_case().raw() - before).norm(), 1e-15);
  gyro.advance(kStep_s, kStep_s, {}, {});
  EXPECT_LT((gyro.alignment().log().raw() - step).norm(), 1e-15);
  // v_c = exp([step×]) v_b.
  EXPECT_LT((gyro.momentum_in_case().raw() - (before - step.cross(before))).norm(), 1e-6);
  EXPECT_EQ(gyro.truth().alignment_rotation_vector_rad, gyro.alignment().log().raw());
}

TEST(Gyro, MisalignmentIsOfItsLengthAndEvenInDirection) {
  const GyroScenario scenario;
  Vector3d sum = Vector3d::Zero();
  constexpr int kSeeds = 2000;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Vector3d v = Gyro(scenario, {}, seed, 0).alignment().log().raw();
    ASSERT_NEAR(v.norm(), 30 * kArcminute, 1e-15);
    sum += v.normalized() / kSeeds;
  }
  EXPECT_LT(sum.cwiseAbs().maxCoeff(), test::kBand * std::sqrt(1.0 / 3 / kSeeds));
}

TEST(Gyro, MisalignmentTurnsTheMountedCaseInTrackerAxes) {
  GyroScenario scenario;
  scenario.mounting_rotation_vector_rad << 0, 0, std::numbers::pi / 2;
  scenario.misalignment_rad = Vector3d(0.01, 0, 0);
  const Gyro gyro(scenario, {}, 0, 0);
  const Eigen::Matrix3d expected =
      (Eigen::AngleAxisd(0.01, Vector3d::UnitX()) * Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitZ()))
          .toRotationMatrix();
  EXPECT_LT((gyro.alignment().raw() - expected).norm(), 1e-15);
  EXPECT_LT((Rot<C, Case>::exp(Vec<C>::assume(gyro.truth().alignment_rotation_vector_rad)).raw() - expected).norm(),
            1e-15);
  // With the body along in, the momentum starts in its given direction.
  EXPECT_LT((gyro.momentum().raw() - scenario.start_direction_c.normalized()).norm(), 1e-15);
  EXPECT_LT((expected * gyro.momentum_in_case().raw() - gyro.momentum().raw()).norm(), 1e-15);
}

TEST(Gyro, TwoAtATimeHaveTheBitsOfEachAlone) {
  const KeplerJ2 orbit{OrbitScenario{}};
  const AttitudeProgramme attitude(AttitudeScenario{}, orbit, 3, 0, 2000);
  GyroScenario only_eq1;
  only_eq1.drift.outside_sigma_rad_s = 0;
  GyroScenario with_more;
  with_more.drift.outside_sigma_rad_s = 1e-7;
  with_more.drift.markov_sigma_rad_s = 1e-8;
  with_more.drift.bump_rad_s = 1e-7;
  with_more.drift.direction_walk_rad_sqrt_s = 1e-8;
  // The first pair has eq. (1) alone, the second more as well, the last gyro stands alone.
  std::vector<Gyro> together;
  for (const GyroScenario& scenario : {only_eq1, only_eq1, with_more, only_eq1, with_more}) {
    together.emplace_back(scenario, attitude.at(0), 3, static_cast<int>(together.size()));
  }
  std::vector<Gyro> alone = together;
  for (int i = 0; i < 100; ++i) {
    const double t = 600 + i * kStep_s;
    Gyro::advance_all(together, t, kStep_s, attitude.at(t + kStep_s / 2), attitude.at(t + kStep_s), false);
    for (Gyro& gyro : alone) {
      gyro.advance(t, kStep_s, attitude.at(t + kStep_s / 2), attitude.at(t + kStep_s));
    }
  }
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(together[i].momentum().raw(), alone[i].momentum().raw()) << i;
    EXPECT_EQ(together[i].momentum_in_case().raw(), alone[i].momentum_in_case().raw()) << i;
  }
}

TEST(Gyro, TwoAtATimeTurnAsFarAsTheyShould) {
  // So far in one step that the series of small angles does not do.
  GyroScenario fast;
  fast.misalignment_rad = Vector3d::Zero();
  fast.start_direction_c = Vector3d::UnitX();
  fast.drift = no_drift();
  fast.drift.harmonics = {{DriftHarmonic::Potential::kD, 1, 0, 1}};
  std::vector<Gyro> together;
  together.emplace_back(fast, Rot<In, C>(), 1, 0);
  together.emplace_back(fast, Rot<In, C>(), 1, 1);
  Gyro alone = together[0];
  Gyro::advance_all(together, 0, 0.5, {}, {}, false);
  alone.advance(0, 0.5, {}, {});
  EXPECT_GT((alone.momentum().raw() - Vector3d::UnitX()).norm(), 0.01);
  EXPECT_EQ(together[0].momentum().raw(), alone.momentum().raw());
  EXPECT_EQ(together[1].momentum().raw(), alone.momentum().raw());
}

TEST(Gyro, IntegrationIsThatOfAHundredTimesFinerStep) {
  const KeplerJ2 orbit{OrbitScenario{}};
  const AttitudeProgramme attitude(AttitudeScenario{}, orbit, 3, 0, 2000);
  GyroScenario scenario;
  scenario.drift.outside_sigma_rad_s = 1e-7;
  Gyro coarse(scenario, attitude.at(0), 3, 0);
  Gyro fine(scenario, attitude.at(0), 3, 0);
  const Vector3d start = coarse.momentum().raw();
  const int steps = 1800 * 8;
  for (int i = 0; i < steps; ++i) {
    const double t = i * kStep_s;
    coarse.advance(t, kStep_s, attitude.at(t + kStep_s / 2), attitude.at(t + kStep_s));
    for (int j = 0; j < 100; ++j) {
      const double tj = t + j * kStep_s / 100;
      fine.advance(tj, kStep_s / 100, attitude.at(tj + kStep_s / 200), attitude.at(tj + kStep_s / 100));
    }
  }
  EXPECT_GT((coarse.momentum().raw() - start).norm(), 1e-4);
  // Of 1.4e6 roundings of 1e-16 in the fine one a small part is all the same way; truncation is below that.
  EXPECT_LT((coarse.momentum().raw() - fine.momentum().raw()).norm(), 1e-11);
}

TEST(Gyro, RefusesAStartDirectionOfNoLength) {
  GyroScenario scenario;
  scenario.start_direction_c.setZero();
  EXPECT_THROW(Gyro(scenario, {}, 0, 0), std::invalid_argument);
}

}  // namespace
}  // namespace trihedron::sim
