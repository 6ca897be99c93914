#pragma once
/// What the calibration filters have in common: noise and prior they are set up with, and the report on each fix.

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <optional>

#include "trihedron/core/attitude.hpp"
#include "trihedron/core/cholesky.hpp"
#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/precession.hpp"
#include "trihedron/core/result.hpp"
#include "trihedron/core/status.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron {

/// Parameters of all gyros in the order of calibration.json: per gyro the drift coefficients, then alignment x, y, z.
template <class Model, int N>
struct ParameterLayout {
  static constexpr int kPerGyro = Model::kSize + 3;
  static constexpr int kSize = N * kPerGyro;
  [[nodiscard]] static constexpr int drift(int gyro) { return gyro * kPerGyro; }
  [[nodiscard]] static constexpr int alignment(int gyro) { return gyro * kPerGyro + Model::kSize; }
};

/// Errors whose covariance every estimator can give: φ of each momentum (3 components in `in`; along the momentum zero
/// or without meaning), then the parameters, then Δb of each readout where its bias is estimated. See Sensitivity for
/// the definition of φ, Δκ and δ; bias(true) = bias(est) + Δb.
template <class Model, int N, bool ReadoutBias = false>
struct ErrorLayout {
  static constexpr bool kReadoutBias = ReadoutBias;
  static constexpr int kDirections = 3 * N;
  static constexpr int kBiases = kDirections + ParameterLayout<Model, N>::kSize;
  static constexpr int kSize = kBiases + (ReadoutBias ? 3 * N : 0);
  [[nodiscard]] static constexpr int direction(int gyro) { return 3 * gyro; }
  [[nodiscard]] static constexpr int drift(int gyro) { return kDirections + ParameterLayout<Model, N>::drift(gyro); }
  [[nodiscard]] static constexpr int alignment(int gyro) {
    return kDirections + ParameterLayout<Model, N>::alignment(gyro);
  }
  [[nodiscard]] static constexpr int readout_bias(int gyro) { return kBiases + 3 * gyro; }
};

enum class SetupFault { kPriorNotPositiveDefinite, kPriorMeanNotUsable, kNoiseNotPositive, kGateNotPositive };

template <class Model, int N>
struct CalibrationSetup {
  using Layout = ParameterLayout<Model, N>;
  static constexpr Duration kNever = Duration::max();

  PerGyro<GyroModel<Model>, N> prior;  ///< prior means; the momenta come from the first fix
  Eigen::Matrix<double, Layout::kSize, Layout::kSize> prior_covariance =
      Eigen::Matrix<double, Layout::kSize, Layout::kSize>::Zero();  ///< rad/s and rad, positive definite
  PerGyro<double, N> readout_noise_rad{};                           ///< 1-sigma per direction cosine
  Eigen::Vector3d star_tracker_noise_rad{0, 0, 0};                  ///< 1-sigma about c x, y, z
  double direction_random_walk_rad_sqrt_s = 0;  ///< process noise of each momentum, per axis across it
  /// A fix with a NIS above this is rejected; χ² of 4 degrees of freedom passes 30 once in 2e5 good fixes. That of a
  /// pair: of more gyros a gate that good fixes pass as often.
  double gate_nis = 30;
  /// ν of Student's t, or 0 for normal noise. With it a fix above the gate is used with its weight instead of rejected,
  /// unless the star tracker or one gyro is plainly at fault; a run above the gate still reopens.
  /// Better where many fixes are a few times too noisy; few far outliers the gate alone keeps out no worse, and the
  /// paper's filter better. Between 5 and 20.
  double student_t_freedom = 0;
  /// After so many rejections in a row the directions are set free by the size of the misfit and the fix is used: the
  /// model was wrong, not the tracker.
  int reopen_after_rejections = 20;
  /// The same where the run began with a misfit that no drift can make: the tracker was wrong, or has been turned.
  int reopen_after_jump_rejections = 400;
  /// When that happens again within so many fixes, the parameters are what is wrong: their information goes. The
  /// estimates stay; of estimator invariant not when that has not helped, or the prior excludes them.
  int restart_within_fixes = 200;
  /// Without a fix that could be used for longer than this, the angles between the momenta are used alone; or kNever.
  Duration angles_after = std::chrono::minutes(1);

