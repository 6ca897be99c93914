#pragma once
/// A measurement y = H x + noise of covariance R, and how it agrees with what is known of x.

#include <Eigen/Cholesky>

#include "trihedron/core/calibration.hpp"
#include "trihedron/core/square_root_information.hpp"

namespace trihedron {

/// The same measurement with unit white noise.
template <class Information, int M>
struct WhiteMeasurement {
  typename Information::template Rows<M> H;
  Eigen::Matrix<double, M, 1> y;
  Eigen::Matrix<double, M, M> noise_root;  ///< L: y of the measurement itself is L times this one's

  /// R must be positive definite.
  WhiteMeasurement(const typename Information::template Rows<M>& its_H, const Eigen::Matrix<double, M, 1>& its_y,
                   const Eigen::Matrix<double, M, M>& R)
      : noise_root(R.llt().matrixL()) {
    const auto lower = noise_root.template triangularView<Eigen::Lower>();
    H = lower.solve(its_H);
    y = lower.solve(its_y);
  }
};

/// Writes the innovation, its covariance and its NIS into the report. Needs information.regular().
template <class Information, int M>
void report_innovation(const Information& information, const WhiteMeasurement<Information, M>& white,
                       FixReport<M>& report) {
  const typename Information::template Rows<M> through = information.template through_uncertainty<M>(white.H);
  const Eigen::Matrix<double, M, M> covariance =
      Eigen::Matrix<double, M, M>::Identity() + through * through.transpose();
  report.innovation = white.noise_root * white.y;
  report.innovation_covariance = white.noise_root * covariance * white.noise_root.transpose();
  report.nis = white.y.dot(covariance.llt().solve(white.y));
}

}  // namespace trihedron
