// What an estimator refuses to be set up with, and that it stays as it was.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>

#include "flight.hpp"

namespace trihedron {
namespace {

using test::FullGiven;
using test::PairGiven;
constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Everything at once, so that there is all that may be wrong.
const Layout kEverything{.gyros = 3, .drift_model = vsh(1), .further = kAllFurtherStates, .star_trackers = 2};

/// The fault after something of `given` has been spoilt.
template <class Spoil>
std::optional<SetupFault> fault_after(Spoil&& spoil) {
  FullGiven given(kEverything);
  spoil(given);
  return given.fault();
}

TEST(SetUp, TakesWhatIsRight) {
  EXPECT_EQ(fault_after([](FullGiven&) {}), std::nullopt);
  EXPECT_EQ(FullGiven(kLargestLayout).fault(), std::nullopt);
  EXPECT_EQ(FullGiven().fault(), std::nullopt);
  EXPECT_EQ(PairGiven().fault(), std::nullopt);
  EXPECT_EQ(test::PaperGiven().fault(), std::nullopt);
}

TEST(SetUp, RefusesLayoutsForWhichThereIsNoRoom) {
  for (const Layout& layout : {Layout{.gyros = 3}, Layout{.drift_model = vsh(1)}, Layout{.drift_model = kEsg20},
                               Layout{.further = {.clock_offset = true}}, Layout{.star_trackers = 2}}) {
    EXPECT_EQ(PairGiven(layout).fault(), SetupFault::kTooLarge);
    EXPECT_EQ(test::PaperGiven(layout).fault(), SetupFault::kTooLarge);
    EXPECT_EQ(FullGiven(layout).fault(), std::nullopt);
  }
  // No more of anything but of what the gyros share.
  EXPECT_EQ(PairGiven(Layout{.further = {.clock_offset = true}, .direction_size = 2}).fault(), SetupFault::kTooLarge);
  const auto with = [](auto&& change) { return fault_after([&](FullGiven& given) { change(given.setup.layout); }); };
  EXPECT_EQ(with([](Layout& layout) { layout.gyros = 1; }), SetupFault::kTooLarge);
  EXPECT_EQ(with([](Layout& layout) { layout.gyros = 5; }), SetupFault::kTooLarge);
  EXPECT_EQ(with([](Layout& layout) { layout.star_trackers = 0; }), SetupFault::kTooLarge);
  EXPECT_EQ(with([](Layout& layout) { layout.star_trackers = 5; }), SetupFault::kTooLarge);
  EXPECT_EQ(with([](Layout& layout) { layout.drift_model = vsh(7); }), SetupFault::kTooLarge);
  EXPECT_EQ(with([](Layout& layout) { layout.direction_size = 2; }), SetupFault::kTooLarge);
}

TEST(SetUp, RefusesNoiseThatIsNotPositive) {
  for (const double bad : {0.0, -1e-5, kNotANumber, kInfinite}) {
    for (int k = 0; k < kEverything.gyros; ++k) {
      EXPECT_EQ(fault_after([&](FullGiven& given) { given.setup.readout_noise_rad[k] = bad; }),
                SetupFault::kNoiseNotPositive);
    }
    for (std::size_t head = 0; head < 2; ++head) {
      EXPECT_EQ(fault_after([&](FullGiven& given) { given.setup.star_trackers[head].noise_rad.y() = bad; }),
                SetupFault::kNoiseNotPositive);
    }
  }
  for (const double bad : {-1e-9, kNotANumber, kInfinite}) {
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.setup.direction_random_walk_rad_sqrt_s = bad; }),
              SetupFault::kNoiseNotPositive);
  }
  for (const Duration bad : {Duration::zero(), Duration(-1), CalibrationSetup::kLongestGyroPeriod + Duration(1)}) {
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.setup.gyro_period = bad; }), SetupFault::kNoiseNotPositive);
  }
  EXPECT_EQ(fault_after([](FullGiven& given) { given.setup.star_trackers[1].C_c_s *= 1.01; }),
            SetupFault::kNoiseNotPositive);
  // Of those that there are not nothing is asked.
  EXPECT_EQ(fault_after([](FullGiven& given) {
              given.setup.readout_noise_rad[3] = 0;
              given.setup.star_trackers[2].noise_rad.setZero();
            }),
            std::nullopt);
}

