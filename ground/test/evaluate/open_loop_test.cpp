#include "trihedron/ground/evaluate/open_loop.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <limits>

#include "passes.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::ground {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;

constexpr double kLimit = 5 * kArcminute;

/// Three hours of the paper's experiment with all drift in the model.
const sim::SimulatedPass& three_hours() {
  static const sim::SimulatedPass simulated = [] {
    Scenario scenario;
    scenario.seed = 5;
    scenario.duration = std::chrono::hours(3);
    for (GyroScenario& gyro : scenario.gyros) {
      gyro.drift.outside_sigma_rad_s = 0;
    }
    return sim::simulate(scenario);
  }();
  return simulated;
}

std::vector<GyroCalibration> true_gyros(std::size_t row) { return ground::true_gyros(three_hours().truth, row); }

TEST(OpenLoop, WithTheTrueGyrosStaysWithinTheReadoutNoise) {
  const auto& [pass, truth, events] = three_hours();
  const auto history = fly_open_loop(pass, truth.t[100], true_gyros(100), truth.t);
  EXPECT_EQ(history.t.front(), truth.t[100]);
  EXPECT_EQ(history.age_s.back(), 10'500);
  const auto errors = attitude_errors(history, truth.t, truth.q_in_c);
  ASSERT_EQ(errors.t.size(), truth.t.size() - 100);
  const ErrorStatistics all = statistics(errors);
  // 2″ per direction cosine and axis; the attitude about one of the momenta has a little more.
  EXPECT_LT(all.rms_rad.maxCoeff(), 3 * kArcsecond);
  EXPECT_GT(all.rms_rad.minCoeff(), 1 * kArcsecond);
}

TEST(OpenLoop, InterpolatesBetweenSamplesAndLeavesOutWhereThereAreNone) {
  auto [pass, truth, events] = three_hours();
  std::vector<Time> between;
  for (int i = 0; i < 100; ++i) {
    between.push_back(truth.t[static_cast<std::size_t>(i)] + std::chrono::milliseconds(60));
  }
  EXPECT_EQ(fly_open_loop(pass, truth.t[0], true_gyros(0), between).size(), 100U);
  // A gap of a minute, and a sample that is no direction.
  for (std::size_t i = 0; i < 480 * 3; ++i) {
    pass.gyro.h[480 * 6 + i] = std::numeric_limits<double>::quiet_NaN();
  }
  const auto history = fly_open_loop(pass, truth.t[0], true_gyros(0), truth.t);
  EXPECT_EQ(history.size(), truth.t.size() - 10);
  EXPECT_LT(statistics(attitude_errors(history, truth.t, truth.q_in_c)).max_total_rad, 15 * kArcsecond);
}

TEST(OpenLoop, RefusesWhatItCannotFly) {
  const Pass& pass = three_hours().pass;
  const std::vector<Time>& epochs = three_hours().truth.t;
  auto gyros = true_gyros(0);
  // Seven coefficients are not those of these models, and there is no degree of 7.
  for (const DriftModelId& model : {vsh(3), vsh(7), kEsg20}) {
    gyros[1].drift_model = model;
    EXPECT_THROW(static_cast<void>(fly_open_loop(pass, epochs[0], gyros, epochs)), SetupError) << name_of(model);
  }
  gyros.pop_back();
  EXPECT_THROW(static_cast<void>(fly_open_loop(pass, epochs[0], gyros, epochs)), SetupError);
}

TEST(OpenLoops, MeasureTheExtensionFromTheSecondCorrectionOn) {
  const auto& [pass, truth, events] = three_hours();
  const CalibrationRun run = calibrate(pass, {});
  ASSERT_EQ(run.corrections.size(), 3U);
  EXPECT_EQ(run.corrections[1].t - run.corrections[0].t, minutes(90));
  const auto loops = fly_open_loops(pass, run, truth.t, truth.q_in_c, kLimit);
  ASSERT_EQ(loops.size(), 3U);
  const auto& [before, after] = loops[1].intervals;
  ASSERT_TRUE(before.passed);
  EXPECT_LT(*before.passed, minutes(15));
  EXPECT_FALSE(after.passed);
  EXPECT_EQ(after.observed, minutes(90));
  const auto extension = median_extension(loops);
  ASSERT_TRUE(extension);
  EXPECT_DOUBLE_EQ(extension->factor, to_seconds(minutes(90)) / to_seconds(*before.passed));
  EXPECT_TRUE(extension->is_lower_bound);
  // The third is at the end of the pass: nothing to watch.
  EXPECT_EQ(loops[2].intervals.extension(), std::nullopt);

  const auto alone = fly_open_loops(pass, run, truth.t, truth.q_in_c, kLimit, OpenLoopScope::kExtension);
  ASSERT_EQ(alone.size(), 3U);
  EXPECT_TRUE(alone[0].calibrated.t.empty());
  EXPECT_EQ(alone[1].calibrated.error_rad, loops[1].calibrated.error_rad);
  EXPECT_FALSE(loops[1].predicted.empty());
  EXPECT_TRUE(alone[1].predicted.empty());
  EXPECT_EQ(median_extension(alone)->factor, extension->factor);
}

TEST(OpenLoops, WithBetterCoefficientsLastLonger) {
  const auto& [pass, truth, events] = three_hours();
  CalibrationRun run;
  for (const std::size_t epoch : {0U, 600U, 1200U}) {
    Correction correction{truth.t[epoch], true_gyros(epoch), true_gyros(epoch), {}};
    for (std::size_t i = 0; i < 7; ++i) {
      correction.known_before[0].drift_rad_s[i] += 1e-5;
      correction.calibrated[0].drift_rad_s[i] += 1e-6;
    }
    run.corrections.push_back(correction);
  }
  const auto extension = median_extension(fly_open_loops(pass, run, truth.t, truth.q_in_c, kArcminute));
  ASSERT_TRUE(extension);
  EXPECT_FALSE(extension->is_lower_bound);
  EXPECT_GT(extension->factor, 3);
  EXPECT_LT(extension->factor, 30);
}

}  // namespace
}  // namespace trihedron::ground
