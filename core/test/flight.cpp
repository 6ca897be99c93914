#include "flight.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>

namespace trihedron::test {

Eigen::Matrix3d turn(const Eigen::Vector3d& v) { return Rot<C, C>::exp(Vec<C>::assume(v)).raw(); }
Eigen::Matrix3d turn(double x, double y, double z) { return turn(Eigen::Vector3d(x, y, z)); }

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& C_a_b) { return Rot<C, C>::assume(C_a_b).log().raw(); }

Eigen::Vector3d attitude_error(const Eigen::Matrix3d& truth, const AttitudeSolution& estimate) {
  return rotation_vector(truth.transpose() * estimate.C_in_c.raw());
}

Eigen::Vector3d white(std::mt19937& random, std::normal_distribution<double>& normal) {
  const double z = normal(random);
  const double y = normal(random);
  const double x = normal(random);
  return {x, y, z};
}

double normalised_square(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  // Scaled to unit diagonal first: errors may differ by 1e6 in size.
  const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  const Eigen::VectorXd scaled = scale.cwiseProduct(error);
  return scaled.dot(correlation.llt().solve(scaled));
}

Eigen::Matrix3d Flight::attitude(double t_s, double slews_rad, double steady_until_s, double turn_rad_s) {
  const double slewing_s = std::max(t_s - steady_until_s, 0.0);
  const double roll = slews_rad * std::sin(slewing_s / 97);
  const double pitch = slews_rad / 3 * std::sin(slewing_s / 151);
  return turn(0.3, -0.2, 0.9) * turn(0, turn_rad_s * t_s, 0) * turn(roll, 0, 0) * turn(0, pitch, 0);
}

Flight::Flight(const FlightPlan& plan) {
  truth[0].h_in = Eigen::Vector3d(0.51, 0.59, 0.63).normalized();
  truth[1].h_in = Eigen::Vector3d(-0.72, 0.49, 0.49).normalized();
  truth[0].drift_rad_s << -2.0e-6, -3.8e-7, -4.7e-8, -1.2e-6, 1.8e-6, 7.0e-7, -7.8e-7;
  truth[1].drift_rad_s << 4.4e-8, 1.4e-7, -1.3e-7, -1.3e-6, 1.5e-6, 9.3e-7, 1.8e-6;
  truth[0].C_c_b = turn(plan.misalignment * Eigen::Vector3d(2.4e-3, -4.2e-3, -7.3e-3));
  truth[1].C_c_b = turn(plan.misalignment * Eigen::Vector3d(4.0e-3, -2.0e-3, -7.5e-3));
  const DriftModel eq1;
  std::mt19937 random(plan.seed);
  std::normal_distribution<double> normal;
  const auto white = [&] { return test::white(random, normal); };

  const auto attitude_at = [&](double t_s) {
    return attitude(t_s, plan.slews_rad, plan.steady_until_s, plan.turn_rad_s);
  };
  constexpr double kPeriod_s = 0.125;
  const int count = static_cast<int>(plan.duration_s / kPeriod_s);
  double next_fix_s = plan.fix_offset_s;
  std::mt19937 intervals(plan.seed);
  std::uniform_real_distribution<double> even;
  for (int i = 0; i <= count; ++i) {
    const double t_s = i * kPeriod_s;
    const Eigen::Matrix3d C_in_c = attitude_at(t_s);
    GyroSample sample;
    sample.t = Time(from_seconds(t_s));
    for (int k = 0; k < 2; ++k) {
      sample.h_b[k] =
          truth[k].C_c_b.transpose() * C_in_c.transpose() * truth[k].h_in + plan.noise * kReadout_rad * white();
    }
    samples.push_back(sample);
    C_in_c_at_samples.push_back(C_in_c);
    for (; next_fix_s < t_s + kPeriod_s && next_fix_s <= plan.duration_s;) {
      const Eigen::Vector3d error = plan.noise * kTracker_rad.cwiseProduct(white());
      const Eigen::Matrix3d measured = attitude_at(next_fix_s) * turn(error);
      fixes.push_back({Time(from_seconds(next_fix_s)), Eigen::Quaterniond(measured)});
      next_fix_s += plan.fix_interval_s - plan.fix_jitter_s * even(intervals);
    }
    if (i == count) {
      break;
    }
    for (int k = 0; k < 2; ++k) {
      const Eigen::Matrix3d middle = attitude_at(t_s + kPeriod_s / 2);
      precess(truth[k], eq1, middle, Eigen::Vector3d(truth[k].C_c_b.transpose() * middle.transpose() * truth[k].h_in),
              {}, kPeriod_s);
    }
  }
}

std::vector<GyroSample> with_third_gyro(const Flight& pair, const Eigen::Vector3d& h_in, unsigned seed) {
  std::vector<GyroSample> samples = pair.samples;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].h_b[2] = pair.C_in_c_at_samples[i].transpose() * h_in + Flight::kReadout_rad * white(random, normal);
  }
  return samples;
}

CalibrationSetup nominal_setup(const Layout& layout) {
  CalibrationSetup setup;
  setup.layout = layout;
  for (int k = 0; k < layout.gyros; ++k) {
    setup.readout_noise_rad[k] = Flight::kReadout_rad;
  }
  for (StarTrackerSetup& star_tracker : setup.star_trackers) {
    star_tracker.noise_rad = Flight::kTracker_rad;
  }
  setup.wandering_drift.sigma = 1e-9;
  return setup;
}

Eigen::MatrixXd nominal_covariance(const Layout& layout) {
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(layout.parameters(), layout.parameters());
  for (int k = 0; k < layout.gyros; ++k) {
    covariance.diagonal().segment(layout.drift(k) - layout.dynamic(), layout.drift_size()).setConstant(4e-12);
    covariance.diagonal().segment<3>(layout.alignment(k) - layout.dynamic()).setConstant(7.6e-5);
  }
  return covariance;
}

void draw_means(const PairGyros& truth, unsigned seed, double alignment_sigma_rad, PairGyros& means) {
  std::mt19937 random(seed + 1000);
  std::normal_distribution<double> normal;
  for (int k = 0; k < PairGyros::capacity(); ++k) {
    means[k].drift_rad_s =
        truth[k].drift_rad_s + 2e-6 * Esg7::Coefficients<double>::NullaryExpr([&] { return normal(random); });
    const Eigen::Vector3d delta = alignment_sigma_rad * Eigen::Vector3d::NullaryExpr([&] { return normal(random); });
    means[k].C_c_b = turn(delta) * truth[k].C_c_b;
  }
}

}  // namespace trihedron::test
