#pragma once
/// Whether the errors of a star tracker from fix to fix are those of one normal distribution.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Alignments are found by the mean of these errors. Where they lie more to one side, or in two heaps, it is not where
/// most of them are, and no number of fixes makes up for it. What moves slowly is taken off: the fixes are compared
/// with the open-loop navigator, less the mean of the kNeighbours nearest; so drift has no part in it.
struct ShapeOfErrors {
  static constexpr int kNeighbours = 21;

  std::size_t fixes = 0;
  /// E z³ of the component z, unit variance, for which it is most; 0 of normal errors.
  double skewness = 0;
  double skewness_sigma = 0;  ///< by chance, by E z⁶: heavy tails make it larger
  /// E z⁴ − 3 of the component for which it is least; 0 of normal errors.
  double least_kurtosis = 0;
  Eigen::Vector3d mean_off_median_rad{0, 0, 0};  ///< c axes
};

/// Of the fixes of a star tracker that were used after the second correction of the navigator, which has good
/// parameters then. Nothing where there are too few to tell.
[[nodiscard]] std::optional<ShapeOfErrors> shape_of_errors(const std::vector<FixRecord>& fixes, int head);

}  // namespace trihedron::ground
