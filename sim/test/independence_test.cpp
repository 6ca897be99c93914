// What one source draws tells nothing of what another draws, of another gyro or of another seed.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>

#include "statistics.hpp"
#include "trihedron/sim/gyro.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Vector3d;
using test::Sequence;

/// What each source has drawn for each of many seeds, by name.
class Draws {
 public:
  template <class Values>
  void add(const std::string& source, const Values& values) {
    int number = 0;
    for (const double value : values) {
      by_name_[source + " " + std::to_string(number++)].push_back(value);
    }
  }
  [[nodiscard]] const std::map<std::string, Sequence>& by_name() const { return by_name_; }

 private:
  std::map<std::string, Sequence> by_name_;
};

/// The first draws of everything that belongs to a gyro.
void draw_of_gyro(std::uint64_t seed, int gyro, Draws& draws) {
  GyroScenario scenario;
  scenario.drift.outside_sigma_rad_s = 1e-7;
  scenario.drift.coefficient_walk_rad_s_sqrt_s = 1e-9;
  scenario.drift.direction_walk_rad_sqrt_s = 1e-8;
  scenario.drift.markov_sigma_rad_s = 1e-7;
  scenario.drift.markov_time_s = 0.01;  // forgotten in a step: start and step draw apart
  const std::string suffix = " of gyro " + std::to_string(gyro);

  Drift drift(scenario.drift, seed, static_cast<std::uint64_t>(gyro));
  const Esg7::Coefficients<double> kappa = drift.kappa_rad_s();
  draws.add("kappa" + suffix, kappa);
  Sequence outside;
  for (const DriftHarmonic& member : drift.outside().members()) {
    outside.push_back(member.amplitude_rad_s);
  }
  draws.add("outside" + suffix, outside);
  draws.add("Markov start" + suffix, drift.markov_rad_s());
  drift.next_step(0, 0.125);
  draws.add("Markov step" + suffix, drift.markov_rad_s());
  draws.add("coefficient walk" + suffix, Esg7::Coefficients<double>(drift.kappa_rad_s() - kappa));
  draws.add("direction walk" + suffix, drift.walk()->raw());
  draws.add("misalignment" + suffix, Gyro(scenario, {}, seed, gyro).alignment().log().raw());

  std::vector<Event> events;
  Readout readout(scenario.readout, std::chrono::milliseconds{125}, seed, gyro);
  const Vec<Case> z = Vec<Case>::assume(0, 0, 1);
  draws.add("readout noise" + suffix, Vector3d(readout.read({}, z, events)).head<2>());
}

/// ±1 for struck or not, where the chance is a half.
double struck(const std::vector<Event>& events, Fault fault) {
  return std::any_of(events.begin(), events.end(), [fault](const Event& e) { return e.fault == fault; }) ? 1 : -1;
}

/// The first fault of each kind. Later ones of two kinds on one stream would not meet, for they use it at different
/// rates.
void draw_faults_of_gyro(std::uint64_t seed, int gyro, Draws& draws) {
  constexpr Duration kPeriod = std::chrono::milliseconds{125};
  const ReadoutScenario scenario{
      .dropout_probability = 0.5, .spike_probability = 0.5, .stuck_probability = 0.5, .stuck_s = 0.125};
  Readout readout(scenario, kPeriod, seed, gyro);
  const Vec<Case> z = Vec<Case>::assume(0, 0, 1);
  std::vector<Event> first;
  std::vector<Event> second;  // tells whether the readout has been stuck since the first
  static_cast<void>(readout.read({}, z, first));
  static_cast<void>(readout.read(Time{} + kPeriod, z, second));
  draws.add("faults of gyro " + std::to_string(gyro),
            std::array{struck(first, Fault::kReadoutDropout), struck(first, Fault::kReadoutSpike),
                       struck(second, Fault::kReadoutStuck)});
}

/// A pass of one fix, attitude at rest but for jitter.
Scenario one_fix(std::uint64_t seed) {
  Scenario scenario;
  scenario.seed = seed;
  scenario.duration = std::chrono::seconds{1};
  scenario.star_tracker_period = std::chrono::seconds{3};
  scenario.attitude.reference = AttitudeScenario::Reference::kInertial;
  scenario.attitude.slews = std::vector<Slew>{};
  scenario.star_tracker.noise_rad.setZero();
  return scenario;
}

Vector3d error_of_fix(const SimulatedPass& result, std::size_t fix = 0) {
  return (Rot<In, C>::assume(result.truth.q_in_c[fix]).inverse() *
          Rot<In, C>::assume(result.pass.star_tracker.q_in_c[fix]))
      .log()
      .raw();
}

/// The first draws of the attitude and the star tracker; of the tracker one source at a time, to tell them apart.
void draw_of_head(std::uint64_t seed, Draws& draws) {
  Scenario scenario = one_fix(seed);
  scenario.star_tracker.noise_rad.setConstant(1e-5);
  const SimulatedPass noisy = simulate(scenario);
  draws.add("jitter", Rot<In, C>::assume(noisy.truth.q_in_c[0]).log().raw());
  draws.add("tracker noise", error_of_fix(noisy));
  scenario = one_fix(seed);
  scenario.star_tracker.field_error_rad.setConstant(1e-5);
  draws.add("field error", error_of_fix(simulate(scenario)));
  scenario = one_fix(seed);
  scenario.star_tracker.outlier_probability = 1;
  scenario.star_tracker.wrong_sign_probability = 0.5;
  const SimulatedPass wrong = simulate(scenario);
  draws.add("outlier", error_of_fix(wrong));
  draws.add("size of outlier", std::array{error_of_fix(wrong).norm() - scenario.star_tracker.outlier_rad / 2});
  scenario.star_tracker.dropout_probability = 0.5;
  draws.add("faults of the tracker", std::array{struck(wrong.events, Fault::kFixWrongSign),
                                                struck(simulate(scenario).events, Fault::kFixDropout)});
}

