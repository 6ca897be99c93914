// Nine hours by part, and the on-board step against hours, states and gyros. Times are of the processor, all threads
// together.

#include <benchmark/benchmark.h>

#include "parts.hpp"

namespace {

using namespace trihedron;

void measure(benchmark::State& state, const bench::Run& run, long samples) {
  for (auto _ : state) {
    run();
  }
  state.SetItemsProcessed(state.iterations() * samples);
}

void add(const std::string& name, const std::function<void(benchmark::State&)>& what) {
  benchmark::RegisterBenchmark(name.c_str(), what)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
}

/// Directions of further momenta at the beginning.
const Eigen::Vector3d kFurther[] = {{0.64, -0.42, 0.64}, {-0.55, -0.6, 0.58}};

void of_pipeline(benchmark::State& state, const Scenario& scenario, const CalibrationOptions& options) {
  const bench::PipelineRun its = bench::pipeline(scenario, options);
  measure(state, its.run, static_cast<long>(to_seconds(scenario.duration) * 8) + 1);
  state.counters["states"] = its.states;
}

const bool kRegistered = [] {
  for (const bench::Part& part : bench::parts()) {
    add("nine hours/" + part.name,
        [&part](benchmark::State& state) { measure(state, part.prepare(), bench::kSamples); });
  }
  for (const int hours : {1, 3, 9, 27, 100}) {
    add("hours/" + std::to_string(hours), [hours](benchmark::State& state) {
      const auto events = std::make_shared<const bench::Events>(bench::events_of(bench::scenario_of(hours)));
      measure(state, bench::on_board(events, true), static_cast<long>(events->samples.size()));
    });
  }
  for (const char* model : {"esg7", "esg20", "vsh:3", "vsh:4", "vsh:5", "vsh:6"}) {
    add(std::string("states/") + model, [model](benchmark::State& state) {
      CalibrationOptions options = bench::all_told();
      TRIHEDRON_ASSERT(set_drift_model(model, options));
      of_pipeline(state, bench::scenario_of(1), options);
    });
  }
  for (const int gyros : {2, 3, 4}) {
    add("gyros/" + std::to_string(gyros), [gyros](benchmark::State& state) {
      Scenario scenario = bench::scenario_of(1);
      for (int k = 2; k < gyros; ++k) {
        GyroScenario further = scenario.gyros.front();
        further.start_direction_c = kFurther[k - 2].normalized();
        scenario.gyros.push_back(further);
      }
      of_pipeline(state, scenario, bench::all_told());
    });
  }
  return true;
}();

}  // namespace
