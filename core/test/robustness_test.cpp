// What goes wrong in flight, and that it does not take the calibration with it: flights with one thing wrong against
// the same flights without.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "flight.hpp"

namespace trihedron {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

using Pair = test::PairEstimator;
using Full = test::FullEstimator;

template <class Estimator>
std::unique_ptr<OnBoard<Estimator>> make_on_board(const test::Given<Estimator>& given = test::Given<Estimator>()) {
  return given.on_board();
}

/// What was done with each fix.
template <class OnBoard>
std::vector<StepReport> fly_fixes(const test::Flight& flight, OnBoard& on_board) {
  std::vector<StepReport> fixes;
  const auto note = [&](const StepReport& report) {
    if (report.fix.status != FixStatus::kNone && report.fix.status != FixStatus::kPending) {
      fixes.push_back(report);
    }
  };
  test::fly(flight, on_board, note);
  test::flush(on_board, note);
  return fixes;
}

long count(const std::vector<StepReport>& fixes, FixStatus status) {
  return std::count_if(fixes.begin(), fixes.end(),
                       [&](const StepReport& report) { return report.fix.status == status; });
}

/// Turns the fixes of an interval by an angle about x.
void turn_fixes(test::Flight& flight, std::size_t begin, std::size_t end, double angle_rad) {
  for (std::size_t i = begin; i < std::min(end, flight.fixes.size()); ++i) {
    flight.fixes[i].q_in_c =
        flight.fixes[i].q_in_c * Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitX()));
  }
}

/// Largest error of the momenta at the end, rad.
template <class OnBoard>
double momentum_error(const OnBoard& on_board, const test::Flight& flight) {
  double worst = 0;
  for (int k = 0; k < 2; ++k) {
    worst = std::max(worst, angle_between<double>(on_board.estimator().gyros()[k].h_in, flight.truth[k].h_in));
  }
  return worst;
}

// ---- A gyro with spikes

template <class Estimator>
class SpikedGyro : public testing::Test {};
using SpikedEstimators = testing::Types<PaperEstimator, Pair, Full>;
TYPED_TEST_SUITE(SpikedGyro, SpikedEstimators);

