#pragma once
/// A small flight for the tests of core: orbital rotation with rolls and pitches, two gyros that drift by eq. (1). The
/// simulator proper is a module above core; this one only has to be independent of the code under test where it
/// matters, and exact.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "trihedron/core/paper_estimator.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron::test {

inline constexpr double kArcsecond = std::numbers::pi / 180 / 3600;

struct FlightPlan {
  double duration_s = 1800;
  double slews_rad = 0.5;  ///< amplitude of rolls; a third of it in pitch
  double steady_until_s = 0;
  double misalignment = 1;  ///< times 30′
  double noise = 1;         ///< of the nominal noise
  unsigned seed = 1;
  double fix_offset_s = 0;  ///< fixes at 3 s · n + offset
};

struct Flight {
  static constexpr double kReadout_rad = 9.7e-6;
  static inline const Eigen::Vector3d kTracker_rad{1.45e-5, 1.45e-5, 9.7e-5};

  PerGyro<GyroModel<Esg7>, 2> truth;  ///< momenta at the end
  std::vector<GyroSample<2>> samples;
  std::vector<StarFix> fixes;
  std::vector<Eigen::Matrix3d> C_in_c_at_samples;

  [[nodiscard]] static Eigen::Matrix3d attitude(double t_s, double slews_rad, double steady_until_s = 0) {
    const auto turn = [](double x, double y, double z) { return Rot<C, C>::exp(Vec<C>::assume(x, y, z)).raw(); };
    const double slewing_s = std::max(t_s - steady_until_s, 0.0);
    const double roll = slews_rad * std::sin(slewing_s / 97);
    const double pitch = slews_rad / 3 * std::sin(slewing_s / 151);
    return Rot<In, C>::exp(Vec<In>::assume(0.3, -0.2, 0.9)).raw() * turn(0, 1.1e-3 * t_s, 0) * turn(roll, 0, 0) *
           turn(0, pitch, 0);
  }

  explicit Flight(const FlightPlan& plan) {
    truth[0].h_in = Eigen::Vector3d(0.51, 0.59, 0.63).normalized();
    truth[1].h_in = Eigen::Vector3d(-0.72, 0.49, 0.49).normalized();
    truth[0].drift_rad_s << -2.0e-6, -3.8e-7, -4.7e-8, -1.2e-6, 1.8e-6, 7.0e-7, -7.8e-7;
    truth[1].drift_rad_s << 4.4e-8, 1.4e-7, -1.3e-7, -1.3e-6, 1.5e-6, 9.3e-7, 1.8e-6;
    truth[0].C_c_b =
        Rot<C, B<1>>::exp(Vec<C>::assume(plan.misalignment * Eigen::Vector3d(2.4e-3, -4.2e-3, -7.3e-3))).raw();
    truth[1].C_c_b =
        Rot<C, B<2>>::exp(Vec<C>::assume(plan.misalignment * Eigen::Vector3d(4.0e-3, -2.0e-3, -7.5e-3))).raw();
    std::mt19937 random(plan.seed);
    std::normal_distribution<double> normal;
    const auto white = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };

    constexpr double kPeriod_s = 0.125;
    const int count = static_cast<int>(plan.duration_s / kPeriod_s);
    double next_fix_s = plan.fix_offset_s;
    for (int i = 0; i <= count; ++i) {
      const double t_s = i * kPeriod_s;
      const Eigen::Matrix3d C_in_c = attitude(t_s, plan.slews_rad, plan.steady_until_s);
      GyroSample<2> sample;
      sample.t = Time(from_seconds(t_s));
      for (int k = 0; k < 2; ++k) {
        sample.h_b[k] =
            truth[k].C_c_b.transpose() * C_in_c.transpose() * truth[k].h_in + plan.noise * kReadout_rad * white();
      }
      samples.push_back(sample);
      C_in_c_at_samples.push_back(C_in_c);
      for (; next_fix_s < t_s + kPeriod_s && next_fix_s <= plan.duration_s; next_fix_s += 3) {
        const Eigen::Vector3d error = plan.noise * kTracker_rad.cwiseProduct(white());
        const Eigen::Matrix3d measured =
            attitude(next_fix_s, plan.slews_rad, plan.steady_until_s) * Rot<C, C>::exp(Vec<C>::assume(error)).raw();
        fixes.push_back({Time(from_seconds(next_fix_s)), Eigen::Quaterniond(measured)});
      }
      if (i == count) {
        break;
      }
      for (int k = 0; k < 2; ++k) {
        const Eigen::Matrix3d middle = attitude(t_s + kPeriod_s / 2, plan.slews_rad, plan.steady_until_s);
        precess(truth[k], middle, Eigen::Vector3d(truth[k].C_c_b.transpose() * middle.transpose() * truth[k].h_in),
                kPeriod_s);
      }
    }
  }
};

/// Priors of the nominal mission: 30′ of alignment, 2e-6 rad/s of each coefficient.
inline CalibrationSetup<Esg7, 2> nominal_setup() {
  CalibrationSetup<Esg7, 2> setup;
  for (int k = 0; k < 2; ++k) {
    setup.prior_covariance.diagonal().segment<7>(10 * k).setConstant(4e-12);
    setup.prior_covariance.diagonal().segment<3>(10 * k + 7).setConstant(7.6e-5);
    setup.readout_noise_rad[k] = Flight::kReadout_rad;
  }
  setup.star_tracker_noise_rad = Flight::kTracker_rad;
  return setup;
}

/// Feeds a flight to a cycle in time order; calls on_report for every report.
template <class Cycle, class OnReport>
void fly(const Flight& flight, Cycle& cycle, OnReport&& on_report) {
  std::size_t fix = 0;
  for (const auto& sample : flight.samples) {
    for (; fix < flight.fixes.size() && flight.fixes[fix].t < sample.t; ++fix) {
      on_report(cycle.on_fix(flight.fixes[fix]));
    }
    on_report(cycle.on_gyro(sample));
    for (; fix < flight.fixes.size() && flight.fixes[fix].t == sample.t; ++fix) {
      on_report(cycle.on_fix(flight.fixes[fix]));
    }
  }
}

}  // namespace trihedron::test
