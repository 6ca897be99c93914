#pragma once
/// What the estimator reports of each fix.

#include <Eigen/Core>

#include "trihedron/core/layout.hpp"
#include "trihedron/core/status.hpp"
#include "trihedron/core/telemetry.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron {

/// Eq. (3), components 2–5, at one fix, and what was done with it: two components for each gyro of the layout, zero for
/// those that could not be used.
struct FixReport {
  using Innovation = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxComponents, 1>;
  using Covariance = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxComponents, kMaxComponents>;

  FixStatus status = FixStatus::kNone;
  Time t{};
  int head = 0;           ///< the star tracker
  Innovation innovation;  ///< −z of eq. (3); empty where the fix was not compared
  Covariance innovation_covariance;
  double nis = 0;  ///< innovation² over its covariance; as many degrees of freedom as components
  /// What the angles between the momenta that were read are off those estimated, and the 1-sigma of that, rad; each the
  /// largest of all pairs of gyros used that give an attitude. An error of the fix has no part in it. Zero where the
  /// fix was not compared.
  double angle_off_rad = 0;
  double angle_sigma_rad = 0;
  double weight = 1;            ///< the noise was assumed 1/√weight times the nominal one; 1 without Student's t
  int rejections_in_a_row = 0;  ///< or, with Student's t, fixes above the gate
  /// The misfit appeared within one fix and is larger than drift can cause: attributed to the star tracker.
  bool jumped = false;
  /// Index of the one gyro without which all others agree with the fix, where a fault of it explains the rejection.
  int odd_gyro = kNoGyro;

  /// An angle that is off by more sigmas is not by chance: a gyro is at fault, or its momentum or alignment is not what
  /// the estimator takes it for.
  static constexpr double kContradiction = 8;

  [[nodiscard]] bool used() const { return is_used(status); }
  [[nodiscard]] bool gyros_contradict() const { return angle_off_rad > kContradiction * angle_sigma_rad; }
};

/// The report on a fix at which the estimate was lost.
[[nodiscard]] inline FixReport lost(const StarFix& fix) {
  FixReport report;
  report.status = FixStatus::kEstimateLost;
  report.t = fix.t;
  report.head = fix.head;
  return report;
}

/// Report on one update by the angles between the momenta alone.
struct AngleReport {
  FixStatus status = FixStatus::kNone;
  Time t{};
  double nis = 0;  ///< 2 n − 3 degrees of freedom, n gyros used
  int rejections_in_a_row = 0;
  int odd_gyro = kNoGyro;  ///< as of FixReport
};

/// Weight of an innovation when its noise is not normal but Student's t with ν degrees of freedom: of normal noise with
/// covariance R/w, w ~ Γ(ν/2, ν/2), the mean of w given an innovation of M components is (ν + M)/(ν + NIS). One step,
/// at the NIS before the update: R is nearly all of its covariance once the filter has settled, and before that too
/// large a weight is safe. Limited to 1: better agreement than expected is chance. ν = 0: always 1.
[[nodiscard]] double student_t_weight(double freedom, double nis, int components);

}  // namespace trihedron