TEST(SetUp, RefusesGatesThatAreNotPositive) {
  for (const double bad : {0.0, -1.0, kNotANumber}) {
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.setup.gate_nis = bad; }), SetupFault::kGateNotPositive);
  }
  for (const double bad : {-1.0, kNotANumber}) {
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.setup.student_t_freedom = bad; }),
              SetupFault::kGateNotPositive);
  }
  for (const int bad : {0, -1}) {
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.setup.reopen_after_rejections = bad; }),
              SetupFault::kGateNotPositive);
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.setup.reopen_after_jump_rejections = bad; }),
              SetupFault::kGateNotPositive);
  }
}

TEST(SetUp, RefusesPriorsThatAreNotPositiveDefinite) {
  constexpr SetupFault kFault = SetupFault::kPriorNotPositiveDefinite;
  for (const double bad : {0.0, -1e-12, kNotANumber, kInfinite}) {
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.covariance(3, 3) = bad; }), kFault) << bad;
  }
  EXPECT_EQ(fault_after([](FullGiven& given) { given.covariance(1, 0) = given.covariance(0, 1) = 4.1e-12; }), kFault);
  EXPECT_EQ(fault_after([](FullGiven& given) { given.covariance(5, 2) = kNotANumber; }), kFault);
  EXPECT_EQ(fault_after([](FullGiven& given) { given.covariance.conservativeResize(10, 10); }), kFault);
  EXPECT_EQ(fault_after([](FullGiven& given) { given.covariance.conservativeResize(Eigen::NoChange, 10); }), kFault);
  EXPECT_EQ(fault_after([](FullGiven& given) { given.covariance.resize(0, 0); }), kFault);
}

TEST(SetUp, TakesACommonPriorOfParametersAndDriftThatComesBack) {
  const Layout layout{.further = {.readout_bias = true, .orbital_drift = true, .polhode = true}};
  FullGiven given(layout);
  const int parameters = layout.parameters();
  const Eigen::VectorXd sigma = (Eigen::VectorXd(layout.drift_parameters()) << given.covariance.diagonal().cwiseSqrt(),
                                 Eigen::VectorXd::Constant(layout.amplitudes_size(), 3e-8))
                                    .finished();
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(sigma.size(), sigma.size());
  correlation(parameters + 2, 4) = correlation(4, parameters + 2) = -0.9;
  const Eigen::MatrixXd common = sigma.asDiagonal() * correlation * sigma.asDiagonal();
  const auto estimator = std::make_unique<test::FullEstimator>();
  ASSERT_FALSE(estimator->set_up(given.setup, given.prior, common));
  const int size = layout.size() - layout.direction(layout.gyros);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> root;
  root.setZero(size, size);
  estimator->prior_error_root(rows_of(root));
  const Eigen::MatrixXd found = root * root.transpose();
  EXPECT_TRUE(found.topLeftCorner(sigma.size(), sigma.size()).isApprox(common, 1e-12));
  const double bias = given.setup.further_sigma[FurtherState::kReadoutBias];
  EXPECT_TRUE(found.bottomRightCorner(6, 6).isApprox(bias * bias * Eigen::MatrixXd::Identity(6, 6), 1e-12));
  // Of another size it is none.
  EXPECT_EQ(estimator->set_up(given.setup, given.prior, common.topLeftCorner(parameters + 6, parameters + 6)),
            SetupFault::kPriorNotPositiveDefinite);
}

