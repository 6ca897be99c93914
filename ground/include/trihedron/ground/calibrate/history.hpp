#pragma once
/// Calibrations of one spacecraft over the starts of its rotors: drift coefficients change at each start, alignments
/// should not.

#include <string>
#include <vector>

#include "trihedron/ground/judge/agreement.hpp"
#include "trihedron/records/catalogue.hpp"

namespace trihedron::ground {

/// The calibration that represents a start-up: of the trustworthy ones that of most passes; of several such the latest.
struct StartUp {
  std::string name;
  const Calibration* calibration = nullptr;  ///< of the catalogue, which must outlive it
};

/// Change of one parameter between two start-ups.
struct ParameterChange {
  ParameterId state;
  double change = 0;  ///< rad/s, or rad about c x, y, z
  double sigma = 0;
};

/// From one start-up to the next, in the states that both have. The covariance is the sum of both: where neither says
/// more than was known before, the comparison is milder than it could be.
struct StartUpChange {
  std::string from;
  std::string to;
  std::vector<ParameterChange> parameters;
  Agreement coefficients;
  Agreement alignments;
};

/// A parameter over the start-ups that have it: normal about one mean, each seen with its own sigma.
struct Spread {
  ParameterId state;
  int start_ups = 0;
  double mean = 0;        ///< weighted; rad/s or rad
  double deviation = 0;   ///< between start-ups, without what their own sigmas explain
  double next_sigma = 0;  ///< of the next start-up about the mean: deviation and uncertainty of the mean
};

/// Calibrations of a spacecraft compared from start-up to start-up.
struct History {
  std::vector<StartUp> start_ups;      ///< in the order of their epochs
  std::vector<StartUpChange> changes;  ///< between neighbours
  std::vector<Spread> spreads;         ///< of what two start-ups or more have
  std::vector<Finding> findings;
};

/// Calibrations that are not trustworthy are left out.
[[nodiscard]] History compare_start_ups(const std::vector<CatalogueEntry>& catalogue);

/// Drift coefficients and alignments that any calibration has, once each, in their order.
[[nodiscard]] std::vector<ParameterId> states_of(const std::vector<CatalogueEntry>& catalogue);

/// Mean and deviation between start-ups by R. C. Paule and J. Mandel, J. Res. NBS 87 (1982) 377: the deviation is such
/// that the squared distances from the weighted mean, over deviation² + sigma², sum to one less than their number; zero
/// where the sigmas explain them. Of two values or more, sigmas above zero.
[[nodiscard]] Spread spread_of(const std::vector<double>& values, const std::vector<double>& sigmas);

}  // namespace trihedron::ground
