#pragma once

#include <array>
#include <vector>

#include "consistency/grid.hpp"
#include "consistency/statistics.hpp"
#include "trihedron/records/estimator.hpp"

namespace trihedron::consistency {

inline constexpr int kParameters = 20;  ///< of two gyros, eq. (1) and alignment
inline constexpr int kInnovations = 4;  ///< of one fix

/// One estimator over one flight.
struct Outcome {
  double nees = 0;  ///< of the parameters at the end
  Nees observable;  ///< of what the flight made observable of them
  double nis = 0;   ///< mean over the fixes; of estimator batch of what is left of them when the pass is smoothed
  long fixes = 0;   ///< all but the first, rejected ones as well: there are no outliers; of estimator batch all used
  /// Mean over the parameters of error² over the variance of parameter_bound(); not a number with process noise.
  double error_over_bound_square = 0;
  /// Of estimator batch: how estimator invariant differs from it. Otherwise zero.
  Difference by_parameter;
  Difference by_combination;
};

/// One flight of this cell, calibrated by each of the estimators named, which are given the true noise.
[[nodiscard]] std::vector<Outcome> fly(const Cell& cell, int run, const std::vector<Estimator>& estimators);

}  // namespace trihedron::consistency
