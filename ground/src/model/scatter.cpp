#include "model/scatter.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace trihedron::ground {

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

Eigen::Vector3d medians_of(const Eigen::Ref<const Eigen::Matrix3Xd>& columns) {
  Eigen::Vector3d medians;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> of_axis(columns.row(axis).begin(), columns.row(axis).end());
    medians(axis) = median_of(of_axis);
  }
  return medians;
}

double sigma_without_outliers(std::vector<double>& sizes) {
  constexpr double kMedianOfNormal = 0.6744897501960817;
  constexpr double kWithin = 4;
  const double most = kWithin * median_of(sizes) / kMedianOfNormal;
  double squares = 0;
  double count = 0;
  for (const double size : sizes) {
    if (size <= most) {
      squares += size * size;
      count += 1;
    }
  }
  return std::sqrt(squares / count);
}

}  // namespace trihedron::ground
