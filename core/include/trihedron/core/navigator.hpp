#pragma once
/// The open-loop navigator: between astro-corrections the momenta turn by the drift model alone, and they give the
/// attitude.

#include <algorithm>
#include <cmath>

#include "trihedron/core/calibration.hpp"
#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/core/per_gyro.hpp"

namespace trihedron {

/// Attitude with the covariance of its error ε in c axes, rad²: true C_in_c = est · exp([ε×]).
struct AttitudeSolution {
  Rot<In, C> C_in_c;
  Eigen::Matrix3d covariance_rad2 = Eigen::Matrix3d::Zero();
};

/// Error of the attitude by readings h_b, c axes, by errors at a reference epoch (columns as in ErrorLayout) carried by
/// `since`.
template <class Estimator>
[[nodiscard]] Eigen::Matrix<double, 3, Estimator::Errors::kSize> attitude_by_errors(
    const AttitudeByDirections<Estimator::kGyros>& attitude, const typename Estimator::Gyros& gyros,
    const typename Estimator::Directions& h_b, const typename Estimator::Sensitivities& since) {
  using Errors = typename Estimator::Errors;
  constexpr int kDrift = Estimator::DriftModel::kSize;
  const Eigen::Matrix3d C_c_in = attitude.C_in_c.raw().transpose();
  Eigen::Matrix<double, 3, Errors::kSize> by_errors = Eigen::Matrix<double, 3, Errors::kSize>::Zero();
  for (int k = 0; k < Estimator::kGyros; ++k) {
    const Eigen::Matrix3d by_phi = attitude.by_directions.template middleCols<3>(3 * k);
    const Eigen::Matrix3d by_phi_in = by_phi * C_c_in;
    by_errors.template middleCols<3>(Errors::direction(k)) = by_phi_in * since[k].by_start;
    by_errors.template middleCols<kDrift>(Errors::drift(k)) = by_phi_in * since[k].by_drift;
    by_errors.template middleCols<3>(Errors::alignment(k)) = by_phi_in * since[k].by_alignment - by_phi;
    if constexpr (Errors::kReadoutBias) {
      by_errors.template middleCols<3>(Errors::readout_bias(k)) =
          by_phi * skew<double>(gyros[k].in_c(h_b[k])) * gyros[k].C_c_b;
    }
  }
  return by_errors;
}

/// Attitude with its covariance: `spread` spreadᵀ by errors of what is estimated, plus the readout noise of these
/// readings and a random walk of the directions of `walk_variance_rad2` per axis.
template <int N, int Columns>
[[nodiscard]] AttitudeSolution with_covariance(const AttitudeByDirections<N>& attitude,
                                               const Eigen::Matrix<double, 3, Columns>& spread,
                                               const PerGyro<double, N>& readout_noise_rad, double walk_variance_rad2) {
  AttitudeSolution solution;
  solution.C_in_c = attitude.C_in_c;
  for (int k = 0; k < N; ++k) {
    const Eigen::Matrix3d by_phi = attitude.by_directions.template middleCols<3>(3 * k);
    const double white = readout_noise_rad[k] * readout_noise_rad[k] + walk_variance_rad2;
    solution.covariance_rad2 += white * by_phi * by_phi.transpose();
  }
  solution.covariance_rad2 += gram(spread);
  return solution;
}

/// Momenta and parameters in use since the last astro-correction, and what is known of their errors. Drift that wanders
/// fades as first-order Gauss–Markov noise does, and what comes in its place is unknown.
template <class Estimator>
class Navigator {
 public:
  static constexpr int kGyros = Estimator::kGyros;
  static constexpr bool kWanders = int{Estimator::DriftModel::kSize} > int{Estimator::BaseModel::kSize};

  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] const typename Estimator::Gyros& gyros() const { return gyros_; }

  /// Instantaneous astro-correction: takes over the estimator's directions and parameters.
  void correct(const Estimator& estimator) {
    gyros_ = estimator.gyros();
    errors_ = estimator.error_root();
    restart_clock(estimator.setup());
  }

  /// Instantaneous astro-correction with the parameters of the set-up held: the directions are those that the held
  /// alignments read at this attitude (`h_b`), and the errors those of the set-up and of the attitude.
  void correct_directions(const Estimator& estimator, const AttitudeSolution& attitude,
                          const typename Estimator::Directions& h_b) {
    using Errors = typename Estimator::Errors;
    constexpr int kParameters = Errors::kSize - Errors::kDirections;
    static_assert(Estimator::ErrorRoot::ColsAtCompileTime >= kParameters + 3);
    if (!started_) {
      gyros_ = estimator.prior_gyros();
    }
    const Eigen::Matrix3d& C_in_c = attitude.C_in_c.raw();
    errors_.setZero();
    errors_.template block<kParameters, kParameters>(Errors::kDirections, 0) = estimator.prior_parameter_root();
    const Eigen::Matrix3d attitude_root = cholesky_root<3>(attitude.covariance_rad2);
    for (int k = 0; k < kGyros; ++k) {
      gyros_[k].h_in = (C_in_c * gyros_[k].in_c(h_b[k])).normalized();
      // φ = C_in_c (δ + ε − h_c × C_c_b Δb): h_in was read through what is held at the estimated attitude.
      auto phi = errors_.template middleRows<3>(Errors::direction(k));
      phi = C_in_c * errors_.template middleRows<3>(Errors::alignment(k));
      if constexpr (Errors::kReadoutBias) {
        phi -= C_in_c * skew<double>(gyros_[k].in_c(h_b[k])) * gyros_[k].C_c_b *
               errors_.template middleRows<3>(Errors::readout_bias(k));
      }
      errors_.template block<3, 3>(Errors::direction(k), kParameters) = C_in_c * attitude_root;
    }
    restart_clock(estimator.setup());
  }

