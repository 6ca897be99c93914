#include "trihedron/ground/evaluate/open_loop_forecast.hpp"

#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <array>
#include <chrono>
#include <cmath>
#include <random>

#include "model/gyro.hpp"
#include "model/prior.hpp"
#include "trihedron/core/forecast.hpp"
#include "trihedron/core/measurement.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/core/precession.hpp"

namespace trihedron::ground {
namespace {

using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::seconds;

constexpr double kRate_rad_s = 1.1e-3;
constexpr double kWalk_rad_sqrt_s = 2e-8;
constexpr int kGyros = 2;

GyroMask both() {
  GyroMask used{};
  used[0] = used[1] = true;
  return used;
}

/// Orbital flight about −y for two hours, with a roll slew and back in the second hour.
struct Flight {
  std::vector<Time> t;
  std::vector<Eigen::Quaterniond> q_in_c;

  Flight() {
    for (int s = 0; s <= 7200; s += 10) {
      const double roll = s > 4000 && s < 4600 ? 0.5 * std::pow(std::sin((s - 4000) * M_PI / 600), 2) : 0;
      t.push_back(Time{} + seconds(s));
      q_in_c.push_back(Eigen::Quaterniond(Eigen::AngleAxisd(-kRate_rad_s * s, Eigen::Vector3d::UnitY()) *
                                          Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX())));
    }
  }
};

std::vector<GyroCalibration> gyros(const Eigen::Matrix3d& C_in_c) {
  std::vector<GyroCalibration> two(kGyros);
  const std::array<Eigen::Vector3d, kGyros> h_c = {Eigen::Vector3d(0.9, 0.3, 0.3), Eigen::Vector3d(-0.2, 0.9, 0.4)};
  for (int k = 0; k < kGyros; ++k) {
    GyroCalibration& gyro = two[static_cast<std::size_t>(k)];
    gyro.drift_rad_s = {1e-6, -2e-6, 1.5e-6, 5e-7, -1e-6, 2e-6, -7e-7};
    gyro.alignment_rotation_vector_rad = {0.004 * (k + 1), -0.003, 0.005};
    gyro.momentum_in = C_in_c * h_c[static_cast<std::size_t>(k)].normalized();
  }
  return two;
}

/// An open loop as it is flown: the body turns as it does, the true momenta are read, and those in the computer turn by
/// what is known. `x`: the errors at the correction, in the order of the layout. Returns the attitude error, truth by
/// estimate, c axes.
class Loop {
 public:
  Loop(const OpenLoopStart& start, const BodyMotion& motion, Time t, const Eigen::VectorXd& x, unsigned seed)
      : start_(start), motion_(motion), t_(t), drift_(start.layout.drift_model, start.layout.further), random_(seed) {
    const std::vector<GyroCalibration> records = gyros(motion.C_in_c(t));
    for (int k = 0; k < kGyros; ++k) {
      estimate_[k] = gyro_of(records[static_cast<std::size_t>(k)], start.layout);
      truth_[k] = estimate_[k];
      add_parameter_errors(start.layout, k, x, truth_[k]);
      truth_[k].h_in = rotated<double>(truth_[k].h_in, Eigen::Vector3d(x.segment<3>(start.layout.direction(k))));
      if (start.layout.further.wandering_drift) {
        truth_[k].drift_rad_s.segment<3>(start.layout.wandering_column()) = x.segment<3>(start.layout.wandering(k));
      }
    }
  }

  Eigen::Vector3d error_after(Duration after, bool noisy) {
    const Duration step = seconds(10);
    while (now_ < after) {
      const Eigen::Matrix3d C_in_c = motion_.C_in_c(t_ + now_ + step / 2);
      const Directions h_b = read(C_in_c, 0);
      const Eigen::Matrix3d estimated = attitude(h_b);
      const double dt_s = to_seconds(step);
      for (int k = 0; k < kGyros; ++k) {
        precess(truth_[k], drift_, C_in_c, h_b[k], {}, dt_s);
        precess(estimate_[k], drift_, estimated, h_b[k], {}, dt_s);
        if (noisy) {
          truth_[k].h_in = rotated<double>(truth_[k].h_in, Eigen::Vector3d(start_.direction_random_walk_rad_sqrt_s *
                                                                           std::sqrt(dt_s) * normal()))
                               .normalized();
        }
        if (start_.layout.further.wandering_drift) {
          const double kept = start_.wandering_drift.kept(dt_s);
          auto wandering = truth_[k].drift_rad_s.segment<3>(start_.layout.wandering_column());
          wandering = (kept * wandering + (noisy ? start_.wandering_drift.noise(kept) : 0.0) * normal()).eval();
        }
      }
      now_ += step;
    }
    const Eigen::Matrix3d C_in_c = motion_.C_in_c(t_ + now_);
    return Rot<C, C>::assume(
               Eigen::Matrix3d(attitude(read(C_in_c, noisy ? start_.readout_noise_rad[0] : 0)).transpose() * C_in_c))
        .log()
        .raw();
  }