TYPED_TEST(SpikedGyro, GivesNoAttitudeInPlaceOfAWrongOne) {
  test::Flight flight({.duration_s = 1800});
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> even;
  for (GyroSample& sample : flight.samples) {
    for (int k = 0; k < 2; ++k) {
      if (even(random) < 0.01) {  // a degree in any direction, the length kept
        const Eigen::Vector3d h = sample.h_b[k];
        sample.h_b[k] = rotated<double>(h, kDegree * h.cross(test::white(random, normal)).normalized());
      }
    }
  }
  const auto on_board = make_on_board<TypeParam>();
  double worst = 0;
  int given = 0;
  int samples = 0;
  std::size_t sample = 0;
  test::fly(flight, *on_board, [&](const StepReport& report) {
    if (report.sample == SampleStatus::kNone) {
      return;
    }
    const Eigen::Matrix3d& truth = flight.C_in_c_at_samples[sample++];
    if (!on_board->navigator().started()) {
      return;
    }
    ++samples;
    if (const auto attitude = on_board->navigation_attitude()) {
      ++given;
      const Eigen::Vector3d error = test::attitude_error(truth, attitude.value());
      worst = std::max(
          worst, error.cwiseQuotient(attitude.value().covariance_rad2.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff());
    }
  });
  EXPECT_LT(worst, 10);  // a spike is a thousand
  EXPECT_GT(given, 0.97 * samples);
  EXPECT_LT(given, 0.99 * samples);
}

// ---- A star tracker that lies

template <class Estimator>
class LyingTracker : public testing::Test {};
using Estimators = testing::Types<PaperEstimator, Pair>;
TYPED_TEST_SUITE(LyingTracker, Estimators);

TYPED_TEST(LyingTracker, IsNotBelievedForMinutes) {
  constexpr std::size_t kFirst = 300;
  for (const std::size_t length : {std::size_t{40}, std::size_t{200}}) {  // 2 and 10 min
    test::Flight flight({.duration_s = 2700});
    turn_fixes(flight, kFirst, kFirst + length, 3 * kDegree);
    const auto on_board = make_on_board<TypeParam>();
    const auto fixes = fly_fixes(flight, *on_board);
    EXPECT_EQ(count(fixes, FixStatus::kRejectedByGate), static_cast<long>(length));
    EXPECT_EQ(count(fixes, FixStatus::kUsed), static_cast<long>(flight.fixes.size() - length) - 1);
    EXPECT_TRUE(fixes[kFirst + length - 1].fix.jumped);
    EXPECT_FALSE(fixes[kFirst + length].fix.jumped);
    // As if there had been no fixes at all in that time.
    test::Flight gap({.duration_s = 2700});
    gap.fixes.erase(gap.fixes.begin() + kFirst, gap.fixes.begin() + kFirst + static_cast<long>(length));
    const auto other = make_on_board<TypeParam>();
    fly_fixes(gap, *other);
    EXPECT_LT(momentum_error(*on_board, flight), momentum_error(*other, gap) + 0.05 * test::kArcsecond);
  }
}

TYPED_TEST(LyingTracker, IsBelievedInTheEnd) {
  // Turned in its mount for good, by more than drift can make: not locked out.
  test::Flight flight({.duration_s = 2700});
  turn_fixes(flight, 300, flight.fixes.size(), kDegree);
  const auto on_board = make_on_board<TypeParam>();
  const auto fixes = fly_fixes(flight, *on_board);
  EXPECT_EQ(std::count_if(fixes.begin(), fixes.end(), [](const StepReport& report) { return report.fix.jumped; }), 399);
  EXPECT_EQ(fixes[300 + 399].fix.status, FixStatus::kUsedAfterReopening);
  EXPECT_EQ(fixes.back().fix.status, FixStatus::kUsed);
}

TYPED_TEST(LyingTracker, IsNotTakenForOneWhenTheModelGoesWrongStepByStep) {
  // All that is seen turns by 1e-5 rad/s, which no parameter explains: 6″ a minute.
  test::Flight flight({.duration_s = 1800});
  for (std::size_t i = 300; i < flight.fixes.size(); ++i) {
    turn_fixes(flight, i, i + 1, std::min(1e-5 * 3 * static_cast<double>(i - 300), 2e-3));
  }
  const auto on_board = make_on_board<TypeParam>();
  const auto fixes = fly_fixes(flight, *on_board);
  EXPECT_GE(count(fixes, FixStatus::kUsedAfterReopening), 1);
  int longest = 0;
  for (const StepReport& report : fixes) {
    longest = std::max(longest, report.fix.rejections_in_a_row);
  }
  EXPECT_EQ(longest, 19);
  EXPECT_EQ(fixes.back().fix.status, FixStatus::kUsed);
}

TYPED_TEST(LyingTracker, OfTheFirstFixOnlyIsLeftAtTheSecond) {
  test::Flight flight({.duration_s = 1800});
  turn_fixes(flight, 0, 1, 3 * kDegree);
  const auto on_board = make_on_board<TypeParam>();
  const auto fixes = fly_fixes(flight, *on_board);
  EXPECT_EQ(fixes[1].fix.status, FixStatus::kRestarted);
  EXPECT_EQ(count(fixes, FixStatus::kUsed), static_cast<long>(fixes.size()) - 2);
  EXPECT_LT(momentum_error(*on_board, flight), 60 * test::kArcsecond);
}

// ---- Without a star tracker: the angles between the momenta

/// After the last sample: errors of momenta and parameters over flights, with and without the angles.
struct Bridged {
  double angle_square = 0;    ///< of the error of the angle between the momenta, rad²
  double angle_variance = 0;  ///< as the estimator gives it
  double angle_nees = 0;      ///< of the two, mean
  double nees = 0;            ///< of the 20 parameters, mean
  long looked = 0;
  long rejected = 0;
};

Bridged bridge(int runs, const test::FlightPlan& plan, double last_fix_s, double alignment_sigma_rad, bool use_angles) {
  Bridged mean;
  for (int run = 1; run <= runs; ++run) {
    test::FlightPlan own = plan;
    own.seed = static_cast<unsigned>(run);
    test::Flight flight(own);
    flight.fixes.resize(static_cast<std::size_t>(last_fix_s / 3) + 1);
    test::PairGiven given;
    given.set_alignment_sigma(alignment_sigma_rad);
    test::draw_means(flight.truth, own.seed, alignment_sigma_rad, given.prior);
    given.setup.angles_after = use_angles ? std::chrono::minutes(1) : CalibrationSetup::kNever;
    const auto on_board = make_on_board(given);
    test::fly(flight, *on_board, [&](const StepReport& report) {
      mean.looked += report.angles.status == FixStatus::kUsed;
      mean.rejected += report.angles.status == FixStatus::kRejectedByGate;
    });
    // The estimator stands some seconds before the end; the momenta turn by thousandths of an arcsecond in them.
    const Pair& estimator = on_board->estimator();
    const auto& gyros = estimator.gyros();
    const Layout& layout = estimator.layout();
    const Eigen::Vector3d n = gyros[0].h_in.cross(gyros[1].h_in).normalized();
    Pair::Rows3 by_errors = Pair::Rows3::Zero(3, layout.size());
    for (int k = 0; k < layout.gyros; ++k) {
      by_errors.row(0).segment<3>(layout.direction(k)) = (k == 0 ? 1 : -1) * n.transpose();
    }
    carry_back(layout, estimator.since_fix(), by_errors);
    const double variance = estimator.covariance_of_errors(by_errors)(0, 0);
    const double off = angle_between<double>(gyros[0].h_in, gyros[1].h_in) -
                       angle_between<double>(flight.truth[0].h_in, flight.truth[1].h_in);
    mean.angle_square += off * off / runs;
    mean.angle_variance += variance / runs;
    mean.angle_nees += off * off / variance / runs;
    mean.nees += test::parameter_nees(flight.truth, estimator) / runs;
  }
  return mean;
}

TEST(AnglesWithoutFixes, KeepTheAngleOverAnHourAndAreHonest) {
  constexpr int kRuns = 20;
  const test::FlightPlan plan{.duration_s = 600 + 3600};
  const Bridged without = bridge(kRuns, plan, 600, 8e-3, false);
  const Bridged with = bridge(kRuns, plan, 600, 8e-3, true);
  EXPECT_EQ(without.looked + without.rejected, 0);
  EXPECT_NEAR(static_cast<double>(with.looked) / kRuns, (3600 - 60) / 3, 3);
  EXPECT_LE(with.rejected, 1);  // of 24 000 that are good
  EXPECT_LT(with.angle_square, 1e-4 * without.angle_square);
  EXPECT_LT(with.angle_variance, 1e-4 * without.angle_variance);
  EXPECT_NEAR(with.angle_nees, 1, 3.29 * std::sqrt(2.0 / kRuns));
  EXPECT_NEAR(with.nees, 20, 3.29 * std::sqrt(40.0 / kRuns));
}

TEST(AnglesWithoutFixes, AreHonestInSteadyFlightWithHalfADegree) {
  // The terms of second order are large here, and the same in all 1200 looks.
  constexpr int kRuns = 20;
  const Bridged with = bridge(kRuns, {.duration_s = 600 + 3600, .slews_rad = 0}, 600, 8e-3, true);
  EXPECT_LT(with.angle_nees, 1 + 3.29 * std::sqrt(2.0 / kRuns));
  EXPECT_LT(with.nees, 20 + 3.29 * std::sqrt(40.0 / kRuns));
}

/// An estimator that has just been started, and readings that agree with it.
template <class Estimator>
struct Started {
  std::unique_ptr<Estimator> estimator;
  Eigen::Matrix3d C_in_c = test::turn(0.3, -0.2, 0.9);
  FixReadings readings;

  explicit Started(const Layout& layout = {}) : estimator(test::Given<Estimator>(layout).estimator()) {
    const Eigen::Vector3d h_c[] = {{0.8, 0.1, 0.6}, {-0.1, 0.9, 0.4}, {0.5, -0.6, 0.7}};
    readings.used = all_gyros(layout.gyros);
    for (int k = 0; k < layout.gyros; ++k) {
      readings.h_b[k] = h_c[k].normalized();
    }
    EXPECT_EQ(estimator->correct({Time{}, Eigen::Quaterniond(C_in_c)}, readings).status, FixStatus::kStarted);
  }
  /// By a second fix that agrees.
  void confirm() {
    const StarFix second{Time(std::chrono::seconds(1)), Eigen::Quaterniond(C_in_c)};
    EXPECT_EQ(estimator->correct(second, readings).status, FixStatus::kUsed);
  }
};

/// Three gyros with eq. (1).
const Layout kThree{.gyros = 3};

template <class Estimator>
void expect_nothing_of_common_turns(const Layout& layout) {
  Started<Estimator> s(layout);
  Estimator& estimator = *s.estimator;
  // A turn of all directions, of all alignments, and of one gyro's direction and alignment together.
  Eigen::VectorXd unseen[3];
  const Eigen::Vector3d n = Eigen::Vector3d(1, 2, 3).normalized();
  for (auto& v : unseen) {
    v.setZero(layout.size());
  }
  for (int k = 0; k < layout.gyros; ++k) {
    unseen[0].segment<3>(layout.direction(k)) = n;
    unseen[1].segment<3>(layout.alignment(k)) = n;
  }
  unseen[2].segment<3>(layout.direction(0)) = n;
  unseen[2].segment<3>(layout.alignment(0)) = s.C_in_c.transpose() * n;
  Eigen::VectorXd seen = Eigen::VectorXd::Zero(layout.size());
  seen.segment<3>(layout.direction(0)) = estimator.gyros()[0].h_in.cross(estimator.gyros()[1].h_in).normalized();
  const auto information_of = [&](const Eigen::VectorXd& v) { return test::information_along(estimator, v); };
  const double before[] = {information_of(unseen[0]), information_of(unseen[1]), information_of(unseen[2])};
  const double seen_before = information_of(seen);
  constexpr int kLooks = 1000;
  for (int i = 1; i <= kLooks; ++i) {
    ASSERT_EQ(estimator.check_angles(Time(std::chrono::seconds(3 * i)), s.readings).status, FixStatus::kUsed);
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(information_of(unseen[i]) / before[i], 1, 1e-9) << i;
  }
  const double sigma_rad = estimator.setup().readout_noise_rad[0];
  EXPECT_GT(information_of(seen) - seen_before, 1 / (sigma_rad * sigma_rad));
}

TEST(AnglesWithoutFixes, SayNothingOfWhatTurnsAllMomenta) {
  expect_nothing_of_common_turns<Pair>({});
  expect_nothing_of_common_turns<Full>(kThree);
}

TEST(AnglesWithoutFixes, ShowAGyroThatHasJumped) {
  Started<Pair> s;
  const Eigen::Vector3d other = s.readings.h_b[1];
  s.readings.h_b[0] = (s.readings.h_b[0] + 1e-3 * other).normalized();
  const auto before = s.estimator->gyros()[0].h_in;
  for (int i = 1; i <= 30; ++i) {  // never believed, however often
    const auto report = s.estimator->check_angles(Time(std::chrono::seconds(3 * i)), s.readings);
    EXPECT_EQ(report.status, FixStatus::kRejectedByGate);
    EXPECT_EQ(report.rejections_in_a_row, i);
    EXPECT_GT(report.nis, 21);
  }
  EXPECT_EQ(s.estimator->gyros()[0].h_in, before);
}

TEST(AnglesWithoutFixes, AreNotToldOfMomentaThatAreReadNearlyParallel) {
  Started<Pair> s;
  const Eigen::Vector3d before = s.estimator->gyros()[0].h_in;
  FixReadings parallel = s.readings;
  parallel.h_b[1] = parallel.h_b[0];
  EXPECT_EQ(s.estimator->check_angles(Time(std::chrono::seconds(3)), parallel).status, FixStatus::kRejectedGeometry);
  EXPECT_EQ(s.estimator->gyros()[0].h_in, before);
  EXPECT_EQ(s.estimator->check_angles(Time(std::chrono::seconds(3)), s.readings).status, FixStatus::kUsed);
}

// A soft error in an estimate, as if a bit of the memory had been flipped, is noticed when the estimate is used next.

TEST(EstimateThatIsNotFinite, OfADriftIsLostAtTheNextFix) {
  Started<PaperEstimator> s;
  const_cast<double&>(s.estimator->gyros()[1].drift_rad_s(2)) = std::numeric_limits<double>::infinity();
  const StarFix fix{Time(std::chrono::seconds(3)), Eigen::Quaterniond(s.C_in_c)};
  EXPECT_EQ(s.estimator->correct(fix, s.readings).status, FixStatus::kEstimateLost);
  EXPECT_FALSE(s.estimator->started());
  EXPECT_EQ(s.estimator->correct(fix, s.readings).status, FixStatus::kStarted);
  EXPECT_TRUE(s.estimator->gyros()[1].drift_rad_s.allFinite());
}

TEST(EstimateThatIsNotFinite, OfTheClockOffsetIsLostAtTheNextFix) {
  Started<Full> s({.further = {.clock_offset = true}});
  const_cast<double&>(s.estimator->shared()(0)) = std::numeric_limits<double>::infinity();
  const StarFix fix{Time(std::chrono::seconds(3)), Eigen::Quaterniond(s.C_in_c)};
  EXPECT_EQ(s.estimator->correct(fix, s.readings).status, FixStatus::kEstimateLost);
  EXPECT_FALSE(s.estimator->started());
  EXPECT_EQ(s.estimator->correct(fix, s.readings).status, FixStatus::kStarted);
  EXPECT_EQ(s.estimator->shared()(0), 0);
}

TEST(AnglesWithoutFixes, ShareNoSamplesWithFixes) {
  // The star tracker falls silent at 60 s and comes back at some second of the interval between two looks.
  for (int back_s = 150; back_s < 153; ++back_s) {
    test::Flight flight({.duration_s = 200, .fix_offset_s = 0.25});
    std::erase_if(flight.fixes, [&](const StarFix& fix) {
      return fix.t > Time(std::chrono::seconds(60)) && fix.t < Time(std::chrono::seconds(back_s));
    });
    const auto on_board = make_on_board<Pair>();
    std::vector<Time> looks;
    std::vector<Time> fixes;
    test::fly(flight, *on_board, [&](const StepReport& report) {
      if (report.angles.status != FixStatus::kNone) {
        EXPECT_EQ(report.angles.status, FixStatus::kUsed);
        looks.push_back(report.angles.t);
      }
      if (report.fix.used()) {
        fixes.push_back(report.fix.t);
      }
    });
    const Duration reach = on_board->estimator().setup().reach();
    ASSERT_GE(looks.size(), 9U);
    EXPECT_EQ(looks.front(), flight.fixes[19].t + std::chrono::minutes(1));
    EXPECT_GE(fixes.size(), flight.fixes.size() - 1);  // none is lost but the last, which waits
    for (const Time look : looks) {
      for (const Time fix : fixes) {
        EXPECT_GE(std::max(look - fix, fix - look), 2 * reach);
      }
    }
    for (std::size_t i = 1; i < looks.size(); ++i) {
      EXPECT_GE(looks[i] - looks[i - 1], 2 * reach);
    }
  }
}

TEST(AnglesWithoutFixes, GoOnOverAGapOfTheGyros) {
  test::Flight flight({.duration_s = 900});
  flight.fixes.resize(60);  // until 3 min
  flight.samples.erase(flight.samples.begin() + 8 * 400, flight.samples.begin() + 8 * 600);
  const auto on_board = make_on_board<Pair>();
  std::vector<Time> looks;
  test::fly(flight, *on_board, [&](const StepReport& report) {
    if (report.angles.status != FixStatus::kNone) {
      EXPECT_EQ(report.angles.status, FixStatus::kUsed);
      looks.push_back(report.angles.t);
    }
  });
  const auto is_late = [](Time t) { return t > Time(std::chrono::seconds(600)); };
  EXPECT_NEAR(static_cast<double>(std::count_if(looks.begin(), looks.end(), is_late)), 98, 2);
}

// ---- Gyros that fail

/// A pair's flight with a third gyro of a rotor that does not drift.
struct Flight3 {
  explicit Flight3(const test::FlightPlan& plan)
      : pair(plan), samples(test::with_third_gyro(pair, third_in, plan.seed + 77)) {}
  Eigen::Vector3d third_in = Eigen::Vector3d(0.1, -0.8, 0.6).normalized();
  test::Flight pair;
  std::vector<GyroSample> samples;
};

/// Readings of one gyro stand still over an interval, in s.
void stick(std::vector<GyroSample>& samples, int gyro, double from_s, double to_s) {
  const auto at = [](double t_s) { return static_cast<std::size_t>(8 * t_s); };
  for (std::size_t i = at(from_s); i < at(to_s); ++i) {
    samples[i].h_b[gyro] = samples[at(from_s)].h_b[gyro];
  }
}

/// The rotor slows down and its momentum wanders off, about an axis of its case, faster and faster.
void wander_off(std::vector<GyroSample>& samples, int gyro, double from_s, double acceleration_rad_s2) {
  for (std::size_t i = static_cast<std::size_t>(8 * from_s); i < samples.size(); ++i) {
    const double age_s = static_cast<double>(i) / 8 - from_s;
    const Eigen::Vector3d turn = acceleration_rad_s2 * age_s * age_s / 2 * Eigen::Vector3d(0.3, 0.5, 0.8);
    samples[i].h_b[gyro] = rotated<double>(samples[i].h_b[gyro], turn);
  }
}

/// What a flight with a failing gyro came to.
struct GyroOutcome {
  long too_few = 0;        ///< samples rejected
  long too_few_fixes = 0;  ///< fixes rejected
  long used = 0;           ///< fixes
  long rejected = 0;       ///< by the gate
  double first_not_used_s = 0;
  double worst_rad = 0;  ///< error of the navigator's attitude from 3 s after the failure on
};

template <class Estimator>
GyroOutcome outcome(const std::vector<GyroSample>& samples, const test::Flight& truth, OnBoard<Estimator>& on_board,
                    int gyro, double from_s) {
  GyroOutcome sum;
  test::fly(samples, truth.fixes, on_board, [&](const StepReport& report) {
    sum.too_few += report.sample == SampleStatus::kRejectedTooFewGyros;
    sum.too_few_fixes += report.fix.status == FixStatus::kRejectedTooFewGyros;
    sum.used += report.fix.used();
    sum.rejected += report.fix.status == FixStatus::kRejectedByGate;
    const double t_s = to_seconds(report.t.time_since_epoch());
    if (report.gyros[gyro] != GyroState::kUsed && sum.first_not_used_s == 0) {
      sum.first_not_used_s = t_s;
    }
    if (report.fix.status == FixStatus::kNone && report.sample == SampleStatus::kUsed && t_s > from_s + 3) {
      const auto i = static_cast<std::size_t>(8 * t_s + 0.5);
      const AttitudeSolution now = on_board.navigation_attitude().value();
      sum.worst_rad = std::max(sum.worst_rad, test::attitude_error(truth.C_in_c_at_samples[i], now).norm());
    }
  });
  return sum;
}

/// The navigator is corrected at every fix.
template <class Estimator>
std::unique_ptr<OnBoard<Estimator>> every_fix(const Layout& layout = {}) {
  return test::Given<Estimator>(layout).on_board({.interval = CorrectionPolicy::kEveryFix});
}

TEST(StuckGyro, OfThreeIsLeftOutWhileItIsStuck) {
  Flight3 flight({.duration_s = 2400});
  const auto good = every_fix<Full>(kThree);
  const GyroOutcome without = outcome(flight.samples, flight.pair, *good, 2, 900);
  EXPECT_EQ(without.first_not_used_s, 0);
  for (const int gyro : {0, 2}) {
    Flight3 stuck = flight;
    stick(stuck.samples, gyro, 900, 1500);
    const auto on_board = every_fix<Full>(kThree);
    const GyroOutcome with = outcome(stuck.samples, flight.pair, *on_board, gyro, 900);
    EXPECT_NEAR(with.first_not_used_s, 900, 0.3);  // it had moved
    EXPECT_EQ(with.too_few + with.too_few_fixes, 0);
    EXPECT_LE(with.rejected, 2);  // those of the seconds before it is known
    EXPECT_GE(with.used, without.used - 2);
    EXPECT_LT(with.worst_rad, 3 * without.worst_rad);
    // Used again, and no worse for it at the end.
    EXPECT_EQ(on_board->on_gyro(stuck.samples.back()).gyros[gyro], GyroState::kUsed);
    const auto& gyros = on_board->estimator().gyros();
    EXPECT_LT(angle_between<double>(gyros[0].h_in, flight.pair.truth[0].h_in), 5 * test::kArcsecond);
    EXPECT_LT(angle_between<double>(gyros[2].h_in, flight.third_in), 5 * test::kArcsecond);
  }
}

TEST(StuckGyro, WithoutADirectionIsLeftOutToo) {
  Flight3 flight({.duration_s = 900});
  for (std::size_t i = 8 * 300; i < flight.samples.size(); ++i) {
    flight.samples[i].h_b[1].setZero();
  }
  const auto on_board = every_fix<Full>(kThree);
  long not_direction = 0;
  long used = 0;
  test::fly(flight.samples, flight.pair.fixes, *on_board, [&](const StepReport& report) {
    not_direction += report.sample == SampleStatus::kRejectedNotDirection;
    used += report.fix.used();
  });
  EXPECT_EQ(not_direction, 15);  // the sixteenth is known for what it is
  EXPECT_GE(used, 298);
  EXPECT_TRUE(on_board->navigation_attitude().ok());
}

TEST(StuckGyro, OfAPairStopsItUntilItLivesAgain) {
  const test::Flight flight({.duration_s = 2400});
  test::Flight stuck = flight;
  stick(stuck.samples, 1, 900, 1200);
  const auto on_board = every_fix<Pair>();
  const GyroOutcome sum = outcome(stuck.samples, flight, *on_board, 1, 1200);
  EXPECT_NEAR(static_cast<double>(sum.too_few), 8 * 300, 3);
  EXPECT_NEAR(static_cast<double>(sum.too_few_fixes), 100, 2);
  EXPECT_GE(sum.used, 801 - 103);
  EXPECT_LE(sum.rejected, 2);
  EXPECT_LT(momentum_error(*on_board, flight), 2.5 * test::kArcsecond);
  EXPECT_LT(sum.worst_rad, 60 * test::kArcsecond);
}

TEST(StuckGyro, OfAPairWhenTheAnglesAreDuePutsThemOff) {
  // The stretch begins half a second before a look. A spike not long before keeps it from being known at once.
  test::Flight flight({.duration_s = 400});
  flight.fixes.resize(60);  // until 177 s: looks at 237, 240, … s
  stick(flight.samples, 1, 239.5, 300);
  Eigen::Vector3d& spiked = flight.samples[8 * 235].h_b[1];
  spiked = rotated<double>(spiked, 0.05 * spiked.unitOrthogonal());
  const auto on_board = make_on_board<Pair>();
  std::vector<double> looks_s;
  test::fly(flight, *on_board, [&](const StepReport& report) {
    if (report.angles.status != FixStatus::kNone) {
      EXPECT_EQ(report.angles.status, FixStatus::kUsed);
      looks_s.push_back(to_seconds(report.angles.t.time_since_epoch()));
    }
  });
  ASSERT_GE(looks_s.size(), 20U);
  EXPECT_EQ(looks_s[0], 237);
  EXPECT_GT(looks_s[1], 300);
  EXPECT_LT(looks_s[1], 310);
}

TEST(WanderingGyro, OfThreeIsSuspectedOnlyWhereTheMisfitIsFarAboveTheGate) {
  for (const double off_rad : {1.6e-4, 1e-3}) {
    Started<Full> s(kThree);
    s.confirm();
    s.readings.h_b[2] = rotated<double>(s.readings.h_b[2], Eigen::Vector3d(off_rad, 0, 0));
    const FixReport report =
        s.estimator->correct({Time(std::chrono::seconds(3)), Eigen::Quaterniond(s.C_in_c)}, s.readings);
    EXPECT_EQ(report.status, FixStatus::kRejectedByGate);
    EXPECT_EQ(report.nis > 4 * s.estimator->setup().gate_nis, off_rad > 5e-4);
    EXPECT_EQ(report.odd_gyro, off_rad > 5e-4 ? 2 : kNoGyro);
  }
}

/// The directions go to the fix as far as their variance, widened by the square of the misfit, and that of the fix say.
template <class Estimator>
void expect_reopening_by_the_misfit() {
  constexpr double kNoise_rad = 2e-5;
  constexpr double kMisfit_rad = 2e-4;
  test::Given<Estimator> given;
  given.setup.reopen_after_rejections = given.setup.reopen_after_jump_rejections = 1;
  given.setup.star_trackers[0].noise_rad.setConstant(kNoise_rad);
  given.setup.readout_noise_rad[0] = given.setup.readout_noise_rad[1] = 1e-7;
  given.covariance *= 1e-8;
  Started<Estimator> s;
  ASSERT_FALSE(s.estimator->set_up(given.setup, given.prior, given.covariance));
  ASSERT_EQ(s.estimator->correct({Time{}, Eigen::Quaterniond(s.C_in_c)}, s.readings).status, FixStatus::kStarted);
  s.confirm();
  // About an axis across both momenta, so that each is off by all of it.
  const Eigen::Vector3d across = s.readings.h_b[0].cross(s.readings.h_b[1]).normalized();
  const Eigen::Matrix3d turned = s.C_in_c * test::turn(kMisfit_rad * across);
  const StarFix fix{Time(std::chrono::seconds(3)), Eigen::Quaterniond(turned)};
  ASSERT_EQ(s.estimator->correct(fix, s.readings).status, FixStatus::kUsedAfterReopening);
  // Both agree, so that the variance of their mean is half of what each is widened by.
  const double of_fix = kNoise_rad * kNoise_rad;
  const double widened = of_fix / 2 + 2 * kMisfit_rad * kMisfit_rad / 4 / 2;
  for (int k = 0; k < 2; ++k) {
    const double left_rad = angle_between<double>(s.estimator->gyros()[k].h_in, turned * s.readings.h_b[k]);
    EXPECT_NEAR(left_rad / kMisfit_rad, of_fix / (of_fix + widened), 0.01);
  }
}

TEST(Reopening, WidensByTheSquareOfTheMisfit) {
  expect_reopening_by_the_misfit<Pair>();
  expect_reopening_by_the_misfit<PaperEstimator>();
}

TEST(RestartOfThree, WhileOneIsNotUsedKeepsItsMomentumAndKnowsNothingOfIt) {
  test::FullGiven given(kThree);
  given.setup.reopen_after_rejections = given.setup.reopen_after_jump_rejections = 1;
  Started<Full> s(kThree);
  ASSERT_FALSE(s.estimator->set_up(given.setup, given.prior, given.covariance));
  ASSERT_EQ(s.estimator->correct({Time{}, Eigen::Quaterniond(s.C_in_c)}, s.readings).status, FixStatus::kStarted);
  s.confirm();
  const Eigen::Vector3d third_in = s.estimator->gyros()[2].h_in;
  s.readings.used[2] = false;
  const Eigen::Matrix3d turned[] = {s.C_in_c * test::turn(0.01, 0, 0), s.C_in_c * test::turn(0, 0.02, 0)};
  const auto correct = [&](int i) {
    return s.estimator->correct({Time(std::chrono::seconds(3 * (i + 1))), Eigen::Quaterniond(turned[i])}, s.readings);
  };
  ASSERT_EQ(correct(0).status, FixStatus::kUsedAfterReopening);
  ASSERT_EQ(correct(1).status, FixStatus::kRestarted);
  const Eigen::MatrixXd root = test::error_root(*s.estimator);
  for (int k = 0; k < 3; ++k) {
    const Full::Gyro& gyro = s.estimator->gyros()[k];
    const double sigma = root.middleRows<3>(kThree.direction(k)).rowwise().norm().maxCoeff();
    const double off_rad = angle_between<double>(gyro.h_in, turned[1] * gyro.in_c(s.readings.h_b[k]));
    if (k < 2) {
      EXPECT_LT(off_rad, 1e-12);
      EXPECT_LT(sigma, 0.02);
    } else {
      EXPECT_LT(angle_between<double>(gyro.h_in, third_in), 0.03);
      EXPECT_GT(off_rad, 1e-3);
      EXPECT_GT(sigma, 0.5);
    }
  }
}

TEST(WanderingGyro, OfThreeIsIsolatedAndTheOthersGoOn) {
  Flight3 flight({.duration_s = 2400});
  const auto good = every_fix<Full>(kThree);
  const GyroOutcome without = outcome(flight.samples, flight.pair, *good, 0, 900);
  EXPECT_EQ(without.first_not_used_s, 0);
  for (const int gyro : {0, 1, 2}) {
    Flight3 failing = flight;
    wander_off(failing.samples, gyro, 900, 1e-7);
    const auto on_board = every_fix<Full>(kThree);
    const GyroOutcome with = outcome(failing.samples, flight.pair, *on_board, gyro, 900);
    EXPECT_GT(with.first_not_used_s, 900);
    EXPECT_LT(with.first_not_used_s, 1200) << gyro;
    for (int other = 0; other < 3; ++other) {
      EXPECT_EQ(on_board->on_gyro(failing.samples.back()).gyros[other],
                other == gyro ? GyroState::kIsolated : GyroState::kUsed);
    }
    EXPECT_LT(with.rejected, 30);
    EXPECT_LT(with.worst_rad, 60 * test::kArcsecond) << gyro;
  }
}

TEST(WanderingGyro, OfThreeIsFoundWithoutAStarTrackerToo) {
  Flight3 flight({.duration_s = 3000});
  flight.pair.fixes.resize(600);
  wander_off(flight.samples, 1, 2000, 1e-7);
  const auto on_board = every_fix<Full>(kThree);
  const GyroOutcome sum = outcome(flight.samples, flight.pair, *on_board, 1, 2000);
  EXPECT_GT(sum.first_not_used_s, 2000);
  EXPECT_LT(sum.first_not_used_s, 2200);
  EXPECT_EQ(on_board->on_gyro(flight.samples.back()).gyros[0], GyroState::kUsed);
  EXPECT_EQ(on_board->on_gyro(flight.samples.back()).gyros[2], GyroState::kUsed);
}

TEST(WanderingGyro, OfAPairStopsItForGood) {
  for (const int gyro : {0, 1}) {
    test::Flight flight({.duration_s = 2400});
    wander_off(flight.samples, gyro, 900, 1e-6);
    const auto on_board = every_fix<Pair>();
    long after = 0;
    SampleStatus last{};
    PerGyro<GyroState> states{};
    test::fly(flight, *on_board, [&](const StepReport& report) {
      states = report.gyros;
      if (report.fix.status == FixStatus::kNone) {
        last = report.sample;
      }
      after += report.fix.used() && report.fix.t > Time(std::chrono::seconds(1300));
    });
    EXPECT_EQ(states[gyro], GyroState::kIsolated) << gyro;
    EXPECT_EQ(states[1 - gyro], GyroState::kUsed) << gyro;
    EXPECT_EQ(last, SampleStatus::kRejectedTooFewGyros);
    EXPECT_EQ(after, 0);
  }
}

TEST(WanderingGyro, IsNotSuspectedWhenTheStarTrackerIsAtFault) {
  test::Flight flight({.duration_s = 1800});
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (std::size_t i = 100; i < flight.fixes.size(); ++i) {  // about each axis, small and large, five minutes in ten
    const Eigen::Vector3d axis(uniform(random), uniform(random), uniform(random));
    if (i % 40 < 19) {
      const double angle_rad = std::pow(10, -3 + uniform(random));
      flight.fixes[i].q_in_c =
          flight.fixes[i].q_in_c * Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis.normalized()));
    }
  }
  const auto on_board = make_on_board<Pair>();
  for (const StepReport& report : fly_fixes(flight, *on_board)) {
    EXPECT_EQ(report.fix.odd_gyro, kNoGyro);
  }
}

