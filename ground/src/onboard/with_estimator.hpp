#pragma once
/// From options to the estimator that they name.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "onboard/setup.hpp"
#include "trihedron/ground/model/names.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {

/// Calls `body` with the estimator as a type tag. Of what is built, the smallest that has what is asked for.
template <class Body>
auto with_estimator(const Pass& pass, const CalibrationOptions& options, Body&& body) {
  if (std::ranges::find(kEstimators, options.estimator) == kEstimators.end()) {
    throw SetupError(fmt::format("there is no estimator '{}'", options.estimator),
                     fmt::format("use one of: {}", fmt::join(kEstimators, ", ")));
  }
  const bool whole_pass = is_for_whole_pass(options.drift_model);
  const bool esg20 = options.drift_model == Esg20::kModelName;
  if ((whole_pass && options.estimator != kBatch) || (esg20 && (options.estimator == kPaper || pass.gyro.gyros > 2))) {
    throw SetupError(fmt::format("estimator {} of {} gyros has no drift model '{}'", options.estimator, pass.gyro.gyros,
                                 options.drift_model),
                     fmt::format("use {}", kDriftModels));
  }
  if (options.estimator == kPaper) {
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
  if (esg20 || (whole_pass && !pass.settings.prior)) {
    return body.template operator()<InvariantEstimator<Esg20, 2, kAllFurtherStates>>();
  }
  const bool further = has_further_states(options) || !pass.further_star_trackers.empty();
  return further ? body.template operator()<InvariantEstimator<Esg7, 2, kAllFurtherStates>>()
                 : body.template operator()<InvariantEstimator<Esg7, 2>>();
}

}  // namespace trihedron::ground