TEST(Independence, SourcesGyrosAndSeedsDrawApart) {
  constexpr std::size_t kSeeds = 2000;
  Draws draws;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    draw_of_gyro(seed, 0, draws);
    draw_of_gyro(seed, 1, draws);
    draw_faults_of_gyro(seed, 0, draws);
    draw_faults_of_gyro(seed, 1, draws);
    draw_of_head(seed, draws);
  }
  ASSERT_EQ(draws.by_name().size(), 2U * 43 + 15);
  const double band = test::kBand * test::correlation_sigma(kSeeds);
  for (auto a = draws.by_name().begin(); a != draws.by_name().end(); ++a) {
    EXPECT_LT(std::abs(test::mean(a->second)), test::kBand * std::sqrt(test::mean_square(a->second) / kSeeds))
        << a->first;
    EXPECT_NEAR(test::correlation(a->second, a->second, 1), 0, band) << a->first << " of neighbouring seeds";
    for (auto b = std::next(a); b != draws.by_name().end(); ++b) {
      EXPECT_NEAR(test::correlation(a->second, b->second), 0, band) << a->first << " and " << b->first;
    }
  }
}

constexpr double kProbability = 0.1;

/// By epoch of `period`: what is above its mean of `kProbability` where the fault struck.
Sequence strikes(const std::vector<Event>& events, Fault fault, int gyro, Time begin, Duration period, std::size_t n) {
  Sequence x(n, -kProbability);
  for (const Event& event : events) {
    if (event.fault == fault && event.gyro == gyro) {
      x[static_cast<std::size_t>((event.t - begin) / period)] += 1;
    }
  }
  return x;
}

/// Rate, no memory from one epoch to the next, nothing in common with each other.
void expect_apart(const std::vector<std::pair<std::string, Sequence>>& faults) {
  for (std::size_t i = 0; i < faults.size(); ++i) {
    const auto& [name, x] = faults[i];
    const double band = test::kBand * test::correlation_sigma(x.size());
    EXPECT_NEAR(test::mean(x), 0, band * std::sqrt(kProbability)) << name;
    for (std::size_t lag = 1; lag <= 4; ++lag) {
      EXPECT_NEAR(test::correlation(x, x, lag), 0, band) << name << " " << lag << " later";
    }
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_NEAR(test::correlation(x, faults[j].second), 0, band) << name << " and " << faults[j].first;
    }
  }
}

TEST(Independence, FaultsOfTheReadoutStrikeApart) {
  constexpr std::size_t kReadings = 100'000;
  constexpr Duration kPeriod = std::chrono::milliseconds{125};
  ReadoutScenario scenario;
  scenario.dropout_probability = kProbability;
  scenario.spike_probability = kProbability;
  std::vector<std::pair<std::string, Sequence>> faults;
  for (const int gyro : {0, 1}) {
    Readout readout(scenario, kPeriod, 1, gyro);
    std::vector<Event> events;
    for (std::size_t i = 0; i < kReadings; ++i) {
      static_cast<void>(
          readout.read(Time{} + kPeriod * static_cast<std::int64_t>(i), Vec<Case>::assume(0.6, 0, 0.8), events));
    }
    for (const auto& [name, fault] :
         {std::pair("dropout ", Fault::kReadoutDropout), std::pair("spike ", Fault::kReadoutSpike)}) {
      faults.emplace_back(name + std::to_string(gyro), strikes(events, fault, gyro, Time{}, kPeriod, kReadings));
    }
  }
  expect_apart(faults);
}

TEST(Independence, FaultsOfTheStarTrackerStrikeApartAndOutliersTurnAboutAnyAxis) {
  Scenario scenario = one_fix(1);
  scenario.duration = std::chrono::hours{9};
  scenario.gyro_period = std::chrono::seconds{3};
  scenario.star_tracker.outlier_probability = kProbability;
  scenario.star_tracker.wrong_sign_probability = kProbability;
  const SimulatedPass full = simulate(scenario);
  const std::size_t n = full.truth.t.size();
  const auto of = [&](const SimulatedPass& result, Fault fault) {
    return strikes(result.events, fault, -1, scenario.epoch, scenario.star_tracker_period, n);
  };
  // A dropped fix shows no other fault, so that dropouts come from a pass of their own.
  Scenario thinned = scenario;
  thinned.star_tracker.dropout_probability = kProbability;
  expect_apart({{"outlier", of(full, Fault::kFixOutlier)},
                {"wrong sign", of(full, Fault::kFixWrongSign)},
                {"dropout", of(simulate(thinned), Fault::kFixDropout)}});

  Vector3d mean = Vector3d::Zero();
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  double outliers = 0;
  for (std::size_t fix = 0; fix < n; ++fix) {
    const Vector3d e = error_of_fix(full, fix);
    if (e.norm() > 1e-9) {
      ++outliers;
      mean += e.normalized();
      square += e.normalized() * e.normalized().transpose();
    }
  }
  // As for any even direction: mean 0 ± √(1/3n), mean square 1/3 ± √((1/5 − 1/9)/n).
  EXPECT_LT((mean / outliers).cwiseAbs().maxCoeff(), test::kBand * std::sqrt(1 / 3.0 / outliers));
  EXPECT_LT((square / outliers - Eigen::Matrix3d::Identity() / 3).cwiseAbs().maxCoeff(),
            test::kBand * std::sqrt(0.0889 / outliers));
}

}  // namespace
}  // namespace trihedron::sim
