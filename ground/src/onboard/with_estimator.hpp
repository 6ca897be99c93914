#pragma once
/// From options to the estimator that they name.

#include <fmt/format.h>

#include "onboard/setup.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {

/// Calls `body` with the estimator as a type tag. Of what is built, the smallest that has what is asked for.
template <class Body>
auto with_estimator(const Pass& pass, const CalibrationOptions& options, Body&& body) {
  const DriftModelId drift_model = decided_drift_model(options);
  const bool is_paper = options.estimator == Estimator::kPaper;
  const bool whole_pass = is_for_whole_pass(drift_model);
  const bool esg20 = drift_model == kEsg20;
  if ((whole_pass && options.estimator != Estimator::kBatch) || (esg20 && (is_paper || pass.gyro.gyros > 2))) {
    throw SetupError(fmt::format("estimator {} of {} gyros has no drift model '{}'", name_of(options.estimator),
                                 pass.gyro.gyros, name_of(drift_model)),
                     fmt::format("use {}, {}", kAutoDriftModel, drift_model_choices()));
  }
  if (is_paper) {
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