// ---- Noise that is not normal

struct Spread {
  double square = 0;    ///< of the errors of the alignments, mean
  double variance = 0;  ///< as the estimator gives it
  double least_weight = 1;
  long rejected = 0;
};

/// Some fixes, at random, that are noisier than they should be.
struct Outliers {
  double share = 0;
  double least = 0;  ///< times the noise, added to it
  double most = 0;
};
constexpr Outliers kNone{};
constexpr Outliers kFewFar{.share = 0.05, .least = 5, .most = 10};
constexpr Outliers kManyNear{.share = 0.2, .least = 2, .most = 4};

template <class Estimator>
Spread with_outliers(const Outliers& outliers, double student_t_freedom) {
  constexpr unsigned kRuns = 12;
  Spread mean;
  for (unsigned run = 1; run <= kRuns; ++run) {
    test::Flight flight({.duration_s = 1800, .seed = run});
    std::mt19937 random(run + 500);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(0, 1);
    for (std::size_t i = 1; i < flight.fixes.size(); ++i) {
      const double size = outliers.least + (outliers.most - outliers.least) * uniform(random);
      const double factor = uniform(random) < outliers.share ? size : 0;
      const Eigen::Vector3d error = factor * test::Flight::kTracker_rad.cwiseProduct(test::white(random, normal));
      flight.fixes[i].q_in_c = flight.fixes[i].q_in_c * Eigen::Quaterniond(test::turn(error));
    }
    test::Given<Estimator> given;
    given.setup.student_t_freedom = student_t_freedom;
    const auto on_board = make_on_board(given);
    for (const StepReport& report : fly_fixes(flight, *on_board)) {
      mean.least_weight = std::min(mean.least_weight, report.fix.weight);
      mean.rejected += report.fix.status == FixStatus::kRejectedByGate;
    }
    const Eigen::MatrixXd root = test::error_root(on_board->estimator());
    const Layout layout = on_board->estimator().error_layout();
    const Eigen::VectorXd errors = test::parameter_errors(flight.truth, on_board->estimator().gyros());
    for (int k = 0; k < layout.gyros; ++k) {
      mean.square += errors.segment<3>(layout.alignment(k) - layout.drift(0)).squaredNorm() / kRuns;
      mean.variance += root.middleRows<3>(layout.alignment(k)).squaredNorm() / kRuns;
    }
  }
  return mean;
}

