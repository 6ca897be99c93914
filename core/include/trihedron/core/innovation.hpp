#pragma once
/// A measurement y = H x + noise of covariance R, and how it agrees with what is known of x.

#include "trihedron/core/calibration.hpp"
#include "trihedron/core/cholesky.hpp"
#include "trihedron/core/square_root_information.hpp"

namespace trihedron {

/// The same measurement with unit white noise.
template <class Information, int M>
struct WhiteMeasurement {
  typename Information::template Rows<M> H;
  Eigen::Matrix<double, M, 1> y;
  Eigen::Matrix<double, M, M> noise_root;  ///< L: y of the measurement itself is L times this one's
};

/// R must be positive definite.
template <class Information, int M>
[[nodiscard]] WhiteMeasurement<Information, M> whitened(const typename Information::template Rows<M>& H,
                                                        const Eigen::Matrix<double, M, 1>& y,
                                                        const Eigen::Matrix<double, M, M>& R) {
  WhiteMeasurement<Information, M> white{H, y, cholesky_root<M>(R)};
  solve_lower(white.noise_root, white.H);
  solve_lower(white.noise_root, white.y);
  return white;
}

/// Writes the innovation, its covariance and its NIS into the report. Needs information.regular().
template <class Information, int M>
void report_innovation(const Information& information, const WhiteMeasurement<Information, M>& white,
                       FixReport<M>& report) {
  const Eigen::Matrix<double, M, M> covariance =
      Eigen::Matrix<double, M, M>::Identity() + gram(information.template through_uncertainty<M>(white.H));
  report.innovation = white.noise_root * white.y;
  report.innovation_covariance = white.noise_root * covariance * white.noise_root.transpose();
  Eigen::Matrix<double, M, 1> normalized = white.y;
  solve_lower(cholesky_root<M>(covariance), normalized);
  report.nis = normalized.squaredNorm();
}

}  // namespace trihedron
