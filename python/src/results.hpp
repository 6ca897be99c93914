#pragma once
/// What work gives back: each keeps the pass that it is of.

#include <memory>
#include <utility>
#include <vector>

#include "bindings.hpp"
#include "trihedron/ground/evaluate/calibration_evaluation.hpp"
#include "trihedron/ground/observe/observe.hpp"
#include "trihedron/io/residuals.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::python {

struct CalibrationResult {
  std::shared_ptr<const ScreenedPass> pass;
  CalibrationRun run;
  std::vector<io::Table> tables;  ///< as in residuals.nc
};

struct NavigationResult {
  std::shared_ptr<const ScreenedPass> pass;
  NavigationRun run;
};

struct ObservationResult {
  std::shared_ptr<const ScreenedPass> pass;
  ground::Observability its;
};

/// Errors of a calibration's attitudes against a reference.
struct EvaluationResult {
  Time epoch{};
  ground::CalibrationEvaluation its;
};

/// A predicted error as columns.
struct ForecastColumns {
  explicit ForecastColumns(const std::vector<PredictedError>& errors);
  std::vector<double> after_s;
  std::vector<Eigen::Vector3d> sigma_rad;
  std::vector<double> error_68_rad;
  std::vector<double> error_95_rad;
  std::vector<double> error_997_rad;
};

}  // namespace trihedron::python