template <class Estimator>
class StudentT : public testing::Test {};
TYPED_TEST_SUITE(StudentT, Estimators);

TYPED_TEST(StudentT, IsBetterThanTheGateWithManyNearOutliers) {
  const Spread gate = with_outliers<TypeParam>(kManyNear, 0);
  const Spread weighted = with_outliers<TypeParam>(kManyNear, 5);
  EXPECT_EQ(gate.least_weight, 1);
  EXPECT_GT(gate.rejected, 100);
  EXPECT_EQ(weighted.rejected, 0);
  EXPECT_LT(weighted.least_weight, 0.1);
  EXPECT_LT(weighted.square, 0.9 * gate.square);
}

TYPED_TEST(StudentT, CostsLittleWithoutOutliers) {
  const Spread gate = with_outliers<TypeParam>(kNone, 0);
  const Spread weighted = with_outliers<TypeParam>(kNone, 20);
  EXPECT_NEAR(std::sqrt(weighted.variance / gate.variance), 1.02, 0.02);
  EXPECT_LT(std::sqrt(weighted.square / gate.square), 1.08);  // (ν + 4)/(ν + 6) is the efficiency: 1.04
}

TEST(StudentTOfInvariant, ComesNearTheGateWithFewFarOutliers) {
  // There the gate is as good as knowing which they are; twelve flights differ by a tenth.
  const Spread gate = with_outliers<Pair>(kFewFar, 0);
  const Spread weighted = with_outliers<Pair>(kFewFar, 20);
  EXPECT_GT(gate.rejected, 100);
  EXPECT_EQ(weighted.rejected, 0);
  EXPECT_LT(std::sqrt(weighted.square / gate.square), 1.2);
}

