#pragma once

namespace trihedron::consistency {

/// Two-sided limits.
struct Band {
  double low = 0;
  double high = 0;

  /// −1 below, 0 inside, 1 above or not a number.
  [[nodiscard]] int side(double value) const { return value < low ? -1 : value <= high ? 0 : 1; }
};

/// Where 95 % of the means of `count` independent values lie, each χ², of `freedom` degrees on the average.
[[nodiscard]] Band band_of_mean(double freedom, long count);

}  // namespace trihedron::consistency
