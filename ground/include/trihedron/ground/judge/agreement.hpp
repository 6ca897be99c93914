#pragma once
/// Whether two estimates of the same parameters agree, by chi-square.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "trihedron/records/calibration.hpp"

namespace trihedron::ground {

/// The result of a comparison.
struct Agreement {
  double chi_square = 0;       ///< of the difference by its covariance
  int degrees_of_freedom = 0;  ///< directions compared; 0 where nothing could be
  double limit = 0;            ///< 99.9 % of agreeing estimates lie below

  [[nodiscard]] bool holds() const { return chi_square <= limit; }
  /// "chi-square 21.3 of 14 degrees of freedom; 99.9 % of agreeing ones lie below 36.1"
  [[nodiscard]] std::string text() const;
};

/// In all directions. `covariance`: of the difference, positive definite. `sure`: the part of agreeing ones that lie
/// below the limit.
[[nodiscard]] Agreement agreement(const Eigen::VectorXd& difference, const Eigen::MatrixXd& covariance,
                                  double sure = 0.999);

/// Only in the directions in which the difference is better known than by `scale`, a covariance, positive definite.
[[nodiscard]] Agreement agreement_within(const Eigen::VectorXd& difference, const Eigen::MatrixXd& covariance,
                                         const Eigen::MatrixXd& scale);

/// Of an estimate with what was known before it, whose covariances these are, positive definite. `difference`: between
/// them. Only in the directions in which a prior that is wrong does harm and can be seen to be so: those in which both
/// the data and the prior tell something. `sure`: the part of agreeing ones that lie below the limit.
[[nodiscard]] Agreement agreement_with_prior(const Eigen::VectorXd& difference, const Eigen::MatrixXd& prior,
                                             const Eigen::MatrixXd& posterior, double sure);

/// The states of a drift coefficient or alignment that both calibrations have, in the order of the first.
[[nodiscard]] std::vector<ParameterId> common_states(const Calibration& a, const Calibration& b, bool alignments);

/// `to` less `from`, one per state: drift rad/s; alignment δ of C_c_b(to) = exp([δ×]) C_c_b(from), rad, c axes.
[[nodiscard]] Eigen::VectorXd difference(const Calibration& from, const Calibration& to,
                                         const std::vector<ParameterId>& states);

}  // namespace trihedron::ground
