#pragma once
/// The simulated situations: slews, geometry, drift, misalignment and process noise, each with each.

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "trihedron/records/scenario.hpp"

namespace trihedron::consistency {

/// Where the momenta point at the start, c axes: x along track, y orbit normal, z up. In steady flight a momentum in
/// the orbit plane turns once per orbit in its case, one on the normal stands still there.
struct Geometry {
  const char* name;
  std::array<Eigen::Vector3d, 2> start_direction_c;
};

struct Cell {
  int number = 0;  ///< 1 … 216, in the order of the table
  bool slews = true;
  Geometry geometry;
  double drift_rad_s = 0;       ///< 1-sigma of each coefficient
  double misalignment_rad = 0;  ///< length of the rotation vector; its direction is uniformly distributed
  double walk_rad_sqrt_s = 0;   ///< of each momentum, per axis: the process noise

  /// "slews/plane-normal/1e-06/30arcmin/1e-08"
  [[nodiscard]] std::string name() const;
  /// Nine hours, truth and noise drawn for this cell and this run, 1 …; clean telemetry, all drift in eq. (1). Its
  /// priors are the spread that the truth is drawn from.
  [[nodiscard]] Scenario scenario(int run) const;
};

/// All 216, in the order of the table.
[[nodiscard]] std::vector<Cell> grid();

}  // namespace trihedron::consistency
