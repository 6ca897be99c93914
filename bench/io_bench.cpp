// Reading a nine-hour pass, CSV and NetCDF, and writing it.

#include <benchmark/benchmark.h>

#include <filesystem>

#include "flight.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/sim/simulate.hpp"

namespace {

using namespace trihedron;
namespace fs = std::filesystem;

Pass nine_hours() {
  const test::Flight flight({.duration_s = 9 * 3600});
  Pass pass;
  pass.settings.spacecraft = "BENCH";
  pass.settings.epoch = Time(std::chrono::hours(24) * 365 * 51);
  pass.settings.duration = std::chrono::hours(9);
  pass.settings.gyro_period = std::chrono::milliseconds(125);
  pass.settings.star_tracker_period = std::chrono::seconds(3);
  pass.settings.star_tracker_noise_rad = test::Flight::kTracker_rad;
  GyroPrior prior;
  prior.readout_noise_rad = test::Flight::kReadout_rad;
  prior.drift_common_sigma_rad_s = 2e-6;
  prior.alignment_sigma_rad.setConstant(8.7e-3);
  pass.settings.gyros = {prior, prior};
  pass.gyro.gyros = 2;
  for (const auto& sample : flight.samples) {
    pass.gyro.t.push_back(pass.settings.epoch + sample.t.time_since_epoch());
    for (int k = 0; k < pass.gyro.gyros; ++k) {
      pass.gyro.h.insert(pass.gyro.h.end(), sample.h_b[k].begin(), sample.h_b[k].end());
    }
  }
  for (const auto& fix : flight.fixes) {
    pass.star_tracker.t.push_back(pass.settings.epoch + fix.t.time_since_epoch());
    pass.star_tracker.q_in_c.push_back(fix.q_in_c);
  }
  return pass;
}

std::int64_t bytes_of(const fs::path& path) {
  std::uintmax_t bytes = 0;
  if (fs::is_directory(path)) {
    for (const auto& file : fs::directory_iterator(path)) {
      bytes += file.file_size();
    }
  } else {
    bytes = fs::file_size(path);
  }
  return static_cast<std::int64_t>(bytes);
}

void read(benchmark::State& state, const char* name) {
  const fs::path path = fs::temp_directory_path() / name;
  io::write_pass(path, nine_hours(), nullptr);
  for (auto _ : state) {
    benchmark::DoNotOptimize(io::read_pass(path));
  }
  state.SetBytesProcessed(state.iterations() * bytes_of(path));
  fs::remove_all(path);
}

/// What `simulate` does after simulating.
void write(benchmark::State& state, const char* name) {
  const fs::path path = fs::temp_directory_path() / name;
  const sim::SimulatedPass simulated = sim::simulate({});
  for (auto _ : state) {
    io::write_pass(path, simulated.pass, &simulated.truth);
  }
  state.counters["file_MB"] = static_cast<double>(bytes_of(path)) / 1e6;
  fs::remove_all(path);
}

BENCHMARK_CAPTURE(read, csv, "trihedron-bench-pass")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read, netcdf, "trihedron-bench-pass.nc")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(write, csv, "trihedron-bench-written")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(write, netcdf, "trihedron-bench-written.nc")->Unit(benchmark::kMillisecond);

}  // namespace
