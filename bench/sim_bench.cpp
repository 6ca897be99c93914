// Simulating the paper's nine hours with two gyros, nothing written: as it is, and with the twelve members of the drift
// family of degree 1 and 2 that eq. (1) does not contain.

#include <benchmark/benchmark.h>

#include "trihedron/sim/simulate.hpp"

namespace {

using namespace trihedron;

void simulate(benchmark::State& state, double outside_sigma_rad_s) {
  Scenario scenario;
  for (GyroScenario& gyro : scenario.gyros) {
    gyro.drift.outside_sigma_rad_s = outside_sigma_rad_s;
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(sim::simulate(scenario));
  }
}

BENCHMARK_CAPTURE(simulate, nine_hours, 0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(simulate, nine_hours_twelve_members, 1e-7)->Unit(benchmark::kMillisecond);

}  // namespace
