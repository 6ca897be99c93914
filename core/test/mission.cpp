#include "mission.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace trihedron::test {
namespace {

constexpr double kAlignmentSigma_rad = 8e-3;
constexpr double kDriftSigma_rad_s = 2e-6;

/// What the estimator is told; the further states are such that minutes show them.
CalibrationSetup setup_of(const MissionPlan& plan) {
  CalibrationSetup setup = nominal_setup(plan.layout);
  setup.gyro_period = from_seconds(plan.gyro_period_s);
  setup.wandering_drift = {2e-7, 300};
  setup.further_sigma[FurtherState::kCoefficientChange] = 2e-6;
  setup.further_sigma[FurtherState::kOrbitalDrift] = 1e-6;
  setup.further_sigma[FurtherState::kPolhode] = 1e-6;
  for (int k = 0; k < plan.layout.gyros; ++k) {
    setup.polhodes[k] = {static_cast<float>(100 + 30 * k), 0.1F};
  }
  setup.change.duration_s = 600;
  setup.change.zero_at = Time(from_seconds(100));
  setup.orbital_rate_rad_s = 0.02;
  for (int head = 0; head < kMaxStarTrackers; ++head) {
    setup.star_trackers[static_cast<std::size_t>(head)].C_c_s = turn(0.9 * head, 0.3 * head, 0);
  }
  return setup;
}

}  // namespace

Mission::Mission(const MissionPlan& plan) : given(plan.layout) {
  const Layout& layout = plan.layout;
  const CalibrationSetup& setup = given.setup = setup_of(plan);
  given.set_alignment_sigma(kAlignmentSigma_rad);
  given.covariance *= plan.calibration_sigma * plan.calibration_sigma;
  std::mt19937 random(plan.seed);
  std::normal_distribution<double> normal;
  const auto white = [&] { return test::white(random, normal); };

  const Eigen::Vector3d momenta[] = {{0.51, 0.59, 0.63}, {-0.72, 0.49, 0.49}, {0.1, -0.8, 0.6}, {0.7, 0.1, -0.7}};
  for (int k = 0; k < layout.gyros; ++k) {
    auto& gyro = truth[k];
    gyro.h_in = momenta[k].normalized();
    gyro.drift_rad_s = plan.calibration_sigma * kDriftSigma_rad_s *
                       Eigen::VectorXd::NullaryExpr(layout.drift_columns(), [&] { return normal(random); });
    gyro.C_c_b = turn(plan.calibration_sigma * kAlignmentSigma_rad * white());
    if (layout.further.wandering_drift) {
      gyro.drift_rad_s.segment<3>(layout.wandering_column()) = setup.wandering_drift.sigma * white();
    }
    if (layout.further.orbital_drift) {
      const double sigma = setup.further_sigma[FurtherState::kOrbitalDrift];
      gyro.drift_rad_s.segment<6>(layout.orbital_column()) << sigma * white(), sigma * white();
    }
    if (layout.further.polhode) {
      auto its = gyro.drift_rad_s.segment<Layout::kPolhode>(layout.polhode_column());
      its = setup.further_sigma[FurtherState::kPolhode] / (plan.calibration_sigma * kDriftSigma_rad_s) * its;
    }
    if (layout.further.readout_bias) {
      gyro.readout_bias = setup.further_sigma[FurtherState::kReadoutBias] * white();
    }
  }
  shared.resize(layout.shared_size());
  for (int i = 0; i < layout.shared_size(); ++i) {
    shared(i) = prior_sigma_of_further_state(setup, layout.shared() + i) * normal(random);
  }
  const auto clock_s = [&](double t_s) {
    const double offset_s = layout.further.clock_offset ? shared(layout.clock_offset() - layout.shared()) : 0;
    const double rate = layout.further.clock_rate ? shared(layout.clock_rate() - layout.shared()) : 0;
    return offset_s + rate * (t_s - to_seconds(setup.orbital_phase_zero - Time{}));
  };
  const auto attitude = [&](double t_s) { return Flight::attitude(t_s, plan.slews_rad, plan.slews_from_s); };

  const DriftModel drift(layout.drift_model, layout.further);
  const int count = static_cast<int>(plan.duration_s / plan.gyro_period_s);
  std::vector<double> next_fix_s;
  for (int head = 0; head < layout.star_trackers; ++head) {
    next_fix_s.push_back(head * plan.fix_period_s / layout.star_trackers);
  }
  for (int i = 0; i <= count; ++i) {
    const double t_s = i * plan.gyro_period_s;
    const double next_s = t_s + plan.gyro_period_s;
    const Eigen::Matrix3d C_in_c = attitude(t_s);
    GyroSample sample;
    sample.t = Time(from_seconds(t_s));
    Eigen::VectorXd wandering = Eigen::VectorXd::Zero(3 * layout.gyros);
    for (int k = 0; k < layout.gyros; ++k) {
      const auto& gyro = truth[k];
      sample.h_b[k] = (gyro.C_c_b.transpose() * C_in_c.transpose() * gyro.h_in + gyro.readout_bias +
                       setup.readout_noise_rad[k] * white())
                          .normalized();
      if (layout.further.wandering_drift) {
        wandering.segment<3>(3 * k) = gyro.drift_rad_s.segment<3>(layout.wandering_column());
      }
    }
    samples.push_back(sample);
    C_in_c_at_samples.push_back(C_in_c);
    wandering_at_samples.push_back(wandering);
    // The fixes until the next sample, in time order.
    for (;;) {
      const auto first = std::min_element(next_fix_s.begin(), next_fix_s.end());
      if (!(*first < next_s - 1e-6 && *first <= plan.duration_s)) {
        break;
      }
      StarFix fix;
      fix.t = Time(from_seconds(*first));
      fix.head = static_cast<int>(first - next_fix_s.begin());
      const StarTrackerSetup& its = setup.star_trackers[static_cast<std::size_t>(fix.head)];
      // A clock that is off shows another attitude; the other errors that the shared states stand for turn it.
      Eigen::Vector3d error = fix_by_shared_states(setup, fix, Eigen::Vector3d::Zero()) * shared;
      error += its.C_c_s * its.noise_rad.cwiseProduct(white());
      fix.q_in_c = Eigen::Quaterniond(attitude(*first + clock_s(*first)) * turn(error));
      fixes.push_back(fix);
      *first += plan.fix_period_s;
    }
    if (i == count) {
      break;
    }
    const Eigen::Matrix3d middle = attitude(t_s + plan.gyro_period_s / 2);
    const DriftTimes times = setup.drift_times(Time(from_seconds(t_s + plan.gyro_period_s / 2)));
    const double kept = setup.wandering_drift.kept(plan.gyro_period_s);
    for (int k = 0; k < layout.gyros; ++k) {
      auto& gyro = truth[k];
      precess(gyro, drift, middle,
              Eigen::Vector3d(gyro.C_c_b.transpose() * middle.transpose() * gyro.h_in) + gyro.readout_bias, times[k],
              plan.gyro_period_s);
      if (layout.further.wandering_drift) {
        auto its = gyro.drift_rad_s.segment<3>(layout.wandering_column());
        its = (kept * its + setup.wandering_drift.noise(kept) * white()).eval();
      }
    }
  }
}

