#pragma once

#include <Eigen/Core>
#include <vector>

namespace trihedron::ground {

/// The median, of an even number of values the upper one of the two in the middle; there has to be one. Changes the
/// order.
[[nodiscard]] double median_of(std::vector<double>& values);

/// Of each component; there has to be one column.
[[nodiscard]] Eigen::Vector3d medians_of(const Eigen::Ref<const Eigen::Matrix3Xd>& columns);

/// 1-sigma of normal numbers of mean 0 among which there are outliers, by their sizes, of which there is one at least:
/// the root mean square of those within four of the sigmas that the median tells. Changes the order.
[[nodiscard]] double sigma_without_outliers(std::vector<double>& sizes);

}  // namespace trihedron::ground