TYPED_TEST(StudentT, DoesNotBelieveALieEither) {
  test::Flight flight({.duration_s = 2100});
  turn_fixes(flight, 300, 500, 3 * kDegree);
  test::Given<TypeParam> given;
  given.setup.student_t_freedom = 5;
  const auto on_board = make_on_board(given);
  const auto fixes = fly_fixes(flight, *on_board);
  EXPECT_EQ(count(fixes, FixStatus::kRejectedByGate), 200);
  EXPECT_EQ(fixes.back().fix.status, FixStatus::kUsed);
  EXPECT_LT(momentum_error(*on_board, flight), 8 * test::kArcsecond);
}

TEST(StudentTOfInvariant, DoesNotUseAFixThatTheFaultOfOneOfThreeGyrosExplains) {
  test::FullGiven given(kThree);
  given.setup.student_t_freedom = 5;
  Started<Full> s(kThree);
  ASSERT_FALSE(s.estimator->set_up(given.setup, given.prior, given.covariance));
  ASSERT_EQ(s.estimator->correct({Time{}, Eigen::Quaterniond(s.C_in_c)}, s.readings).status, FixStatus::kStarted);
  s.confirm();
  const StarFix fix{Time(std::chrono::seconds(3)), Eigen::Quaterniond(s.C_in_c)};
  const Eigen::Vector3d before = s.estimator->gyros()[2].h_in;
  FixReadings odd = s.readings;
  odd.h_b[2] = rotated<double>(odd.h_b[2], Eigen::Vector3d(2e-3, 0, 0));
  const FixReport report = s.estimator->correct(fix, odd);
  EXPECT_EQ(report.status, FixStatus::kRejectedByGate);
  EXPECT_EQ(report.odd_gyro, 2);
  EXPECT_FALSE(report.jumped);
  EXPECT_LT(report.weight, 0.1);
  EXPECT_LT(angle_between<double>(s.estimator->gyros()[2].h_in, before), 1e-9);
}

