#pragma once
/// Drift coefficients and alignments of all gyros by a solution of a whole pass, in the members of the drift model
/// also where the pass was solved for modes of them (docs/mathematics.md, section 12).

#include <Eigen/Core>

#include "batch/batch.hpp"
#include "trihedron/records/calibration.hpp"

namespace trihedron::ground {

/// κ and δ of all gyros.
struct KappaAndDelta {
  Gyros gyros;
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd by_states;  ///< their errors by those of κ and δ along the pass
  Eigen::MatrixXd to_states;  ///< κ and δ along the pass by them
  Eigen::MatrixXd added;      ///< part of the covariance, for the uncertainty of the spectrum; empty: none
};

/// `more_covariance`: of κ and δ, for the uncertainty of the spectrum of a drift field; empty: none.
[[nodiscard]] KappaAndDelta kappa_and_delta(const PassProblem& problem, const BatchResult& result,
                                            const Eigen::MatrixXd& more_covariance);

/// The same as a calibration: coefficients, alignments and their covariance, and nothing else.
[[nodiscard]] Calibration calibration_of(const PassProblem& problem, const KappaAndDelta& parameters);

}  // namespace trihedron::ground