  /// Finite drift coefficients and biases, and alignments that are rotations.
  [[nodiscard]] bool means_are_usable() const {
    return std::all_of(prior.begin(), prior.end(), [](const GyroModel<Model>& gyro) {
      const double off = (gyro.C_c_b * gyro.C_c_b.transpose() - Eigen::Matrix3d::Identity()).norm();
      return gyro.drift_rad_s.allFinite() && gyro.readout_bias.allFinite() && off < 1e-6;
    });
  }

  /// What keeps it from working, beside the prior covariance.
  [[nodiscard]] std::optional<SetupFault> fault() const {
    if (!noise_is_positive()) {
      return SetupFault::kNoiseNotPositive;
    }
    if (!(gate_nis > 0) || !(student_t_freedom >= 0) || !(reopen_after_rejections > 0) ||
        !(reopen_after_jump_rejections > 0)) {
      return SetupFault::kGateNotPositive;
    }
    if (!means_are_usable()) {
      return SetupFault::kPriorMeanNotUsable;
    }
    return std::nullopt;
  }

  [[nodiscard]] bool noise_is_positive() const {
    return (star_tracker_noise_rad.array() > 0).all() && star_tracker_noise_rad.allFinite() &&
           direction_random_walk_rad_sqrt_s >= 0 &&
           std::all_of(readout_noise_rad.begin(), readout_noise_rad.end(),
                       [](double noise) { return noise > 0 && noise < 1; });
  }
};

/// Eq. (3), components 2–5, at one fix, and what was done with it.
template <int M>
struct FixReport {
  FixStatus status = FixStatus::kNone;
  Time t{};
  int head = 0;                                                                  ///< the star tracker
  Eigen::Matrix<double, M, 1> innovation = Eigen::Matrix<double, M, 1>::Zero();  ///< −z of eq. (3)
  Eigen::Matrix<double, M, M> innovation_covariance = Eigen::Matrix<double, M, M>::Zero();
  double nis = 0;               ///< innovation² over its covariance; M degrees of freedom
  double weight = 1;            ///< its noise was taken for 1/√weight of the nominal; 1 without Student's t
  int rejections_in_a_row = 0;  ///< or, with Student's t, fixes above the gate
  bool jumped = false;  ///< the misfit came at once and is more than drift can make: put down to the star tracker

  int odd_gyro = kNoGyro;  ///< index of the gyro that alone, and not the star tracker, explains why it was rejected

  [[nodiscard]] bool used() const { return is_used(status); }
};

/// Weight of an innovation when its noise is not normal but Student's t with ν degrees of freedom: of normal noise with
/// covariance R/w, w ~ Γ(ν/2, ν/2), the mean of w given an innovation of M components is (ν + M)/(ν + NIS). One step,
/// at the NIS before the update: R is nearly all of its covariance once the filter has settled, and before that too
/// large a weight is the safe side. Never above 1: what agrees too well is chance. ν = 0: always 1.
[[nodiscard]] inline double student_t_weight(double freedom, double nis, int components) {
  return freedom > 0 ? std::min((freedom + components) / (freedom + nis), 1.0) : 1.0;
}

/// Some square root of the information in `covariance`: rootᵀ root = covariance⁻¹.
template <int P>
[[nodiscard]] Result<Eigen::Matrix<double, P, P>, SetupFault> information_root(
    const Eigen::Matrix<double, P, P>& covariance) {
  // Scaled to unit diagonal first: the states differ by 1e6 in size.
  const Eigen::Matrix<double, P, 1> sigma = covariance.diagonal().cwiseSqrt();
  if (!(sigma.array() > 0).all() || !sigma.allFinite()) {
    return SetupFault::kPriorNotPositiveDefinite;
  }
  Eigen::Matrix<double, P, P> factor =
      sigma.cwiseInverse().asDiagonal() * covariance * sigma.cwiseInverse().asDiagonal();
  if (!factorize(factor) || !(factor.diagonal().array() > 1e-12).all()) {
    return SetupFault::kPriorNotPositiveDefinite;
  }
  Eigen::Matrix<double, P, P> root = sigma.cwiseInverse().asDiagonal();
  solve_lower(factor, root);
  return root;
}

}  // namespace trihedron
