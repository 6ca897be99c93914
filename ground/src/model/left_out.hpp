#pragma once
/// A calibration and a drift model that has fewer coefficients (docs/mathematics.md, section 12).

#include <Eigen/Core>
#include <vector>

#include "trihedron/core/frames.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// What a smaller drift model leaves out of a calibration. Along the pass by which all coefficients were found those
/// that it keeps, and the alignments, make up for those that it leaves out, by M: with x = (κ, δ), x + M κ_left_out
/// alone is to the star tracker nearly what all are.
class LeftOut {
 public:
  /// `all`: by a pass as a whole. Throws SetupError where it lacks a coefficient of the model.
  LeftOut(const Calibration& all, const DriftModelId& kept);

  [[nodiscard]] bool nothing() const { return left_out_.empty(); }
  [[nodiscard]] const DriftModelId& kept_model() const { return kept_model_; }
  /// Coefficients and alignments that are kept, among Calibration::states, in the order of drift_and_alignment().
  [[nodiscard]] const std::vector<Eigen::Index>& kept() const { return kept_; }
  /// Coefficients among Calibration::states that are not kept.
  [[nodiscard]] const std::vector<Eigen::Index>& left_out() const { return left_out_; }
  /// M, a row for each of those kept, a column for each of those left out.
  [[nodiscard]] const Eigen::MatrixXd& made_up() const { return made_up_; }
  /// Expectation of κ_left_out κ_left_outᵀ by the calibration, (rad/s)².
  [[nodiscard]] Eigen::MatrixXd mean_squares() const;

  /// Coefficients and alignments that make up for what is left out, with their covariance.
  [[nodiscard]] Calibration reduced() const;
  /// All coefficients and the alignments, where `by_kept` was estimated along the same pass without those left out;
  /// these are as `all` has them. The momenta turn with the alignments through which they are read; `C_in_c`: the
  /// attitude at by_kept.t, to degrees.
  [[nodiscard]] Calibration completed(Calibration by_kept, const Rot<In, C>& C_in_c) const;
  /// Of what was known before the pass: what is left out is as large as `all` has it, either way.
  [[nodiscard]] Calibration completed_prior(Calibration kept) const;
  /// The same of the rows of a history, the columns of which then are the states of `all`; what is left out was not
  /// followed along the pass, and is NaN.
  [[nodiscard]] ParameterHistory completed(const ParameterHistory& by_kept) const;

 private:
  Calibration all_;
  DriftModelId kept_model_;
  std::vector<ParameterId> states_;  ///< coefficients kept and alignments
  std::vector<Eigen::Index> kept_, left_out_;
  Eigen::MatrixXd made_up_;
  Eigen::VectorXd mean_;  ///< of κ_left_out
};

}  // namespace trihedron::ground
