#pragma once
/// Estimator batch: a calibration refined by least squares over the whole pass.

#include <optional>
#include <vector>

#include "batch/batch.hpp"
#include "batch/drift_field.hpp"
#include "batch/pass_setup.hpp"
#include "batch/smoothed_attitude.hpp"
#include "onboard/screen.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// The constants by the first half of the pass compared with those by all of it.
struct Halves {
  double chi_square = 0;
  int degrees_of_freedom = 0;
};

/// The whole pass by least squares; its results replace those of the on-board step.
class Refinement {
 public:
  /// Solves the problem. `field`: what a trial has found of the drift field, where the drift is one; the setup has its
  /// variances. `nearby`: where to begin. Keeps a reference to `screened`. Throws SetupError.
  Refinement(const Screened& screened, PassSetup setup, const CalibrationOptions& options,
             const std::optional<FieldPrior>& field, const std::optional<Nearby>& nearby);

  /// What the smoothed pass shows at the fixes.
  [[nodiscard]] const SmoothedCourse& course() const { return course_; }

  /// Judges fixes, used ones and outliers, by the smoothed pass, and puts their residuals in place of their
  /// innovations.
  void judge(std::vector<FixRecord>& fixes) const;

  /// Puts the most likely values and their covariance in place of those of `run`, which was made on board, and the
  /// smoothed attitude and residuals in place of those of the filter.
  void put_into(CalibrationRun& run) &&;

 private:
  PassProblem problem_;
  std::optional<FieldPrior> field_;
  BatchResult result_;
  std::optional<Halves> halves_;
  CovarianceRoots roots_;
  SmoothedCourse course_;
  AttitudeHistory definitive_attitude_;
};

}  // namespace trihedron::ground