/// The one thing that each further state is described by.
struct Described {
  bool FurtherStates::*flag;
  double& (*of)(CalibrationSetup&);
};
template <FurtherState kState>
double& sigma_of(CalibrationSetup& setup) {
  return setup.further_sigma[kState];
}
const Described kDescribed[] = {
    {&FurtherStates::wandering_drift, [](CalibrationSetup& s) -> double& { return s.wandering_drift.sigma; }},
    {&FurtherStates::wandering_drift, [](CalibrationSetup& s) -> double& { return s.wandering_drift.time_s; }},
    {&FurtherStates::readout_bias, sigma_of<FurtherState::kReadoutBias>},
    {&FurtherStates::coefficient_change, sigma_of<FurtherState::kCoefficientChange>},
    {&FurtherStates::coefficient_change, [](CalibrationSetup& s) -> double& { return s.change.duration_s; }},
    {&FurtherStates::clock_offset, sigma_of<FurtherState::kClockOffset>},
    {&FurtherStates::orbital_error, sigma_of<FurtherState::kOrbitalError>},
    {&FurtherStates::orbital_drift, sigma_of<FurtherState::kOrbitalDrift>},
    {&FurtherStates::polhode, sigma_of<FurtherState::kPolhode>},
};

TEST(SetUp, RefusesACourseWithoutATime) {
  const auto fault_of = [](CourseOfChange::Kind kind, double time_s) {
    return fault_after([&](FullGiven& given) {
      given.setup.change.kind = kind;
      given.setup.change.time_s = time_s;
    });
  };
  for (const double bad : {0.0, -1.0, kNotANumber, kInfinite}) {
    EXPECT_EQ(fault_of(CourseOfChange::Kind::kWarmUp, bad), SetupFault::kPriorNotPositiveDefinite) << bad;
    EXPECT_EQ(fault_of(CourseOfChange::Kind::kJump, bad), SetupFault::kPriorNotPositiveDefinite) << bad;
    EXPECT_EQ(fault_of(CourseOfChange::Kind::kEven, bad), std::nullopt) << bad;
  }
  EXPECT_EQ(fault_of(CourseOfChange::Kind::kWarmUp, 3600), std::nullopt);
}

TEST(SetUp, HasThePolhodeOfEachGyro) {
  FullGiven given(kEverything);
  CalibrationSetup& setup = given.setup;
  setup.orbital_phase_zero = Time(from_seconds(1000));
  for (int k = 0; k < setup.layout.gyros; ++k) {
    setup.polhodes[k] = {1000.0F * static_cast<float>(k + 1), 0.02F};
  }
  const DriftTimes times = setup.drift_times(Time(from_seconds(1700)));
  for (int k = 0; k < setup.layout.gyros; ++k) {
    const double angle = setup.polhodes[k].angle_rad(700);
    EXPECT_NEAR(times[k].polhode_sine, std::sin(angle), 1e-14) << k;
    EXPECT_NEAR(times[k].polhode_cosine, std::cos(angle), 1e-14) << k;
    EXPECT_NEAR(times[k].orbital_sine, std::sin(700 * setup.orbital_rate_rad_s), 1e-14) << k;
  }
}

TEST(SetUp, RefusesAPolhodeWithoutAPeriod) {
  constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
  const auto fault_of = [](Polhode polhode) {
    return fault_after([&](FullGiven& given) { given.setup.polhodes[1] = polhode; });
  };
  for (const float bad : {0.0F, -1.0F, kNoNumber, std::numeric_limits<float>::infinity()}) {
    EXPECT_EQ(fault_of({bad, 0}), SetupFault::kPriorNotPositiveDefinite) << bad;
  }
  EXPECT_EQ(fault_of({7200, kNoNumber}), SetupFault::kPriorNotPositiveDefinite);
  EXPECT_EQ(fault_of({7200, -0.1F}), std::nullopt);
  Layout without = kEverything;
  without.further.polhode = false;
  FullGiven given(without);
  given.setup.polhodes[1].period_s = 0;
  EXPECT_EQ(given.fault(), std::nullopt);
}