TYPED_TEST(StudentT, ReopensAsTheGateDoes) {
  test::Flight flight({.duration_s = 1800});
  turn_fixes(flight, 300, flight.fixes.size(), 120 * test::kArcsecond);
  test::Given<TypeParam> given;
  given.setup.student_t_freedom = 5;
  const auto on_board = make_on_board(given);
  const auto fixes = fly_fixes(flight, *on_board);
  EXPECT_EQ(count(fixes, FixStatus::kUsedAfterReopening), 1);
}

TEST(StudentTWeight, IsTheMeanOfTheScaleGivenTheInnovation) {
  EXPECT_EQ(student_t_weight(0, 1000, 4), 1);
  EXPECT_EQ(student_t_weight(5, 4, 4), 1);
  EXPECT_EQ(student_t_weight(5, 1, 4), 1);
  EXPECT_DOUBLE_EQ(student_t_weight(5, 85, 4), 0.1);
  // By integration over w ~ Γ(ν/2, ν/2) of normal densities with variance 1/w.
  constexpr double kFreedom = 5;
  constexpr double kNis = 40;
  double mean = 0;
  double sum = 0;
  for (double w = 1e-4; w < 10; w += 1e-4) {
    const double density =
        std::pow(w, kFreedom / 2 - 1) * std::exp(-kFreedom / 2 * w) * std::pow(w, 2) * std::exp(-w * kNis / 2);
    sum += density;
    mean += w * density;
  }
  EXPECT_NEAR(student_t_weight(kFreedom, kNis, 4), mean / sum, 1e-6);
}

