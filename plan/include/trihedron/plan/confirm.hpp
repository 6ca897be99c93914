#pragma once
/// Whether simulated flights bear out what was predicted.

#include <string>
#include <vector>

#include "trihedron/ground/observe/observe.hpp"
#include "trihedron/records/progress.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::plan {

/// Errors of calibrations along combinations of the parameters.
struct Confirmation {
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
};

/// Flies the scenario with other seeds, alignments and drift drawn from what is known before, and calibrates each by
/// estimator batch. `combinations` and `predicted`: of a flight, with options decided. Throws ground::SetupError.
[[nodiscard]] Confirmation confirm(const Scenario& scenario, const std::vector<ground::Combination>& combinations,
                                   const ground::Observability& predicted, int runs, const Progress& progress = {});

}  // namespace trihedron::plan
