#pragma once
/// From options to the estimator that they name.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "setup.hpp"

namespace trihedron::ground {

/// Calls `body` with the estimator as a type tag. Of what is built, the smallest that has what is asked for.
template <class Body>
auto with_estimator(const Pass& pass, const CalibrationOptions& options, Body&& body) {
  if (std::find(kEstimators.begin(), kEstimators.end(), options.estimator) == kEstimators.end()) {
    throw SetupError(fmt::format("there is no estimator '{}'", options.estimator),
                     fmt::format("use one of: {}", fmt::join(kEstimators, ", ")));
  }
  const bool esg20 = options.drift_model == Esg20::kModelName;
  if ((!esg20 && options.drift_model != Esg7::kModelName) ||
      (esg20 && (options.estimator == "paper" || pass.gyro.gyros > 2))) {
    throw SetupError(fmt::format("estimator {} of {} gyros has no drift model '{}'", options.estimator, pass.gyro.gyros,
                                 options.drift_model),
                     fmt::format("use one of: {}", fmt::join(kDriftModels, ", ")));
  }
  if (options.estimator == "paper") {
    return body.template operator()<PaperEstimator<Esg7>>();
  }
  switch (pass.gyro.gyros) {
    case 3:
      return body.template operator()<InvariantEstimator<Esg7, 3>>();
    case 4:
      return body.template operator()<InvariantEstimator<Esg7, 4>>();
    default:
      break;
  }
  if (esg20) {
    return body.template operator()<InvariantEstimator<Esg20, 2, kAllFurtherStates>>();
  }
  const bool further = has_further_states(options) || !pass.further_star_trackers.empty();
  return further ? body.template operator()<InvariantEstimator<Esg7, 2, kAllFurtherStates>>()
                 : body.template operator()<InvariantEstimator<Esg7, 2>>();
}

}  // namespace trihedron::ground