  /// Open-loop prediction over one step; C_in_c and h_b of its middle. Needs started().
  void predict(const Eigen::Matrix3d& C_in_c, const typename Estimator::Directions& h_b, double dt_s) {
    for (int k = 0; k < kGyros; ++k) {
      precess(gyros_[k], C_in_c, h_b[k], dt_s);
      if constexpr (kWanders) {
        gyros_[k].drift_rad_s.template tail<3>() *= std::exp(-dt_s / wandering_time_s_);
      }
    }
    time_since_correction_s_ += dt_s;
  }

  /// Widens the directions: `variance_rad2` per axis, as the estimator's.
  void add_direction_variance(double variance_rad2) { extra_variance_rad2_ += variance_rad2; }

  /// Carries the errors over the stretch between two fixes, for which the estimator has integrated the sensitivities.
  void extend(const typename Estimator::Sensitivities& stretch) {
    since_correction_ = since_correction(stretch);
    extended_until_s_ = time_since_correction_s_;
  }

  /// Attitude by the momenta and these readings. Needs started().
  [[nodiscard]] Result<AttitudeByDirections<kGyros>, DirectionsFault> attitude(
      const typename Estimator::Directions& h_b, const GyroMask<kGyros>& used) const {
    return Estimator::attitude(gyros_, h_b, used);
  }

  /// The same with its covariance; `since_fix`: the stretch not yet given to extend().
  [[nodiscard]] Result<AttitudeSolution, DirectionsFault> attitude_with_covariance(
      const FixReadings<kGyros>& readings, const typename Estimator::Sensitivities& since_fix,
      const typename Estimator::Setup& setup) const {
    const auto by_directions = attitude(readings.h_b, readings.used);
    if (!by_directions) {
      return by_directions.fault();
    }
    const typename Estimator::Sensitivities since = since_correction(since_fix);
    PerGyro<double, kGyros> noise_rad;
    for (int k = 0; k < kGyros; ++k) {
      noise_rad[k] = readings.noise_factor * setup.readout_noise_rad[k];
    }
    const double walk = setup.direction_random_walk_rad_sqrt_s;
    const Eigen::Matrix<double, 3, Estimator::ErrorRoot::ColsAtCompileTime> spread =
        attitude_by_errors<Estimator>(by_directions.value(), gyros_, readings.h_b, since) * errors_;
    return with_covariance(by_directions.value(), spread, noise_rad,
                           walk * walk * time_since_correction_s_ + extra_variance_rad2_ + wandered_variance_rad2());
  }

 private:
  /// The sensitivities since the correction, with those of the stretch after them.
  [[nodiscard]] typename Estimator::Sensitivities since_correction(
      const typename Estimator::Sensitivities& stretch) const {
    typename Estimator::Sensitivities since = since_correction_;
    for (int k = 0; k < kGyros; ++k) {
      if constexpr (kWanders) {
        auto faded = stretch[k];
        faded.by_drift.template rightCols<3>() *= std::exp(-extended_until_s_ / wandering_time_s_);
        since[k] = since[k].then(faded);
      } else {
        since[k] = since[k].then(stretch[k]);
      }
    }
    return since;
  }

  /// Of the directions, per axis: by the drift that has come since the correction, ∫w(t) dt less what w(0) lets expect
  /// of it, σ² τ² (2x − 3 + 4 exp(−x) − exp(−2x)) with x = t/τ.
  [[nodiscard]] double wandered_variance_rad2() const {
    const double x = time_since_correction_s_ / wandering_time_s_;
    const double scale_rad = wandering_sigma_rad_s_ * wandering_time_s_;
    return scale_rad * scale_rad * std::max(2 * x - 3 + 4 * std::exp(-x) - std::exp(-2 * x), 0.0);
  }

  void restart_clock(const typename Estimator::Setup& setup) {
    if constexpr (kWanders) {
      wandering_sigma_rad_s_ = setup.wandering_sigma_rad_s;
      wandering_time_s_ = setup.wandering_time_s;
    }
    since_correction_ = {};
    extended_until_s_ = 0;
    time_since_correction_s_ = 0;
    extra_variance_rad2_ = 0;
    started_ = true;
  }

  typename Estimator::Gyros gyros_;
  typename Estimator::ErrorRoot errors_ = Estimator::ErrorRoot::Zero();
  typename Estimator::Sensitivities since_correction_;
  double time_since_correction_s_ = 0;
  double extended_until_s_ = 0;
  double wandering_sigma_rad_s_ = 0;
  double wandering_time_s_ = 1;
  double extra_variance_rad2_ = 0;
  bool started_ = false;
};

}  // namespace trihedron
