#pragma once
/// A flight before it begins.

#include <memory>
#include <vector>

#include "trihedron/core/invariant_estimator.hpp"
#include "trihedron/lanes/filter_flight.hpp"
#include "trihedron/sim/gyro.hpp"
#include "trihedron/sim/star_tracker.hpp"

namespace trihedron::lanes {

/// What it flies, and its filter.
struct Lane {
  using Estimator = InvariantEstimator<kPairCapacity>;

  /// before: null, or one that has_reference_of() this flight.
  Lane(const FilterFlight& flight, const Lane* before);

  const Scenario* scenario;
  double begin_s;  ///< over which time the attitude is known
  double end_s;
  std::unique_ptr<sim::Ephemeris> ephemeris;
  sim::AttitudeProgramme attitude;
  std::vector<sim::Gyro> gyros;
  std::vector<sim::Stream> readout_noise;
  StarTrackerTelemetry fixes;
  std::unique_ptr<Estimator> estimator;

  /// Whether the momenta turn by less than kLittle_rad from one sample to the next.
  [[nodiscard]] bool turns_by_little() const;
  /// Whether both can go side by side: the same times, of samples, fixes, and what the attitude is made of.
  [[nodiscard]] bool is_like(const Lane& other) const;
  /// Whether its reference attitude is that of the other scenario: of the same orbit, steered alike, over the same
  /// time.
  [[nodiscard]] bool has_reference_of(const Scenario& other) const;
};

}  // namespace trihedron::lanes
