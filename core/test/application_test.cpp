#include "trihedron/core/application.hpp"

#include <gtest/gtest.h>

#include <cstdio>

#include "application_flight.hpp"

namespace trihedron {
namespace {

using test::kArcsecond;

TEST(Application, Explore) {
  const test::Flight flight({.duration_s = 3 * 3600, .slews_rad = 0.5});
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  std::printf("sizeof %zu on board %zu forecast %zu\n", sizeof(PairApplication), sizeof(PairOnBoard),
              sizeof(Forecast<test::PairEstimator>));
  for (int minute = 0; minute < 180; ++minute) {
    test::fly_from(flight.samples, minute < 100 || minute > 175 ? flight.fixes : test::kNoFixes, minute * 60.0,
                   minute * 60.0 + 60, *application);
    const Housekeeping record = application->housekeeping();
    const std::size_t last = static_cast<std::size_t>(minute + 1) * 480 - 1;
    const double error = record.attitude_valid
                             ? test::attitude_error(flight.C_in_c_at_samples[last], *application->attitude()).norm()
                             : -1;
    std::printf("%d min mode %d faults %u predicted %.1f ready %.0f s ratio %.2f error %.1f sigma %.1f\n", minute + 1,
                record.mode, record.faults, record.predicted_error_rad / kArcsecond, record.ready_s,
                record.residual_ratio, error / kArcsecond, record.sigma_rad[0] / kArcsecond);
  }
}

}  // namespace
}  // namespace trihedron
