#pragma once
/// Monte Carlo check of a prediction: simulated flights, and how large the errors of their calibrations are.

#include <cmath>
#include <string>
#include <vector>

#include "trihedron/ground/observe/observe.hpp"
#include "trihedron/records/progress.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::plan {

/// Errors of calibrations along combinations of the parameters.
struct Confirmation {
  /// One combination: its predicted and its simulated error.
  struct Along {
    ground::Combination combination;
    double predicted = 0;  ///< 1-sigma, rad or rad/s
    double simulated = 0;  ///< rms
  };
  std::vector<Along> along;
  double ratio = 0;  ///< of simulated to predicted, rms over all combinations and runs
  int runs = 0;
  double nees = 0;  ///< mean, of all parameters
  int parameters = 0;

  /// Two standard deviations of the mean NEES of so many runs, where the calibrations are consistent.
  [[nodiscard]] double nees_tolerance() const { return 2 * std::sqrt(2.0 * parameters / runs); }
  /// Whether errors were larger than predicted by more than a factor of 1.2, and than chance makes.
  [[nodiscard]] bool contradicts() const {
    return !(nees <= parameters + 2.5 * nees_tolerance()) && !(nees <= 1.2 * 1.2 * parameters);
  }
};

/// Flies the scenario with other seeds, alignments and drift drawn from what is known before, and calibrates each by
/// estimator batch. `combinations` and `predicted`: of a flight, with options decided. Throws ground::SetupError.
[[nodiscard]] Confirmation confirm(const Scenario& scenario, const std::vector<ground::Combination>& combinations,
                                   const ground::Observability& predicted, int runs, const Progress& progress = {});

}  // namespace trihedron::plan