Eigen::VectorXd Mission::errors(const FullEstimator& estimator, std::size_t last_fix) const {
  const Layout& layout = estimator.layout();
  Eigen::VectorXd errors = Eigen::VectorXd::Zero(layout.size());
  for (int k = 0; k < layout.gyros; ++k) {
    const auto& its = estimator.gyros()[k];
    const Eigen::VectorXd drift = truth[k].drift_rad_s - its.drift_rad_s;
    errors.segment(layout.drift(k), layout.drift_size()) = drift.head(layout.drift_size());
    errors.segment<3>(layout.alignment(k)) = rotation_vector(truth[k].C_c_b * its.C_c_b.transpose());
    if (layout.further.wandering_drift) {
      errors.segment<3>(layout.wandering(k)) =
          wandering_at_samples[last_fix].segment<3>(3 * k) - its.drift_rad_s.segment<3>(layout.wandering_column());
    }
    if (layout.further.readout_bias) {
      errors.segment<3>(layout.readout_bias(k)) = truth[k].readout_bias - its.readout_bias;
    }
    if (layout.further.coefficient_change) {
      errors.segment<7>(layout.change(k)) = drift.segment<7>(layout.change_column());
    }
    if (layout.further.orbital_drift) {
      errors.segment<6>(layout.orbital_drift(k)) = drift.segment<6>(layout.orbital_column());
    }
    if (layout.further.polhode) {
      errors.segment<14>(layout.polhode(k)) = drift.segment<14>(layout.polhode_column());
    }
  }
  errors.tail(layout.shared_size()) = shared - estimator.shared();
  return errors;
}

}  // namespace trihedron::test
