#pragma once
/// Comparison of drift models by prediction: each is fitted to the beginning of a pass and scored on the rest.

#include <vector>

#include "batch/batch.hpp"
#include "batch/smoothed_attitude.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

struct Forecast {
  DriftModelId drift_model;
  /// ln of the likelihood of each part of the pass given the parts before it, summed over all but the first parts; up
  /// to a constant that the models share.
  double log_likelihood = 0;
  struct Fit {
    Time until{};
    std::vector<GyroCalibration> gyros;  ///< without momenta
  };
  std::vector<Fit> fits;  ///< to the parts before each forecast
};

/// Forecasts by these drift models, each contained in that of the problem; the problem is taken as linear about its
/// solution. Empty where it has too few arcs.
[[nodiscard]] std::vector<Forecast> forecasts(const PassProblem& problem, const BatchResult& found,
                                              const std::vector<DriftModelId>& models);

/// Flies the fits open loop, each until the next one, over the smoothed pass.
[[nodiscard]] std::vector<DriftModelForecast> flown(const std::vector<Forecast>& forecasts,
                                                    const SmoothedCourse& course);

}  // namespace trihedron::ground
