#pragma once
/// Flights of the on-board application: its parameters, and what happens to it.

#include <Eigen/Core>
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

/// Events of a flight from `from_s` up to `to_s`, in time order; with_fixes: those for which it is true.
template <class Application>
void fly_from(const std::vector<GyroSample>& samples, const std::vector<StarFix>& fixes, double from_s, double to_s,
              Application& application, const OnReport& on_report = kIgnore) {
  const auto is_within = [&](Time t) { return t >= Time(from_seconds(from_s)) && t < Time(from_seconds(to_s)); };
  std::vector<GyroSample> some_samples;
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(some_samples),
               [&](const GyroSample& sample) { return is_within(sample.t); });
  std::vector<StarFix> some_fixes;
  std::copy_if(fixes.begin(), fixes.end(), std::back_inserter(some_fixes),
               [&](const StarFix& fix) { return is_within(fix.t); });
  fly(some_samples, some_fixes, application, on_report);
}
template <class Application>
void fly_from(const Flight& flight, double from_s, double to_s, Application& application,
              const OnReport& on_report = kIgnore) {
  fly_from(flight.samples, flight.fixes, from_s, to_s, application, on_report);
}
inline const std::vector<StarFix> kNoFixes;

}  // namespace trihedron::test
