#pragma once
/// Flights of the on-board application: its parameters, and what happens to it.

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "flight.hpp"
#include "trihedron/core/application.hpp"

namespace trihedron::test {

/// Of the flights of flight.hpp: their noise and priors, an orbit of twenty minutes, 5′ for twenty minutes.
[[nodiscard]] Parameters nominal_parameters(int gyros = 2);
/// Position of an element in Parameters::covariance.
[[nodiscard]] constexpr std::size_t covariance_index(int row, int column) {
  return static_cast<std::size_t>(row * (row + 1) / 2 + column);
}

/// An application, loaded and started.
template <class Application>
[[nodiscard]] std::unique_ptr<Application> started(const Parameters& parameters) {
  auto made = std::make_unique<Application>();
  TRIHEDRON_ASSERT(made->load(parameters) == Answer::kAccepted);
  TRIHEDRON_ASSERT(made->command(Command::kStart) == Answer::kAccepted);
  return made;
}

/// The samples or fixes, which are in time order, from `from_s` up to `to_s`.
template <class Row>
std::vector<Row> between(const std::vector<Row>& rows, double from_s, double to_s) {
  const auto at = [&](double t_s) { return std::ranges::lower_bound(rows, Time(from_seconds(t_s)), {}, &Row::t); };
  return std::vector<Row>(at(from_s), at(to_s));
}

/// Events of a flight from `from_s` up to `to_s`.
template <class Application>
void fly_from(const std::vector<GyroSample>& samples, const std::vector<StarFix>& fixes, double from_s, double to_s,
              Application& application, const OnReport& on_report = kIgnore) {
  fly(between(samples, from_s, to_s), between(fixes, from_s, to_s), application, on_report);
}
template <class Application>
void fly_from(const Flight& flight, double from_s, double to_s, Application& application,
              const OnReport& on_report = kIgnore) {
  fly_from(flight.samples, flight.fixes, from_s, to_s, application, on_report);
}
inline const std::vector<StarFix> kNoFixes;

}  // namespace trihedron::test
