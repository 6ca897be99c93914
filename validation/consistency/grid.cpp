#include "consistency/grid.hpp"

#include <fmt/format.h>

#include <cmath>

namespace trihedron::consistency {

std::string Cell::name() const {
  return fmt::format("{}/{}/{:.0e}/{:.0f}arcmin/{:.0e}", slews ? "slews" : "steady", geometry.name, drift_rad_s,
                     misalignment_rad / kArcminute, walk_rad_sqrt_s);
}

Scenario Cell::scenario(int run) const {
  Scenario scenario;
  scenario.seed = static_cast<std::uint64_t>(number) * 1'000'000 + static_cast<std::uint64_t>(run);
  if (!slews) {
    scenario.attitude.slews = std::vector<Slew>{};
  }
  for (std::size_t k = 0; k < scenario.gyros.size(); ++k) {
    GyroScenario& gyro = scenario.gyros[k];
    gyro.start_direction_c = geometry.start_direction_c[k];
    gyro.misalignment_magnitude_rad = misalignment_rad;
    gyro.alignment_prior_sigma_rad = misalignment_rad / std::sqrt(3.0);
    gyro.drift.prior_sigma_rad_s = drift_rad_s;
    gyro.drift.outside_sigma_rad_s = 0;
    gyro.drift.direction_walk_rad_sqrt_s = walk_rad_sqrt_s;
  }
  return scenario;
}

std::vector<Cell> grid() {
  const Eigen::Vector3d near_x(0.995, 0.087, 0.045);
  const std::array<Geometry, 3> geometries = {{
      {"plane-normal", {near_x, {0.14, 0.985, 0.094}}},  // the paper's
      {"plane-plane", {near_x, {0.05, 0.124, 0.991}}},
      {"oblique", {{{0.7, 0.6, 0.4}, {-0.6, 0.5, 0.6}}}},
  }};
  std::vector<Cell> cells;
  for (const bool slews : {true, false}) {
    for (const Geometry& geometry : geometries) {
      for (const double drift_rad_s : {1e-7, 1e-6, 1e-5}) {
        for (const double misalignment_arcmin : {1, 30, 60, 300}) {
          for (const double walk_rad_sqrt_s : {0.0, 1e-8, 1e-7}) {
            cells.push_back({static_cast<int>(cells.size()) + 1, slews, geometry, drift_rad_s,
                             misalignment_arcmin * kArcminute, walk_rad_sqrt_s});
          }
        }
      }
    }
  }
  return cells;
}

}  // namespace trihedron::consistency