TEST(SetUp, RefusesFurtherStatesThatNothingIsKnownOf) {
  for (const Described& described : kDescribed) {
    for (const double bad : {0.0, -1.0, kNotANumber, kInfinite}) {
      const auto spoil = [&](FullGiven& given) { described.of(given.setup) = bad; };
      EXPECT_EQ(fault_after(spoil), SetupFault::kPriorNotPositiveDefinite) << bad;
      // What is off is not asked for.
      Layout without = kEverything;
      without.further.*described.flag = false;
      FullGiven given(without);
      spoil(given);
      EXPECT_EQ(given.fault(), std::nullopt) << bad;
    }
  }
  for (const bool error : {false, true}) {
    for (const bool drift : {false, true}) {
      Layout layout = kEverything;
      layout.further.orbital_error = error;
      layout.further.orbital_drift = drift;
      FullGiven given(layout);
      given.setup.orbital_rate_rad_s = kNotANumber;
      EXPECT_EQ(given.fault() == SetupFault::kPriorNotPositiveDefinite, error || drift);
    }
  }
  EXPECT_EQ(fault_after([](FullGiven& given) { given.setup.star_trackers[1].alignment_sigma_rad = 0; }),
            SetupFault::kPriorNotPositiveDefinite);
  // The first star tracker has no alignment.
  EXPECT_EQ(fault_after([](FullGiven& given) { given.setup.star_trackers[0].alignment_sigma_rad = 0; }), std::nullopt);
}

TEST(SetUp, RefusesMeansThatCannotBeUsed) {
  constexpr SetupFault kFault = SetupFault::kPriorMeanNotUsable;
  for (int k = 0; k < kEverything.gyros; ++k) {
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.prior[k].drift_rad_s(2) = kNotANumber; }), kFault);
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.prior[k].drift_rad_s.conservativeResize(7); }), kFault);
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.prior[k].readout_bias.y() = kInfinite; }), kFault);
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.prior[k].C_c_b *= 1.001; }), kFault);
    EXPECT_EQ(fault_after([&](FullGiven& given) { given.prior[k].C_c_b(0, 0) = kNotANumber; }), kFault);
  }
  EXPECT_EQ(fault_after([](FullGiven& given) { given.prior[3].C_c_b.setZero(); }), std::nullopt);  // of no gyro
}

TEST(SetUp, ThatIsRefusedChangesNothing) {
  const test::Flight flight({.duration_s = 60});
  const PairGiven given;
  const auto on_board = test::flown(flight, given);
  const PairOnBoard before = *on_board;
  PairGiven bad;
  bad.setup.gate_nis = 0;
  EXPECT_EQ(on_board->set_up(bad.setup, bad.prior, bad.covariance, {}), SetupFault::kGateNotPositive);
  PairGiven singular;
  singular.covariance.setZero();
  EXPECT_EQ(on_board->set_up(singular.setup, singular.prior, singular.covariance, {}),
            SetupFault::kPriorNotPositiveDefinite);
  EXPECT_EQ(on_board->t(), before.t());
  EXPECT_TRUE(on_board->estimator().started());
  EXPECT_EQ(on_board->navigation_attitude().value().C_in_c.raw(), before.navigation_attitude().value().C_in_c.raw());
}

TEST(SetUp, AgainForgetsAllThatWas) {
  test::Flight flight({.duration_s = 120});
  const PairGiven given;
  const auto fresh = given.on_board();
  const auto used = given.on_board();
  test::fly(flight, *used);
  EXPECT_EQ(used->set_up(given.setup, given.prior, given.covariance, {}), std::nullopt);
  EXPECT_FALSE(used->estimator().started());
  EXPECT_FALSE(used->navigator().started());
  test::fly(flight, *fresh);
  test::fly(flight, *used);
  EXPECT_EQ(test::state_root(used->estimator()), test::state_root(fresh->estimator()));
  EXPECT_EQ(used->navigation_attitude().value().C_in_c.raw(), fresh->navigation_attitude().value().C_in_c.raw());
}

}  // namespace
}  // namespace trihedron