// ---- A clock that is set back

template <class Estimator>
class ClockSetBack : public testing::Test {};
TYPED_TEST_SUITE(ClockSetBack, Estimators);

TYPED_TEST(ClockSetBack, IsTakenOverAfterSixteenSamples) {
  const test::Flight flight({.duration_s = 1800});
  for (const double back_s : {5.0, 600.0, 1e6}) {
    test::Flight set_back = flight;
    const Time from(std::chrono::seconds(900));
    for (auto& sample : set_back.samples) {
      sample.t -= sample.t > from ? from_seconds(back_s) : Duration::zero();
    }
    for (auto& fix : set_back.fixes) {
      fix.t -= fix.t > from ? from_seconds(back_s) : Duration::zero();
    }
    const auto on_board = make_on_board<TypeParam>();
    long rejected = 0;
    long taken_over = 0;
    long used = 0;
    std::size_t fix = 0;
    for (std::size_t i = 0; i < flight.samples.size(); ++i) {
      const StepReport report = on_board->on_gyro(set_back.samples[i]);
      rejected += report.sample == SampleStatus::kRejectedOutOfOrder;
      taken_over += report.sample == SampleStatus::kUsedAfterClockSetBack;
      used += report.fix.used();
      if (report.sample == SampleStatus::kUsedAfterClockSetBack) {
        EXPECT_EQ(flight.samples[i].t, from + 16 * std::chrono::milliseconds(125));
        EXPECT_EQ(report.t, set_back.samples[i].t);
      }
      for (; fix < flight.fixes.size() && flight.fixes[fix].t == flight.samples[i].t; ++fix) {
        used += on_board->on_fix(set_back.fixes[fix]).fix.used();
      }
    }
    EXPECT_EQ(rejected, 15);
    EXPECT_EQ(taken_over, 1);
    EXPECT_GE(used, 598);
    // Two seconds of drift are not predicted: 1″ at the most.
    EXPECT_LT(momentum_error(*on_board, flight), 3 * test::kArcsecond);
  }
}

