// Gyro samples from 1 Hz to 200 Hz and fixes from 0.1 Hz to 20 Hz, of one and of two star trackers: every fix is used,
// and what the estimator says of its errors is true at all of them.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "mission.hpp"

namespace trihedron {
namespace {

struct AtRate {
  std::array<long, kFixStatuses> fixes{};
  std::size_t expected = 0;
  double nis = 0;  ///< over its degrees of freedom
  double components = 0;
  double nees = 0;  ///< of all states but the directions
  double states = 0;
  double attitude = 0;  ///< normalised square of the errors of the attitudes at fixes
  double attitudes = 0;
  [[nodiscard]] long count(FixStatus status) const { return fixes[static_cast<std::size_t>(status)]; }
};

AtRate fly_at(double gyro_hz, double fix_hz, int star_trackers, unsigned runs) {
  AtRate sum;
  for (unsigned run = 1; run <= runs; ++run) {
    const Layout layout{.star_trackers = star_trackers};
    const test::Mission mission(
        {.layout = layout, .duration_s = 240, .gyro_period_s = 1 / gyro_hz, .fix_period_s = 1 / fix_hz, .seed = run});
    const auto on_board = mission.given.on_board({.interval = CorrectionPolicy::kEveryFix});
    Time next_look(std::chrono::seconds(60));  // errors one after the other are those of the same samples
    const test::OnReport note = [&](const StepReport& report) {
      ++sum.fixes[static_cast<std::size_t>(report.fix.status)];
      if (report.fix.status == FixStatus::kUsed) {
        sum.nis += report.fix.nis;
        sum.components += static_cast<double>(report.fix.innovation.size());
      }
      if (report.calibrated && report.fix.t >= next_look) {
        next_look = report.fix.t + std::chrono::seconds(20);
        const double t_s = to_seconds(report.fix.t.time_since_epoch());
        const Eigen::Matrix3d truth = test::Flight::attitude(t_s, 0.5, -1000);
        sum.attitude += test::normalised_square(test::attitude_error(truth, *report.calibrated),
                                                report.calibrated->covariance_rad2);
        sum.attitudes += 3;
      }
    };
    mission.fly(*on_board, note);
    test::flush(*on_board, note);
    sum.expected += mission.fixes.size();
    const test::FullEstimator& estimator = on_board->estimator();
    const int first = layout.direction(layout.gyros);
    const Eigen::VectorXd errors = mission.errors(estimator, 0).tail(layout.size() - first);
    const Eigen::MatrixXd root = test::state_root(estimator).bottomRows(layout.size() - first);
    sum.nees += test::normalised_square(errors, root * root.transpose());
    sum.states += static_cast<double>(errors.size());
  }
  return sum;
}

class AtGyroRate : public testing::TestWithParam<double> {};

TEST_P(AtGyroRate, EveryFixIsUsedAndErrorsAreTrue) {
  constexpr unsigned kRuns = 3;
  double nees = 0;
  double states = 0;
  double attitude = 0;
  double attitudes = 0;
  for (const int star_trackers : {1, 2}) {
    for (const double fix_hz : {0.1, 1.0 / 3, 1.0, 5.0, 20.0}) {
      SCOPED_TRACE(testing::Message() << "fixes at " << fix_hz << " Hz of " << star_trackers << " star trackers");
      const AtRate at = fly_at(GetParam(), fix_hz, star_trackers, kRuns);
      EXPECT_EQ(at.count(FixStatus::kStarted), kRuns);
      // Chance makes one in 2e5 good fixes an outlier.
      EXPECT_LE(at.count(FixStatus::kRejectedByGate), 2);
      EXPECT_EQ(at.count(FixStatus::kStarted) + at.count(FixStatus::kUsed) + at.count(FixStatus::kRejectedByGate),
                static_cast<long>(at.expected));
      // Fixes that share samples agree a little better than independent ones: a tenth at most.
      EXPECT_NEAR(at.nis / at.components, 0.97, 0.08 + 3.29 * std::sqrt(2 / at.components));
      EXPECT_LT(at.nees / at.states, 1 + 3.29 * std::sqrt(2 / at.states));
      nees += at.nees;
      states += at.states;
      attitude += at.attitude;
      attitudes += at.attitudes;
    }
  }
  // Over all rates of fixes: honest, and not much more careful than it need be.
  EXPECT_NEAR(nees / states, 0.95, 0.1 + 3.29 * std::sqrt(2 / states));
  // Attitudes of one flight have the same errors of alignment: as many independent ones as flights.
  EXPECT_NEAR(attitude / attitudes, 0.95, 0.1 + 3.29 * std::sqrt(2 / (3.0 * 10 * kRuns)));
}

INSTANTIATE_TEST_SUITE_P(Hz, AtGyroRate, testing::Values(1.0, 2.0, 8.0, 25.0, 50.0, 200.0),
                         [](const auto& rate) { return "Of" + std::to_string(static_cast<int>(rate.param)) + "Hz"; });

TEST(SlowSamples, EveryFixIsUsedOfTenBetweenTwoOfThem) {
  const AtRate at = fly_at(2, 20, 1, 1);
  EXPECT_EQ(at.count(FixStatus::kUsed) + at.count(FixStatus::kStarted), static_cast<long>(at.expected));
}

TEST(Thinning, KeepsSamplesThatThereIsRoomForAndTellsOfTheOthers) {
  const test::Mission mission({.duration_s = 30, .gyro_period_s = 0.005});
  const auto on_board = mission.given.on_board();
  double last_s = -1;
  long used = 0;
  for (const GyroSample& sample : mission.samples) {
    const SampleStatus status = on_board->on_gyro(sample).sample;
    const double t_s = to_seconds(sample.t.time_since_epoch());
    EXPECT_EQ(status, t_s - last_s < 0.075 - 1e-9 ? SampleStatus::kThinned : SampleStatus::kUsed) << t_s;
    if (status == SampleStatus::kUsed) {
      last_s = t_s;
      ++used;
      EXPECT_EQ(on_board->t(), sample.t);
    }
  }
  EXPECT_EQ(used, 401);
}

}  // namespace
}  // namespace trihedron