 private:
  Eigen::Vector3d normal() { return {normal_(random_), normal_(random_), normal_(random_)}; }
  Directions read(const Eigen::Matrix3d& C_in_c, double noise_rad) {
    Directions h_b;
    for (int k = 0; k < kGyros; ++k) {
      h_b[k] = truth_[k].reading_of(C_in_c.transpose() * truth_[k].h_in);
      if (noise_rad > 0) {
        h_b[k] += noise_rad * normal();
      }
      h_b[k].normalize();
    }
    return h_b;
  }
  [[nodiscard]] Eigen::Matrix3d attitude(const Directions& h_b) const {
    return optimal_rotation(momenta(estimate_, kGyros), in_c(estimate_, kGyros, h_b), both()).value().raw();
  }

  const OpenLoopStart& start_;
  const BodyMotion& motion_;
  Time t_;
  DriftModel drift_;
  Gyros estimate_;
  Gyros truth_;
  Duration now_{};
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// Momenta as a correction with a star tracker leaves them: as wrong as alignment and attitude together.
OpenLoopStart start_of(const Layout& layout, const Eigen::Matrix3d& C_in_c) {
  OpenLoopStart start;
  start.layout = layout;
  start.covariance = Eigen::MatrixXd::Zero(layout.shared(), layout.shared());
  Eigen::MatrixXd follow = Eigen::MatrixXd::Identity(layout.shared(), layout.shared());
  for (int k = 0; k < kGyros; ++k) {
    start.readout_noise_rad[k] = 1e-5;
    start.covariance.block(layout.direction(k), layout.direction(k), 3, 3).diagonal().setConstant(1e-10);
    start.covariance.block(layout.drift(k), layout.drift(k), layout.drift_size(), layout.drift_size())
        .diagonal()
        .setConstant(1e-16);
    start.covariance.block(layout.alignment(k), layout.alignment(k), 3, 3).diagonal().setConstant(4e-8);
    follow.block<3, 3>(layout.direction(k), layout.alignment(k)) = C_in_c;
    if (layout.further.wandering_drift) {
      start.wandering_drift = {2e-8, 2000};
      start.covariance.block(layout.wandering(k), layout.wandering(k), 3, 3).diagonal().setConstant(4e-16);
    }
  }
  start.covariance = (follow * start.covariance * follow.transpose()).eval();
  return start;
}

OpenLoopPrediction prediction_of(const OpenLoopStart& start, const BodyMotion& motion, Time t) {
  return {start, gyros(motion.C_in_c(t)), t, motion, AttitudeRule::kAllAlike, both()};
}

Layout with_wandering_drift() {
  Layout layout;
  layout.further.wandering_drift = true;
  return layout;
}

// One state after the other is off by one small amount: the covariance of that alone has the outer product of the
// derivative, which flights to both sides give. Beyond the end of what is given, so that the last orbit is repeated.
TEST(OpenLoopPrediction, HasTheDerivativesOfTheFlight) {
  const Flight flight;
  const BodyMotion motion(flight.t, flight.q_in_c);
  const Layout layout = with_wandering_drift();
  const Time t = flight.t.back() - minutes(40);
  OpenLoopStart start = start_of(layout, motion.C_in_c(t));
  const Eigen::VectorXd sigma = start.covariance.diagonal().cwiseSqrt();
  for (const Duration after : {Duration(minutes(20)), Duration(minutes(170))}) {
    for (Eigen::Index i = 0; i < layout.shared(); ++i) {
      start.covariance.setZero();
      start.covariance(i, i) = sigma(i) * sigma(i);
      start.readout_noise_rad = {};
      const GaussMarkov wandering = start.wandering_drift;
      start.wandering_drift.sigma = 0;
      OpenLoopPrediction prediction = prediction_of(start, motion, t);
      prediction.go_on(after);
      const Eigen::Matrix3d predicted = prediction.error().covariance_rad2;
      const Eigen::VectorXd x = sigma(i) * Eigen::VectorXd::Unit(layout.shared(), i);
      const Eigen::Vector3d by_flight = (Loop(start, motion, t, x, 1).error_after(after, false) -
                                         Loop(start, motion, t, -x, 1).error_after(after, false)) /
                                        2;
      start.wandering_drift = wandering;
      // The sensitivities take the attitude as known: of an error the drift makes κT ≈ 2 % more in this time.
      EXPECT_LT((by_flight * by_flight.transpose() - predicted).norm(), 0.05 * by_flight.squaredNorm() + 1e-18)
          << "state " << i << " after " << to_seconds(after) << " s";
    }
  }
}

// Draws from the covariance, flown with all their noise: their squares by the predicted covariance are χ² of three.
TEST(OpenLoopPrediction, IsWhatDrawsFromTheCovarianceDo) {
  const Flight flight;
  const BodyMotion motion(flight.t, flight.q_in_c);
  const Time t = flight.t.back() - minutes(40);
  OpenLoopStart start = start_of(with_wandering_drift(), motion.C_in_c(t));
  start.direction_random_walk_rad_sqrt_s = kWalk_rad_sqrt_s;
  constexpr std::array<Duration, 2> kAfter = {minutes(20), minutes(120)};
  std::array<PredictedError, kAfter.size()> predicted;
  OpenLoopPrediction prediction = prediction_of(start, motion, t);
  for (std::size_t i = 0; i < kAfter.size(); ++i) {
    prediction.go_on(kAfter[i]);
    predicted[i] = prediction.error();
  }
  constexpr int kDraws = 300;
  const Eigen::MatrixXd L = start.covariance.ldlt().matrixL();
  const Eigen::VectorXd D = start.covariance.ldlt().vectorD().cwiseMax(0).cwiseSqrt();
  const auto P = start.covariance.ldlt().transpositionsP();
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::array<double, kAfter.size()> squares{};
  std::array<Eigen::Vector3d, kAfter.size()> by_axis{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::array<int, kAfter.size()> beyond_68{};
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::VectorXd x(D.size());
    for (double& value : x) {
      value = normal(random);
    }
    x = P.transpose() * Eigen::VectorXd(L * D.cwiseProduct(x));
    Loop loop(start, motion, t, x, static_cast<unsigned>(draw));
    for (std::size_t i = 0; i < kAfter.size(); ++i) {
      const Eigen::Vector3d error = loop.error_after(kAfter[i], true);
      squares[i] += error.dot(predicted[i].covariance_rad2.llt().solve(error)) / kDraws;
      by_axis[i] += error.cwiseAbs2().cwiseQuotient(predicted[i].covariance_rad2.diagonal()) / kDraws;
      beyond_68[i] += error.norm() > predicted[i].error_68_rad ? 1 : 0;
    }
  }
  for (std::size_t i = 0; i < kAfter.size(); ++i) {
    // Four sigmas of the means of 300 χ² of three and of one: √(2·3/300) and √(2/300).
    EXPECT_NEAR(squares[i], 3, 4 * std::sqrt(6.0 / kDraws));
    for (const double square : by_axis[i]) {
      EXPECT_NEAR(square, 1, 4 * std::sqrt(2.0 / kDraws));
    }
    // Four of the binomial, and what the approximation of the quantile is off.
    EXPECT_NEAR(beyond_68[i], 0.32 * kDraws, 4 * std::sqrt(0.32 * 0.68 * kDraws) + 0.02 * kDraws);
  }
}

TEST(BodyMotion, GoesOnTurningWithTheSameManoeuvresAtOtherPhases) {
  const Flight flight;
  const BodyMotion motion(flight.t, flight.q_in_c);
  // Off the steady turn by 0.5 rad in the middle of the slew, which comes again when the 1.26 orbits of the flight have
  // passed, at another phase.
  const auto off_rad = [&](Time t) {
    const Eigen::AngleAxisd steady(-kRate_rad_s * to_seconds(t - flight.t.front()), Eigen::Vector3d::UnitY());
    return Eigen::AngleAxisd(steady.toRotationMatrix().transpose() * motion.C_in_c(t)).angle();
  };
  const Time slew = flight.t.front() + seconds(4300);
  const Duration orbit = from_seconds(2 * M_PI / kRate_rad_s);
  EXPECT_NEAR(off_rad(slew), 0.5, 1e-3);
  // Between slew and slew back the axis of both turns in space by a third of a radian: what they leave of 0.5 rad moves
  // the mean rate.
  constexpr double kLeft_rad = 0.06;
  EXPECT_NEAR(off_rad(slew + seconds(7200)), 0.5, kLeft_rad);
  EXPECT_LT(off_rad(slew + orbit), kLeft_rad);
  EXPECT_LT(off_rad(flight.t.back() + seconds(60)), kLeft_rad);
  // A flight of one orbit: 0.62 of an orbit later.
  Flight one_orbit;
  one_orbit.t.resize(573);
  one_orbit.q_in_c.resize(573);
  const BodyMotion of_one(one_orbit.t, one_orbit.q_in_c);
  const Eigen::AngleAxisd steady(-kRate_rad_s * 0.62 * to_seconds(orbit), Eigen::Vector3d::UnitY());
  EXPECT_LT(Eigen::AngleAxisd((steady * of_one.C_in_c(slew)).transpose() *
                              of_one.C_in_c(slew + from_seconds(0.62 * to_seconds(orbit))))
                .angle(),
            kLeft_rad);
}

TEST(BodyMotion, OfAShortPassTurnsOnAndOfAFixedAttitudeStays) {
  Flight ten_minutes;
  const Flight flight = ten_minutes;
  ten_minutes.t.resize(61);
  ten_minutes.q_in_c.resize(61);
  const BodyMotion turns(ten_minutes.t, ten_minutes.q_in_c);
  // Steady until then, so that the flight itself goes on the same for a while.
  EXPECT_TRUE(turns.C_in_c(flight.t[300]).isApprox(flight.q_in_c[300].toRotationMatrix(), 1e-9));
  const std::vector<Eigen::Quaterniond> fixed(flight.t.size(), Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5));
  const BodyMotion stays(flight.t, fixed);
  EXPECT_TRUE(stays.C_in_c(flight.t.back() + hours(5)).isApprox(fixed[0].toRotationMatrix(), 1e-9));
  const std::vector<Time> once{flight.t.front()};
  const BodyMotion known_once(once, fixed);
  EXPECT_TRUE(known_once.C_in_c(flight.t.back()).isApprox(fixed[0].toRotationMatrix(), 1e-9));
}

TEST(Forecast, SaysHowLongAnAccuracyIsKeptAndWhatLimitsIt) {
  const Flight flight;
  const BodyMotion motion(flight.t, flight.q_in_c);
  const Eigen::Matrix3d C_in_c = motion.C_in_c(motion.end());
  OpenLoopStart start = start_of(Layout{}, C_in_c);
  const Eigen::Index k0 = start.layout.drift(0);
  start.covariance(k0, k0) = 1e-12;  // much less known than the others
  const Need need{5 * kArcminute, minutes(271)};
  const OpenLoopForecast found = forecast(start, gyros(C_in_c), motion, AttitudeRule::kAllAlike, need);
  ASSERT_EQ(found.errors.size(), 145);
  EXPECT_EQ(found.errors.back().after, hours(24));
  ASSERT_TRUE(found.need);
  EXPECT_FALSE(found.need->met);
  EXPECT_EQ(found.need->causes.front().name, "gyro1.k0");
  EXPECT_GT(found.need->causes.front().share, 0.9);
  // The same limit, so the same time; the error passes it there.
  EXPECT_FALSE(found.usual.is_lower_bound);
  EXPECT_EQ(found.usual.within, found.need->accuracy.within);
  EXPECT_LT(found.usual.within, minutes(271));
  OpenLoopPrediction prediction = prediction_of(start, motion, motion.end());
  prediction.go_on(found.usual.within);
  // Between two minutes the error is taken as linear.
  EXPECT_NEAR(prediction.error().error_997_rad, 5 * kArcminute, 0.01 * kArcminute);
  const Need easy{10 * kArcminute, found.usual.within};
  EXPECT_TRUE(forecast(start, gyros(C_in_c), motion, AttitudeRule::kAllAlike, easy).need->met);
}

TEST(Forecast, OfNoErrorsHoldsAndOfParallelMomentaDoesNot) {
  const Flight flight;
  const BodyMotion motion(flight.t, flight.q_in_c);
  const Eigen::Matrix3d C_in_c = motion.C_in_c(motion.end());
  OpenLoopStart start = start_of(Layout{}, C_in_c);
  start.covariance.setZero();
  const OpenLoopForecast holds = forecast(start, gyros(C_in_c), motion, AttitudeRule::kAllAlike, std::nullopt);
  EXPECT_TRUE(holds.usual.is_lower_bound);
  EXPECT_EQ(holds.usual.within, hours(24));
  EXPECT_FALSE(holds.need);
  std::vector<GyroCalibration> parallel = gyros(C_in_c);
  parallel[1].momentum_in = parallel[0].momentum_in;
  const OpenLoopForecast none =
      forecast(start, parallel, motion, AttitudeRule::kAllAlike, Need{5 * kArcminute, minutes(10)});
  EXPECT_FALSE(none.need->met);
  EXPECT_EQ(none.usual.within, Duration::zero());
  EXPECT_FALSE(none.usual.is_lower_bound);
}

}  // namespace
}  // namespace trihedron::ground