TYPED_TEST(ClockSetBack, IsNotBelievedOfSamplesThatComeLate) {
  // A block of old samples among the present ones, and a few that go backwards.
  const test::Flight flight({.duration_s = 600});
  const auto on_board = make_on_board<TypeParam>();
  const auto plain = make_on_board<TypeParam>();
  std::size_t fix = 0;
  for (std::size_t i = 0; i < flight.samples.size(); ++i) {
    EXPECT_EQ(on_board->on_gyro(flight.samples[i]).sample, SampleStatus::kUsed);
    plain->on_gyro(flight.samples[i]);
    if (i > 2000) {
      EXPECT_EQ(on_board->on_gyro(flight.samples[i - 1000]).sample, SampleStatus::kRejectedOutOfOrder);
    }
    for (std::size_t j = 0; i == 1000 && j < 100; ++j) {
      EXPECT_EQ(on_board->on_gyro(flight.samples[900 - j]).sample, SampleStatus::kRejectedOutOfOrder);
    }
    for (; fix < flight.fixes.size() && flight.fixes[fix].t == flight.samples[i].t; ++fix) {
      on_board->on_fix(flight.fixes[fix]);
      plain->on_fix(flight.fixes[fix]);
    }
  }
  EXPECT_EQ(on_board->estimator().gyros()[0].drift_rad_s, plain->estimator().gyros()[0].drift_rad_s);
}

TEST(ClockSetBackOfInvariant, TellsOfTheFixesThatWaited) {
  const test::Flight flight({.duration_s = 60});
  const auto on_board = make_on_board<Pair>();
  for (std::size_t i = 0; i <= 24 * 5; ++i) {
    on_board->on_gyro(flight.samples[i]);
  }
  EXPECT_EQ(on_board->on_fix(flight.fixes[5]).fix.status, FixStatus::kPending);
  int dropped = 0;
  for (std::size_t i = 0; i < 24; ++i) {
    dropped += on_board->on_gyro(flight.samples[i]).fixes_dropped;
  }
  EXPECT_EQ(dropped, 1);
  EXPECT_EQ(on_board->flush().fix.status, FixStatus::kNone);
}

}  // namespace
}  // namespace trihedron
